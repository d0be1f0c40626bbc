"""The planner: of all throws that get there, the one that forgives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.planning.expectation import Spread, end_in_play, possible_ices, spreads
from agents.planning.search import SPINS, check_target, direction_to, find_throws
from agents.planning.words import InWords, in_words
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.slide import NO_OBSTACLES, SlideEnd
from curling_env.sheet import HOG_LINE_Y, HOUSE_RADIUS, Direction, tee
from curling_env.skill import Skill, skill_named
from curling_env.throw import Throw

Floats = NDArray[np.float64]

FIRST_TRIALS, LAST_TRIALS = 128, 1024
"""Trials that rank the candidates, and that describe the best two."""
USUAL_SPIN = 1.0
"""About three turns on a draw's way [rad/s]; the spin of the standard draw."""
ALIKE = 1.03
"""Expected misses closer than this ratio are alike: so few trials do not tell them apart."""
ICES = 32
"""Ices drawn from the map's standard errors."""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """A throw and what to expect of it.

    Parameters
    ----------
    throw : to be meant
    rest : (2,) where it rests without error, sheet frame [m]
    time : from release to rest [s]
    miss_without_error : [m]
    spread : when it is tried many times
    chance_in_house : share of those that rest in the house by themselves
    words : for a person
    """

    throw: Throw
    rest: Floats
    time: float
    miss_without_error: float
    spread: Spread
    chance_in_house: float
    words: InWords

    @property
    def expected_miss(self) -> float:
        """Mean distance from the target [m]."""
        return self.spread.expected_miss


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The best throw for a target, and the second choice.

    Parameters
    ----------
    target : (2,) sheet frame [m]
    direction : the end played to
    skill : of the player it was planned for
    best : the throw with the smallest expected miss
    second : the best of the other handle, or of another weight; None if there is no other
    stones : (k, 2) that lie on the sheet [m]
    map_is_uncertain : whether the ice had standard errors, which the spread then includes
    """

    target: Floats
    direction: Direction
    skill: Skill
    best: Choice
    second: Choice | None
    stones: Floats
    map_is_uncertain: bool

    def as_dict(self) -> dict[str, object]:
        """For `curling plan`: plain numbers, sheet frame, SI."""
        return {
            **_choice(self.best, self.target, self.direction),
            "target": {"x": float(self.target[0]), "y": float(self.target[1])},
            "direction": self.direction.name.lower(),
            "skill": {
                "name": self.skill.name,
                "sigma_speed": self.skill.sigma_speed,
                "sigma_angle": self.skill.sigma_angle,
                "sigma_spin": self.skill.sigma_spin,
            },
            "map_is_uncertain": self.map_is_uncertain,
            "second_choice": None
            if self.second is None
            else _choice(self.second, self.target, self.direction),
        }


def _choice(choice: Choice, target: Floats, direction: Direction) -> dict[str, object]:
    spread, throw = choice.spread, choice.throw
    deviation = np.sqrt(np.diag(spread.covariance))
    return {
        "speed": throw.speed,
        "angle": throw.angle,
        "spin": throw.spin,
        "x": throw.x,
        "expected_miss_m": choice.expected_miss,
        "miss_without_error_m": choice.miss_without_error,
        "rest": {"x": float(choice.rest[0]), "y": float(choice.rest[1])},
        "time_s": choice.time,
        "spread": {
            "median_miss_m": float(np.median(spread.miss)),
            "miss_90_percent_m": float(np.quantile(spread.miss, 0.9)),
            "sigma_across_m": float(deviation[0]),
            "sigma_along_m": float(deviation[1]),
            "chance_in_house": choice.chance_in_house,
            "chance_touches_a_stone": spread.chance(SlideEnd.CONTACT),
            "chance_out_of_play": float(
                (
                    (spread.why == SlideEnd.LEFT_BOUNDS)
                    | ((spread.why == SlideEnd.REST) & (direction * spread.ends[:, 1] < HOG_LINE_Y))
                ).mean()
            ),
        },
        "in_words": choice.words.as_dict(),
    }


def plan(
    ice: Ice,
    target: ArrayLike,
    *,
    stones: ArrayLike = NO_OBSTACLES,
    skill: str | Skill = "elite",
    spins: Sequence[float] = SPINS,
    x: float = 0.0,
    seed: int = 0,
) -> Plan:
    """Find the throw that comes to rest at a target, and say how far it expects to miss.

    Among all throws that get there without touching a stone, the one with the smallest expected
    miss is chosen: it forgives the player's errors and what the map does not know.

    Parameters
    ----------
    ice : known or estimated ice
    target : (2,) sheet frame [m]; its half of the sheet is the end played to
    stones : (k, 2) centres of resting stones, sheet frame [m]
    skill : name in `SKILLS`, or a skill
    spins : to try [rad/s]
    x : offset of the release at the hog line, delivery frame [m]
    seed : of the trials; the same seed, the same plan

    Raises
    ------
    InputError : a target no stone can rest at, or that every throw reaches only through a stone
    """
    target = np.asarray(target, dtype=np.float64)
    stones = np.asarray(stones, dtype=np.float64).reshape(-1, 2)
    skill = skill_named(skill)
    if not spins:
        raise InputError("no spin to try was given")
    check_target(ice, target)
    _check_stones(ice, target, stones)
    direction = direction_to(target)
    throws = _clear_throws(ice, target, stones, spins, x, direction)

    ices = possible_ices(ice, ICES, np.random.default_rng((seed, 1)))
    first = spreads(ices, throws, target, skill, stones, n=FIRST_TRIALS, seed=seed)
    order = _best_first(throws, np.array([spread.expected_miss for spread in first]))
    best = order[0]
    others = [i for i in order[1:] if throws[i, 2] * throws[best, 2] <= 0] or order[1:]
    chosen = throws[[best, *others[:1]]]
    last = spreads(ices, chosen, target, skill, stones, n=LAST_TRIALS, seed=seed)
    choices = [
        _describe(ice, throw, target, direction, stones, spread)
        for throw, spread in zip(chosen, last, strict=True)
    ]
    return Plan(
        target=target,
        direction=direction,
        skill=skill,
        best=choices[0],
        second=choices[1] if len(choices) > 1 else None,
        stones=stones,
        map_is_uncertain=len(ices) > 1,
    )


def _best_first(throws: Floats, expected: Floats) -> list[int]:
    """Throws by expected miss; of those about as good as the best, the usual spin first."""
    good = expected <= ALIKE * expected.min() + 1e-3
    unusual = np.abs(np.abs(throws[:, 2]) - USUAL_SPIN)
    return sorted(
        range(len(throws)),
        key=lambda i: (0, unusual[i], i) if good[i] else (1, expected[i], i),
    )


def _check_stones(ice: Ice, target: Floats, stones: Floats) -> None:
    for k, stone in enumerate(stones):
        place = f"({stone[0]:g}, {stone[1]:g}) m"
        if not bool(ice.sheet.contains(stone)):
            raise InputError(f"stone {k + 1} at {place} is off the ice")
        if np.hypot(*(stone - target)) < 2 * ice.stone.radius:
            raise InputError(
                f"no stone can rest at the target: stone {k + 1} at {place} lies in its place"
            )


def _clear_throws(
    ice: Ice,
    target: Floats,
    stones: Floats,
    spins: Sequence[float],
    x: float,
    direction: Direction,
) -> Floats:
    """Throws (n, 4) that rest at the target having touched neither a stone nor the side."""
    throws = find_throws(ice, target, spins=spins, x=x).throws
    result = end_in_play(ice, throws, direction, stones)
    if result.rested.any():
        return throws[result.rested]
    first = int(np.argmin(np.hypot(*(result.xy - target).T)))
    xy = result.xy[first]
    if result.end[first] == SlideEnd.CONTACT:
        hit = stones[int(np.argmin(np.hypot(*(stones - xy).T)))]
        raise InputError(
            f"the way to ({target[0]:g}, {target[1]:g}) m is blocked: every throw found touches a "
            f"stone first, such as the one at ({hit[0]:g}, {hit[1]:g}) m"
        )
    raise InputError(
        f"no throw found reaches ({target[0]:g}, {target[1]:g}) m in play: one leaves at "
        f"({xy[0]:.2f}, {xy[1]:.2f}) m"
    )


def _describe(
    ice: Ice,
    throw: Floats,
    target: Floats,
    direction: Direction,
    stones: Floats,
    spread: Spread,
) -> Choice:
    exact = end_in_play(ice, throw[None], direction, stones)
    from_tee = np.hypot(*(spread.ends - tee(direction)).T)
    in_house = (from_tee <= HOUSE_RADIUS + ice.stone.radius) & (spread.why == SlideEnd.REST)
    speed, angle, spin, x = (float(value) for value in throw)
    meant = Throw(speed=speed, angle=angle, spin=spin, x=x)
    return Choice(
        throw=meant,
        rest=exact.xy[0],
        time=float(exact.time[0]),
        miss_without_error=float(np.hypot(*(exact.xy[0] - target))),
        spread=spread,
        chance_in_house=float(in_house.mean()),
        words=in_words(ice, meant, target, direction),
    )
