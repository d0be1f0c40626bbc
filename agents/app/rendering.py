"""Templates of pages and reports; text is escaped."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from agents.coaching.calls import shown_call
from curling_env.units import Units, brooms, chosen_units, length, short_length

METRIC = re.compile(
    r"(?<![\w.])(\d+(?:\.\d+)?) (cm|m)\b(?!/)|(?:(?<=, not )|(?<=off by ))(\d+(?:\.\d+)?)(?=\.$)"
)
"""Metric lengths; a last one without a unit ("5 cm from the forecast, not 49.") is in cm."""


def rendered(template: str, **content: Any) -> str:
    """Fill a template of `templates`."""
    units = chosen_units()
    other = next(one for one in Units if one is not units)
    return _environment().get_template(template).render(units=units, other_units=other, **content)


def in_units(text: str) -> str:
    """Return a stored sentence, whose lengths are metric, with lengths in the chosen units."""
    if chosen_units() is Units.METRES:
        return text
    return METRIC.sub(
        lambda one: short_length(float(one[1] or one[3]) * (1.0 if one[2] == "m" else 0.01)), text
    )


@cache
def _environment() -> Environment:
    found = Environment(
        loader=PackageLoader("agents.app"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters |= {
        "short": short_length,
        "metres": length,
        "brooms": brooms,
        "in_units": in_units,
        "call": shown_call,
    }
    return found
