"""A trained model as a player: one that plays ends, or one that draws to the button."""

from __future__ import annotations

from pathlib import Path

from agents.learning.model_file import read_model
from agents.playing.search.player import SearchPlayer
from curling_env.errors import InputError
from curling_env.game import Call, Player, PlayerView, player_named
from curling_env.game.players import player_names
from curling_env.ice import Ice
from curling_env.sheet import Direction, tee
from curling_env.throw import Throw

LOOKED_AT = 400
"""Throws that a player of a league tries in the mind before each delivery."""


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
        from agents.learning.policy import Thrower

        self._thrower = Thrower.load(path)
        self._throws: dict[Direction, tuple[Ice, Throw]] = {}

    def call(self, view: PlayerView) -> Call:
        known = self._throws.get(view.direction)
        if known is None or known[0] is not view.ice:
            known = (view.ice, self._throw(view))
            self._throws[view.direction] = known
        return Call(throw=known[1], shot="draw to the button")

    def _throw(self, view: PlayerView) -> Throw:
        speed, angle, spin, x = self._thrower.throws(view.ice, tee(view.direction))[0].tolist()
        return Throw(speed=speed, angle=angle, spin=spin, x=x)


def trained_player(path: str | Path) -> Player:
    """The player whose model is in a file: of a league, or of draws.

    Raises
    ------
    InputError : no such file, or not a model of this project
    """
    document = read_model(path)
    player: Player
    if "layers" in document:
        from agents.playing.league.run import load_ends_network

        player = SearchPlayer(LOOKED_AT, network=load_ends_network(document, path))
    else:
        player = TrainedPlayer(path)
    where = Path(path)
    # `model.npz` is what every run leaves; its folder says which.
    player.name = where.absolute().parent.name if where.stem == "model" else where.stem
    return player


def player_from(name: str) -> Player:
    """The player of that name, with its option if it has one, or the model in that file.

    Raises
    ------
    InputError : neither a player nor a model's file
    """
    is_file = Path(name).exists()
    if name.partition(":")[0] in player_names() or (":" in name and not is_file):
        return player_named(name)
    if Path(name).suffix or is_file:
        return trained_player(name)
    raise InputError(
        f"no player is named {name!r}; there are {', '.join(player_names())}, module:Class, "
        "or a trained model's file"
    )
