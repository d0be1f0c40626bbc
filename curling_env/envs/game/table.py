"""What `CurlingEnd-v0` and the two-team game are both made of, from their options."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from curling_env.envs.game.action import Choices, GameAction, Sweeping
from curling_env.envs.game.observation import GameObservation, ObservationKind
from curling_env.envs.game.shots import ShotActions, checked_actions, mask_of
from curling_env.envs.ices import EpisodeIces, GivenIce, IceOption
from curling_env.envs.known_ice import KnownIce
from curling_env.envs.options import delivery_from, evolution_from, skill_from
from curling_env.envs.sheet.action import widest_range
from curling_env.game import GameSimulator, IceEvolution, PlayerView
from curling_env.game.ice_evolution import ice_for_game
from curling_env.game.rules import RuleSet
from curling_env.ice import Ice
from curling_env.physics.tuning import QUICK_TOLERANCE
from curling_env.throw import Delivery, Skill

SkillOption = str | Skill | Mapping[str, Any]
EvolutionOption = str | IceEvolution | Mapping[str, Any]
RulesOption = str | RuleSet | Mapping[str, Any]
DeliveryOption = str | Delivery | Mapping[str, Any]


class GameTable:
    """The simulator of games, their actions and their observations.

    Parameters
    ----------
    ice, known_ice, ices : the ice of every game, see `EpisodeIces`
    rules : the rules
    skills : execution errors of the home and the away team
    ice_evolution, sweeping, delivery, choices, observation, actions : options of the environments

    Raises
    ------
    InputError : an option that makes no sense
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
        observation: ObservationKind,
        actions: str = "throws",
    ) -> None:
        evolution = evolution_from(ice_evolution)
        lasting = replace(evolution, stone_spread=0.0)
        is_swept = sweeping != "none"

        told = partial(ice_for_game, evolution=lasting, seed=0, sweeping=is_swept)
        self.ices = EpisodeIces(ice, known_ice, ices, told=told)
        self._settings: dict[str, Any] = {
            "rules": rules,
            "skills": tuple(skill_from("skill", skill) for skill in skills),
            "ice_evolution": evolution,
            "sweeping": is_swept,
            "delivery": delivery_from(delivery),
            # As exact as many ends side by side, so that both play the same ends.
            "tolerance": QUICK_TOLERANCE,
        }
        # Those on ices that come again: ends that share one are simulated together.
        self._kept: dict[tuple[int, int], tuple[GameSimulator, GameObservation]] = {}
        known = self.ices.known_as(self.ices.known[0])
        self.simulator = self._simulator_on(self.ices.usual, known.ice)
        throws = widest_range(self.ices.known, hits=True, delivery=self.simulator.delivery)
        usual = GameAction(throws, sweeping, choices)
        with_shots = checked_actions(actions, sweeping, choices) == "shots"
        self.action: GameAction | ShotActions = ShotActions() if with_shots else usual
        self.observation = GameObservation(observation, known, self.simulator.lines)

    def draw(self, rng: np.random.Generator, given: GivenIce = (None, None)) -> None:
        """Take the ice of a game that begins; `simulator` and `observation` are then those on it.

        Parameters
        ----------
        rng : source of the randomness
        given : the ice that `reset` was asked for
        """
        self.play_on(*self.ices.draw(rng, given))

    def play_on(self, ice: Ice, known: KnownIce) -> None:
        """Take an ice, and what the teams are told of it."""
        if ice is self.simulator.ice and known is self.observation.known:
            return
        key = (id(ice), id(known))
        kept = self._kept.get(key)
        if kept is None:
            kept = (self._simulator_on(ice, known.ice), self.observation.on(known))
            if self.ices.lasts(ice, known):
                self._kept[key] = kept
        self.simulator, self.observation = kept

    def observation_of(self, known: Ice) -> GameObservation:
        """The observations of a team that knows the ice so."""
        if known is self.observation.known.ice:
            return self.observation
        return self.observation.on(self.ices.known_as(known))

    def mask(self, view: PlayerView) -> dict[str, Any]:
        """For `info`: `action_mask`, the shots that a team has, where actions are shots."""
        mask = mask_of(self.action, view)
        return {} if mask is None else {"action_mask": mask}

    def _simulator_on(self, ice: Ice, known: Ice) -> GameSimulator:
        return GameSimulator(ice, known_ice=known, **self._settings)
