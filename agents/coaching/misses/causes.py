"""Why a throw missed: the parts of its miss, which add up to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot
from typing import Literal

import numpy as np

from agents.coaching.calls import Call
from agents.coaching.throw_sheet import ThrowSheet
from curling_env.throw import Throw
from curling_env.typing import Floats
from friction_estimation.tracks.measured import Measured

Cause = Literal["weight", "line", "rotation", "ice", "sweeping", "neither"]
CAUSES: tuple[Cause, ...] = ("weight", "line", "rotation", "ice", "sweeping", "neither")
"""In the order in which they are told."""
INTERVAL = 1.96
"""Standard errors to either side of a 95 % interval."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """What one cause added to where a stone came to rest.

    Parameters
    ----------
    right, past : to the right, and past the target, each with its standard error [m]
    share : its part of the miss: along the miss, over its length; the shares of a throw add up to 1
    """

    right: Measured
    past: Measured
    share: Measured

    @property
    def size(self) -> float:
        """Its length [m]."""
        return hypot(self.right.value, self.past.value)

    def interval(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """95 % intervals of right and of past [m]."""
        return interval(self.right), interval(self.past)

    def as_dict(self) -> dict[str, float | None]:
        """The numbers by name."""
        return {
            f"{name}{ending}": value
            for name, one in (("right", self.right), ("past", self.past), ("share", self.share))
            for ending, value in (("", one.value), ("_sigma", one.sigma))
        }


def interval(value: Measured) -> tuple[float, float]:
    """The 95 % interval of a measured number."""
    half = INTERVAL * (value.sigma or 0.0)
    return value.value - half, value.value + half


@dataclass(frozen=True, kw_only=True, eq=False)
class HandError:
    """How far the release was from the one that was meant; None for what was not meant.

    Parameters
    ----------
    speed : faster [m/s]
    seconds : the same as a time from hog line to hog line: more is lighter [s]
    line : at the far tee line, to the right [m]
    spin : more turning than was meant, whatever the handle [rad/s]
    covariance : (3, 3) of speed, line, spin
    """

    speed: Measured | None
    line: Measured | None
    spin: Measured | None
    seconds: Measured | None = None
    covariance: Floats = field(default_factory=lambda: np.zeros((3, 3)))

    def as_dict(self) -> dict[str, float | None]:
        """The numbers by name."""
        return {
            f"{name}{ending}": None if one is None else value
            for name in ("speed", "seconds", "line", "spin")
            for one in [getattr(self, name)]
            for ending, value in zip(("_error", "_error_sigma"), one or (None, None), strict=True)
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class ThrowCauses:
    """Why one throw missed.

    Parameters
    ----------
    sheet : the throw, with who threw it and what was called
    target, rest : right and past the tee [m]; of a hit, where it crossed the line of its target
    miss : (2,) their difference [m]
    parts : what each cause added; they add up to the miss
    errors : of the release
    intended, released : the throw that was meant, and the one that was made
    draws : (k, n, 2) the parts under errors that the measurement and the ice may have, in the order
        of `parts` [m]
    """

    sheet: ThrowSheet
    target: Floats
    rest: Floats
    miss: Floats
    parts: Mapping[Cause, Part]
    errors: HandError
    intended: Throw
    released: Throw
    draws: Floats = field(repr=False)

    @property
    def throw(self) -> int:
        """The number of the throw in the tracks."""
        return self.sheet.throw

    @property
    def athlete(self) -> str:
        """Who threw it; empty where nobody noted it."""
        return self.sheet.athlete

    @property
    def call(self) -> Call:
        """What was called."""
        assert self.sheet.call is not None  # a throw without a call has no causes
        return self.sheet.call

    @property
    def distance(self) -> float:
        """The length of the miss [m]."""
        return float(np.hypot(*self.miss))

    @property
    def main(self) -> Cause:
        """The cause with the largest share of the miss."""
        return max(self.parts, key=lambda cause: self.parts[cause].share.value)

    def together(self, causes: Sequence[Cause]) -> Part:
        """What some causes added together."""
        names = list(self.parts)
        chosen = [names.index(cause) for cause in causes if cause in names]
        value = sum(
            (np.array([self.parts[names[k]].right.value, self.parts[names[k]].past.value]))
            for k in chosen
        )
        return part_of(np.zeros(2) + value, self.draws[:, chosen].sum(axis=1), self.miss)

    def as_dict(self) -> dict[str, object]:
        """The numbers by name, for JSON and CSV."""
        found: dict[str, object] = {
            "throw": self.throw,
            "athlete": self.athlete,
            "called": self.call.text,
            "target_right": float(self.target[0]),
            "target_past": float(self.target[1]),
            "miss_right": float(self.miss[0]),
            "miss_past": float(self.miss[1]),
            "main": self.main,
        }
        for cause, part in self.parts.items():
            found |= {f"{cause}_{name}": value for name, value in part.as_dict().items()}
        return found | self.errors.as_dict()


def part_of(value: Floats, draws: Floats, miss: Floats) -> Part:
    """A part from its value (2,) and its draws (k, 2).

    Parameters
    ----------
    miss : (2,) the whole miss [m]
    """
    sigma = draws.std(axis=0)
    size = max(float(miss @ miss), 1e-6)
    share = draws @ miss / size
    return Part(
        right=Measured(float(value[0]), float(sigma[0])),
        past=Measured(float(value[1]), float(sigma[1])),
        share=Measured(float(value @ miss) / size, float(share.std())),
    )


@dataclass(frozen=True, kw_only=True)
class Pattern:
    """What some throws have in common.

    Parameters
    ----------
    athlete : whose they are; None for everybody's
    throws : how many
    shares : of each cause in all squared misses, which add up to 1
    mean : the mean part of each cause, with the standard error of that mean: what happens again and
        again, beside what goes one way today and the other way next time
    typical_miss : root mean square of the misses [m]
    """

    athlete: str | None
    throws: int
    shares: Mapping[Cause, Measured]
    mean: Mapping[Cause, tuple[Measured, Measured]]
    typical_miss: float

    def as_dict(self) -> dict[str, object]:
        """The numbers by name."""
        found: dict[str, object] = {
            "athlete": self.athlete,
            "throws": self.throws,
            "typical_miss": self.typical_miss,
        }
        for cause, share in self.shares.items():
            right, past = self.mean[cause]
            found[cause] = {
                "share": share.value,
                "share_sigma": share.sigma,
                "mean_right": right.value,
                "mean_right_sigma": right.sigma,
                "mean_past": past.value,
                "mean_past_sigma": past.sigma,
            }
        return found


@dataclass(frozen=True, kw_only=True, eq=False)
class SessionCauses:
    """Why the throws of a session missed.

    Parameters
    ----------
    throws : those with a called target that were seen from the hog line to their rest
    left_out : why others are not among them, by their number
    pattern : of all of them; None without throws
    athletes : of each athlete
    believed : whether the ice that the team believed in was given; without it nothing but a called
        broom or time tells how the ice was read
    remarks : what a reader should know
    """

    throws: tuple[ThrowCauses, ...]
    left_out: Mapping[int, str]
    pattern: Pattern | None
    athletes: tuple[Pattern, ...]
    believed: bool
    remarks: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, object]:
        """The numbers by name, for JSON."""
        return {
            "believed": self.believed,
            "throws": [one.as_dict() for one in self.throws],
            "pattern": None if self.pattern is None else self.pattern.as_dict(),
            "athletes": [one.as_dict() for one in self.athletes],
            "left_out": {str(throw): why for throw, why in self.left_out.items()},
            "remarks": list(self.remarks),
        }


def pattern_of(throws: Sequence[ThrowCauses], athlete: str | None = None) -> Pattern | None:
    """What throws have in common; None without throws.

    Parameters
    ----------
    throws : the throws
    athlete : whose alone; None for everybody's
    """
    chosen = [one for one in throws if athlete is None or one.athlete == athlete]
    if not chosen:
        return None
    causes: list[Cause] = [cause for cause in CAUSES if any(cause in one.parts for one in chosen)]
    misses = np.array([one.miss for one in chosen])
    whole = max(float((misses**2).sum()), 1e-6)
    shares: dict[Cause, Measured] = {}
    mean: dict[Cause, tuple[Measured, Measured]] = {}
    for cause in causes:
        values, draws = zip(*(_of(one, cause) for one in chosen), strict=True)
        value, draw = np.array(values), np.array(draws)
        share = np.einsum("nkc,nc->k", draw, misses) / whole
        shares[cause] = Measured(float((value * misses).sum()) / whole, float(share.std()))
        # What an average is worth depends on how much the throws differ, and on what all of them
        # share: the ice. Draws of one number stand for one ice in all throws.
        spread = value.std(axis=0, ddof=1) if len(value) > 1 else np.abs(value[0])
        sigma = np.hypot(spread / len(value) ** 0.5, draw.mean(axis=0).std(axis=0))
        centre = value.mean(axis=0)
        mean[cause] = (
            Measured(float(centre[0]), float(sigma[0])),
            Measured(float(centre[1]), float(sigma[1])),
        )
    return Pattern(
        athlete=athlete,
        throws=len(chosen),
        shares=shares,
        mean=mean,
        typical_miss=(whole / len(chosen)) ** 0.5,
    )


def _of(one: ThrowCauses, cause: Cause) -> tuple[Floats, Floats]:
    """The part of a cause in a throw, and its draws; noughts where it had none."""
    if cause not in one.parts:
        return np.zeros(2), np.zeros((len(one.draws), 2))
    part = one.parts[cause]
    return (
        np.array([part.right.value, part.past.value]),
        one.draws[:, list(one.parts).index(cause)],
    )
