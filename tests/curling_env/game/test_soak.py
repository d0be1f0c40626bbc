"""Ends of random throws, very many of them with `make soak`: nothing breaks."""

from __future__ import annotations

import os

import numpy as np

from curling_env.game import RULE_SETS, TYPICAL_EVOLUTION, Call, GameSimulator, Team
from curling_env.throw import Throw

ENDS = int(os.environ.get("CURLING_SOAK_ENDS", "60"))
SEED = int(os.environ.get("CURLING_SOAK_SEED", "0"))


def test_ends_of_random_throws():
    rng = np.random.default_rng(SEED)
    names = sorted(RULE_SETS)
    played = 0
    while played < ENDS:
        simulator = GameSimulator(
            rng.choice(["standard", "fcv1", "paper"]),
            rules=names[played % len(names)],
            skills="club",
            ice_evolution=TYPICAL_EVOLUTION,
            sweeping=True,
        )
        reach = 1.4 if simulator.ice.stone.radius < 0.14 else 2.6
        state = simulator.new_game(int(rng.integers(2**31)), last_stone=Team(int(rng.integers(2))))
        while not state.game.is_over and len(state.game.line_score) < 12 and played < ENDS:
            state = simulator.begin_end(state)
            while state.game.end is not None:
                throw = Throw(
                    speed=float(rng.uniform(0.5, 1.5) * reach),
                    angle=float(rng.uniform(-0.1, 0.1)),
                    spin=float(rng.uniform(-4, 4)),
                    x=float(rng.uniform(-0.3, 0.3)),
                )
                state, shot = simulator.play(state, Call(throw=throw))
                places = np.array([(s.x, s.y) for s in shot.stones_after]).reshape(-1, 2)
                assert np.isfinite(places).all()
                before = 0.5 * shot.thrown.speed**2
                for stone, status in zip(shot.outcome.stones, shot.outcome.status, strict=True):
                    if not status.in_play:
                        before -= 0.5 * (stone.vx**2 + stone.vy**2)
                assert before >= 0  # no more energy left the sheet than was thrown onto it
            home, away = state.game.line_score[-1]
            assert min(home, away) == 0
            assert max(home, away) <= simulator.rules.stones + simulator.rules.placed_stones
            played += 1
