"""Network that calls shots, as a player of games."""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path

from agents.playing.learned.features import LINES
from agents.playing.learned.network import ShotNetwork
from curling_env.envs.game.observation import GameObservation
from curling_env.envs.game.shots import ShotActions
from curling_env.envs.known_ice import KnownIce
from curling_env.game import Call, Player, PlayerView
from curling_env.ice import Ice

PACKAGE, FILE = "agents.models", "ends.npz"
"""Location of the package's own network."""


class LearnedPlayer(Player):
    """Player that calls the shots of a network; each is simulated once for its value.

    Parameters
    ----------
    network : the network; by default the package's own

    Raises
    ------
    InputError : another kind of network
    """

    name = "learned"

    def __init__(self, network: ShotNetwork | str | Path | None = None) -> None:
        if network is None:
            with as_file(files(PACKAGE).joinpath(FILE)) as path:
                network = ShotNetwork.load(path)
        elif not isinstance(network, ShotNetwork):
            network = ShotNetwork.load(network)
        self.network = network
        self._shots = ShotActions()
        self._seen: tuple[Ice, GameObservation] | None = None

    def call(self, view: PlayerView) -> Call:
        observation = self._observation(view).of_view(view)
        shot, _ = self.network.predict(observation, views=[view])
        return self._shots.call_of(shot, view)

    def _observation(self, view: PlayerView) -> GameObservation:
        """Return the maker of observations on the known ice."""
        if self._seen is None or self._seen[0] is not view.ice:
            # On a sheet of any width, the network sees metres as in training.
            self._seen = (view.ice, GameObservation("flat", KnownIce(view.ice), LINES))
        return self._seen[1]
