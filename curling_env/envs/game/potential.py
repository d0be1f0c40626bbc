"""Reward shaping: the increase of the position's potential by a delivery.

The points of an end come only with its last stone. A potential, such as the expected points, shows
earlier how good a delivery was. Because the additional reward is a difference of potentials,
optimal policies stay optimal (Ng, Harada and Russell, ICML 1999).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

from curling_env.envs.options import brief, dataclass_from, number
from curling_env.errors import InputError
from curling_env.game.rules.game import Game
from curling_env.game.rules.teams import Team
from curling_env.infrastructure.plugins import load_plugin, plugin_names

POTENTIAL_GROUP = "curling.potentials"
"""The entry-point group of potentials: functions of a game and a team."""

PotentialFunction = Callable[[Game, Team], float]


@dataclass(frozen=True, kw_only=True)
class Potential:
    """Potential of positions, and the discount of later rewards.

    Parameters
    ----------
    of : value of a game to a team; a function, a declared name, or ``module:function``
    discount : discount of the learner; only with the same one here the best policies stay the best

    Raises
    ------
    InputError : an unknown name, something that is no function, or a discount beyond 0 and 1
    """

    of: PotentialFunction | str
    discount: float = 1.0

    def __post_init__(self) -> None:
        number("the discount of potential", self.discount, above=0.0, most=1.0)
        if isinstance(self.of, str):
            found = load_plugin("potential", POTENTIAL_GROUP, self.of, form="module:function")
            object.__setattr__(self, "of", found)
        if not callable(self.of):
            raise InputError(
                f"potential must be a function of a game and a team, or one of "
                f"{', '.join(plugin_names(POTENTIAL_GROUP))}, got {brief(self.of)}"
            )

    def value(self, game: Game, team: Team) -> float:
        """Return the potential of a game to a team; 0 if no end is in play."""
        return 0.0 if game.end is None else float(cast("PotentialFunction", self.of)(game, team))

    def rise(self, before: float, game: Game, team: Team) -> float:
        """Return the reward for a rise: the discounted potential of a game minus that before."""
        return self.discount * self.value(game, team) - before


def potential_from(given: Any) -> Potential | None:
    """Return a potential: None, a name, a function, a `Potential`, or a mapping of its fields."""
    if given is None or isinstance(given, Potential):
        return given
    if isinstance(given, Mapping):
        return dataclass_from(Potential, "potential", given)
    return Potential(of=given)
