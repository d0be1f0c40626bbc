"""Common parts of `CurlingEnd-v0` and the two-team game: actions, rewards, masks, the ice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.envs.field import Field
from curling_env.envs.game.action import Choices, GameAction, Sweeping
from curling_env.envs.game.observation import GameObservation, ObservationKind
from curling_env.envs.game.potential import potential_from
from curling_env.envs.game.reward import GameRewardParts, GameRewardWeights
from curling_env.envs.game.shots import ShotActions
from curling_env.envs.ices import EpisodeIces, IceOption
from curling_env.envs.known_ice import KnownIce
from curling_env.envs.options import (
    dataclass_from,
    delivery_from,
    evolution_from,
    one_of,
    players_from,
)
from curling_env.envs.sheet.action import widest_range
from curling_env.errors import InputError, placed
from curling_env.game import (
    Call,
    GameSimulator,
    GameState,
    IceEvolution,
    PlayerView,
)
from curling_env.game.ice_evolution import ice_for_game
from curling_env.game.rules import RuleSet, Team
from curling_env.game.rules.game import Game
from curling_env.game.simulator import direction_of, skill_by_stone
from curling_env.ice import Ice
from curling_env.physics.tuning import QUICK_TOLERANCE
from curling_env.throw import Delivery, Skill
from curling_env.typing import Singles

SkillOption = str | Skill | Mapping[str, Any]
TeamSkillOption = SkillOption | Sequence[SkillOption]
"""One skill for a team, or one for each of its players."""
EvolutionOption = str | IceEvolution | Mapping[str, Any]
RulesOption = str | RuleSet | Mapping[str, Any]
DeliveryOption = str | Delivery | Mapping[str, Any]

DIRECTION = direction_of(0)
"""End of the sheet played to in the first end of a game."""


class GameIce:
    """Ice of a game, with its simulator and its maker of observations.

    Parameters
    ----------
    simulator : plays single throws
    observation : makes the observations, on the ice as it is known
    """

    def __init__(self, simulator: GameSimulator, observation: GameObservation) -> None:
        self.simulator, self.observation = simulator, observation

    @cached_property
    def field(self) -> Field:
        """Simulator of the throws of many first ends together, on ice that does not wear."""
        simulator = self.simulator
        evolution = simulator.ice_evolution
        return Field(ice_for_game(simulator.ice, evolution, 0, sweeping=simulator.sweeping))


class GameCore:
    """Common options and rules of both environments of games.

    Parameters
    ----------
    ice, known_ice, ices : the ice of every game, see `EpisodeIces`
    rules : the rules
    skills : execution errors of the home and the away team, or of the players of each
    ice_evolution, sweeping, delivery, choices, actions, observation, weights, potential : see
        `CurlingEndEnv`

    Raises
    ------
    InputError : an invalid option
    """

    def __init__(
        self,
        *,
        ice: IceOption,
        known_ice: IceOption | None,
        ices: Any,
        rules: RuleSet,
        skills: tuple[Any, Any],
        ice_evolution: EvolutionOption,
        sweeping: Sweeping,
        delivery: DeliveryOption,
        choices: Choices,
        actions: str,
        observation: ObservationKind,
        weights: GameRewardWeights | Mapping[str, Any] | None,
        potential: Any,
    ) -> None:
        evolution = evolution_from(ice_evolution)
        home, away = (players_from("skill", skill) for skill in skills)
        with placed(where="skill"):
            throwers = skill_by_stone(rules, home), skill_by_stone(rules, away)
        is_swept = sweeping != "none"
        self._settings: dict[str, Any] = {
            "rules": rules,
            "skills": (home[0], away[0]),
            "throwers": throwers,
            "ice_evolution": evolution,
            "sweeping": is_swept,
            "delivery": delivery_from(delivery),
            # The tolerance of ends that are simulated together, so that both give the same ends.
            "tolerance": QUICK_TOLERANCE,
        }
        self._observation: GameObservation | None = None
        self._kind: ObservationKind = observation
        # The future change of the ice is observed; the stones' own factors are drawn for every
        # game.
        lasting = replace(evolution, stone_spread=0.0)
        observed = partial(ice_for_game, evolution=lasting, seed=0, sweeping=is_swept)
        self.ices = EpisodeIces(ice, known_ice, ices, make=self._on, observed=observed)
        self.usual = self.ices.on(self.ices.usual, self.ices.known[0])
        """The ice of every game, or one like those of the games."""
        delivery = self.usual.simulator.delivery
        throws = GameAction(
            widest_range(self.ices.known, hits=True, delivery=delivery), sweeping, choices
        )
        with_shots = one_of("actions", actions, ("throws", "shots")) == "shots"
        if with_shots and "action" in (sweeping, choices):
            raise InputError("sweeping and choices as actions need actions='throws', got 'shots'")
        self.action: GameAction | ShotActions = ShotActions() if with_shots else throws
        self.weights = dataclass_from(
            GameRewardWeights, "weights", GameRewardWeights() if weights is None else weights
        )
        self.potential = potential_from(potential)

    def _on(self, ice: Ice, known: KnownIce) -> GameIce:
        simulator = GameSimulator(ice, known_ice=known.ice, **self._settings)
        # All observations are on the scale of the usual ice.
        usual = self._observation or GameObservation(self._kind, known, simulator.lines)
        self._observation = usual.on(known)
        return GameIce(simulator, self._observation)

    def action_of(self, call: Call) -> Singles:
        """Return the action of a call, clipped to the range."""
        return self.action.action_of(call)

    def observation_of(self, view: PlayerView) -> Any:
        """Return the observation of a team with this view, on its known ice."""
        seen = self._observation or self.usual.observation
        if view.ice is not seen.known.ice:
            self._observation = seen = seen.on(self.ices.known_as(view.ice))
        return seen.of_view(view)

    def checked_state(self, state: Any) -> GameState:
        """Check a state to continue from.

        Raises
        ------
        InputError : something else, or a game by other rules
        """
        if not isinstance(state, GameState):
            raise InputError(f"state must be a GameState, as env.unwrapped.state, got {state!r}")
        if state.game.rules != self.usual.simulator.rules:
            raise InputError("a state must be of a game by this environment's rules")
        return state

    def value(self, game: Game, team: Team) -> float:
        """Return the potential of a game to a team; 0 without that option."""
        return self.potential.value(game, team) if self.potential else 0.0

    def with_potential(
        self, parts: GameRewardParts, before: float, game: Game, team: Team
    ) -> GameRewardParts:
        """Return the parts of a reward with the rise of the potential from `before` to that of a
        game.
        """
        if not self.potential:
            return parts
        return replace(parts, potential=self.potential.rise(before, game, team))

    def mask(self, view: PlayerView) -> NDArray[np.int8]:
        """Return which shots are available to a team, 1 or 0 each.

        Raises
        ------
        InputError : actions are throws, which are always available
        """
        if not isinstance(self.action, ShotActions):
            raise InputError("only shots have a mask: make the environment with actions='shots'")
        return self.action.mask(view)

    @property
    def has_masks(self) -> bool:
        """True if actions are shots, which are not always all available."""
        return isinstance(self.action, ShotActions)


def checked_power_play(side: Any) -> Any:
    """Check the side of a power play in a reset, or None.

    Raises
    ------
    InputError : something else
    """
    return None if side is None else one_of("power_play", side, ("left", "right"))


def score_of(game: Game, team: Team) -> tuple[int, int]:
    """Return the points of the last end, a team's own first."""
    points = game.line_score[-1]
    return points[team], points[team.other]
