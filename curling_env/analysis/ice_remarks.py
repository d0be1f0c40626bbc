"""Remarks for the user of an ice: on what it lacks, and what of it was never measured."""

from __future__ import annotations

from curling_env.ice import Ice
from curling_env.physics.effects import catalogue

UNKNOWN = (
    "this ice lacks something: the tracks it was made from show what none of its effects explains, "
    "and predictions on it may be off by that"
)
NO_CURL = (
    "this ice was estimated without effects, so that no stone curls on it: "
    "`curling estimate TRACKS.csv -o ice.json` gives the whole ice"
)


def is_marked_unknown(ice: Ice) -> bool:
    """Tell if an ice is marked as lacking something that its tracks show."""
    return ice.effect("unknown") is not None


def lacks_curl(ice: Ice) -> bool:
    """Tell if an ice was estimated from tracks and has no effect that a stone feels.

    An ice that was written by hand, such as a preset, is not estimated: all its cells are observed.
    """
    cards = catalogue()
    felt = any(e.name not in cards or cards[e.name].is_physical for e in ice.effects)
    return not felt and not ice.friction.observed.all()


def what_is_lacking(ice: Ice) -> list[str]:
    """Remarks on what an ice lacks of what the tracks show that it was made from."""
    said = [UNKNOWN] if is_marked_unknown(ice) else []
    return said + ([NO_CURL] if lacks_curl(ice) else [])


def believed_effects(ice: Ice) -> dict[str, tuple[str, ...]]:
    """Effects that a stone feels, each with the parameters that are believed and not measured."""
    cards = catalogue()
    return {
        e.name: e.believed
        for e in ice.effects
        if e.believed and e.name in cards and cards[e.name].is_physical
    }


def belief_in_words(name: str) -> str:
    """Remark that an effect of the catalogue is believed, and how it is measured."""
    card = catalogue()[name]
    return f"{card.words} is believed, not measured: {card.measured_by} to measure it"
