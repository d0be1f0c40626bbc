"""Evaluation of misses: a policy compared with the planner, on the same draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize

import curling_env  # noqa: F401  (registers the environments)
from agents.learning.configuration import TrainingSettings
from agents.learning.policy import TrainedPolicy
from agents.planning import plan_throw
from agents.planning.rollouts import roll_out_in_play
from agents.planning.target_search import direction_to
from curling_env.envs.sheet.action import ThrowRange
from curling_env.errors import InputError
from curling_env.ice import Ice, load_ice
from curling_env.infrastructure.files.schema import FileFormat
from curling_env.physics.slides import NO_OBSTACLES
from curling_env.sheet import HOUSE_RADIUS, Direction, to_delivery, to_sheet
from curling_env.throw import MAX_SPEED, Skill, Throw, skill_named
from curling_env.typing import Floats, Progress, no_progress, with_progress
from curling_env.units import Units, short_length

EVALUATION_FORMAT = FileFormat(name="curling-evaluation/1", what="an evaluation")

TRIALS = 256
"""Number of throws with execution error at each target."""
TRIALS_OF_ONE_DRAW = 16 * TRIALS
"""The same number if there is only one draw."""
BOOTSTRAP_SAMPLES = 1000
"""Number of resampled sets of draws for a confidence interval."""


@dataclass(frozen=True, kw_only=True)
class Misses:
    """Distances from n targets.

    Parameters
    ----------
    exact : (n,) distance from each target without execution error [m]
    with_error : (n, trials) distances with execution error [m]
    """

    exact: Floats
    with_error: Floats

    def as_dict(self) -> dict[str, float]:
        """Return mean and median of both [m]."""
        return {
            "mean_miss_m": float(self.exact.mean()),
            "median_miss_m": float(np.median(self.exact)),
            "mean_miss_with_error_m": float(self.with_error.mean()),
            "median_miss_with_error_m": float(np.median(self.with_error)),
        }


def rest_in_env(ice: Ice, throw: Throw, target: ArrayLike) -> Floats:
    """Return the place of rest of a throw in `CurlingSheet-v0` on an ice, (2,) sheet frame [m].

    Parameters
    ----------
    target : (2,) target, sheet frame [m]; the end played to is its half of the sheet
    """
    direction = direction_to(np.asarray(target))
    # Actions have single precision; a narrow range around the throw keeps it to a micrometre.
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
        details=True,
    )
    env.reset(seed=0)
    *_, info = env.step(env.unwrapped.action_of(throw))  # pyright: ignore[reportAttributeAccessIssue]
    stone = info["outcome"].delivered
    env.close()
    return np.array([stone.x, stone.y])


def house_targets(n: int, rng: np.random.Generator) -> Floats:
    """Draw targets uniformly distributed over the away house, (n, 2) sheet frame [m]."""
    radius = HOUSE_RADIUS * np.sqrt(rng.random(n))
    angle = 2 * np.pi * rng.random(n)
    places = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    return to_sheet(places, Direction.AWAY)


def planner_throw(ice: Ice, target: Floats, skill: str | Skill) -> Floats:
    """Return the planner's throw at a target, (4,) speed, angle, spin and offset."""
    throw = plan_throw(ice, target, skill=skill).best.throw
    return np.array([throw.speed, throw.angle, throw.spin, throw.x])


@dataclass(frozen=True, kw_only=True)
class EvaluationDraw:
    """Draw of an evaluation.

    Parameters
    ----------
    ice : true ice
    known : the known ice
    target : (2,) target, sheet frame [m]
    """

    ice: Ice
    known: Ice
    target: Floats


def is_draw(settings: TrainingSettings) -> bool:
    """Return whether a policy learns draws on an empty sheet, which the planner can make too."""
    options = settings.environment()
    return options.get("task", "draw") == "draw" and not options.get("stones", ())


def evaluation_draws(settings: TrainingSettings, ice: Ice, n: int) -> list[EvaluationDraw]:
    """Make new draws like those of the training, on unseen ices and at other targets.

    Parameters
    ----------
    settings : settings of the training
    ice : ice to throw on, if the settings have no random ices
    n : number of draws; one if neither the ice nor the target changes

    Raises
    ------
    InputError : the policy does not learn draws on an empty sheet
    """
    if not is_draw(settings):
        raise InputError("only draws on an empty sheet can be compared with the planner")
    rng = np.random.default_rng((settings.seed, 1_000_003))
    target = settings.environment().get("target")
    if settings.ices is None and not isinstance(target, str):
        n = 1
    places = house_targets(n, rng)
    if not isinstance(target, str):
        places[:] = to_sheet((0.0, 0.0) if target is None else target, Direction.AWAY)
    if settings.ices is None:
        return [EvaluationDraw(ice=ice, known=ice, target=place) for place in places]
    # All policies get the map here, so that policies with and without it meet the same ices.
    drawn = [(*settings.ices.draw(rng), place) for place in places]
    return [EvaluationDraw(ice=true, known=known, target=place) for true, known, place in drawn]


def best_throw(ice: Ice, target: Floats, skill: Skill, *, seed: int = 1) -> Floats:
    """Return the throw with the smallest mean miss for a player, (4,).

    The search starts from the planner's throw, which rests at the target without error, and
    corrects it: too much weight carries a stone farther than too little holds it back.
    """
    throw = planner_throw(ice, target, skill)
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


def in_words(result: dict[str, Any], skill: str, units: Units = Units.METRES) -> str:
    """Compare the agent's mean miss with that of the planner and of the best possible throw.

    Parameters
    ----------
    result : from `evaluate`
    skill : name of the player's skill
    units : units of the misses
    """
    over = result["agent_over_best"]
    misses = ", ".join(
        f"{name} {short_length(result[who]['mean_miss_with_error_m'], units)}"
        for name, who in (("agent", "agent"), ("planner", "planner"), ("best possible", "best"))
    )
    return (
        f"mean miss with skill {skill}, {result['draws']} draws: {misses}; agent over "
        f"best {over['ratio']:.2f} ({over['low']:.2f}-{over['high']:.2f})"
    )


def evaluate(
    policy: TrainedPolicy | str | Path,
    ice: str | Path | Ice = "standard",
    *,
    draws: int = 50,
    seed: int | None = None,
    progress: Progress = no_progress,
) -> dict[str, Any]:
    """Compare a trained policy with the planner, on new draws with the same execution errors.

    Parameters
    ----------
    policy : the policy, or the file of its model
    ice : file, preset or ice to throw on, unless the policy learned on random ices
    draws : number of draws; one if neither the ice nor the target changes
    seed : seed of the execution errors; by default that of the training
    progress : called after each draw

    Returns
    -------
    see `compare_with_planner`

    Raises
    ------
    InputError : not a trained model, or one that did not learn draws on an empty sheet
    """
    trained = policy if isinstance(policy, TrainedPolicy) else TrainedPolicy.load(policy)
    some = evaluation_draws(trained.settings, load_ice(ice), draws)
    chosen = trained.settings.seed if seed is None else seed
    return compare_with_planner(trained, some, seed=chosen, progress=progress)


def compare_with_planner(
    policy: TrainedPolicy,
    draws: Sequence[EvaluationDraw],
    *,
    seed: int = 0,
    progress: Progress = no_progress,
) -> dict[str, Any]:
    """Compare a trained policy with the planner on the same draws with the same execution errors.

    Returns
    -------
    misses in metres of the agent, of the planner with the same knowledge of the ice, and of the
    best possible throw on the true ice; and mean misses with execution error over the best one's,
    with 95 % intervals (bootstrap over the draws, or over the errors if there is one draw)
    """
    skill = skill_named(policy.settings.skill)
    who: dict[str, list[Misses]] = {"agent": [], "planner": [], "best": []}
    trials = TRIALS if len(draws) > 1 else TRIALS_OF_ONE_DRAW
    for k, draw in enumerate(with_progress(draws, "evaluating", progress)):
        throws = {
            "agent": policy.throws(draw.known, draw.target)[0],
            "planner": planner_throw(draw.known, draw.target, skill),
            "best": best_throw(draw.ice, draw.target, skill),
        }
        targets = draw.target[None]
        for name, throw in throws.items():
            missed = misses(draw.ice, throw[None], targets, skill, seed=seed + k, trials=trials)
            who[name].append(missed)
    all_of = {
        name: Misses(
            exact=np.concatenate([m.exact for m in made]),
            with_error=np.concatenate([m.with_error for m in made]),
        )
        for name, made in who.items()
    }
    return {
        "draws": len(draws),
        "skill": skill.name,
        **{name: made.as_dict() for name, made in all_of.items()},
        "agent_over_best": _ratio(all_of["agent"], all_of["best"], seed),
        "planner_over_best": _ratio(all_of["planner"], all_of["best"], seed),
    }


def _ratio(one: Misses, other: Misses, seed: int) -> dict[str, float]:
    """Return one mean miss over the other, with its 95 % interval."""
    a, b = one.with_error, other.with_error
    pairs = (a[0], b[0]) if len(a) == 1 else (a.mean(axis=1), b.mean(axis=1))
    rng = np.random.default_rng(seed)
    sampled = rng.integers(len(pairs[0]), size=(BOOTSTRAP_SAMPLES, len(pairs[0])))
    ratios = pairs[0][sampled].mean(axis=1) / pairs[1][sampled].mean(axis=1)
    low, high = np.quantile(ratios, [0.025, 0.975])
    return {"ratio": float(a.mean() / b.mean()), "low": float(low), "high": float(high)}


def misses(
    ice: Ice, throws: Floats, targets: Floats, skill: Skill, *, seed: int, trials: int = TRIALS
) -> Misses:
    """Return distances of throws (n, 4) from their targets (n, 2), with and without execution
    error.

    The same seed gives the same errors. A stone that leaves play counts at the place where it left.
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
    """Return the distance of each throw (n, 4) from a target; a stone that left play counts where
    it left.
    """
    throws[:, 0] = np.clip(throws[:, 0], 1e-3, MAX_SPEED)
    ends = roll_out_in_play(ice, throws, direction_to(target), NO_OBSTACLES).xy
    return np.hypot(*(ends - target).T)
