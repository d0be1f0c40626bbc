"""From a shot in the sport's words to a throw on the ice as the player knows it.

Positions are in the delivery frame: the tee at the origin, +y along the direction of play.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from curling_env.game import Call, Player, PlayerView
from curling_env.game.rules import RestingStone
from curling_env.ice import Ice
from curling_env.physics.aim import Aim
from curling_env.sheet import Direction
from curling_env.throw import Delivery, Throw

BOARD_WEIGHT = 1.25
"""Speed of a takeout over draw weight; it would run a few metres past the house."""
PEEL_WEIGHT = 1.6
"""Speed of a peel over draw weight."""


class AimingPlayer(Player):
    """A player that chooses shots; its methods turn them into throws."""

    def __init__(self) -> None:
        self._aims: dict[tuple[Direction, Delivery], tuple[Ice, Aim]] = {}
        self._to_button: dict[tuple[Direction, Delivery], tuple[Ice, Throw]] = {}

    def aim(self, view: PlayerView) -> Aim:
        """The aim on the known ice towards the end played to."""
        key = view.direction, view.delivery
        known = self._aims.get(key)
        if known is None or known[0] is not view.ice:
            known = (view.ice, Aim(view.ice, view.direction, delivery=view.delivery))
            self._aims[key] = known
        return known[1]

    def to_button(self, view: PlayerView) -> Throw:
        """The draw to the button on the empty sheet, computed once for each ice."""
        key, spin = (view.direction, view.delivery), view.delivery.spin
        known = self._to_button.get(key)
        if known is None or known[0] is not view.ice:
            throw = self.aim(view).draw(0.0, 0.0, spin) or Throw(speed=2.1, spin=spin)
            known = (view.ice, throw)
            self._to_button[key] = known
        return known[1]

    # --- shots ------------------------------------------------------------------------------------

    def draw_to(self, view: PlayerView, x: float, y: float, shot: str) -> Call | None:
        """A draw or guard to (x, y) that touches nothing on its way, with either handle."""
        aim, stones = self.aim(view), _centres(view)
        for spin in _sides(x, view.delivery.spin):
            throw = aim.draw(x, y, spin)
            if throw is not None and aim.path_clears(throw, stones, until=y + 0.5):
                return Call(throw=throw, shot=shot)
        return None

    def hit(
        self,
        view: PlayerView,
        target: RestingStone,
        shot: str,
        *,
        weight: float = BOARD_WEIGHT,
        off: float = 0.0,
        clear: bool = True,
    ) -> Call | None:
        """A takeout of a stone, with either handle.

        Parameters
        ----------
        target : the stone to hit
        shot : name of the shot
        weight : speed over that of a draw to the button
        off : how far to the right of the stone's centre to aim [m]
        clear : whether the way must be free; otherwise a stone in the way is driven onto the target
        """
        aim = self.aim(view)
        speed = min(weight * self.to_button(view).speed, view.delivery.max_speed)
        others = _centres(view, but=target)
        for spin in _sides(target.x, view.delivery.spin):
            throw = aim.through(target.x + off, target.y, speed, spin)
            if throw is None:
                continue
            if not clear or aim.path_clears(throw, others, until=target.y):
                return Call(throw=throw, shot=shot)
        return None

    def through(self, view: PlayerView) -> Call:
        """A stone thrown through the house and away, past everything that lies there."""
        aim, stones, spin = self.aim(view), _centres(view), view.delivery.spin
        speed = min(1.4 * self.to_button(view).speed, view.delivery.max_speed)
        for x in (1.6, -1.6, 1.9, -1.9, 1.0, -1.0):
            throw = aim.through(x, 0.0, speed, -spin if x < 0 else spin)
            if throw is not None and aim.path_clears(throw, stones, until=2.5):
                return Call(throw=throw, shot="through the house")
        return Call(throw=Throw(speed=0.5 * self.to_button(view).speed), shot="short")


def _centres(view: PlayerView, but: RestingStone | None = None) -> np.ndarray:
    end = view.game.end
    stones = () if end is None else end.stones
    return np.array([(s.x, s.y) for s in stones if s is not but], dtype=np.float64).reshape(-1, 2)


def _sides(x: float, spin: float) -> Iterable[float]:
    """Spins to try; first the one that curls towards the centre, where there is most room."""
    return (spin, -spin) if x >= 0 else (-spin, spin)
