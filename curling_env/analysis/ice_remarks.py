"""Remarks for the user of an ice: missing effects, and effects that were never measured."""

from __future__ import annotations

from curling_env.ice import Ice
from curling_env.physics.effects import catalogue

UNKNOWN = (
    "this ice lacks an effect: its tracks show a residual that none of its effects explains, and "
    "predictions on it may be off by that much"
)
NO_CURL = (
    "this ice was estimated without effects, so no stone curls on it: "
    "`curling estimate TRACKS.csv -o ice.json` gives the whole ice"
)


def is_marked_unknown(ice: Ice) -> bool:
    """Return whether an ice is marked as lacking an effect that its tracks show."""
    return ice.effect("unknown") is not None


def lacks_curl(ice: Ice) -> bool:
    """Return whether an ice was estimated from tracks and has no effect that acts on a stone.

    An ice that was written by hand, such as a preset, is not estimated: all its cells are observed.
    """
    cards = catalogue()
    felt = any(e.name not in cards or cards[e.name].is_physical for e in ice.effects)
    return not felt and not ice.friction.observed.all()


def missing_effect_remarks(ice: Ice) -> list[str]:
    """Return remarks on effects that an ice lacks although its tracks show them."""
    remarks = [UNKNOWN] if is_marked_unknown(ice) else []
    return remarks + ([NO_CURL] if lacks_curl(ice) else [])


def believed_effects(ice: Ice) -> dict[str, tuple[str, ...]]:
    """Return the effects that act on a stone, each with its assumed parameters."""
    cards = catalogue()
    return {
        e.name: e.believed
        for e in ice.effects
        if e.believed and e.name in cards and cards[e.name].is_physical
    }


def assumption_remark(name: str) -> str:
    """Note that an effect was assumed rather than measured, and how to measure it."""
    card = catalogue()[name]
    return f"{card.words} is assumed, not measured: {card.measured_by} to measure it"
