"""Measures of planning and games: planned throws, the closed loop, `search` and its networks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from agents.planning import plan_throw
from agents.playing import NETWORKS, end_simulator, play_tournament
from agents.playing.league.fit import negative_log_likelihood, shares_error
from agents.playing.league.run import played_batch
from agents.playing.search.networks import network_named
from agents.playing.tournament import Standing
from curling_env import load_ice
from curling_env.game import NO_EVOLUTION, TYPICAL_EVOLUTION, GameSimulator, player_named, rule_set
from curling_env.physics import slide
from curling_env.sheet import TEE_Y
from curling_env.throw import FROM_HACK
from measures.loop import run_loop
from measures.server_games import Games

MEASURES = (
    *("plans", "closed_loop", "closed_loop_full", "search", "search_full"),
    *("values", "logs", "other_programs"),
)
TARGETS = 12
"""Number of draws planned on the exact ice."""
SHOTS = {"freeze": ("elite",), "takeout": ("elite", "club")}
"""Tasks with one stone, and the players of their plans."""
STONE = (0.3, 17.6)
CANDIDATES = 30_000
VALUE_BATCHES = 8
"""Number of batches of 128 ends that test a network."""
RUNS = Path(__file__).parents[2] / "runs"
LOGS = RUNS / "independent" / "digital_curling"
PROGRAMS = ("rulebased", "ylab", "ayumu")
"""Folders of `runs/dc` with the games against each program, as `curling join -o` writes them."""


def plans() -> dict[str, float]:
    """Plan draws on an ice that is known exactly, and shots at a stone for two players."""
    ice, rng = load_ice("standard"), np.random.default_rng(0)
    off = 0.0
    for _ in range(TARGETS):
        target = tuple((np.array([0.0, TEE_Y]) + rng.uniform(-1.5, 1.5, 2)).tolist())
        best = plan_throw(ice, target, skill="elite").best
        rest = slide(ice, best.throw.release())
        off = max(off, 1e3 * float(np.hypot(rest.x - target[0], rest.y - target[1])))
    found = {
        (task, skill): plan_throw(ice, task, STONE, skill=skill, candidates=CANDIDATES).best
        for task, skills in SHOTS.items()
        for skill in skills
    }
    share = {key: 100 * float(best.trials.success.mean()) for key, best in found.items()}
    return {
        "draw_mm": off,
        "freeze_elite": share["freeze", "elite"],
        "takeout_club": share["takeout", "club"],
        "weight_elite": found["takeout", "elite"].throw.speed,
        "weight_club": found["takeout", "club"].throw.speed,
    }


def closed_loop() -> dict[str, float]:
    """Run the closed loop on one hidden ice, with eight planned throws."""
    result = run_loop(1, draws=4, guards=2, takeouts=2, trials=12)
    exact = result.exact["map and effects"]
    return {"exact_cm": 100 * float(exact.mean()), "excess": result.excess}


def closed_loop_full() -> dict[str, float]:
    """Run the closed loop on three hidden ices, the last without effects."""
    results = [run_loop(seed, effects=seed != 14) for seed in (1, 11, 14)]
    gains = [result.gain for result in results]
    return {
        "gain": min(gains[:2]),
        "gain_no_effects": gains[2],
        "excess": max(result.excess for result in results),
    }


def search() -> dict[str, float]:
    """Play `search` against players of the package, by two sets of rules."""
    found: dict[str, float] = {}
    for setting in ("world_curling", "digital_curling"):
        first = _standing(setting, 4, "rulebased", games=20, seed=7)
        found[setting] = first.points_for - first.points_against
    return found


def search_full() -> dict[str, float]:
    """Play many games of `search` against players of the package."""
    rows = {
        "rulebased": _standing("world_curling", 8, "rulebased", games=60, seed=0),
        "greedy": _standing("world_curling", 8, "greedy", games=16, seed=0),
        "digital_curling": _standing("digital_curling", 4, "rulebased", games=40, seed=7),
    }
    return {name: 100 * row.share for name, row in rows.items()}


def _standing(setting: str, ends: int, opponent: str, *, games: int, seed: int) -> Standing:
    """Return the result of `search:1000` against an opponent."""
    if setting == "world_curling":
        rules = rule_set("world_curling_2024", ends=ends)
        simulator = GameSimulator(
            rules=rules, skills="elite", ice_evolution=TYPICAL_EVOLUTION, sweeping=True
        )
    else:
        simulator = GameSimulator(
            "fcv1",
            rules=rule_set("digital_curling", ends=ends),
            skills="digital-curling",
            ice_evolution=NO_EVOLUTION,
            delivery=FROM_HACK,
        )
    both = [player_named("search:1000"), player_named(opponent)]
    table = play_tournament(simulator, both, games=games, seed=seed)
    return next(row for row in table.standings if row.name == both[0].name)


def values() -> dict[str, float]:
    """Compare predictions of the value networks with the scores of unseen ends."""
    from train_value_network import settings_for

    found: dict[str, float] = {}
    for known in NETWORKS:
        own = network_named(known.name)
        lines = end_simulator(known.ice, known.rules, known.delivery).lines
        settings = settings_for(known)
        batches = [played_batch(settings, (own, own), (99, 0, k)) for k in range(VALUE_BATCHES)]
        errors = {
            other.name: np.mean(
                [negative_log_likelihood(network_named(other.name), lines, b) for b in batches]
            )
            for other in NETWORKS
        }
        scores = np.concatenate([batch.score for batch in batches])
        found[known.name] = shares_error(scores) - float(errors[known.name])
        if known is NETWORKS[0]:
            found["other_on_standard"] = float(errors[known.name] - errors[NETWORKS[1].name])
    return found


def logs() -> dict[str, float]:
    """Replay two games that were played on the server of Digital Curling."""
    found = Games()
    for path in sorted(LOGS.glob("wire-*.jsonl")):
        found.add(path)
    median, most = (1e3 * np.percentile(found.apart, (50, 100))).tolist()
    return {"other": found.other, "median_mm": median, "mm": most}


def other_programs() -> dict[str, float]:
    """Count games won on the server of Digital Curling, against each program."""
    shown: dict[str, float] = {}
    for program in PROGRAMS:
        found = Games()
        for folder in sorted((RUNS / "dc" / program).iterdir()):
            found.add(folder / "wire.jsonl")
        shown[program] = 100 * found.won / (found.games + found.broken)
    return shown
