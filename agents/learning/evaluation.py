"""How well throws get where they were meant to: agents beside the planner, on the same targets."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize

import curling_env  # noqa: F401  (registers the environments)
from agents.learning.configuration import TrainingSettings
from agents.learning.policy import Thrower
from agents.planning import plan
from agents.planning.rollouts import roll_out_in_play
from agents.planning.target_search import direction_to
from curling_env.envs.sheet.action import ThrowRange
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.one_stone.slide import NO_OBSTACLES
from curling_env.sheet import HOUSE_RADIUS, Direction, to_delivery, to_sheet
from curling_env.throw import MAX_SPEED, Skill, Throw, skill_named
from curling_env.typing import Floats

Through = Callable[[Iterable[Any], str], Iterable[Any]]
"""Passes items on and shows how far it is: (items, label) -> the same items."""

TRIALS = 256
"""Throws with execution error at each target."""
RESAMPLES = 1000
"""Sets of draws that are drawn from those made, for an interval."""


@dataclass(frozen=True, kw_only=True)
class Misses:
    """How far one who throws missed the same targets.

    Parameters
    ----------
    exact : (n,) distance from each target without execution error [m]
    with_error : (n, trials) the same with it [m]
    """

    exact: Floats
    with_error: Floats

    def as_dict(self) -> dict[str, float]:
        """Mean and median of both [m]."""
        return {
            "mean_miss_m": float(self.exact.mean()),
            "median_miss_m": float(np.median(self.exact)),
            "mean_miss_with_error_m": float(self.with_error.mean()),
            "median_miss_with_error_m": float(np.median(self.with_error)),
        }


def rest_in_env(ice: Ice, throw: Throw, target: ArrayLike) -> Floats:
    """Where a throw rests in `CurlingSheet-v0` on an ice, (2,) sheet frame [m].

    Parameters
    ----------
    target : sheet frame [m]; its half of the sheet is the end played to
    """
    direction = direction_to(np.asarray(target))
    # Actions are single precision: a range close around the throw keeps it to a micrometre.
    around = ThrowRange(
        speed=(0.9 * throw.speed, min(1.1 * throw.speed, MAX_SPEED)),
        angle=(throw.angle - 0.01, throw.angle + 0.01),
        spin=(throw.spin - 0.1, throw.spin + 0.1),
    )
    env = gymnasium.make(
        "CurlingSheet-v0",
        ice=ice,
        throw_range=around,
        direction=direction,
        target=tuple(to_delivery(target, direction)),
    )
    env.reset(seed=0)
    *_, info = env.step(env.unwrapped.action_of(throw))  # pyright: ignore[reportAttributeAccessIssue]
    stone = info["outcome"].delivered
    env.close()
    return np.array([stone.x, stone.y])


def house_targets(n: int, rng: np.random.Generator) -> Floats:
    """Targets spread evenly over the away house, (n, 2) sheet frame [m]."""
    radius = HOUSE_RADIUS * np.sqrt(rng.random(n))
    angle = 2 * np.pi * rng.random(n)
    return to_sheet(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]),
                    Direction.AWAY)  # fmt: skip


def planner_throws(
    ice: Ice,
    targets: Floats,
    skill: str | Skill,
    through: Through = lambda items, label: items,
) -> Floats:
    """What the planner throws at each target, (n, 4)."""
    throws: list[tuple[float, ...]] = []
    for target in through(targets, "planning"):
        throw = plan(ice, target, skill=skill).best.throw
        throws.append((throw.speed, throw.angle, throw.spin, throw.x))
    return np.array(throws)


@dataclass(frozen=True, kw_only=True)
class Case:
    """A draw that is asked for.

    Parameters
    ----------
    ice : thrown on
    known : what is known of it
    target : (2,) sheet frame [m]
    """

    ice: Ice
    known: Ice
    target: Floats


def cases_of(settings: TrainingSettings, ice: Ice, n: int) -> list[Case]:
    """Draws like those that were learnt, but others: unseen ices, other targets.

    Parameters
    ----------
    ice : where the settings have no random ices
    n : how many; one, where neither the ice nor the target changes
    """
    options = settings.environment()
    if options.get("task", "draw") != "draw" or options.get("stones", ()):
        raise InputError("only draws on an empty sheet are judged beside the planner")
    rng = np.random.default_rng((settings.seed, 1_000_003))
    target = options.get("target")
    if settings.ices is None and not isinstance(target, str):
        n = 1
    places = house_targets(n, rng)
    if not isinstance(target, str):
        places[:] = to_sheet((0.0, 0.0) if target is None else target, Direction.AWAY)
    if settings.ices is None:
        return [Case(ice=ice, known=ice, target=place) for place in places]
    # The map is drawn whoever sees it, so that policies with and without meet the same ices.
    return [_unseen(settings, rng, place) for place in places]


def _unseen(settings: TrainingSettings, rng: np.random.Generator, target: Floats) -> Case:
    assert settings.ices is not None
    ice, known = settings.ices.draw(rng)
    return Case(ice=ice, known=known, target=target)


def best_throw(ice: Ice, target: Floats, skill: Skill, *, seed: int = 1) -> Floats:
    """The throw with the least mean miss under a hand's errors, (4,).

    The planner's throw, which rests at the target when nothing goes wrong, corrected for what does:
    too much weight carries a stone farther than too little holds it back.
    """
    throw = planner_throws(ice, target[None], skill)[0]
    if skill.is_exact:
        return throw
    errors = skill.errors(2 * TRIALS, np.random.default_rng(seed))
    scale = np.array([0.01, 0.002, 0.2])

    def mean_miss(change: Floats) -> float:
        trials = np.repeat(throw[None], len(errors), axis=0)
        trials[:, :3] += errors + change * scale
        return float(_distances(ice, trials, target).mean())

    found = minimize(mean_miss, np.zeros(3), method="Nelder-Mead", options={"maxfev": 80})
    best = throw.copy()
    best[:3] += found.x * scale
    return best


def judge(
    thrower: Thrower,
    cases: Sequence[Case],
    *,
    seed: int = 0,
    through: Through = lambda items, label: items,
) -> dict[str, Any]:
    """A trained policy beside the planner on the same draws, with the same execution errors.

    Returns
    -------
    misses in metres of the agent, of the planner told of the same ice, and of the best possible
    throw on the true ice; and mean misses with execution error over the best one's, with their
    95 % interval (bootstrap over the draws, or over the errors where there is one draw)
    """
    skill = skill_named(thrower.settings.skill)
    who: dict[str, list[Misses]] = {"agent": [], "planner": [], "best": []}
    for k, case in enumerate(through(cases, "judging")):
        throws = {
            "agent": thrower.throws(case.known, case.target)[0],
            "planner": planner_throws(case.known, case.target[None], skill)[0],
            "best": best_throw(case.ice, case.target, skill),
        }
        trials = TRIALS if len(cases) > 1 else 16 * TRIALS
        for name, throw in throws.items():
            who[name].append(
                misses(case.ice, throw[None], case.target[None], skill, seed=seed + k,
                       trials=trials)
            )  # fmt: skip
    all_of = {
        name: Misses(
            exact=np.concatenate([m.exact for m in made]),
            with_error=np.concatenate([m.with_error for m in made]),
        )
        for name, made in who.items()
    }
    return {
        "draws": len(cases),
        "skill": skill.name,
        **{name: made.as_dict() for name, made in all_of.items()},
        "agent_over_best": _ratio(all_of["agent"], all_of["best"], seed),
        "planner_over_best": _ratio(all_of["planner"], all_of["best"], seed),
    }


def _ratio(one: Misses, other: Misses, seed: int) -> dict[str, float]:
    """Mean miss over mean miss, and its interval."""
    a, b = one.with_error, other.with_error
    pairs = (a[0], b[0]) if len(a) == 1 else (a.mean(axis=1), b.mean(axis=1))
    rng = np.random.default_rng(seed)
    drawn = rng.integers(len(pairs[0]), size=(RESAMPLES, len(pairs[0])))
    ratios = pairs[0][drawn].mean(axis=1) / pairs[1][drawn].mean(axis=1)
    low, high = np.quantile(ratios, [0.025, 0.975])
    return {"ratio": float(a.mean() / b.mean()), "low": float(low), "high": float(high)}


def misses(
    ice: Ice, throws: Floats, targets: Floats, skill: Skill, *, seed: int, trials: int = TRIALS
) -> Misses:
    """How far throws end from their targets, with and without execution error.

    The same seed gives everyone the same errors. A stone that leaves play counts where it left.
    """
    errors = skill.errors(trials, np.random.default_rng(seed))
    exact: list[float] = []
    with_error: list[Sequence[float]] = []
    for throw, target in zip(throws, targets, strict=True):
        thrown = np.repeat(throw[None], trials + 1, axis=0)
        thrown[1:, :3] += errors
        distance = _distances(ice, thrown, target)
        exact.append(float(distance[0]))
        with_error.append(distance[1:].tolist())
    return Misses(exact=np.array(exact), with_error=np.array(with_error))


def _distances(ice: Ice, throws: Floats, target: Floats) -> Floats:
    """From a target to where throws (n, 4) ended; for a stone that left play, where it left."""
    throws[:, 0] = np.clip(throws[:, 0], 1e-3, MAX_SPEED)
    ends = roll_out_in_play(ice, throws, direction_to(target), NO_OBSTACLES).xy
    return np.hypot(*(ends - target).T)
