"""Greedy player: it simulates every shot of its list and looks one delivery ahead."""

from __future__ import annotations

import numpy as np

from agents.playing.players.heuristic import heuristic_value
from curling_env.game import Call, GameSimulator, GameState, PlayerView
from curling_env.game.opponents import PEEL_WEIGHT, AimingPlayer
from curling_env.game.rules import shot_order
from curling_env.game.rules.delivery import guards
from curling_env.ice import Ice
from curling_env.throw import Delivery

TRIALS = 8
"""Number of simulations of each shot, with the same execution errors for every shot."""
DRAWS = (
    (0.0, 0.0),
    (0.4, 0.2),
    (-0.4, 0.2),
    (0.0, 0.7),
    (1.0, 0.2),
    (-1.0, 0.2),
    (0.0, -1.2),
)
"""Places to draw to [m]."""
GUARDS = ((0.0, -3.2), (0.0, -2.4), (0.9, -3.0), (-0.9, -3.0))
OFF_CENTRE = 0.12
"""Offsets from the centre at which a stone is hit for a roll [m]."""


class GreedyPlayer(AimingPlayer):
    """Player that chooses the shot with the highest mean value of its position, before any
    reply.
    """

    name = "greedy"

    def __init__(self) -> None:
        super().__init__()
        self._simulator: tuple[Ice, Delivery, GameSimulator] | None = None

    def call(self, view: PlayerView) -> Call:
        calls = self.shots(view)
        simulator = self._simulator_of(view)
        seed = view.seed
        values = [self._value(view, simulator, call, seed) for call in calls]
        return calls[int(np.argmax(values))]

    def shots(self, view: PlayerView) -> list[Call]:
        """Return the candidate shots."""
        end = view.game.end
        assert end is not None
        protected = guards(view.game.rules, view.game.lines, end.stones, view.team, end.delivered)
        calls = [self.draw_to(view, x, y, "draw") for x, y in DRAWS]
        if end.delivered < view.game.rules.deliveries - 1:
            calls += [self.draw_to(view, x, y, "guard") for x, y in GUARDS]
        for stone in end.stones:
            if stone.team is view.team or stone in protected:
                continue
            for off in (0.0, OFF_CENTRE, -OFF_CENTRE):
                calls.append(self.hit(view, stone, "takeout", off=off))
            calls.append(self.hit(view, stone, "peel", weight=PEEL_WEIGHT))
        order = shot_order(view.game.lines, end.stones)
        if order and order[0].team is not view.team:
            shot = order[0]
            calls.append(
                self.draw_to(
                    view, shot.x, shot.y - 2 * view.game.lines.stone_radius - 0.02, "freeze"
                )
            )
        calls.append(self.through(view))
        return [call for call in calls if call is not None]

    def _value(self, view: PlayerView, simulator: GameSimulator, call: Call, seed: int) -> float:
        total = 0.0
        for trial in range(TRIALS):
            after, _ = simulator.play(GameState(game=view.game, seed=seed + trial), call)
            total += heuristic_value(after.game, view.team)
        return total / TRIALS

    def _simulator_of(self, view: PlayerView) -> GameSimulator:
        """Make a simulator of the known ice, with the player's own skill for both teams."""
        known = self._simulator
        if known is None or known[0] is not view.ice or known[1] != view.delivery:
            simulator = GameSimulator(
                view.ice, rules=view.game.rules, skills=view.skill, delivery=view.delivery
            )
            known = self._simulator = (view.ice, view.delivery, simulator)
        simulator = known[2]
        simulator.skills = (view.skill, view.skill)
        return simulator
