"""A recorded game as one animated page that needs neither the network nor another file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from curling_env.infrastructure.files.storage import write_text
from curling_env.infrastructure.page_policy import policy_of
from curling_env.units import Units

POLICY = "<!--POLICY-->"
"""Place of the content security policy in the template."""
PLACE = "/*RECORD*/"
"""Place of the record in the template."""


def page_of(lines: Sequence[dict[str, Any]], units: Units = Units.METRES) -> str:
    """The HTML page of a recorded game.

    Parameters
    ----------
    lines : lines of the game, from `record.lines_of` or `record.read_record`
    units : what lengths are told in
    """
    template = files("agents.playing.replay").joinpath("replay.html").read_text(encoding="utf-8")
    template = template.replace('data-units="metres"', f'data-units="{units}"')
    # A name must not end the script element that holds the record.
    record = json.dumps(list(lines), separators=(",", ":")).replace("<", "\\u003c")
    # Only the script that comes with the template may run, whatever the record holds.
    return template.replace(POLICY, policy_of(template)).replace(PLACE, record)


def write_page(
    path: str | Path, lines: Sequence[dict[str, Any]], units: Units = Units.METRES
) -> None:
    """Write the page of a recorded game, complete or not at all; see `page_of`."""
    write_text(path, page_of(lines, units))
