"""Matching of stones: keener or heavier than the set, and more or less curl.

Each throw measures the friction and the curl of its stone, relative to the ice. The scatter between
throws of one stone shows how reliable they are: hair, frost, and errors of the ice file. A steady
change of the ice during the session, the end played to, and for the curl the handle are removed, if
the throws can separate them from the stones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from math import ceil
from typing import Any

import numpy as np
from scipy.optimize import LinearConstraint, milp, minimize_scalar
from scipy.special import stdtrit

from agents.coaching.athletes import Interval
from agents.coaching.misses.ices import SessionIce
from agents.coaching.misses.released import Released, read_release
from agents.coaching.runs import SPEED, SPIN, Place, rests
from agents.coaching.tuning import (
    ALIKE_CURL,
    ALIKE_FRICTION,
    MAX_CURL_SIGMA,
    MAX_MORE_THROWS,
    STONE_DRAWS,
)
from curling_env.errors import InputError, TrackTooShortError
from curling_env.ice import ActiveEffect, Ice
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Integers, Progress, no_progress
from friction_estimation.tracks.throw_list import NO_NOTES, ThrowNote
from friction_estimation.tracks.throw_table import thrown_stones


@dataclass(frozen=True, kw_only=True)
class StoneFactor:
    """One stone against the set.

    Parameters
    ----------
    stone : name as noted, else its number
    number : number in the tracks
    throws : number of throws used
    friction : friction over the mean of the set: below 1 is keen, above 1 heavy
    curl : curl over the mean of the set; None if nothing curls, or too little is known
    carry : extra distance over the set's at draw weight, with its interval [m]
    """

    stone: str
    number: int
    throws: int
    friction: Interval
    curl: Interval | None
    carry: Interval

    def as_dict(self) -> dict[str, object]:
        """Return the numbers by name."""
        found: dict[str, object] = {
            "stone": self.stone,
            "number": self.number,
            "throws": self.throws,
        }
        for name, one in (("friction", self.friction), ("curl", self.curl), ("carry", self.carry)):
            low, high = (None, None) if one is None else (one.low, one.high)
            found |= {
                name: None if one is None else one.value,
                f"{name}_low": low,
                f"{name}_high": high,
            }
        return found


@dataclass(frozen=True, kw_only=True)
class StonePair:
    """Two stones compared.

    Parameters
    ----------
    first, second : the stones, as noted
    friction : friction of the first over that of the second
    curl : the same for the curl; None if unknown
    apart : distance between their places of rest at draw weight [m]
    verdict : ``differ``; ``alike`` within a difference that a player notices; or ``open``
    more : throws of each needed to settle an open pair
    """

    first: str
    second: str
    friction: Interval
    curl: Interval | None
    apart: float
    verdict: str
    more: int = 0

    def as_dict(self) -> dict[str, object]:
        """Return the numbers by name."""
        found: dict[str, object] = {"stones": [self.first, self.second]}
        for name, one in (("friction", self.friction), ("curl", self.curl)):
            if one is not None:
                found |= {name: one.value, f"{name}_low": one.low, f"{name}_high": one.high}
        return found | {"apart": self.apart, "verdict": self.verdict, "more_throws": self.more}


@dataclass(frozen=True, kw_only=True)
class StoneMatch:
    """Set of stones, matched.

    Parameters
    ----------
    stones : stones, the keenest first
    pairs : suggested pairs: each stone in at most one, with the most similar partners
    all_pairs : every pair of stones
    spread : standard deviation of ln friction from throw to throw of one stone
    left_out : reason why throws were excluded, by number
    remarks : remarks for the reader
    """

    stones: tuple[StoneFactor, ...]
    pairs: tuple[StonePair, ...]
    all_pairs: tuple[StonePair, ...] = field(repr=False)
    spread: float
    left_out: Mapping[int, str]
    remarks: tuple[str, ...] = ()

    @property
    def undecided(self) -> tuple[StonePair, ...]:
        """Return the pairs that cannot be distinguished yet, those that need fewest throws
        first.
        """
        open_pairs = [pair for pair in self.all_pairs if pair.verdict == "open"]
        return tuple(sorted(open_pairs, key=lambda pair: pair.more))

    @property
    def more_throws(self) -> dict[str, int]:
        """Return the throws of each stone needed to settle all its pairs; stones that need none are
        missing.
        """
        wanted = {
            one.stone: max(
                (p.more for p in self.undecided if one.stone in (p.first, p.second)), default=0
            )
            for one in self.stones
        }
        return {stone: more for stone, more in wanted.items() if more}

    def on(self, ice: Ice) -> Ice:
        """Return the ice with a `stone_bias` for every stone, for planning."""
        ice = ice.without_effect("stone_bias")
        for one in self.stones:
            parameters = {"stone": float(one.number), "factor": one.friction.value}
            sigma = {"factor": (one.friction.high - one.friction.low) / 3.92}
            if one.curl is not None:
                parameters["curl_factor"] = one.curl.value
                sigma["curl_factor"] = (one.curl.high - one.curl.low) / 3.92
            ice = ice.with_effect(
                ActiveEffect(name="stone_bias", parameters=parameters, sigma=sigma)
            )
        return ice

    def as_dict(self) -> dict[str, object]:
        """Return the numbers by name, for JSON."""
        return {
            "stones": [one.as_dict() for one in self.stones],
            "pairs": [one.as_dict() for one in self.pairs],
            "undecided": [one.as_dict() for one in self.undecided],
            "more_throws": self.more_throws,
            "spread_between_throws": self.spread,
            "left_out": {str(throw): why for throw, why in self.left_out.items()},
            "remarks": list(self.remarks),
        }


def match_stones(
    tracks: Sequence[Trajectory],
    ice: Ice,
    notes: Mapping[int, ThrowNote] = NO_NOTES,
    *,
    seed: int = 0,
    progress: Progress = no_progress,
) -> StoneMatch:
    """Estimate friction and curl of every stone against the set.

    Parameters
    ----------
    tracks : tracks of one session with numbered stones (`load_tracks`)
    ice : ice of the session; its values for single stones are ignored
    notes : names of the stones (`throws_beside`)
    seed : seed of the sampled errors of the ice
    progress : called with the number of throws done

    Raises
    ------
    InputError : fewer than two stones, or no usable throw
    """
    plain = ice.without_effect("stone_bias")
    session = SessionIce(plain, np.random.default_rng(seed), STONE_DRAWS)
    read: list[tuple[int, Released]] = []
    left_out: dict[int, str] = {}
    names: dict[int, str] = {}
    thrown = list(thrown_stones(tracks))
    for order, (track, contacts) in enumerate(thrown):
        progress("throws", order, len(thrown))
        names.setdefault(track.stone, notes.get(track.throw, ThrowNote()).stone or str(track.stone))
        try:
            released = read_release(
                track, session.now.ice, contacts=contacts, order=order, whole=True
            )
            read.append((track.stone, released))
        except TrackTooShortError as error:
            left_out[track.throw] = error.problem.removeprefix(f"throw {track.throw}: ")
        session.ran(track.xy)
    progress("throws", len(thrown), len(thrown))
    numbers = sorted({stone for stone, _ in read})
    if len(numbers) < 2:
        raise InputError(
            f"expected two or more stones, found {len(numbers)}: enter the stone of each throw in "
            "throws.csv"
        )
    return _Match(plain, read, numbers, names, left_out).result()


class _Match:
    def __init__(
        self,
        ice: Ice,
        read: Sequence[tuple[int, Released]],
        numbers: Sequence[int],
        names: Mapping[int, str],
        left_out: Mapping[int, str],
    ) -> None:
        self._numbers, self._names, self._left_out = numbers, names, left_out
        stone = np.array([numbers.index(stone) for stone, _ in read])
        self._throws = np.bincount(stone, minlength=len(numbers))
        releases = [released for _, released in read]
        ends = np.array([float(one.place.direction) for one in releases])
        when = np.array([one.place.clock for one in releases])
        order = np.array([float(one.place.order) for one in releases])
        trend = when if np.ptp(when) > 0 else order
        handle = np.array([np.sign(one.throw[SPIN]) for one in releases])
        friction = np.array([one.friction for one in releases], dtype=np.float64)
        self._friction = levels(friction, stone, len(numbers), [trend, ends])
        curl = np.array([one.curl for one in releases], dtype=np.float64)
        known = curl[:, 1] < MAX_CURL_SIGMA
        self._curl = None
        if set(stone[known].tolist()) == set(range(len(numbers))):
            self._curl = levels(
                curl[known], stone[known], len(numbers), [handle[known], ends[known]]
            )
        self._carry, self._bend = _draw(ice, releases)

    def result(self) -> StoneMatch:
        """Return the complete result."""
        k = len(self._numbers)
        stones = [self._stone(i) for i in range(k)]
        pairs = {(i, j): self._pair(i, j) for i, j in combinations(range(k), 2)}
        partners = _partners(k, {pair: found.apart for pair, found in pairs.items()})
        remarks: list[str] = []
        if self._curl is None:
            remarks.append("the curl of single throws is too uncertain to distinguish stones")
        if (self._throws < 2).any():
            few = ", ".join(stones[i].stone for i in np.flatnonzero(self._throws < 2).tolist())
            remarks.append(f"thrown only once: {few}; their scatter is taken from the other stones")
        return StoneMatch(
            stones=tuple(sorted(stones, key=lambda one: one.friction.value)),
            pairs=tuple(sorted((pairs[pair] for pair in partners), key=lambda one: one.apart)),
            all_pairs=tuple(pairs.values()),
            spread=self._friction.between**0.5,
            left_out=dict(sorted(self._left_out.items())),
            remarks=tuple(remarks),
        )

    def _name(self, k: int) -> str:
        return self._names[self._numbers[k]]

    def _stone(self, k: int) -> StoneFactor:
        against = np.eye(len(self._numbers))[k]
        friction = self._friction.interval(against)
        carry = sorted(-self._carry * value for value in friction[1:])
        return StoneFactor(
            stone=self._name(k),
            number=self._numbers[k],
            throws=int(self._throws[k]),
            friction=_factor(friction),
            curl=None if self._curl is None else _factor(self._curl.interval(against)),
            carry=Interval(-self._carry * friction[0], *carry),
        )

    def _pair(self, i: int, j: int) -> StonePair:
        against = np.zeros(len(self._numbers))
        against[i], against[j] = 1.0, -1.0
        friction = self._friction.interval(against)
        curl = None if self._curl is None else self._curl.interval(against)
        verdict, more = self._verdict(self._friction, friction, ALIKE_FRICTION, i, j)
        if self._curl is not None and curl is not None:
            by_curl, more_of_curl = self._verdict(self._curl, curl, ALIKE_CURL, i, j)
            if "differ" in (verdict, by_curl):
                verdict, more = "differ", 0
            elif "open" in (verdict, by_curl):
                verdict, more = "open", max(more, more_of_curl)
        along = self._carry * friction[0]
        across = 0.0 if curl is None else self._bend * curl[0]
        return StonePair(
            first=self._name(i),
            second=self._name(j),
            friction=_factor(friction),
            curl=None if curl is None else _factor(curl),
            apart=float(np.hypot(along, across)),
            verdict=verdict,
            more=more,
        )

    def _verdict(
        self, levels: Levels, interval: tuple[float, float, float], alike: float, i: int, j: int
    ) -> tuple[str, int]:
        """Return the verdict on two stones, and the number of further throws of each to settle
        it.
        """
        value, low, high = interval
        if low > 0 or high < 0:
            return "differ", 0
        if -alike < low and high < alike:
            return "alike", 0
        # Settled: the interval excludes no difference, or every difference that a player would
        # notice.
        wanted = max(abs(value), alike - abs(value), 0.5 * alike) / 1.96
        needed = (levels.noise[i] + levels.noise[j]) / wanted**2
        more = ceil(needed - min(int(self._throws[i]), int(self._throws[j])))
        return "open", int(np.clip(more, 1, MAX_MORE_THROWS))


def _factor(interval: tuple[float, float, float]) -> Interval:
    value, low, high = np.exp(interval).tolist()
    return Interval(value, low, high)


def _draw(ice: Ice, releases: Sequence[Released]) -> tuple[float, float]:
    """Return the distances that ln friction and ln curl are worth at draw weight [m].

    Parameters
    ----------
    releases : throws; the one that rests nearest to the tee is the draw
    """
    throws = np.array([released.throw for released in releases])
    ends = rests(ice, throws, Place())
    nearest = int(np.nanargmin(np.abs(ends[:, 1]))) if np.isfinite(ends[:, 1]).any() else 0
    draw = throws[[nearest]].copy()
    draw[:, SPEED] = np.clip(draw[:, SPEED], 1.5, 3.0)
    step = 0.01
    own = {"stone": 0.0, "factor": 1.0, "curl_factor": 1.0}

    def changed(name: str) -> Floats:
        other = ice.with_effect(
            ActiveEffect(name="stone_bias", parameters={**own, name: 1.0 + step})
        )
        return (rests(other, draw, Place()) - rests(ice, draw, Place()))[0] / step

    by_friction, by_curl = changed("factor"), changed("curl_factor")
    return float(-np.nan_to_num(by_friction[1])), float(np.abs(np.nan_to_num(by_curl[0])))


def _partners(count: int, apart: Mapping[tuple[int, int], float]) -> list[tuple[int, int]]:
    """Pair the stones, each in at most one pair, with the least sum of squared distances."""
    pairs = list(apart)
    member = np.zeros((count, len(pairs)))
    for k, pair in enumerate(pairs):
        member[list(pair), k] = 1.0
    cost = np.array([apart[pair] ** 2 for pair in pairs])
    found: Any = milp(
        cost,
        integrality=np.ones(len(pairs)),
        bounds=(0, 1),
        constraints=[
            LinearConstraint(member, 0.0, 1.0),
            LinearConstraint(np.ones((1, len(pairs))), count // 2, count // 2),
        ],
    )
    return [pair for pair, taken in zip(pairs, np.round(found.x).tolist(), strict=True) if taken]


@dataclass(frozen=True, kw_only=True, eq=False)
class Levels:
    """Ln factor of each stone against the set.

    Parameters
    ----------
    value : (k,)
    covariance : (k, k)
    freedom : degrees of freedom of its scale
    between : variance from throw to throw
    noise : (k,) variance of one throw of each stone, including its measurement
    """

    value: Floats
    covariance: Floats
    freedom: float
    between: float
    noise: Floats

    def interval(self, weights: Floats) -> tuple[float, float, float]:
        """Return a weighted sum, and the ends of its interval."""
        value = float(weights @ self.value)
        half = float(np.sqrt(weights @ self.covariance @ weights)) * self.reach
        return value, value - half, value + half

    @property
    def reach(self) -> float:
        """Half-width of a 95 % interval [standard errors]."""
        return float(stdtrit(self.freedom, 0.975))


def levels(measured: Floats, stone: Integers, count: int, others: Sequence[Floats]) -> Levels:
    """Estimate the level of each stone by restricted likelihood.

    Parameters
    ----------
    measured : (n, 2) measured number of each throw, and its standard error
    stone : (n,) the stone of each
    count : number of stones
    others : (n,) each, further covariates; dropped if confounded with the stones
    """
    value, variance = measured[:, 0], measured[:, 1] ** 2
    design = np.eye(count)[stone]
    for other in others:
        size = float(np.ptp(other))
        wider = np.column_stack([design, (other - other.mean()) / (size or 1.0)])
        enough = len(value) - wider.shape[1] >= 2
        if size > 0 and enough and np.linalg.cond(wider) < 50.0:
            design = wider

    def solve(between: float) -> tuple[Floats, Floats, float]:
        weight = 1 / (variance + between)
        normal = design.T @ (design * weight[:, None])
        inverse = np.linalg.inv(normal)
        found = inverse @ (design.T @ (weight * value))
        left = value - design @ found
        _, log_determinant = np.linalg.slogdet(normal)
        cost = float((weight * left**2).sum() - np.log(weight).sum() + log_determinant)
        return found, np.asarray(inverse, dtype=np.float64), cost

    free = max(len(value) - design.shape[1], 1)
    plain = value - design @ np.linalg.lstsq(design, value, rcond=None)[0]
    most = 4 * float(plain @ plain) / free + 1e-10
    best: Any = minimize_scalar(
        lambda root: solve(root**2)[2], bounds=(0.0, most**0.5), method="bounded"
    )
    between = min(0.0, float(best.x) ** 2, key=lambda variance: solve(variance)[2])
    found, inverse, _ = solve(between)
    centre = np.eye(count) - 1 / count
    noise = between + np.array([float(variance[stone == k].mean()) for k in range(count)])
    return Levels(
        value=centre @ found[:count],
        covariance=np.asarray(centre @ inverse[:count, :count] @ centre, dtype=np.float64),
        freedom=float(free),
        between=between,
        noise=noise,
    )
