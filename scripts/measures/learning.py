"""Measures of learning: draws, benchmark scores, players of ends, and the value of a map."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium
import h5py
import numpy as np
import ppo
import torch
from learn.cloning import ShotModule, clone, points_lost
from learn.lessons import lessons_of

from agents.benchmark import TASKS, difference_of, played
from agents.benchmark import measure as score
from agents.benchmark.contestants import contestant
from agents.learning import evaluation
from agents.learning.policy import TrainedPolicy
from agents.learning.training import train
from agents.learning.zoo import ALGORITHMS
from agents.models import load
from agents.playing.learned.network import ShotNetwork
from agents.playing.offline_data import DATASET, RECORDED, _episodes
from curling_env.benchmarks import measures as benchmarks
from curling_env.envs.random_ice import KNOWLEDGE, RandomIces
from curling_env.envs.stable_baselines import CurlingVecEnv
from curling_env.game import player_named
from curling_env.throw import skill_named
from curling_env.typing import no_progress

MEASURES = (
    *("button", "draws", "unseen_ices", "house", "one_file", "zoo", "throws", "planner"),
    *("ends", "copy", "knowledge", "recorded", "rates"),
)
DRAWS = 40
"""Draws of an evaluation, each on another unseen ice."""
DRAWS_BY_KNOWLEDGE = 80
LESSONS, HELD_OUT = 400, 0.25
"""Positions of recorded ends to learn from, and the share that only measures."""
SHEETS = 256
PLAYER, FIRST_SEED = "search:200:points", 7500
"""Player and first seed of the newest recorded dataset."""


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
        "model_exact_m": found["agent"]["mean_miss_m"],
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
    with TemporaryDirectory() as folder, contextlib.redirect_stdout(sys.stderr):
        settings = ppo.Settings(output=folder)
        return {"miss_m": ppo.evaluate(ppo.train(settings).predict, settings, 2000)[1]}


def zoo() -> dict[str, float]:
    """Train with RL Zoo's code, and compare with the best possible throw."""
    from measures.zoo import miss_over_best  # needs RL Zoo

    return {algorithm: miss_over_best(algorithm) for algorithm in ALGORITHMS}


def throws() -> dict[str, float]:
    """Measure the shipped models at the benchmark's throws."""
    learned = contestant("learned")
    return {
        "draw_m": score(TASKS["draw"], learned).mean,
        "draw_blind_m": score(TASKS["draw-blind"], learned).mean,
        "takeout": 100 * score(TASKS["takeout"], learned).mean,
    }


def planner() -> dict[str, float]:
    """Measure the planner at draws and takeouts of the benchmark."""
    planned = contestant("planner")
    return {
        "draw_m": score(TASKS["draw"], planned, episodes=100).mean,
        "takeout": 100 * score(TASKS["takeout"], planned, episodes=30).mean,
    }


def ends() -> dict[str, float]:
    """Measure the shipped player of ends against `draw` and `rulebased`."""
    tasks = [TASKS["end-draw"], TASKS["end-rulebased"]]
    own, others = (
        [played(task, contestant(name), episodes=150)[0] for task in tasks]
        for name in ("learned", "rulebased")
    )
    more = difference_of(own, others).mean
    return {"rulebased": float(own[1].mean()), "more_than_rulebased": more}


def copy() -> dict[str, float]:
    """Learn from positions of the packaged ends, and measure the points lost in those held out."""
    with h5py.File(RECORDED / DATASET / "data" / "main_data.hdf5") as file:
        every: Any = file
        seen = np.concatenate([every[name]["observations"][:-1] for name in every])
    env: Any = gymnasium.make("CurlingEnd-v0").unwrapped
    lessons = lessons_of(seen[:: len(seen) // LESSONS][:LESSONS], env.simulator)
    _, lost = clone(lessons, held_out=HELD_OUT)
    shipped = load("ends")
    assert isinstance(shipped, ShotNetwork)
    rest = lessons[round(LESSONS * (1 - HELD_OUT)) :]
    return {"lost": lost, "shipped_lost": points_lost(ShotModule(shipped), rest)}


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
    first = list(_recorded(200))
    pairs = zip(_recorded(25), first, strict=False)
    same = [np.array_equal(one["actions"], other["actions"]) for one, other in pairs]
    return {
        "points": float(np.mean([sum(one["rewards"]) for one in first])),
        "repeated": 100 * float(np.mean(same)),
    }


def _recorded(ends: int) -> Iterator[dict[str, Any]]:
    """Play ends as `curling record-games` does for the newest dataset, without Minari."""
    env = gymnasium.make(
        "CurlingEnd-v0", disable_env_checker=True, opponent=["rulebased", "draw"], ice="standard"
    )
    yield from _episodes(env, player_named(PLAYER), ends, FIRST_SEED, no_progress)


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
