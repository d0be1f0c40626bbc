"""Missing effects found by a discovery, in plain words, and throws that would confirm them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from msgspec import Meta, Struct, field

from curling_env.infrastructure.files.schema import Short, Text, checked
from curling_env.physics.effects import catalogue
from friction_estimation.discovery.report import REPORT_FORMAT
from friction_estimation.discovery.verdict import in_words, readable

TITLES = {
    "curl": "stones curl",
    "slope": "the ice falls to one side or one end",
    "friction_map": "keen and heavy areas",
    "friction_patch": "a keen or heavy spot",
    "pebble_wear": "the pebble wears where stones have run",
    "time_drift": "the ice becomes keener or heavier during the session",
    "stone_bias": "a stone that is keener or heavier than the others",
    "speed_dependent_friction": "fast and slow stones run on different weight",
    "sweeping": "sweeping carries the stones",
    "spin_drag": "stones lose their turn",
    "air_drag": "the air slows fast stones",
    "unknown": "something that no known effect explains",
}
"""Effects in the words of ice makers."""


class Missing(Struct, kw_only=True):
    """Effect that the model of the ice lacked; the part of a report that is used here."""

    name: Short
    kind: Short = "physics"
    where: Text = ""
    alternatives: list[Short] = field(default_factory=list[str])
    depends_on: list[Short] = field(default_factory=list[str])
    evidence: dict[str, Any] = field(default_factory=dict[str, Any])

    @property
    def title(self) -> str:
        """The effect in the words of ice makers."""
        return TITLES.get(self.name) or readable(self.name)

    @property
    def words(self) -> str:
        """Signs of the effect and their places."""
        follows = " and ".join(map(in_words, self.depends_on))
        if follows and (self.name == "unknown" or not self.where):
            return f"stones slow down or bend differently by {follows}"
        return self.where

    @property
    def unsure(self) -> tuple[str, ...]:
        """Alternative effects; empty if the throws exclude them."""
        return tuple(readable(name) for name in self.alternatives)

    @property
    def settled_by(self) -> str:
        """Throw that would distinguish them; empty if unknown."""
        if not self.alternatives:
            return ""
        card, separating = catalogue().get(self.name), self.evidence.get("separating_throws")
        settled = separating.get(self.alternatives[0]) if isinstance(separating, dict) else ""
        return str(settled or ("" if card is None else card.measured_by))


class NextThrow(Struct, kw_only=True):
    """A throw worth making."""

    words: Text
    teaches: dict[Short, float] = field(default_factory=dict[str, float])

    @property
    def lesson(self) -> str:
        """Parameter that it measures best, in words."""
        if not self.teaches:
            return ""
        name, share = max(self.teaches.items(), key=lambda item: item[1])
        return f"it removes {100 * share:.0f} % of the uncertainty of {readable(name)}"


class Findings(Struct, kw_only=True):
    """Findings of a discovery; the part of its report that is used here."""

    verdict: Annotated[str, Meta(max_length=20_000)]
    remarks: Annotated[list[Text], Meta(max_length=50)] = field(default_factory=list[Text])
    missing: Annotated[list[Missing], Meta(max_length=200)] = field(name="effects")
    worth_making: Annotated[list[NextThrow], Meta(max_length=50)] = field(
        default_factory=list[NextThrow], name="next_throws"
    )

    @property
    def next_throws(self) -> tuple[tuple[str, str], ...]:
        """Most informative next throws, in the order in which to make them, each with the parameter
        it measures.
        """
        return tuple((throw.words, throw.lesson) for throw in self.worth_making)


def findings(report: Mapping[str, Any]) -> Findings:
    """Return the findings of a discovery's report, in plain words.

    Parameters
    ----------
    report : content of a `report.json`

    Raises
    ------
    InputError : it is no report of a discovery
    """
    return checked(REPORT_FORMAT.accept(report), Findings)
