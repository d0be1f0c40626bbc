"""The experiment: hidden ice, practice, what is learnt of it, and the throws that follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from agents.closed_loop.execution import Made, make
from agents.closed_loop.hidden_ice import HiddenIce, draw_hidden_ice
from agents.closed_loop.practice import practice_throws, track, track_errors
from agents.planning import Plan, plan, plan_task
from agents.planning.objective import Done
from curling_env.envs.sheet.tasks import task_named
from curling_env.ice import Ice
from curling_env.sheet import TEE_Y
from curling_env.throw import Release, Skill, skill_named
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.discovery.joint import WholeIce, understand_ice
from friction_estimation.discovery.report import sentence
from friction_estimation.inversion import estimate_ice

Tell = Callable[[str, float], None]
Camera = Callable[[HiddenIce, list[Release], np.random.Generator, Tell], list[Trajectory]]
"""Tracks of throws on a hidden ice; see `practice.track`."""

CHAINS = ("uniform", "map", "map and effects", "truth")
"""What each plans on: one friction; the estimated map; the map and what was discovered; the ice."""
PRACTICE, DRAWS, GUARDS, TAKEOUTS = 20, 10, 5, 5
TRIALS = 24
"""Times each planned throw is made with execution error."""
RESAMPLES = 2000
"""Of the throws, for an interval."""


@dataclass(frozen=True, kw_only=True)
class Asked:
    """One of the throws that are planned: a task and its mark, sheet frame [m]."""

    task: str
    mark: tuple[float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Proof:
    """What came of one hidden ice.

    Parameters
    ----------
    seed : of everything
    hidden : the ice
    tracks : of the practice
    track_errors : RMS distance of each from the true path, (n,) [m]
    ices : believed by each chain, in the order of `CHAINS`
    whole : how the third was found
    asked : the throws that were planned
    plans : of each chain
    exact, with_error : how they went, without execution error (1 each) and with it (`TRIALS` each)
    skill : of the hand
    """

    seed: int
    hidden: HiddenIce
    tracks: list[Trajectory]
    track_errors: Floats
    ices: dict[str, Ice]
    whole: WholeIce
    asked: list[Asked]
    plans: dict[str, list[Plan]]
    exact: dict[str, list[Made]]
    with_error: dict[str, list[Made]]
    skill: Skill

    def misses(self, chain: str, *, error: bool) -> Floats:
        """Mean miss of each planned throw, (n,) [m]."""
        made = self.with_error if error else self.exact
        return np.array([float(m.miss.mean()) for m in made[chain]])

    def successes(self, chain: str, *, error: bool) -> Floats:
        """Share of each planned throw's trials that did the task, (n,)."""
        made = self.with_error if error else self.exact
        return np.array([float(m.success.mean()) for m in made[chain]])

    @property
    def excess(self) -> float:
        """Mean miss with execution error on (c), map and effects, over that on (d), the truth."""
        return float(
            self.misses("map and effects", error=True).mean()
            / self.misses("truth", error=True).mean()
        )

    @property
    def gain(self) -> float:
        """Mean miss without execution error on (a), uniform ice, over that on (c)."""
        return float(
            self.misses("uniform", error=False).mean()
            / self.misses("map and effects", error=False).mean()
        )

    def as_dict(self) -> dict[str, object]:
        """For the report."""
        return {
            "seed": self.seed,
            "hidden": self.hidden.as_dict(),
            "track_rms_m": [float(error) for error in self.track_errors],
            "kept_along": self.whole.along,
            "dropped_along": self.whole.dropped,
            "verdict": sentence(self.whole.discovery),
            "effects": [
                {"name": e.name, "parameters": dict(e.parameters), "sigma": dict(e.sigma)}
                for e in self.whole.ice.effects
            ],
            "skill": self.skill.name,
            "chains": {
                chain: {
                    name: {
                        "mean_miss_m": interval(self.misses(chain, error=error)),
                        "success": interval(self.successes(chain, error=error)),
                    }
                    for name, error in (("exact", False), ("with_error", True))
                }
                for chain in CHAINS
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


def as_table(proofs: list[Proof]) -> str:
    """The proofs in lines of text: mean misses, tasks done, and the two ratios."""
    lines = [
        f"{'ice':>4}  {'':12}"
        + "".join(f"{chain:>24}" for chain in CHAINS)
        + f"{'c/d':>9}{'a/c':>8}"
    ]
    for proof in proofs:
        for name, error in (("exact", False), ("with error", True)):
            cells = "".join(
                f"{proof.misses(chain, error=error).mean():13.3f} m "
                f"{100 * proof.successes(chain, error=error).mean():5.0f} % "
                for chain in CHAINS
            )
            ratio = f"{'':9}{proof.gain:8.1f}" if not error else f"{proof.excess:9.3f}"
            lines.append(f"{proof.seed:>4}  {name:12}{cells}{ratio}")
    return "\n".join(lines)


def interval(values: Floats) -> dict[str, float]:
    """Mean of the throws and its 95 % interval, throws drawn again."""
    drawn = np.random.default_rng(0).choice(values, (RESAMPLES, len(values))).mean(axis=1)
    low, high = np.quantile(drawn, (0.025, 0.975))
    return {"mean": float(values.mean()), "low": float(low), "high": float(high)}


def ratio_interval(above: Floats, below: Floats) -> list[float]:
    """95 % interval of a ratio of means, the same throws drawn again in both."""
    rows = np.random.default_rng(0).integers(0, len(above), (RESAMPLES, len(above)))
    ratios = above[rows].mean(axis=1) / below[rows].mean(axis=1)
    return [float(value) for value in np.quantile(ratios, (0.025, 0.975))]


def prove(
    seed: int,
    *,
    effects: bool = True,
    skill: str | Skill = "elite",
    practice: int = PRACTICE,
    draws: int = DRAWS,
    guards: int = GUARDS,
    takeouts: int = TAKEOUTS,
    trials: int = TRIALS,
    camera: Camera | None = None,
    tell: Tell = lambda what, part: None,
) -> Proof:
    """Run the whole loop on one hidden ice.

    Parameters
    ----------
    seed : of the ice, the practice, the camera's noise, the throws and the hand
    effects : whether the hidden ice has any
    skill : of the hand
    practice, draws, guards, takeouts : how many throws of each
    trials : of each planned throw with execution error
    camera : how the practice is seen; 5 mm of noise at 30 frames a second by default
    tell : of the progress
    """
    ice_rng, hand, eye, house, luck = (
        np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(5)
    )
    hidden = draw_hidden_ice(ice_rng, effects=effects)
    releases = practice_throws(practice, hand)
    tell("practice throws", 0.0)
    watched = track if camera is None else camera
    tracks = watched(hidden, releases, eye, lambda what, part: tell(what, 0.05 * part))
    tell("estimating the map", 0.05)
    uniform = estimate_ice(tracks, uniform=True).ice
    mapped = estimate_ice(tracks).ice
    whole = understand_ice(tracks, seed=seed, tell=lambda what, part: tell(what, 0.1 + 0.4 * part))
    truth = hidden.truth()
    ices: dict[str, Ice] = dict(zip(CHAINS, (uniform, mapped, whole.ice, truth), strict=True))
    asked = _throws_asked(house, draws, guards, takeouts)
    skill = skill_named(skill)
    errors = skill.errors(trials, luck)
    plans: dict[str, list[Plan]] = {}
    exact: dict[str, list[Made]] = {}
    with_error: dict[str, list[Made]] = {}
    for number, (chain, ice) in enumerate(ices.items()):
        plans[chain], exact[chain], with_error[chain] = [], [], []
        for k, ask in enumerate(asked):
            part = (number + k / len(asked)) / len(ices)
            tell(f"throwing by {chain}", 0.5 + 0.5 * part)
            planned = _plan(ice, ask, skill, seed)
            plans[chain].append(planned)
            exact[chain].append(make(hidden, truth, ice, planned, np.zeros((1, 3))))
            with_error[chain].append(make(hidden, truth, ice, planned, errors))
    return Proof(
        seed=seed, hidden=hidden, tracks=tracks,
        track_errors=track_errors(hidden, releases, tracks), ices=ices, whole=whole, asked=asked,
        plans=plans, exact=exact, with_error=with_error, skill=skill,
    )  # fmt: skip


def _throws_asked(rng: np.random.Generator, draws: int, guards: int, takeouts: int) -> list[Asked]:
    """Draws anywhere in the house, guards before it, stones anywhere in it to take out."""

    def in_house(reach: float) -> tuple[float, float]:
        radius, turn = reach * np.sqrt(rng.random()), 2 * np.pi * rng.random()
        return float(radius * np.cos(turn)), float(TEE_Y + radius * np.sin(turn))

    return [
        *(Asked(task="draw", mark=in_house(1.5)) for _ in range(draws)),
        *(
            Asked(
                task="guard",
                mark=(float(rng.uniform(-0.9, 0.9)), float(TEE_Y - rng.uniform(2.4, 4.2))),
            )
            for _ in range(guards)
        ),
        *(Asked(task="takeout", mark=in_house(1.5)) for _ in range(takeouts)),
    ]


def _plan(ice: Ice, ask: Asked, skill: Skill, seed: int) -> Plan:
    """Draws and guards are to rest at their marks and are judged as such."""
    if ask.task == "takeout":
        return plan_task(ice, ask.task, ask.mark, skill=skill, seed=seed)
    resting = plan(ice, ask.mark, skill=skill, seed=seed)
    wanted = Done(
        task=task_named(ask.task),
        mark=resting.target,
        direction=resting.direction,
        stones=resting.stones,
        radius=ice.stone.radius,
    )
    return replace(resting, wanted=wanted)
