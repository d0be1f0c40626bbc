"""Recorded game as one animated page that needs neither the network nor another file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from curling_env.infrastructure.files.storage import write_text
from curling_env.infrastructure.page_policy import directives_of, policy_of
from curling_env.units import Units

POLICY = "<!--POLICY-->"
"""Placeholder of the content security policy in the template."""
PLACE = "/*RECORD*/"
"""Placeholder of the record in the template."""


def page_of(lines: Sequence[dict[str, Any]], units: Units = Units.METRES, *, live: str = "") -> str:
    """Return the HTML page of a recorded game.

    Parameters
    ----------
    lines : lines of the game, from `record.lines_of` or `record.read_record`
    units : units of displayed lengths
    live : address of the server's feed of further deliveries; empty for a finished game
    """
    template = _template(units, live)
    # A name must not end the script element that contains the record.
    record = json.dumps(list(lines), separators=(",", ":")).replace("<", "\\u003c")
    # Only the script of the template may run, whatever the record contains.
    policy = policy_of(template) if not live else ""  # a server sends it in a header
    return template.replace(POLICY, policy).replace(PLACE, record)


def live_policy(units: Units, live: str) -> str:
    """Return the content security policy of a page that asks its server for more; see `page_of`."""
    return directives_of(_template(units, live), connect=True)


def _template(units: Units, live: str) -> str:
    template = files("agents.playing.replay").joinpath("replay.html").read_text(encoding="utf-8")
    template = template.replace('data-units="metres"', f'data-units="{units}"')
    return template.replace('data-live=""', f'data-live="{live}"')


def write_page(
    path: str | Path, lines: Sequence[dict[str, Any]], units: Units = Units.METRES
) -> None:
    """Write the page of a recorded game, completely or not at all; see `page_of`."""
    write_text(path, page_of(lines, units))
