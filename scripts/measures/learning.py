"""Measures of learning: draws, benchmark scores, players of ends, and the value of a map."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium
import learn_ends
import learned_ends
import numpy as np
import ppo
import torch

from agents.benchmark import TASKS
from agents.benchmark import measure as score
from agents.benchmark.contestants import contestant
from agents.learning import evaluation
from agents.learning.policy import TrainedPolicy
from agents.learning.training import train
from agents.models import load
from agents.playing.learned.fit import ShotModule, _measured, clone
from agents.playing.learned.network import ShotNetwork
from curling_env.commands import benchmarks
from curling_env.envs.random_ice import KNOWLEDGE, RandomIces
from curling_env.envs.stable_baselines import CurlingVecEnv
from curling_env.throw import skill_named

MEASURES = (
    *("button", "draws", "unseen_ices", "house", "one_file", "zoo", "throws", "planner"),
    *("ends", "ends_and_greedy", "games", "copy", "whole_copy", "alone"),
    *("knowledge", "recorded", "rates"),
)
DRAWS = 40
"""Draws of an evaluation, each on another unseen ice."""
DRAWS_BY_KNOWLEDGE = 80
LESSONS, HELD_OUT = 400, 0.25
"""Positions of recorded ends to learn from, and the share that only measures."""
SHEETS = 256


def button() -> dict[str, float]:
    """Train draws to the button on one ice, and compare them with the best possible throw."""
    return {"ratio": _trained("button-one-ice")}


def draws() -> dict[str, float]:
    """Compare the shipped model `draw` with the planner and the best possible throw."""
    model = load("draw")
    assert isinstance(model, TrainedPolicy)
    found = evaluation.evaluate(model, draws=DRAWS)
    return {
        "model": found["agent_over_best"]["ratio"],
        "planner": found["planner_over_best"]["ratio"],
        "best_m": found["best"]["mean_miss_with_error_m"],
        "model_exact_m": found["agent"]["mean_miss_m"],
        "planner_exact_m": found["planner"]["mean_miss_m"],
    }


def unseen_ices() -> dict[str, float]:
    """Train draws on random ices, and compare them with the best possible throw."""
    return {"ratio": _trained("house-random-ices")}


def _trained(config: str) -> float:
    """Return the mean miss of a configuration's policy over that of the best possible throw."""
    with TemporaryDirectory() as folder:
        found = evaluation.evaluate(train(config, folder), draws=DRAWS)
    return found["agent_over_best"]["ratio"]


def house() -> dict[str, float]:
    """Train PPO of stable-baselines3 by the example of docs/agents.md, and measure its miss."""
    from stable_baselines3 import PPO

    torch.set_num_threads(1)
    envs = CurlingVecEnv("CurlingSheet-v0", n_envs=256, seed=0, target="random", skill="club")
    few = {"policy_kwargs": {"log_std_init": -1.0}, "seed": 0, "device": "cpu"}
    model = PPO("MlpPolicy", envs, n_steps=16, batch_size=512, **few)
    model.learn(160_000)
    _, miss = ppo.evaluate(lambda seen: model.predict(seen, deterministic=True)[0], ppo.Settings())
    return {"miss_m": miss}


def one_file() -> dict[str, float]:
    """Train PPO in one file, and measure its miss."""
    return {"miss_m": miss_of_one_file(ppo.Settings.steps)}


def miss_of_one_file(steps: int) -> float:
    """Return the mean miss of PPO in one file after a number of throws [m]."""
    with TemporaryDirectory() as folder, contextlib.redirect_stdout(sys.stderr):
        settings = ppo.Settings(steps=steps, output=folder)
        return ppo.evaluate(ppo.train(settings).predict, settings, 2000)[1]


def zoo() -> dict[str, float]:
    """Train with RL Zoo's code, and compare with the best possible throw."""
    import zoo  # needs RL Zoo

    results = {algorithm: zoo.measure(algorithm) for algorithm in zoo.ALGORITHMS}
    return {algorithm: found.miss / found.best for algorithm, found in results.items()}


def throws() -> dict[str, float]:
    """Measure the shipped models, and random actions, at the benchmark's throws."""
    learned = contestant("learned")
    tasks = ("draw", "draw-mean", "draw-blind")
    found = {task: score(TASKS[task], learned).mean for task in tasks}
    return {
        **{f"{task.replace('-', '_')}_m": mean for task, mean in found.items()},
        "takeout": 100 * score(TASKS["takeout"], learned).mean,
        "random_draw_m": score(TASKS["draw"], contestant("random")).mean,
    }


def planner() -> dict[str, float]:
    """Measure the planner at draws and takeouts of the benchmark."""
    planned = contestant("planner")
    return {
        "draw_m": score(TASKS["draw"], planned).mean,
        "takeout": 100 * score(TASKS["takeout"], planned, episodes=30).mean,
    }


def ends() -> dict[str, float]:
    """Measure the shipped player of ends against `draw` and `rulebased`."""
    return learned_ends.points(contestant("learned"), ("draw", "rulebased"), episodes=150)


def ends_and_greedy() -> dict[str, float]:
    """Measure the shipped player of ends against every opponent of the benchmark."""
    return learned_ends.points(contestant("learned"))


def games() -> dict[str, float]:
    """Play games of two ends between the shipped player and `greedy`."""
    return learned_ends.games("learned")


def copy() -> dict[str, float]:
    """Learn from positions of the packaged ends, and measure the points lost in those held out."""
    lessons = learned_ends.lessons_in(learned_ends.packaged_positions(LESSONS))
    _, held_out = clone(lessons, held_out=HELD_OUT)
    rest, shipped = lessons[round(LESSONS * (1 - HELD_OUT)) :], load("ends")
    assert isinstance(shipped, ShotNetwork)
    return {
        "lost": held_out["lost"],
        "shipped_lost": _measured(ShotModule(shipped), rest)["lost"],
    }


def whole_copy() -> dict[str, float]:
    """Copy a search from 20,000 positions, and measure it against every opponent."""
    return points_of_copy(ends=2500, episodes=600)


def points_of_copy(*, ends: int, episodes: int) -> dict[str, float]:
    """Return points per end of a copy of a search, see `learned_ends.points`.

    Parameters
    ----------
    ends : number of ends that it learns from
    episodes : number of ends against each opponent
    """
    positions = learned_ends.positions_of(learned_ends.recorded(ends))
    network, _ = clone(learned_ends.lessons_in(positions))
    return learned_ends.points(contestant(network), episodes=episodes)


def alone() -> dict[str, float]:
    """Learn ends by playing alone, and play games against `greedy`."""
    return games_of_learner(deliveries=51_200, count=60)


def games_of_learner(*, deliveries: int, count: int) -> dict[str, float]:
    """Return what a network that learnt by playing alone reaches, see `learned_ends.games`.

    Parameters
    ----------
    deliveries : number of deliveries that it learns from
    count : number of games
    """
    with TemporaryDirectory() as folder:
        output = Path(folder) / "ends.npz"
        with contextlib.redirect_stdout(sys.stderr):
            settings = learn_ends.Settings(deliveries=deliveries, num_envs=32)
            learn_ends.play(None, output, settings)
        return learned_ends.games(output, count)


def knowledge() -> dict[str, float]:
    """Compare draws planned with different knowledge of random ices."""
    rng, club, ices = np.random.default_rng(5), skill_named("club"), RandomIces()
    drawn = [
        (*ices.draw(rng, "map"), evaluation.house_targets(1, rng))
        for _ in range(DRAWS_BY_KNOWLEDGE)
    ]
    found: dict[str, float] = {}
    for knows in KNOWLEDGE:
        misses: list[evaluation.Misses] = []
        for k, (ice, estimate, target) in enumerate(drawn):
            throw = evaluation.planner_throw(ices.as_known(estimate, knows), target[0], club)
            misses.append(evaluation.misses(ice, throw[None], target, club, seed=k))
        found[f"{knows}_m"] = float(np.mean([one.with_error.mean() for one in misses]))
        found[f"{knows}_exact_m"] = float(np.mean([one.exact.mean() for one in misses]))
    return found


def recorded() -> dict[str, float]:
    """Record ends as for the newest dataset, some of them twice."""
    first = list(learned_ends.recorded(200))
    pairs = zip(learned_ends.recorded(25), first, strict=False)
    same = [np.array_equal(one["actions"], other["actions"]) for one, other in pairs]
    return {
        "points": float(np.mean([sum(one["rewards"]) for one in first])),
        "repeated": 100 * float(np.mean(same)),
    }


def rates() -> dict[str, float]:
    """Compare throws per second of 256 sheets, by their ices, with those of one sheet."""
    env = gymnasium.make("CurlingSheet-v0")
    single = benchmarks.rate(lambda: benchmarks.steps(env))
    return {
        "throws_per_s": round(_throws_per_s({})),
        "pool": _throws_per_s({"ices": {"pool": 16}}) / single,
        "every_ice": _throws_per_s({"ices": "random"}) / single,
    }


def _throws_per_s(options: dict[str, Any]) -> float:
    return benchmarks.rate(benchmarks.vector_steps(SHEETS, **options))
