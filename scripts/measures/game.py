"""Measures of planning and games: planned throws, the closed loop, `search` and its networks."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import digital_curling_games as server_games
import numpy as np
import plan_throws
import strength

from agents.closed_loop import film_camera
from agents.closed_loop.experiment import ClosedLoopResult, run_experiment
from agents.planning import plan
from agents.playing import (
    BY_THE_ODDS,
    CHAMPIONSHIP,
    CLASSES,
    FACTORS,
    NETWORKS,
    Conditions,
    SearchPlayer,
    end_simulator,
    load_network,
    play_games,
    play_tournament,
)
from agents.playing.ends.summary import end_comparison, grades
from agents.playing.league.fit import negative_log_likelihood
from agents.playing.search.networks import network_named
from agents.playing.tournament import Standing
from curling_env import load_ice
from curling_env.game import GameSimulator, Player, player_named
from curling_env.physics import slide
from curling_env.sheet import TEE_Y

MEASURES = (
    *("plans", "closed_loop", "closed_loop_full", "closed_loop_film"),
    *("search", "search_full", "earlier", "replies", "backwards", "values"),
    *("ends", "ends_full", "openings", "logs", "other_programs"),
)
TARGETS = 12
"""Draws that are planned on the exact ice."""
VALUE_BATCHES = 8
"""Batches of 128 ends each on which a network is judged."""
EARLIER = "8c67995"
"""Commit of `search` before its network for Digital Curling, tables of the law, and replies."""
FITTED_TO_SCORES = "ee7bad0"
"""Commit of the network for Digital Curling that was fitted to the scores of ends."""
ROOT = Path(__file__).parents[2]
RUNS = ROOT / "runs"
LOGS = RUNS / "independent" / "digital_curling"
PROGRAMS = ("rulebased", "ylab", "ayumu")
"""Folders of `runs/dc` with the games against each program, as `curling join -o` writes them."""


def plans() -> dict[str, float]:
    """Plan draws on an ice that is known exactly, and three shots for three players."""
    ice, rng = load_ice("standard"), np.random.default_rng(0)
    off = 0.0
    for _ in range(TARGETS):
        target = tuple((np.array([0.0, TEE_Y]) + rng.uniform(-1.5, 1.5, 2)).tolist())
        best = plan(ice, target, skill="elite").best
        rest = slide(ice, best.throw.release())
        off = max(off, 1e3 * float(np.hypot(rest.x - target[0], rest.y - target[1])))
    found = {(task, skill): best.best for task, skill, best in plan_throws.plans(ice)}
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
    result = run_experiment(1, draws=4, guards=2, takeouts=2, trials=12)
    return {"exact_cm": _exact_cm(result), "excess": result.excess}


def closed_loop_full() -> dict[str, float]:
    """Run the closed loop on three hidden ices, the last without effects."""
    results = [run_experiment(seed, effects=seed != 14) for seed in (1, 11, 14)]
    gains = [result.gain for result in results]
    return {
        "gain": min(gains[:2]),
        "gain_no_effects": gains[2],
        "excess": max(result.excess for result in results),
    }


def closed_loop_film() -> dict[str, float]:
    """Run the closed loop with practice throws that are filmed and tracked."""
    with TemporaryDirectory() as folder:
        camera = partial(film_camera, folder=Path(folder), workers=1)
        result = run_experiment(
            1, practice=8, draws=6, guards=3, takeouts=3, trials=12, camera=camera
        )
    return {"exact_cm": _exact_cm(result), "excess": result.excess}


def _exact_cm(result: ClosedLoopResult) -> float:
    """Return the mean miss of throws planned on map and effects, without execution error [cm]."""
    return 100 * float(result.misses("map and effects", error=False).mean())


def search() -> dict[str, float]:
    """Play `search` against players of the package, by two sets of rules."""
    found: dict[str, float] = {}
    for setting in ("world_curling", "digital_curling"):
        simulator = strength.simulator_of(setting, 4)
        first = _standing(simulator, ("search:1000", "rulebased"), games=20, seed=7)
        found[setting] = first.points_for - first.points_against
    return found


def search_full() -> dict[str, float]:
    """Play many games of `search` against players of the package."""
    simulator = strength.simulator_of("world_curling", 8)
    club = _standing(simulator, ("search:1000", "rulebased"), games=60, seed=0)
    greedy = _standing(simulator, ("search:1000", "greedy"), games=16, seed=0)
    online = strength.simulator_of("digital_curling", 4)
    server = _standing(online, ("search:1000", "rulebased"), games=40, seed=7)
    rows = {"rulebased": club, "greedy": greedy, "digital_curling": server}
    return {name: 100 * row.share for name, row in rows.items()}


def _standing(
    simulator: GameSimulator, players: tuple[str | Player, ...], *, games: int, seed: int
) -> Standing:
    """Return the result of the first player."""
    both = [player_named(k) if isinstance(k, str) else k for k in players]
    table = play_tournament(simulator, both, games=games, seed=seed)
    return next(row for row in table.standings if row.name == both[0].name)


def earlier() -> dict[str, float]:
    """Play `search:1600` against `search:1000` of an earlier commit, in less time."""
    return _against("search:1600", f"search:1000@{EARLIER}", games=60, seed=100)


def replies() -> dict[str, float]:
    """Play `search:30000`, which looks up replies before every delivery, against `search:1000`."""
    return _against("search:30000", "search:1000", games=100, seed=300)


def _against(player: str, opponent: str, *, games: int, seed: int) -> dict[str, float]:
    simulator = strength.simulator_of("digital_curling", 4)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "games.jsonl"
        rows = strength.play((player, opponent), simulator, games, seed, path)
    spent = [sum(r["seconds"][k] for r in rows) / sum(r["calls"][k] for r in rows) for k in (0, 1)]
    return {"won": 100 * sum(r["won"] for r in rows) / games, "time": spent[0] / spent[1]}


def backwards() -> dict[str, float]:
    """Play the network learned backwards against the one fitted to the scores of ends."""
    name = "agents/playing/search/value_network_digital_curling.npz"
    with TemporaryDirectory() as folder:
        path = Path(folder) / "network.npz"
        shown = ["git", "show", f"{FITTED_TO_SCORES}:{name}"]
        path.write_bytes(subprocess.check_output(shown, cwd=ROOT))
        former = SearchPlayer(1000, network=load_network(path))
    former.name = "fitted to scores"
    simulator = strength.simulator_of("digital_curling", 4)
    first = _standing(simulator, ("search:1000", former), games=200, seed=0)
    return {"won": 100 * first.share}


def values() -> dict[str, float]:
    """Compare what the value networks predict with the scores of ends that they have not seen."""
    from train_value_network import played_ends, shares_error

    found: dict[str, float] = {}
    for known in NETWORKS:
        own = network_named(known.name)
        lines = end_simulator(known.ice, known.rules, known.delivery).lines
        batches = [played_ends(own, known, (99, 0, k))[0] for k in range(VALUE_BATCHES)]
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


def ends() -> dict[str, float]:
    """Play games as championships are played, and compare their ends with published ones."""
    return _ends(CHAMPIONSHIP, range(940_000, 940_024))


def ends_full() -> dict[str, float]:
    """Play 200 games of that kind, from seeds that no fit has seen."""
    return _ends(CHAMPIONSHIP, range(920_000, 920_200))


def openings() -> dict[str, float]:
    """Count the blank ends of `search` by the odds, and with ends that open with a guard."""
    guards = FACTORS["calls: ends open with guards"]
    pairs = {"by_the_odds": BY_THE_ODDS, "guards": guards}
    return {name: _ends(known, range(100, 112))["blank"] for name, known in pairs.items()}


def _ends(conditions: Conditions, seeds: Sequence[int]) -> dict[str, float]:
    games = list(play_games(conditions, seeds))
    comparison = end_comparison(games)
    graded = {row.type: row.mean for row in grades(games)}
    return {
        "chi_square": comparison.chi_square,
        "blank": 100 * float(comparison.shares[CLASSES.index("blank")]),
        "grade": graded["all"],
    }


def logs() -> dict[str, float]:
    """Replay two games that were played on the server of Digital Curling."""
    found = server_games.Games()
    for path in sorted(LOGS.glob("wire-*.jsonl")):
        found.add(server_games.read_log(path))
    median, _, most = found.off()
    replay = found.replay
    return {"other": len(replay.other), "median_mm": median, "mm": most}


def other_programs() -> dict[str, float]:
    """Count games won on the server of Digital Curling, against each program."""
    shown: dict[str, float] = {}
    for program in PROGRAMS:
        found = server_games.Games()
        for folder in sorted((RUNS / "dc" / program).iterdir()):
            found.add(server_games.lines_of(folder))
        shown[program] = 100 * found.won / (found.games + found.broken)
    return shown
