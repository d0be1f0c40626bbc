"""The draw player: it throws every stone to the button, whatever lies there."""

from __future__ import annotations

from curling_env.game import Call, PlayerView
from curling_env.game.opponents.aiming import AimingPlayer


class DrawPlayer(AimingPlayer):
    """Throws the draw to the button of an empty sheet."""

    name = "draw"

    def call(self, view: PlayerView) -> Call:
        return Call(throw=self.to_button(view), shot="draw to the button")
