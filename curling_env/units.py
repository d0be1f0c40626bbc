"""Lengths for display: metres and centimetres, or feet and inches.

Internally, and in files, lengths are metres; only displayed text goes through here. The units are
chosen once, by `choose_units` or `shown_in`; a function that is given units uses those.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from enum import StrEnum

FOOT = 0.3048
"""Foot [m] (international, exact)."""
INCH = FOOT / 12
"""Inch [m]."""
BROOM = 0.2
"""Width of a broom's head, the unit of ice for skips [m]: the usual eight inches."""


_EIGHTHS = ("0", "⅛", "¼", "⅜", "½", "⅝", "¾", "⅞")


class Units(StrEnum):
    """Units of displayed lengths."""

    METRES = "metres"
    FEET = "feet"


_CHOSEN = ContextVar("units", default=Units.METRES)


def chosen_units() -> Units:
    """Return the units in which lengths are displayed now."""
    return _CHOSEN.get()


def choose_units(units: Units) -> None:
    """Display lengths in these units from now on, in this context."""
    _CHOSEN.set(units)


@contextmanager
def shown_in(units: Units) -> Generator[None]:
    """Display lengths in these units within the block."""
    token = _CHOSEN.set(units)
    try:
        yield
    finally:
        _CHOSEN.reset(token)


def length(metres: float, units: Units | None = None) -> str:
    """Format a length on the ice: ``1.23 m`` or ``4 ft 0 in``; without sign.

    Parameters
    ----------
    metres : the length [m]
    units : units of the result; by default the chosen ones
    """
    if (units or chosen_units()) is Units.METRES:
        return f"{abs(metres):.2f} m"
    inches = round(abs(metres) / INCH)
    feet, rest = divmod(inches, 12)
    return f"{feet} ft {rest} in" if feet else f"{rest} in"


def short_length(metres: float, units: Units | None = None) -> str:
    """Format a length to the centimetre or inch: ``12 cm`` or ``5 in``; without sign.

    From a metre, or a foot, on it is formatted as in `length`.
    """
    size = abs(metres)
    if (units or chosen_units()) is Units.METRES:
        return f"{100 * size:.0f} cm" if size < 0.995 else length(metres, units)
    return f"{size / INCH:.0f} in" if size < FOOT - INCH / 2 else length(metres, units)


def miss(metres: float, units: Units | None = None) -> str:
    """Format a deviation to visible precision: ``4 mm``, ``12 cm`` or ``⅜ in``.

    From 1 cm, or an inch, on it is formatted as in `short_length`.
    """
    size = abs(metres)
    if (units or chosen_units()) is Units.METRES:
        return f"{1000 * size:.0f} mm" if size < 0.01 else short_length(size, units)
    eighths = round(8 * size / INCH)
    return f"{_EIGHTHS[eighths]} in" if eighths < 8 else short_length(size, units)


def speed(metres_per_second: float, units: Units | None = None) -> str:
    """Format a speed: ``2.13 m/s`` or ``7.0 ft/s``."""
    if (units or chosen_units()) is Units.METRES:
        return f"{metres_per_second:.2f} m/s"
    return f"{metres_per_second / FOOT:.1f} ft/s"


def side(metres: float, units: Units | None = None, *, right: str = "right") -> str:
    """Format a length with its side: ``0.34 m right``, ``1 ft 1 in left``, or ``on the line``.

    Parameters
    ----------
    metres : the length, positive to the right [m]
    units : units of the result; by default the chosen ones
    right : the word for positive ones; ``past`` gives ``short`` for negative ones
    """
    other = {"right": "left", "left": "right", "past": "short"}[right]
    text = short_length(metres, units)
    if text in ("0 cm", "0 in") or not math.isfinite(metres):
        return {"past": "on the tee line"}.get(right, "on the line")
    return f"{text} {right if metres > 0 else other}"


def brooms(metres: float) -> str:
    """Format a length in widths of a broom, to the half: ``5½ brooms``; without sign."""
    halves = round(2 * abs(metres) / BROOM)
    whole, half = divmod(halves, 2)
    text = f"{whole or ''}{'½' if half else ''}" or "0"
    return f"{text} {'broom' if halves in (1, 2) else 'brooms'}"
