"""A trained model as a player: it draws to the button as it learnt to."""

from __future__ import annotations

from pathlib import Path

from curling_env.errors import InputError
from curling_env.game import Call, Player, View, player_named
from curling_env.game.players import player_names
from curling_env.ice import Ice
from curling_env.sheet import Direction, tee
from curling_env.throw import Throw


class TrainedPlayer(Player):
    """Plays every stone to the button, thrown as a model of `curling train` throws it.

    Parameters
    ----------
    path : of the model

    Raises
    ------
    InputError : no such file, or not a model of this project
    """

    def __init__(self, path: str | Path) -> None:
        from agents.thrower import Thrower

        self.name = Path(path).stem
        self._thrower = Thrower.load(path)
        self._throws: dict[Direction, tuple[Ice, Throw]] = {}

    def call(self, view: View) -> Call:
        known = self._throws.get(view.direction)
        if known is None or known[0] is not view.ice:
            known = (view.ice, self._throw(view))
            self._throws[view.direction] = known
        return Call(throw=known[1], shot="draw to the button")

    def _throw(self, view: View) -> Throw:
        speed, angle, spin, x = self._thrower.throws(view.ice, tee(view.direction))[0].tolist()
        return Throw(speed=speed, angle=angle, spin=spin, x=x)


def player_from(name: str) -> Player:
    """The player of that name, with its option if it has one, or the model in that file.

    Raises
    ------
    InputError : neither a player nor a model's file
    """
    if name.partition(":")[0] in player_names():
        return player_named(name)
    if Path(name).suffix or Path(name).exists():
        return TrainedPlayer(name)
    raise InputError(
        f"no player is named {name!r}; there are {', '.join(player_names())}, or a trained "
        "model's file"
    )
