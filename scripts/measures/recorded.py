"""Replay a recorded game and a recorded batch of throws, and compare every rest to the last bit.

    cd scripts && python -m measures.recorded    record them again

The game has two ends on `standard` ice that wears, with sweeping and execution errors. Each
delivery is played into the recorded position, so that differences do not add up.
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from agents.playing import SearchPlayer, play_game
from curling_env import Direction, Throw
from curling_env.benchmarks.throws import draws_and_hits, houses, mapped_ice
from curling_env.game import (
    TYPICAL_EVOLUTION,
    Call,
    GameSimulator,
    GameState,
    PlayedShot,
    RestingStone,
    Team,
    rule_set,
)
from curling_env.physics import play_batch, play_bounds
from curling_env.typing import Floats

STORED = Path(__file__).with_name("recorded_game.json")
SEED = 7
BATCH_THROWS = 40


def simulator() -> GameSimulator:
    """Return the conditions of the recorded game."""
    return GameSimulator(
        "standard",
        rules=rule_set("world_curling_2024", ends=2),
        skills="club",
        ice_evolution=TYPICAL_EVOLUTION,
        sweeping=True,
    )


def rests(shot: PlayedShot) -> list[list[float]]:
    """Return x, y [m] and heading [rad] of every stone after a delivery."""
    return [[stone.x, stone.y, stone.theta] for stone in shot.outcome.stones]


def recorded() -> list[dict[str, Any]]:
    """Play the game; return its deliveries."""
    players = SearchPlayer(300), SearchPlayer(300)
    game = play_game(simulator(), players, seed=SEED, last_stone=Team.AWAY)
    rows: list[dict[str, Any]] = []
    for before, shot, _ in game.deliveries:
        assert before.game.end is not None
        rows.append(
            {
                "end": shot.end,
                "before": [[int(s.team), s.number, s.x, s.y] for s in before.game.end.stones],
                "throw": asdict(shot.call.throw),
                "sweep": list(shot.sweep),
                "after": rests(shot),
            }
        )
    return rows


def replayed(deliveries: list[dict[str, Any]]) -> list[list[list[float]]]:
    """Return the rests after each delivery of a recorded game, played again."""
    games = simulator()
    state = games.new_game(SEED, last_stone=Team.AWAY)
    found: list[list[list[float]]] = []
    for row in deliveries:
        if state.game.end is None:
            state = games.begin_end(state)
        lying = tuple(RestingStone(Team(t), number, x, y) for t, number, x, y in row["before"])
        call = Call(throw=Throw(**row["throw"]), sweep=tuple(row["sweep"]))
        state, shot = games.play(_with_stones(state, lying), call)
        found.append(rests(shot))
    return found


def _with_stones(state: GameState, stones: tuple[RestingStone, ...]) -> GameState:
    assert state.game.end is not None
    return replace(state, game=replace(state.game, end=replace(state.game.end, stones=stones)))


def batch() -> Floats:
    """Return the rests of throws among eight stones in the batch engine, (n, 9, 2)."""
    rng = np.random.default_rng(SEED)
    ice = mapped_ice(rng)
    throws, stones = draws_and_hits(rng, BATCH_THROWS, hits=0.7), houses(rng, BATCH_THROWS)
    return play_batch(ice, stones, throws, bounds=play_bounds(ice, Direction.AWAY)).last


def compare() -> dict[str, float]:
    """Return the shares of shots that repeat to the last bit, and the largest difference [mm]."""
    document = json.loads(STORED.read_text(encoding="utf-8"))
    pairs = {
        "game": list(
            zip(
                replayed(document["deliveries"]),
                (row["after"] for row in document["deliveries"]),
                strict=True,
            )
        ),
        "batch": list(zip(batch(), document["batch"], strict=True)),
    }
    found: dict[str, float] = {"mm": 0.0}
    for name, shots in pairs.items():
        off = [np.abs(np.array(ours) - np.array(theirs)) for ours, theirs in shots]
        found[f"{name}_same"] = 100 * float(np.mean([not apart.any() for apart in off]))
        found["mm"] = max(found["mm"], *(1e3 * float(apart[:, :2].max()) for apart in off))
    return found


def write() -> None:
    """Record the game and the batch again."""
    lines = ",\n".join(json.dumps(row) for row in recorded())
    rows = ",\n".join(json.dumps(row) for row in batch().tolist())
    text = f'{{"deliveries": [\n{lines}\n],\n"batch": [\n{rows}\n]}}\n'
    STORED.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write()
