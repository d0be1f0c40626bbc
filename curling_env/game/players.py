"""Players: their view, their decisions, and their lookup by name."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.game.rules.delivery import Ruling
from curling_env.game.rules.game import Game
from curling_env.game.rules.rulesets import Side
from curling_env.game.rules.scoring import count
from curling_env.game.rules.teams import Team
from curling_env.ice import Ice
from curling_env.infrastructure.plugins import load_plugin, plugin_names
from curling_env.sheet import Direction
from curling_env.throw import FROM_HOG_LINE, Delivery, Skill, Throw
from curling_env.typing import Floats

PLAYER_GROUP = "curling.players"
"""Entry-point group of players: classes that can be made without arguments."""
PLAYER_FILE_GROUP = "curling.player_files"
"""Entry-point group of functions that make a player from a file, named by the file's suffix."""
OWN_PLAYERS = {
    "draw": "curling_env.game.opponents:DrawPlayer",
    "rulebased": "curling_env.game.opponents:RuleBasedPlayer",
}
"""Players of every installation, independent of other packages."""

SweepInterval = tuple[float, float]
"""Times after release at which sweeping begins and ends [s]."""


@dataclass(frozen=True, kw_only=True)
class PlayerView:
    """View of a player before a delivery.

    Parameters
    ----------
    game : score, stones (delivery frame) and the team to throw
    team : the player's team
    ice : ice as the player knows it, which may differ from the true ice
    direction : the end played to
    skill : execution error of the thrower of the player's team
    entropy : seed of the game, number of the throw, and team: the player's random numbers follow
        from them
    delivery : start, spin and maximum speed of throws
    clock : time since the first delivery of the game [s]
    ice_changes : true if ice and stones may change, or differ, unknown to the player
    ice_is_estimated : true if `ice` is a measurement of the true ice, with standard errors
    wear : (rows, columns) logarithm of each cell's friction relative to the start of the game,
        read-only; None while the ice has not worn
    """

    game: Game
    team: Team
    ice: Ice
    direction: Direction
    skill: Skill
    entropy: tuple[int, int, int]
    delivery: Delivery = FROM_HOG_LINE
    clock: float = 0.0
    ice_changes: bool = True
    ice_is_estimated: bool = False
    wear: Floats | None = None

    @property
    def has_hammer(self) -> bool:
        """Return whether the player's team delivers last in this end."""
        return self.game.end is not None and self.game.end.hammer is self.team

    @property
    def own_stones_left(self) -> int:
        """Number of stones that the team still has to deliver in this end."""
        end = self.game.end
        return 0 if end is None else self.game.rules.stones - end.number_of_stone

    @property
    def seed(self) -> int:
        """Return a seed for a player that decides at random, different before every delivery."""
        return int(np.random.SeedSequence(self.entropy).generate_state(1)[0])

    def rng(self) -> np.random.Generator:
        """Return a random generator for the player; the same before the same delivery."""
        return np.random.default_rng(self.entropy)


@dataclass(frozen=True, kw_only=True)
class Call:
    """Call of a player: a throw, and perhaps the sweeping.

    Parameters
    ----------
    throw : the throw without execution error
    sweep : interval of sweeping; None leaves it to the sweepers
    shot : the shot in the sport's words, for the record
    """

    throw: Throw
    sweep: SweepInterval | None = None
    shot: str = ""


class Player(ABC):
    """Player of a team.

    A player decides from the view alone: data kept between deliveries may only save time.
    """

    name: str = "player"

    @classmethod
    def with_option(cls, option: str) -> Player:
        """Return the player for ``name:option``.

        Raises
        ------
        InputError : an option that this player does not support
        """
        raise InputError(f"the player {cls.name!r} takes no option, got {option!r}")

    @abstractmethod
    def call(self, view: PlayerView) -> Call:
        """Return the call for the team's next delivery."""

    def concedes(self, view: PlayerView) -> bool:
        """Return whether the player concedes the game; asked only when the rules allow it."""
        return False

    def puts_back(self, view: PlayerView, ruling: Ruling) -> bool:
        """Return whether the stones are put back rather than left after the opponent's tick.

        They are put back, unless the stones as they are count for more.

        Parameters
        ----------
        view : the game before the opponent's delivery
        ruling : the stones as they are, and as they would be if put back
        """
        lines = view.game.lines

        def points_for_us(stones: Any) -> int:
            team, points = count(lines, stones)
            return points if team is view.team else -points

        return ruling.option is None or points_for_us(ruling.option) >= points_for_us(ruling.stones)

    def power_play(self, view: PlayerView) -> Side | None:
        """Return the side of a power play in the coming end of mixed doubles; None for none.

        Asked only when the rules allow one.
        """
        return None

    def throws_first(self, view: PlayerView) -> bool:
        """Return whether the team throws first in the coming end of mixed doubles, without the
        hammer.

        The deciding team is asked, unless it takes a power play. If it throws first, the other
        team's placed stone is in the house.
        """
        return False


def player_names() -> list[str]:
    """Return names of players: the built-in ones and those that installed packages declare."""
    return sorted({*OWN_PLAYERS, *plugin_names(PLAYER_GROUP)})


def player_named(name: str | Path | Player) -> Player:
    """Return the player of that name, or in that file; a `Player` is returned unchanged.

    Parameters
    ----------
    name : a name in `player_names`, ``module:Class`` for a class that is not installed, or the file
        of a trained model; an option may follow a name after another colon: ``search:500``,
        ``my_players:Cautious:3``

    Raises
    ------
    InputError : an unknown name, an unsupported option, an object that is not a player, or a file
        without one
    """
    if isinstance(name, Player):
        return name
    if isinstance(name, Path) or Path(name).suffix[1:] in plugin_names(PLAYER_FILE_GROUP):
        return _player_in(Path(name))
    plain, colon, option = name.partition(":")
    if colon and plain not in player_names():
        class_name, colon, option = option.partition(":")
        plain = f"{plain}:{class_name}"
    if plain in OWN_PLAYERS:
        module, _, attribute = OWN_PLAYERS[plain].partition(":")
        found = getattr(import_module(module), attribute)
    else:
        found = load_plugin("player", PLAYER_GROUP, plain, built_in=OWN_PLAYERS)
    if not (isinstance(found, type) and issubclass(found, Player)):
        raise InputError(
            f"{plain!r} is not a player: expected a subclass of curling_env.game.Player"
        )
    return found.with_option(option) if colon else found()


def _player_in(path: Path) -> Player:
    """Return the player of a trained model's file."""
    suffixes = plugin_names(PLAYER_FILE_GROUP)
    if path.suffix[1:] not in suffixes:
        known = ", ".join(f".{suffix}" for suffix in suffixes)
        raise InputError(
            f"expected a player's file that ends in {known or 'a known suffix'}", source=path
        )
    return load_plugin("kind of player's file", PLAYER_FILE_GROUP, path.suffix[1:])(path)
