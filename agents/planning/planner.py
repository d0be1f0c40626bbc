"""Planner of the most forgiving throw that reaches an objective."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from agents.planning.description import describe
from agents.planning.monte_carlo import Trials, run_trials
from agents.planning.objective import Objective, RestAtTarget
from agents.planning.planned_throw import Plan, PlannedThrow
from agents.planning.request import (
    check_room,
    check_stones,
    objective_for,
    place_from,
    places_from,
    skill_with,
    spins_from,
    teams_from,
)
from agents.planning.reward_map import cross_entropy_search, reward_peaks
from agents.planning.rollouts import (
    SPEED,
    SPIN,
    SWEEP,
    SWEEP_END,
    Rollouts,
    roll_out_in_play,
)
from agents.planning.target_search import check_target, direction_to, find_throws, handles_of
from agents.planning.tuning import (
    CLOUD_TRIALS,
    DISTINCT_WEIGHT,
    EQUAL_MISS_RATIO,
    EQUAL_VALUE_DIFFERENCE,
    FINAL_TRIALS,
    GRID_THROWS,
    MIN_EFFECT_ON_REST,
    RANKING_TRIALS,
    REFINED_PEAKS,
    SAMPLED_ICES,
    USUAL_SPIN,
)
from curling_env.analysis.ice_remarks import believed_effects, is_marked_unknown, lacks_curl
from curling_env.analysis.ice_uncertainty import plausible_ices
from curling_env.envs.options import delivery_from, number, whole_number
from curling_env.envs.sheet.tasks import Task
from curling_env.errors import InputError
from curling_env.game.skill_file import load_skill
from curling_env.ice import Ice, load_ice
from curling_env.infrastructure.keywords import rejects_unknown_keywords
from curling_env.physics.slides import NO_OBSTACLES, SlideEnd
from curling_env.sheet import HOUSE_RADIUS, tee
from curling_env.throw import (
    FROM_HOG_LINE,
    SKILLS,
    Delivery,
    Skill,
    Throw,
)
from curling_env.typing import Floats


@rejects_unknown_keywords("plan_throw")
def plan_throw(
    ice: Ice | str | Path,
    target: ArrayLike | str | Task,
    mark: ArrayLike | None = None,
    *,
    stones: ArrayLike = NO_OBSTACLES,
    own: ArrayLike | None = None,
    skill: str | Path | Skill = "elite",
    spins: Sequence[float] | None = None,
    x: float = 0.0,
    delivery: str | Delivery = FROM_HOG_LINE,
    candidates: int = GRID_THROWS,
    seed: int = 0,
) -> Plan:
    """Find the best throw for a target or a task.

    For a target, it is the throw with the smallest expected miss among all that get there without
    touching a stone: it forgives the player's errors and those of the ice. For a task, it is the
    throw with the largest expected reward of the task in `CurlingSheet-v0`, among stones that may
    be moved. Both are taken under the player's errors, on ices sampled within the ice's standard
    errors.

    Parameters
    ----------
    ice : known or estimated ice, a file, or a preset
    target : (2,) place where the stone should rest, sheet frame [m]; the end played to is its half
        of the sheet. Or a task of `CurlingSheet-v0`, such as ``"takeout"``, or ``"score"`` for the
        most points
    mark : (2,) the task's mark, sheet frame [m]. A task about a stone takes the stone nearest to
        it, or puts one there if no stones are given. Without a mark: the opponents' stone nearest
        to the tee, or for other tasks the task's usual mark at the away end
    stones : (k, 2) centres of resting stones, sheet frame [m]
    own : (k,) true for stones of the thrower's team; with None all are the opponents' in a task
        about one of theirs, and ``score`` is refused
    skill : the player who throws: a name in `SKILLS`, a skill file, or a `Skill`
    spins : spins to try [rad/s]; by default some of both handles from the hog line, or the usual
        one of another `delivery`
    x : offset of the release, delivery frame [m]
    delivery : start of the throws: ``hog-line``, ``tee-line``, ``hack`` (as in Digital Curling) or
        a `Delivery`
    candidates : number of throws in the grid for a task
    seed : seed of the trials; the same seed gives the same plan

    Returns
    -------
    the plan; `plan.best.throw` can be thrown as it is

    Raises
    ------
    InputError : an impossible target, mark or stones, an unknown task, stones without teams in a
        plan for points, or no throw that gets there
    """
    known, delivery = load_ice(ice), delivery_from(delivery)
    seed = whole_number("seed", seed, least=0)
    candidates = whole_number("candidates", candidates, least=1)
    x = number("x", x, above=-known.sheet.width / 2, most=known.sheet.width / 2)
    spins = spins_from(spins, delivery)
    player = skill_with(load_skill(skill), spins)
    if not isinstance(target, str | Task):
        place = place_from("target", target)
    else:
        place = None if mark is None else place_from("mark", mark)
    if place is not None:
        check_target(known, place)
    places = places_from("stones", stones)
    teams = teams_from(own, places)
    check_stones(known, places)
    if isinstance(target, str | Task):
        objective = objective_for(known, target, place, places, teams, delivery)
        throws = _throws_for(known, objective, player, spins, x, candidates, seed)
        return _choose(known, objective, throws, player, seed)
    assert place is not None
    check_room(known, place, places)
    rest = RestAtTarget(
        target=place, direction=direction_to(place), stones=places, own=teams, delivery=delivery
    )
    throws = find_throws(known, place, spins=spins, x=x, delivery=delivery)
    return _choose(known, rest, _clear_throws(known, throws, rest), player, seed)


# --- candidates ----------------------------------------------------------------------------------


def _throws_for(
    ice: Ice,
    objective: Objective,
    skill: Skill,
    spins: Sequence[float],
    x: float,
    candidates: int,
    seed: int,
) -> Floats:
    """Return promising throws (n, 6) for a task."""
    handles = handles_of(ice, spins)
    peaks = reward_peaks(ice, objective, skill, handles, x=x, grid_throws=candidates)
    peaks = _best_peaks(peaks)
    ices = _sampled(ice, seed)

    def expected_value(throws: Floats) -> Floats:
        some = ices[:: max(len(ices) // 8, 1)]
        tried = run_trials(some, throws, objective, skill, n=CLOUD_TRIALS, seed=seed + 1)
        return np.array([trials.expected_value for trials in tried])

    delivery = objective.delivery
    refined = cross_entropy_search(
        peaks,
        expected_value,
        skill,
        np.random.default_rng((seed, 2)),
        vary_spin=len(spins) > 1 and delivery == FROM_HOG_LINE,
        max_speed=delivery.max_speed,
    )
    throws = np.concatenate([peaks, refined])
    if objective.comes_to_rest:
        throws = np.concatenate([throws, _throws_to(ice, objective, spins, x)])
    return throws


def _best_peaks(peaks: Floats) -> Floats:
    """Return the first peaks (n, 6), and the first of the other handle if all have the same."""
    best = peaks[:REFINED_PEAKS]
    other = peaks[peaks[:, SPIN] * peaks[:1, SPIN] < 0][:1]
    alike = (best[:, SPIN] * best[:1, SPIN] >= 0).all()
    return np.concatenate([best, other]) if alike else best


def _throws_to(ice: Ice, objective: Objective, spins: Sequence[float], x: float) -> Floats:
    """Return throws that rest at the target on the empty sheet; empty if none reaches it."""
    delivery = objective.delivery
    try:
        return find_throws(ice, objective.target, spins=spins, x=x, delivery=delivery)
    except InputError:
        return np.empty((0, 6))


def _clear_throws(ice: Ice, throws: Floats, objective: RestAtTarget) -> Floats:
    """Return the throws (n, 6) that touch neither a stone nor the side line on their path."""
    target, stones = objective.target, objective.stones
    result = roll_out_in_play(ice, throws, objective.direction, stones, delivery=objective.delivery)
    if result.rested.any():
        return throws[result.rested]
    first = int(np.argmin(np.hypot(*(result.xy - target).T)))
    xy = result.xy[first]
    if (result.end == SlideEnd.CONTACT).any():
        raise InputError(
            f"the path to ({target[0]:g}, {target[1]:g}) m is blocked: every throw found touches "
            f"a stone first, such as the one at {_most_struck(result.stones, stones)}"
        )
    raise InputError(
        f"no throw found reaches ({target[0]:g}, {target[1]:g}) m in play: one leaves at "
        f"({xy[0]:.2f}, {xy[1]:.2f}) m"
    )


def _most_struck(after: Floats, before: Floats) -> str:
    """Return the place of the stone that most throws move."""
    moved = ~(np.abs(after - before).max(axis=2) < 1e-6)
    hit = before[int(np.argmax(moved.sum(axis=0)))]
    return f"({hit[0]:g}, {hit[1]:g}) m"


# --- the choice ----------------------------------------------------------------------------------


def _sampled(ice: Ice, seed: int, *, effects: bool = True) -> list[Ice]:
    rng = np.random.default_rng((seed, 1))
    return plausible_ices(ice, SAMPLED_ICES, rng, effects=effects)


def _choose(ice: Ice, objective: Objective, throws: Floats, skill: Skill, seed: int) -> Plan:
    """Choose the best two of some throws, tried on ices sampled within the standard errors."""
    ices, maps = _sampled(ice, seed), _sampled(ice, seed, effects=False)
    ranking = run_trials(ices, throws, objective, skill, n=RANKING_TRIALS, seed=seed)
    order = _best_first(throws, ranking, isinstance(objective, RestAtTarget))
    best = order[0]
    others = [i for i in order[1:] if _is_another_shot(throws[i], throws[best])]
    chosen = throws[[best, *others[:1]]]
    final = run_trials(ices, chosen, objective, skill, n=FINAL_TRIALS, seed=seed)
    if (
        len(final) > 1
        and final[1].expected_value > final[0].expected_value + EQUAL_VALUE_DIFFERENCE
    ):
        # The trials that rank the candidates are few, so all of them are used.
        chosen, final = chosen[::-1], final[::-1]
    player = final
    if len(ices) > 1:
        player = run_trials([ice], chosen, objective, skill, n=FINAL_TRIALS, seed=seed)
    on_ice, on_map = (
        run_trials(some, chosen, objective, SKILLS["none"], n=1, seed=seed) for some in (ices, maps)
    )
    planned = [
        _expect(ice, throw, objective, final[k], player[k], on_ice[k], on_map[k])
        for k, throw in enumerate(chosen)
    ]
    return Plan(
        objective=objective,
        skill=skill,
        best=planned[0],
        second=planned[1] if len(planned) > 1 else None,
        ice_is_uncertain=len(ices) > 1,
        map_is_uncertain=len(maps) > 1,
        lacks_something=is_marked_unknown(ice),
        lacks_curl=lacks_curl(ice),
        believed=_relevant_assumptions(ice, chosen[0], objective),
    )


def _is_another_shot(throw: Floats, best: Floats) -> bool:
    """Return whether a throw (6,) is another shot: another handle, weight or sweeping."""
    handle = np.sign(throw[SPIN]) != np.sign(best[SPIN])
    weight = abs(throw[SPEED] / best[SPEED] - 1) > DISTINCT_WEIGHT
    swept = (throw[SWEEP_END] > throw[SWEEP]) != (best[SWEEP_END] > best[SWEEP])
    return bool(handle or weight or swept)


def _relevant_assumptions(
    ice: Ice, throw: Floats, objective: Objective
) -> dict[str, tuple[str, ...]]:
    """Return assumed effects, with parameters, without which a throw (6,) would end elsewhere."""
    believed = believed_effects(ice)
    if not believed:
        return {}

    def end_on(known: Ice) -> Floats:
        return _thrown_without_error(known, throw, objective).xy[0]

    end = end_on(ice)
    return {
        name: parameters
        for name, parameters in believed.items()
        # In this form a NaN end matters too.
        if not np.hypot(*(end_on(ice.without_effect(name)) - end)) < MIN_EFFECT_ON_REST
    }


def _thrown_without_error(ice: Ice, throw: Floats, objective: Objective) -> Rollouts:
    """Simulate a throw (6,) without error."""
    return roll_out_in_play(
        ice,
        throw[None],
        objective.direction,
        objective.stones,
        delivery=objective.delivery,
    )


def _best_first(throws: Floats, tried: list[Trials], rests: bool) -> list[int]:
    """Return indices of throws by expected value; among equals, unswept throws with usual spin
    first.
    """
    expected = np.array([trials.expected_value for trials in tried])
    best = expected.max()
    # The value of a stone that should rest is minus its miss.
    good = expected >= (EQUAL_MISS_RATIO * best - 1e-3 if rests else best - EQUAL_VALUE_DIFFERENCE)
    unusual = np.abs(np.abs(throws[:, SPIN]) - USUAL_SPIN)
    swept = throws[:, SWEEP_END] > throws[:, SWEEP]
    if not rests:  # for a task the value matters more than a spin that is easy to call
        unusual = np.round(-expected, 2)
    return sorted(
        range(len(throws)),
        key=lambda i: (0, swept[i], unusual[i], i) if good[i] else (1, False, -expected[i], i),
    )


def _expect(
    ice: Ice,
    throw: Floats,
    objective: Objective,
    final: Trials,
    player: Trials,
    on_ice: Trials,
    on_map: Trials,
) -> PlannedThrow:
    exact = _thrown_without_error(ice, throw, objective)
    from_tee = np.hypot(*(final.ends - tee(objective.direction)).T)
    in_house = (from_tee <= HOUSE_RADIUS + ice.stone.radius) & final.in_play
    speed, angle, spin, x, begin, end = (float(value) for value in throw)
    intended = Throw(speed=speed, angle=angle, spin=spin, x=x)
    return PlannedThrow(
        throw=intended,
        sweep=(begin, end) if end > begin else None,
        rest=exact.xy[0],
        stones=exact.stones[0],
        time=float(exact.time[0]),
        miss_without_error=float(np.hypot(*(exact.xy[0] - objective.target))),
        trials=final,
        player_trials=player,
        ice_trials=on_ice,
        map_trials=on_map,
        chance_in_house=float(in_house.mean()),
        description=describe(
            ice, intended, objective.target, objective.direction, objective.delivery
        ),
    )
