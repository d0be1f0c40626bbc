"""Templates of pages and reports; text is escaped."""

from __future__ import annotations

from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from curling_env.units import brooms, length, short_length


def rendered(template: str, **content: Any) -> str:
    """Fill a template of `templates`."""
    return _environment().get_template(template).render(**content)


@cache
def _environment() -> Environment:
    found = Environment(
        loader=PackageLoader("agents.app"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters |= {"short": short_length, "metres": length, "brooms": brooms}
    return found
