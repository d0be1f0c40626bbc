"""Causes of a miss: its parts, which add up to it."""

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
"""Causes in the order of display."""
INTERVAL = 1.96
"""Standard errors to either side of a 95 % interval."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """Contribution of one cause to a stone's place of rest.

    Parameters
    ----------
    right, past : to the right, and past the target, each with its standard error [m]
    share : component along the miss over its length; the shares of a throw add up to 1
    """

    right: Measured
    past: Measured
    share: Measured

    @property
    def size(self) -> float:
        """Length [m]."""
        return hypot(self.right.value, self.past.value)

    def interval(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """95 % intervals of right and of past [m]."""
        return interval(self.right), interval(self.past)

    def as_dict(self) -> dict[str, float | None]:
        """Return the numbers by name."""
        return {
            f"{name}{ending}": value
            for name, one in (("right", self.right), ("past", self.past), ("share", self.share))
            for ending, value in (("", one.value), ("_sigma", one.sigma))
        }


def interval(value: Measured) -> tuple[float, float]:
    """Return the 95 % interval of a measured number."""
    half = INTERVAL * (value.sigma or 0.0)
    return value.value - half, value.value + half


@dataclass(frozen=True, kw_only=True, eq=False)
class HandError:
    """Error of the release against the intended throw; None for components without an intention.

    Parameters
    ----------
    speed : faster [m/s]
    seconds : the same as a time from hog line to hog line: more is lighter [s]
    line : at the far tee line, to the right [m]
    spin : more turning than intended, for either handle [rad/s]
    covariance : (3, 3) of speed, line, spin
    """

    speed: Measured | None
    line: Measured | None
    spin: Measured | None
    seconds: Measured | None = None
    covariance: Floats = field(default_factory=lambda: np.zeros((3, 3)))

    def as_dict(self) -> dict[str, float | None]:
        """Return the numbers by name."""
        return {
            f"{name}{ending}": None if one is None else value
            for name in ("speed", "seconds", "line", "spin")
            for one in [getattr(self, name)]
            for ending, value in zip(("_error", "_error_sigma"), one or (None, None), strict=True)
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class ThrowCauses:
    """Causes of one throw's miss.

    Parameters
    ----------
    sheet : the throw with its athlete and call
    target, rest : right and past the tee [m]; for a hit, rest is the crossing of the target's line
    miss : (2,) their difference [m]
    parts : contribution of each cause; they add up to the miss
    errors : errors of the release
    intended, released : the intended and the actual throw
    draws : (k, n, 2) the parts under sampled errors of the measurement and the ice, in the order of
        `parts` [m]
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
        """Number of the throw in the tracks."""
        return self.sheet.throw

    @property
    def athlete(self) -> str:
        """Athlete; empty if not noted."""
        return self.sheet.athlete

    @property
    def call(self) -> Call:
        """Called shot."""
        assert self.sheet.call is not None  # a throw without a call has no causes
        return self.sheet.call

    @property
    def distance(self) -> float:
        """Length of the miss [m]."""
        return float(np.hypot(*self.miss))

    @property
    def main(self) -> Cause:
        """Cause with the largest share of the miss."""
        return max(self.parts, key=lambda cause: self.parts[cause].share.value)

    def together(self, causes: Sequence[Cause]) -> Part:
        """Return the combined contribution of some causes."""
        names = list(self.parts)
        chosen = [names.index(cause) for cause in causes if cause in names]
        value = sum(
            (np.array([self.parts[names[k]].right.value, self.parts[names[k]].past.value]))
            for k in chosen
        )
        return part_of(np.zeros(2) + value, self.draws[:, chosen].sum(axis=1), self.miss)

    def as_dict(self) -> dict[str, object]:
        """Return the numbers by name, for JSON and CSV."""
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
    """Make a part from its value (2,) and its draws (k, 2).

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
    """Common pattern of some throws.

    Parameters
    ----------
    athlete : the athlete; None for all athletes
    throws : number of throws
    shares : of each cause in all squared misses, which add up to 1
    mean : mean part of each cause, with the standard error of that mean: the systematic part,
        without random scatter
    typical_miss : root mean square of the misses [m]
    """

    athlete: str | None
    throws: int
    shares: Mapping[Cause, Measured]
    mean: Mapping[Cause, tuple[Measured, Measured]]
    typical_miss: float

    def as_dict(self) -> dict[str, object]:
        """Return the numbers by name."""
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
    """Causes of the misses of a session.

    Parameters
    ----------
    throws : throws with a called target that were seen from the hog line to rest
    left_out : reason why others are excluded, by throw number
    pattern : pattern of all of them; None without throws
    athletes : pattern of each athlete
    believed : true if the ice that the team believed in was given; without it only a called broom
        or time shows how the ice was read
    remarks : remarks for the reader
    """

    throws: tuple[ThrowCauses, ...]
    left_out: Mapping[int, str]
    pattern: Pattern | None
    athletes: tuple[Pattern, ...]
    believed: bool
    remarks: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, object]:
        """Return the numbers by name, for JSON."""
        return {
            "believed": self.believed,
            "throws": [one.as_dict() for one in self.throws],
            "pattern": None if self.pattern is None else self.pattern.as_dict(),
            "athletes": [one.as_dict() for one in self.athletes],
            "left_out": {str(throw): why for throw, why in self.left_out.items()},
            "remarks": list(self.remarks),
        }


def pattern_of(throws: Sequence[ThrowCauses], athlete: str | None = None) -> Pattern | None:
    """Averages over a set of throws, or None if it is empty.

    Parameters
    ----------
    throws : the throws
    athlete : only throws of this athlete; None for all athletes
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
        # The precision of an average depends on the scatter between throws and on the error that
        # all of them share: the ice. Draws with one index are of one ice in all throws.
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
    """Return the part of a cause in a throw, and its draws; zeros if it had none."""
    if cause not in one.parts:
        return np.zeros(2), np.zeros((len(one.draws), 2))
    part = one.parts[cause]
    return (
        np.array([part.right.value, part.past.value]),
        one.draws[:, list(one.parts).index(cause)],
    )
