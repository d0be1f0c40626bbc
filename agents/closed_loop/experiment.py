"""The measured closed loop: hidden ice, practice, estimates of the ice, and throws planned on each.

Every throw is planned on four kinds of knowledge of the same hidden ice and then made on it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from agents.closed_loop.execution import ExecutedThrows, execute_plan
from agents.closed_loop.hidden_ice import HiddenIce, draw_hidden_ice
from agents.closed_loop.practice import ThrowCamera, mixed_practice, noisy_camera, track_errors
from agents.planning import Plan, plan, plan_task
from agents.planning.objective import TaskDone
from curling_env.envs.sheet.tasks import task_named
from curling_env.ice import Ice
from curling_env.sheet import TEE_Y
from curling_env.throw import Skill, skill_named
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Progress, no_progress, part_of_progress
from friction_estimation.estimation.estimate import Estimate
from friction_estimation.estimation.whole_ice import estimate_ice

KNOWLEDGE = ("uniform", "map", "map and effects", "truth")
"""What a throw is planned on: one friction, the estimated map, map and effects, the true ice."""
BOOTSTRAP_SAMPLES = 2000
"""Resampled sets of throws for a confidence interval."""


@dataclass(frozen=True, kw_only=True)
class Request:
    """One of the throws to plan: a task and its mark, sheet frame [m]."""

    task: str
    mark: tuple[float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosedLoopResult:
    """The results on one hidden ice.

    Parameters
    ----------
    seed : seed of everything random
    hidden : the hidden ice
    tracks : measured tracks of the practice throws
    track_errors : (n,) RMS distance of each track from the true path [m]
    ices : the ice of each kind of knowledge, in the order of `KNOWLEDGE`
    joint : the joint estimate of map and effects
    requests : the throws that were planned
    plans : for each kind of knowledge, the plan of each request
    exact, with_error : for each kind of knowledge, the throws made without execution error (one
        each) and with it (several each)
    skill : the skill of the player
    """

    seed: int
    hidden: HiddenIce
    tracks: list[Trajectory]
    track_errors: Floats
    ices: dict[str, Ice]
    joint: Estimate
    requests: list[Request]
    plans: dict[str, list[Plan]]
    exact: dict[str, list[ExecutedThrows]]
    with_error: dict[str, list[ExecutedThrows]]
    skill: Skill

    def misses(self, knowledge: str, *, error: bool) -> Floats:
        """Mean miss of each planned throw, (n,) [m]."""
        made = self.with_error if error else self.exact
        return np.array([float(throw.miss.mean()) for throw in made[knowledge]])

    def successes(self, knowledge: str, *, error: bool) -> Floats:
        """Share of the executions of each planned throw that did the task, (n,)."""
        made = self.with_error if error else self.exact
        return np.array([float(throw.success.mean()) for throw in made[knowledge]])

    @property
    def excess(self) -> float:
        """Mean miss with execution error, planned on map and effects, over that on the truth."""
        return float(
            self.misses("map and effects", error=True).mean()
            / self.misses("truth", error=True).mean()
        )

    @property
    def gain(self) -> float:
        """Mean miss without execution error, planned on one friction, over map and effects."""
        return float(
            self.misses("uniform", error=False).mean()
            / self.misses("map and effects", error=False).mean()
        )

    def as_dict(self) -> dict[str, object]:
        """The content of the report."""
        return {
            "seed": self.seed,
            "hidden": self.hidden.as_dict(),
            "track_rms_m": [float(error) for error in self.track_errors],
            "effects": [
                {
                    "name": e.name,
                    "parameters": dict(e.parameters),
                    "sigma": dict(e.sigma),
                    "believed": list(e.believed),
                }
                for e in self.joint.ice.effects
            ],
            "skill": self.skill.name,
            "chains": {
                knowledge: {
                    name: {
                        "mean_miss_m": interval(self.misses(knowledge, error=error)),
                        "success": interval(self.successes(knowledge, error=error)),
                    }
                    for name, error in (("exact", False), ("with_error", True))
                }
                for knowledge in KNOWLEDGE
            },
            "c_over_d_with_error": self.excess,
            "c_over_d_interval": ratio_interval(
                self.misses("map and effects", error=True), self.misses("truth", error=True)
            ),
            "a_over_c_exact": self.gain,
            "a_over_c_interval": ratio_interval(
                self.misses("uniform", error=False), self.misses("map and effects", error=False)
            ),
        }


def as_table(results: list[ClosedLoopResult]) -> str:
    """Mean misses, shares of tasks done and the two ratios, as lines of text."""
    lines = [
        f"{'ice':>4}  {'':12}"
        + "".join(f"{knowledge:>24}" for knowledge in KNOWLEDGE)
        + f"{'c/d':>9}{'a/c':>8}"
    ]
    for result in results:
        for name, error in (("exact", False), ("with error", True)):
            cells = "".join(
                f"{result.misses(knowledge, error=error).mean():13.3f} m "
                f"{100 * result.successes(knowledge, error=error).mean():5.0f} % "
                for knowledge in KNOWLEDGE
            )
            ratio = f"{'':9}{result.gain:8.1f}" if not error else f"{result.excess:9.3f}"
            lines.append(f"{result.seed:>4}  {name:12}{cells}{ratio}")
    return "\n".join(lines)


def interval(values: Floats) -> dict[str, float]:
    """Mean over the throws and its 95 % interval, by bootstrap over the throws."""
    rng = np.random.default_rng(0)
    means = rng.choice(values, (BOOTSTRAP_SAMPLES, len(values))).mean(axis=1)
    low, high = np.quantile(means, (0.025, 0.975))
    return {"mean": float(values.mean()), "low": float(low), "high": float(high)}


def ratio_interval(above: Floats, below: Floats) -> list[float]:
    """95 % interval of a ratio of means, by bootstrap with the same throws in both."""
    rows = np.random.default_rng(0).integers(0, len(above), (BOOTSTRAP_SAMPLES, len(above)))
    ratios = above[rows].mean(axis=1) / below[rows].mean(axis=1)
    return [float(value) for value in np.quantile(ratios, (0.025, 0.975))]


def run_experiment(
    seed: int,
    *,
    effects: bool = True,
    skill: str | Skill = "elite",
    practice: int = 20,
    draws: int = 10,
    guards: int = 5,
    takeouts: int = 5,
    trials: int = 24,
    camera: ThrowCamera = noisy_camera,
    progress: Progress = no_progress,
) -> ClosedLoopResult:
    """Run the whole loop on one hidden ice.

    Parameters
    ----------
    seed : seed of the ice, the practice, the camera, the requests and the execution errors
    effects : whether the hidden ice has effects
    skill : the skill of the player, by name or as a `Skill`
    practice, draws, guards, takeouts : number of throws of each kind
    trials : executions with error of each planned throw
    camera : how the practice is measured; white noise of 5 mm at 30 frames a second by default
    progress : called with shares of the whole
    """
    ice_rng, practice_rng, camera_rng, request_rng, error_rng = (
        np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(5)
    )
    hidden = draw_hidden_ice(ice_rng, effects=effects)
    releases = mixed_practice(practice, practice_rng)
    progress("practice throws", 0.0)
    tracks = camera(hidden, releases, camera_rng, part_of_progress(progress, 0.0, 0.05))
    progress("estimating the map", 0.05)
    uniform = estimate_ice(tracks, uniform=True).ice
    mapped = estimate_ice(tracks, effects="none").ice
    joint = estimate_ice(tracks, seed=seed, progress=part_of_progress(progress, 0.1, 0.5))
    truth = hidden.truth()
    ices: dict[str, Ice] = dict(zip(KNOWLEDGE, (uniform, mapped, joint.ice, truth), strict=True))
    requests = _requests(request_rng, draws, guards, takeouts)
    skill = skill_named(skill)
    errors = skill.errors(trials, error_rng)
    plans: dict[str, list[Plan]] = {}
    exact: dict[str, list[ExecutedThrows]] = {}
    with_error: dict[str, list[ExecutedThrows]] = {}
    for number, (knowledge, ice) in enumerate(ices.items()):
        plans[knowledge], exact[knowledge], with_error[knowledge] = [], [], []
        for k, request in enumerate(requests):
            part = (number + k / len(requests)) / len(ices)
            progress(f"throws planned on: {knowledge}", 0.5 + 0.5 * part)
            planned = _plan(ice, request, skill, seed)
            plans[knowledge].append(planned)
            exact[knowledge].append(execute_plan(hidden, truth, ice, planned, np.zeros((1, 3))))
            with_error[knowledge].append(execute_plan(hidden, truth, ice, planned, errors))
    return ClosedLoopResult(
        seed=seed,
        hidden=hidden,
        tracks=tracks,
        track_errors=track_errors(hidden, releases, tracks),
        ices=ices,
        joint=joint,
        requests=requests,
        plans=plans,
        exact=exact,
        with_error=with_error,
        skill=skill,
    )


def _requests(rng: np.random.Generator, draws: int, guards: int, takeouts: int) -> list[Request]:
    """Draws anywhere in the house, guards in front of it, and stones in the house to take out."""

    def in_house() -> tuple[float, float]:
        radius, turn = 1.5 * np.sqrt(rng.random()), 2 * np.pi * rng.random()
        return float(radius * np.cos(turn)), float(TEE_Y + radius * np.sin(turn))

    def in_front() -> tuple[float, float]:
        return float(rng.uniform(-0.9, 0.9)), float(TEE_Y - rng.uniform(2.4, 4.2))

    return [
        *(Request(task="draw", mark=in_house()) for _ in range(draws)),
        *(Request(task="guard", mark=in_front()) for _ in range(guards)),
        *(Request(task="takeout", mark=in_house()) for _ in range(takeouts)),
    ]


def _plan(ice: Ice, request: Request, skill: Skill, seed: int) -> Plan:
    """Plan a request; draws and guards should rest at their marks but are judged as tasks."""
    if request.task == "takeout":
        return plan_task(ice, request.task, request.mark, skill=skill, seed=seed)
    resting = plan(ice, request.mark, skill=skill, seed=seed)
    objective = TaskDone(
        task=task_named(request.task),
        mark=resting.target,
        direction=resting.direction,
        stones=resting.stones,
        radius=ice.stone.radius,
    )
    return replace(resting, objective=objective)
