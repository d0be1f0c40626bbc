"""The planner: of all throws that get there, the one that forgives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.planning.description import InWords, in_words
from agents.planning.monte_carlo import Spread, end_in_play, possible_ices, spreads
from agents.planning.objective import Done, MostPoints, RestAt, Wanted
from agents.planning.reward_map import CANDIDATES, STARTS, contract, survey
from agents.planning.rollouts import SPIN, SWEEP, SWEEP_END
from agents.planning.target_search import SPINS, check_target, direction_to, find_throws, ways_of
from curling_env.envs.sheet.tasks import Task, task_named
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.batch import OVERLAP_ALLOWED
from curling_env.physics.one_stone.slide import NO_OBSTACLES, SlideEnd
from curling_env.sheet import HOUSE_RADIUS, Direction, tee, to_sheet
from curling_env.throw import SKILLS, Skill, Throw, skill_named
from curling_env.typing import Floats

ROUGH_TRIALS, FIRST_TRIALS, LAST_TRIALS = 32, 128, 1024
"""Trials that guide a cloud, that rank the candidates, and that describe the best two."""
USUAL_SPIN = 1.0
"""About three turns on a draw's way [rad/s]; the spin of the standard draw."""
ALIKE = 1.03
"""Expected misses closer than this ratio are alike: so few trials do not tell them apart."""
ALIKE_WORTH = 0.02
"""Expected rewards, or points, closer than this are alike."""
ICES = 32
"""Ices drawn from the map's standard errors."""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """A throw and what to expect of it.

    Parameters
    ----------
    throw : to be meant
    sweep : when it is swept, seconds after the release [s]; None if never
    rest : (2,) where it rests without error, sheet frame [m]
    stones : (k, 2) where the other stones then lie, NaN where one left play [m]
    time : from release until all rest [s]
    miss_without_error : [m]
    spread : when it is tried many times, by the player and on all ices that are possible
    by_hand, by_map : the same by the player on the ice as it is given, and without execution error
        on all ices that are possible
    chance_in_house : share of those that rest in the house by themselves
    words : for a person
    """

    throw: Throw
    sweep: tuple[float, float] | None
    rest: Floats
    stones: Floats
    time: float
    miss_without_error: float
    spread: Spread
    by_hand: Spread
    by_map: Spread
    chance_in_house: float
    words: InWords

    @property
    def expected_miss(self) -> float:
        """Mean distance from the target [m]."""
        return self.spread.expected_miss


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The best throw for what is wanted, and the second choice.

    Parameters
    ----------
    wanted : of the throw
    skill : of the player it was planned for
    best : the throw of which most is to be expected
    second : the best of the other handle, or of another weight; None if there is no other
    map_is_uncertain : whether the ice had standard errors, which the spread then includes
    """

    wanted: Wanted
    skill: Skill
    best: Choice
    second: Choice | None
    map_is_uncertain: bool

    @property
    def target(self) -> Floats:
        """Where the delivered stone is to end, or what it is aimed at, (2,) sheet frame [m]."""
        return self.wanted.target

    @property
    def direction(self) -> Direction:
        """The end played to."""
        return self.wanted.direction

    @property
    def stones(self) -> Floats:
        """Centres of the stones that lie on the sheet, (k, 2) [m]."""
        return self.wanted.stones

    def as_dict(self) -> dict[str, object]:
        """For `curling plan`: plain numbers, sheet frame, SI."""
        return {
            **_choice(self.best),
            "task": self.wanted.name,
            "target": {"x": float(self.target[0]), "y": float(self.target[1])},
            "direction": self.direction.name.lower(),
            "skill": {
                "name": self.skill.name,
                "sigma_speed": self.skill.sigma_speed,
                "sigma_angle": self.skill.sigma_angle,
                "sigma_spin": self.skill.sigma_spin,
            },
            "map_is_uncertain": self.map_is_uncertain,
            "second_choice": None if self.second is None else _choice(self.second),
        }


def _choice(choice: Choice) -> dict[str, object]:
    throw = choice.throw
    return {
        "speed": throw.speed,
        "angle": throw.angle,
        "spin": throw.spin,
        "x": throw.x,
        "sweep": None
        if choice.sweep is None
        else {"start_s": choice.sweep[0], "end_s": min(choice.sweep[1], choice.time)},
        "expected_miss_m": choice.expected_miss,
        "expected_worth": choice.spread.expected_worth,
        "chance_of_success": float(choice.spread.success.mean()),
        "miss_without_error_m": choice.miss_without_error,
        "rest": {"x": float(choice.rest[0]), "y": float(choice.rest[1])},
        "stones_after": [
            None if np.isnan(x) else {"x": float(x), "y": float(y)} for x, y in choice.stones
        ],
        "time_s": choice.time,
        "spread": {
            **_spread(choice.spread),
            "chance_in_house": choice.chance_in_house,
            "chance_touches_a_stone": choice.spread.chance(SlideEnd.CONTACT),
            "chance_out_of_play": float((~choice.spread.in_play).mean()),
        },
        "spread_of_the_hand": _spread(choice.by_hand),
        "spread_of_the_map": _spread(choice.by_map),
        "in_words": choice.words.as_dict(),
    }


def _spread(spread: Spread) -> dict[str, float]:
    deviation = np.sqrt(np.diag(spread.covariance))
    return {
        "expected_miss_m": spread.expected_miss,
        "median_miss_m": float(np.median(spread.miss)),
        "miss_90_percent_m": float(np.quantile(spread.miss, 0.9)),
        "sigma_across_m": float(deviation[0]),
        "sigma_along_m": float(deviation[1]),
        "chance_of_success": float(spread.success.mean()),
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
    skill = _checked(skill, spins)
    check_target(ice, target)
    _check_stones(ice, stones)
    _check_place(ice, target, stones)
    direction = direction_to(target)
    throws = _clear_throws(ice, target, stones, spins, x, direction)
    wanted = RestAt(target=target, direction=direction, stones=stones)
    return _choose(ice, wanted, throws, skill, seed)


def plan_task(
    ice: Ice,
    task: str | Task,
    target: ArrayLike | None = None,
    *,
    stones: ArrayLike = NO_OBSTACLES,
    own: ArrayLike | None = None,
    skill: str | Skill = "elite",
    spins: Sequence[float] = SPINS,
    x: float = 0.0,
    candidates: int = CANDIDATES,
    seed: int = 0,
) -> Plan:
    """Find the throw that does a task best on average, among stones that may be moved.

    The grid of candidates is searched for the throw with the largest expected reward of the task
    (as `CurlingSheet-v0` gives it), under the player's errors and on all ices that are possible.

    Parameters
    ----------
    ice : known or estimated ice
    task : name of a task as `CurlingSheet-v0` takes it, a `Task`, or ``score`` for the most points
    target : (2,) the task's mark, sheet frame [m]. Of a task with a given stone: the nearest stone
        to it, or a stone that lies there if no stones are given. By default the task's usual mark
        at the away end; the opponents' stone nearest to the tee where one is to be given
    stones : (k, 2) centres of resting stones, sheet frame [m]
    own : (k,) whether each is of the thrower's team; by default none is
    skill, spins, x, seed : as of `plan`
    candidates : throws in the grid

    Raises
    ------
    InputError : an unknown task, a mark or stones that cannot be, or no throw that gets there
    """
    skill = _checked(skill, spins)
    stones = np.asarray(stones, dtype=np.float64).reshape(-1, 2)
    own = np.zeros(len(stones), dtype=np.bool_) if own is None else np.asarray(own, dtype=np.bool_)
    mark = None if target is None else np.asarray(target, dtype=np.float64)
    if mark is not None:
        check_target(ice, mark)
    _check_stones(ice, stones)
    wanted = _wanted(ice, task, mark, stones, own)
    throws = survey(ice, wanted, skill, ways_of(ice, spins), x=x, candidates=candidates)[:STARTS]
    ices = _possible(ice, seed)

    def worth(some: Floats) -> Floats:
        tried = spreads(
            ices[:: max(len(ices) // 8, 1)], some, wanted, skill, n=ROUGH_TRIALS, seed=seed + 1
        )
        return np.array([spread.expected_worth for spread in tried])

    rng = np.random.default_rng((seed, 2))
    throws = np.concatenate([throws, contract(throws, worth, skill, rng, turns=len(spins) > 1)])
    if wanted.rests:
        throws = np.concatenate([throws, _throws_to(ice, wanted.target, spins, x)])
    return _choose(ice, wanted, throws, skill, seed)


def _wanted(
    ice: Ice, task: str | Task, mark: Floats | None, stones: Floats, own: NDArray[np.bool_]
) -> Wanted:
    """What is wanted, from what was asked for."""
    nearest = stones[:, 1] if mark is None else np.atleast_1d(mark[1])
    direction = Direction.AWAY if nearest.sum() >= 0 else Direction.HOME
    if task == "score":
        target = tee(direction) if mark is None else mark
        return MostPoints(target=target, direction=direction, stones=stones, own=own)
    asked = task_named(task)
    given = None
    if asked.has_target_stone:
        if not len(stones):
            if mark is None:
                raise InputError(f"the task {asked.name} needs a stone: give stones, or a target "
                                 "where one lies")  # fmt: skip
            stones = mark[None]
            own = np.zeros(1, dtype=np.bool_)
        candidates = np.flatnonzero(~own) if mark is None and not own.all() else np.arange(len(own))
        aim = tee(direction) if mark is None else mark
        given = int(candidates[np.argmin(np.hypot(*(stones[candidates] - aim).T))])
        mark = stones[given]
    if mark is None:
        mark = np.asarray(to_sheet(asked.easiest_goal, direction))
    wanted = Done(
        task=asked, mark=mark, direction=direction, stones=stones, given=given,
        radius=ice.stone.radius,
    )  # fmt: skip
    if wanted.rests:
        check_target(ice, wanted.target)
        others = stones if given is None else np.delete(stones, given, axis=0)
        _check_place(ice, wanted.target, others)
    return wanted


def _throws_to(ice: Ice, target: Floats, spins: Sequence[float], x: float) -> Floats:
    """Throws that rest at a target on the empty sheet; none where no throw gets there."""
    try:
        return find_throws(ice, target, spins=spins, x=x).throws
    except InputError:
        return np.empty((0, 6))


def _checked(skill: str | Skill, spins: Sequence[float]) -> Skill:
    if not len(spins):
        raise InputError("no spin to try was given")
    return skill_named(skill)


def _possible(ice: Ice, seed: int) -> list[Ice]:
    return possible_ices(ice, ICES, np.random.default_rng((seed, 1)))


def _choose(ice: Ice, wanted: Wanted, throws: Floats, skill: Skill, seed: int) -> Plan:
    """The best two of some throws, tried on all ices that are possible."""
    ices = _possible(ice, seed)
    first = spreads(ices, throws, wanted, skill, n=FIRST_TRIALS, seed=seed)
    order = _best_first(throws, first, isinstance(wanted, RestAt))
    best = order[0]
    others = [i for i in order[1:] if throws[i, SPIN] * throws[best, SPIN] <= 0] or order[1:]
    chosen = throws[[best, *others[:1]]]
    last = spreads(ices, chosen, wanted, skill, n=LAST_TRIALS, seed=seed)
    by_hand = by_map = last
    if len(ices) > 1:
        by_map = spreads(ices, chosen, wanted, SKILLS["none"], n=1, seed=seed)
        by_hand = spreads([ice], chosen, wanted, skill, n=LAST_TRIALS, seed=seed)
    elif not skill.is_exact:
        by_map = spreads(ices, chosen, wanted, SKILLS["none"], n=1, seed=seed)
    choices = [
        _describe(ice, throw, wanted, last[k], by_hand[k], by_map[k])
        for k, throw in enumerate(chosen)
    ]
    return Plan(
        wanted=wanted,
        skill=skill,
        best=choices[0],
        second=choices[1] if len(choices) > 1 else None,
        map_is_uncertain=len(ices) > 1,
    )


def _best_first(throws: Floats, tried: list[Spread], rests: bool) -> list[int]:
    """Throws by what to expect; of those about as good as the best, unswept with the usual spin."""
    expected = np.array([spread.expected_worth for spread in tried])
    best = expected.max()
    # The worth of a stone that is to rest is minus its miss.
    good = expected >= (ALIKE * best - 1e-3 if rests else best - ALIKE_WORTH)
    unusual = np.abs(np.abs(throws[:, SPIN]) - USUAL_SPIN)
    swept = throws[:, SWEEP_END] > throws[:, SWEEP]
    if not rests:  # what a person can call comes second to what is worth more
        unusual = np.round(-expected, 2)
    return sorted(
        range(len(throws)),
        key=lambda i: (0, swept[i], unusual[i], i) if good[i] else (1, False, -expected[i], i),
    )


def _check_stones(ice: Ice, stones: Floats) -> None:
    for k, stone in enumerate(stones):
        place = f"({stone[0]:g}, {stone[1]:g}) m"
        if not bool(ice.sheet.contains(stone)):
            raise InputError(f"stone {k + 1} at {place} is off the ice")
        apart = np.hypot(*(stones[:k] - stone).T)
        if k and apart.min() < 2 * ice.stone.radius - OVERLAP_ALLOWED:
            other = int(np.argmin(apart))
            raise InputError(
                f"stone {k + 1} at {place} overlaps stone {other + 1}: their centres are "
                f"{apart[other]:.3f} m apart, and touching stones' are {2 * ice.stone.radius:g} m"
            )


def _check_place(ice: Ice, target: Floats, stones: Floats) -> None:
    for stone in stones:
        if np.hypot(*(stone - target)) < 2 * ice.stone.radius - OVERLAP_ALLOWED:
            raise InputError(
                f"no stone can rest at the target: the stone at ({stone[0]:g}, {stone[1]:g}) m "
                "lies in its place"
            )


def _clear_throws(
    ice: Ice,
    target: Floats,
    stones: Floats,
    spins: Sequence[float],
    x: float,
    direction: Direction,
) -> Floats:
    """Throws (n, 6) that rest at the target having touched neither a stone nor the side."""
    throws = find_throws(ice, target, spins=spins, x=x).throws
    result = end_in_play(ice, throws, direction, stones)
    if result.rested.any():
        return throws[result.rested]
    first = int(np.argmin(np.hypot(*(result.xy - target).T)))
    xy = result.xy[first]
    if (result.end == SlideEnd.CONTACT).any():
        raise InputError(
            f"the way to ({target[0]:g}, {target[1]:g}) m is blocked: every throw found touches a "
            f"stone first, such as the one at {_struck(result.stones, stones)}"
        )
    raise InputError(
        f"no throw found reaches ({target[0]:g}, {target[1]:g}) m in play: one leaves at "
        f"({xy[0]:.2f}, {xy[1]:.2f}) m"
    )


def _struck(after: Floats, before: Floats) -> str:
    """Place of the stone that most throws move."""
    moved = ~(np.abs(after - before).max(axis=2) < 1e-6)
    hit = before[int(np.argmax(moved.sum(axis=0)))]
    return f"({hit[0]:g}, {hit[1]:g}) m"


def _describe(
    ice: Ice, throw: Floats, wanted: Wanted, spread: Spread, by_hand: Spread, by_map: Spread
) -> Choice:
    exact = end_in_play(ice, throw[None], wanted.direction, wanted.stones)
    from_tee = np.hypot(*(spread.ends - tee(wanted.direction)).T)
    in_house = (from_tee <= HOUSE_RADIUS + ice.stone.radius) & spread.in_play
    speed, angle, spin, x, begin, end = (float(value) for value in throw)
    meant = Throw(speed=speed, angle=angle, spin=spin, x=x)
    return Choice(
        throw=meant,
        sweep=(begin, end) if end > begin else None,
        rest=exact.xy[0],
        stones=exact.stones[0],
        time=float(exact.time[0]),
        miss_without_error=float(np.hypot(*(exact.xy[0] - wanted.target))),
        spread=spread,
        by_hand=by_hand,
        by_map=by_map,
        chance_in_house=float(in_house.mean()),
        words=in_words(ice, meant, wanted.target, wanted.direction),
    )
