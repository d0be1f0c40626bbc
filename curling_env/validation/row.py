"""A row of the table of published measurements, and what an ice says to it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from curling_env.errors import InputError
from curling_env.validation.shots import Shots


class Verdict(StrEnum):
    """How a computed value stands to a published one."""

    AGREES = "agrees"
    EXPLAINED = "explained"
    DIFFERS = "differs"
    NOT_COMPUTED = "not computed"
    NOT_MEASURED = "not measured"


@dataclass(frozen=True, kw_only=True)
class Row:
    """One published measurement, and how the same is computed.

    Parameters
    ----------
    name : what was measured; no two rows have the same
    part : section of the table
    said : what the source says, as it says it
    low, high : what lies within the source's own uncertainty; both None where nobody has measured
    unit : of low, high and the value
    source : who measured it, and through whom it is quoted if not read there
    value : what an ice gives for it; None where it gives nothing, such as a stone that never stops
    about : what the source leaves open, and where other sources disagree
    why : by name of a preset, why its value does not agree; ``any`` serves for every ice
    depends_on_ice : whether another ice can give another value

    Raises
    ------
    InputError : bounds of which one is missing, or that are the wrong way round
    """

    name: str
    part: str
    said: str
    low: float | None
    high: float | None
    unit: str
    source: str
    value: Callable[[Shots], float | None]
    about: str = ""
    why: Mapping[str, str] = field(default_factory=dict[str, str])
    depends_on_ice: bool = True

    def __post_init__(self) -> None:
        if (self.low is None) != (self.high is None):
            raise InputError(f"row {self.name!r} has only one bound")
        if self.low is not None and self.high is not None and not self.low <= self.high:
            raise InputError(f"row {self.name!r}: low {self.low:g} is above high {self.high:g}")

    def residual(self, value: float) -> float:
        """Distance from the middle of the bounds in halves of their width; within 1 it agrees.

        Raises
        ------
        InputError : a row that nobody has measured, or whose bounds are one number
        """
        if self.low is None or self.high is None or self.low == self.high:
            raise InputError(f"row {self.name!r} has no uncertainty to compare with")
        return (2 * value - self.low - self.high) / (self.high - self.low)

    def compared(self, shots: Shots, preset: str = "") -> Comparison:
        """What an ice says to the row.

        Parameters
        ----------
        shots : throws on the ice
        preset : the name of the ice, for which an explanation may be known
        """
        found = self.value(shots)
        value = None if found is None or not math.isfinite(found) else float(found)
        why = self.why.get(preset, self.why.get("any", ""))
        if value is None:
            verdict = Verdict.NOT_COMPUTED
        elif self.low is None or self.high is None:
            verdict = Verdict.NOT_MEASURED
        elif self.low <= value <= self.high:
            verdict, why = Verdict.AGREES, ""
        else:
            verdict = Verdict.EXPLAINED if why else Verdict.DIFFERS
        return Comparison(row=self, value=value, verdict=verdict, why=why)


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A row with its value on one ice.

    Parameters
    ----------
    row : the published measurement
    value : what the ice gives; None if it gives nothing
    verdict : how the two stand to each other
    why : why they do not agree; empty where they do, or where nobody knows
    """

    row: Row
    value: float | None
    verdict: Verdict
    why: str

    def as_dict(self) -> dict[str, Any]:
        """The comparison by names, for JSON."""
        row = self.row
        return {
            "part": row.part,
            "name": row.name,
            "unit": row.unit,
            "published": row.said,
            "low": row.low,
            "high": row.high,
            "value": self.value,
            "verdict": self.verdict.value,
            "why": self.why,
            "about": row.about,
            "source": row.source,
        }
