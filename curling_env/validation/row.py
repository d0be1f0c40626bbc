"""Row of the table of published measurements, and its comparison with an ice."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from curling_env.errors import InputError
from curling_env.validation.shots import Shots


class Verdict(StrEnum):
    """Agreement of a computed value with a published one."""

    AGREES = "agrees"
    EXPLAINED = "explained"
    DIFFERS = "differs"
    NOT_COMPUTED = "not computed"
    NOT_MEASURED = "not measured"


@dataclass(frozen=True, kw_only=True)
class Row:
    """Published measurement with the computation of the same quantity.

    Parameters
    ----------
    name : measured quantity, unique in the table
    part : section of the table
    published : value in the source's own words
    low, high : bounds of the source's own uncertainty; both None if not measured
    unit : of low, high and the value
    source : source of the measurement, and the quoting source if not read directly
    value : function that computes it on an ice; None if there is no result, such as a stone that
        never stops
    about : open points of the source, and differing sources
    why : by name of a preset, reason why its value does not agree; ``any`` applies to every ice
    depends_on_ice : true if another ice can give another value

    Raises
    ------
    InputError : one bound is missing, or the bounds are reversed
    """

    name: str
    part: str
    published: str
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
        """Return the distance from the middle of the bounds in half-widths; within 1 it agrees.

        Raises
        ------
        InputError : a row without a measurement, or with equal bounds
        """
        if self.low is None or self.high is None or self.low == self.high:
            raise InputError(f"row {self.name!r} has no uncertainty to compare with")
        return (2 * value - self.low - self.high) / (self.high - self.low)

    def compared(self, shots: Shots, preset: str = "") -> Comparison:
        """Compare an ice with the row.

        Parameters
        ----------
        shots : throws on the ice
        preset : name of the ice, for which an explanation may be known
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
    """Row with its value on one ice.

    Parameters
    ----------
    row : the published measurement
    value : computed value; None if absent
    verdict : agreement of the two
    why : reason for a difference; empty if they agree, or if it is unknown
    """

    row: Row
    value: float | None
    verdict: Verdict
    why: str

    def as_dict(self) -> dict[str, Any]:
        """Return the comparison by names, for JSON."""
        row = self.row
        return {
            "part": row.part,
            "name": row.name,
            "unit": row.unit,
            "published": row.published,
            "low": row.low,
            "high": row.high,
            "value": self.value,
            "verdict": self.verdict.value,
            "why": self.why,
            "about": row.about,
            "source": row.source,
        }
