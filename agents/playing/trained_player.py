"""Trained model as a player: one that plays ends, or one that draws to the button."""

from __future__ import annotations

from pathlib import Path

from agents.learning.model_file import read_model
from agents.learning.policy import TrainedPolicy
from agents.playing.learned.network import ShotNetwork
from agents.playing.learned.player import LearnedPlayer
from agents.playing.policy_player import GamePolicy
from agents.playing.search.player import SearchPlayer
from agents.playing.search.value_network import network_from
from agents.playing.stable_baselines_file import stable_baselines_policy
from curling_env.errors import InputError
from curling_env.game import Call, Player, PlayerView, player_named
from curling_env.game.players import PLAYER_GROUP, player_names
from curling_env.ice import Ice
from curling_env.infrastructure.plugins import load_plugin
from curling_env.sheet import HOG_LINE_Y, Direction, tee
from curling_env.throw import Throw


class TrainedPlayer(Player):
    """Player that draws every stone to the button with a model of `curling train`.

    Parameters
    ----------
    path : file of the model

    Raises
    ------
    InputError : no such file, or not a model of this project
    """

    def __init__(self, path: str | Path) -> None:
        self._policy = TrainedPolicy.load(path)
        self._throws: dict[Direction, tuple[Ice, Throw]] = {}

    def call(self, view: PlayerView) -> Call:
        if view.delivery.line_y != HOG_LINE_Y:
            raise InputError(f"{self.name} was trained to throw from the hog line only")
        known = self._throws.get(view.direction)
        if known is None or known[0] is not view.ice:
            known = (view.ice, self._policy.throw(view.ice, tee(view.direction)))
            self._throws[view.direction] = known
        return Call(throw=known[1], shot="draw to the button")


def trained_player(path: str | Path, *, budget: int = 400) -> Player:
    """Load the player of a model file: one that plays ends, or one that draws to the button.

    Parameters
    ----------
    path : file of the model
    budget : number of simulated throws before each delivery, for a player from a league

    Raises
    ------
    InputError : no such file, or not a model of this project
    """
    document = read_model(path)
    player: Player
    if "layers" in document:
        player = SearchPlayer(budget, network=network_from(document, path))
    elif "shots" in document:
        player = LearnedPlayer(ShotNetwork.of_document(document, path))
    else:
        player = TrainedPlayer(path)
    where = Path(path)
    # Every run leaves a `model.npz`, so its folder is the better name.
    player.name = where.absolute().parent.name if where.stem == "model" else where.stem
    return player


def model_in(path: str | Path) -> Player | TrainedPolicy:
    """Load the trained model in a file: a player of ends, or a policy of single throws.

    Raises
    ------
    InputError : no such file, or not a model of this project
    """
    document = read_model(path)
    ends = "layers" in document or "shots" in document
    return trained_player(path) if ends else TrainedPolicy.load(path)


def player_from(name: str) -> Player:
    """Return the player with a name, perhaps with an option, of a model in a file, or of a policy.

    Parameters
    ----------
    name : name of a player; file of a model (``.npz``, or ``.zip`` of stable-baselines3); or
        ``module:object``, a `Player` class, a function of observations, or an object with
        `predict`

    Raises
    ------
    InputError : none of these
    """
    is_file = Path(name).exists()
    if Path(name).suffix == ".zip":
        return GamePolicy(stable_baselines_policy(name), Path(name).stem)
    if ":" in name and not is_file and name.partition(":")[0] not in player_names():
        found = load_plugin(
            "player", PLAYER_GROUP, ":".join(name.split(":")[:2]), built_in=player_names()
        )
        if isinstance(found, type) and not issubclass(found, Player):
            found = found()
        if not isinstance(found, type):
            return found if isinstance(found, Player) else GamePolicy(found, name)
    if name.partition(":")[0] in player_names() or (":" in name and not is_file):
        return player_named(name)
    if Path(name).suffix or is_file:
        return trained_player(name)
    raise InputError(
        f"unknown player {name!r}; expected one of {', '.join(player_names())}, module:Class, or "
        "a trained model's file"
    )
