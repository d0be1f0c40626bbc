"""Rules of the two-team game: its start, and the effect of a delivery."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, cast

import numpy as np
from gymnasium import spaces

from curling_env.envs.core import row_of
from curling_env.envs.game.action import Choices, FollowsDecisions, Sweeping, TeamDecisions
from curling_env.envs.game.core import (
    DeliveryOption,
    EvolutionOption,
    GameCore,
    GameIce,
    RulesOption,
    SkillOption,
    TeamSkillOption,
    checked_power_play,
)
from curling_env.envs.game.observation import GameObservation, ObservationKind
from curling_env.envs.game.reward import (
    GameRewardParts,
    GameRewardWeights,
    concession_parts,
    reward_parts,
)
from curling_env.envs.ices import IceOption
from curling_env.envs.options import brief, rules_from, whole_number, yes_or_no
from curling_env.errors import InputError
from curling_env.game import NO_EVOLUTION, Call, GameState, PlayedShot
from curling_env.game.rules import Team, concede, may_concede
from curling_env.game.rules.game import MOST_EXTRA_ENDS
from curling_env.game.simulator import direction_of
from curling_env.infrastructure.keywords import rejects_unknown_keywords
from curling_env.typing import Singles

TEAMS = {team.label: team for team in Team}
UNDECIDED = (TeamDecisions(), TeamDecisions())


class Match(NamedTuple):
    """Game at one moment, immutable.

    Parameters
    ----------
    ice : the ice it is played on
    state : the game itself
    thrown : number of deliveries since it began, or since a state was put back
    decisions : the last decisions of the home and the away team
    shots : the last delivery, if there was one
    states : the states before and after it, or the one at the beginning
    """

    ice: GameIce
    state: GameState
    thrown: int = 0
    decisions: tuple[TeamDecisions, TeamDecisions] = UNDECIDED
    shots: tuple[PlayedShot, ...] = ()
    states: tuple[GameState, ...] = ()

    @property
    def to_throw(self) -> Team | None:
        """Team whose turn it is; None once the game is over."""
        end = self.state.game.end
        return None if end is None else end.to_throw

    @property
    def end_played_to(self) -> Any:
        """End of the sheet played to; between ends that of the last one."""
        game = self.state.game
        return direction_of(len(game.line_score) - 1 if game.end is None else game.end.number)


@rejects_unknown_keywords("curling_v0")
class MatchCore(GameCore):
    """Options and rules of the two-team game; see `curling_v0.raw_env`."""

    def __init__(
        self,
        *,
        ice: IceOption = "standard",
        known_ice: IceOption | None = None,
        ices: Any = None,
        rules: RulesOption = "world_curling_2024",
        ends: int | None = None,
        skill: SkillOption | Sequence[TeamSkillOption] = "elite",
        ice_evolution: EvolutionOption = NO_EVOLUTION,
        sweeping: Sweeping = "none",
        delivery: DeliveryOption = "hog-line",
        choices: Choices = "rule",
        actions: str = "throws",
        observation: ObservationKind = "flat",
        weights: GameRewardWeights | Mapping[str, Any] | None = None,
        potential: Any = None,
        max_cycles: int | None = None,
        max_throws: int | None = None,
        details: bool = False,
        render_mode: str | None = None,
    ) -> None:
        for name, limit in (("ends", ends), ("max_cycles", max_cycles), ("max_throws", max_throws)):
            if limit is not None:
                whole_number(name, limit, least=1)
        alike = not isinstance(skill, Sequence) or isinstance(skill, str)
        pair = (skill, skill) if alike else tuple(cast("Sequence[TeamSkillOption]", skill))
        if len(pair) != 2:
            raise InputError(f"skill must be one for both teams or a pair, got {brief(skill)}")
        super().__init__(
            ice=ice,
            known_ice=known_ice,
            ices=ices,
            rules=rules_from(rules, ends),
            skills=pair,
            ice_evolution=ice_evolution,
            sweeping=sweeping,
            delivery=delivery,
            choices=choices,
            actions=actions,
            observation=observation,
            weights=weights,
            potential=potential,
        )
        self.render_mode, self.details = render_mode, yes_or_no("details", details)
        limits = [limit for limit in (max_throws, 2 * max_cycles if max_cycles else None) if limit]
        self._max_throws = min(limits, default=None)
        usual = self.usual.observation
        self._flat = GameObservation("flat", usual.known, usual.lines)
        self.state_space = self._flat.space
        self.team_space: spaces.Space[Any] = usual.space
        """The space of a team's observations."""
        if self.has_masks:
            size = (cast("spaces.Discrete", self.action.space).n,)
            masks = spaces.Box(0, 1, size, dtype=np.int8)
            self.team_space = spaces.Dict({"observation": usual.space, "action_mask": masks})

    # --- how a game begins and goes on ----------------------------------------------------------

    def begun(self, rng: np.random.Generator, options: Mapping[str, Any]) -> Match:
        """Return a game before its first delivery.

        Parameters
        ----------
        rng : source of all that is random in it
        options : those of `reset`; unknown ones are ignored, as PettingZoo asks

        Raises
        ------
        InputError : an invalid option
        """
        asked = dict(options)
        ice = self.ices.draw(rng, self.ices.given(asked))
        if "state" in asked:
            return self.continued(ice, self.checked_state(asked["state"]))
        power_play = checked_power_play(asked.get("power_play"))
        label = asked.get("last_stone") or list(TEAMS)[int(rng.integers(2))]
        if label not in TEAMS:
            raise InputError(f"last_stone must be 'home' or 'away', got {label!r}")
        simulator = ice.simulator
        new = simulator.new_game(int(rng.integers(2**31)), last_stone=TEAMS[label])
        throw_first = bool(asked.get("throw_first", False))
        begun = simulator.begin_end(new, power_play=power_play, throw_first=throw_first)
        return self.continued(ice, begun)

    def continued(self, ice: GameIce, state: GameState) -> Match:
        """Continue a game from a state; between two ends the next one is begun."""
        if state.game.end is None and not state.game.is_over:
            state = ice.simulator.begin_end(state)
        return Match(ice, state, states=(state,))

    def played(self, match: Match, action: Any) -> tuple[Match, dict[Team, GameRewardParts]]:
        """Return the game after a delivery, or a concession, and each team's reward.

        Raises
        ------
        InputError : an invalid action
        """
        before, thrower = match.state, match.to_throw
        assert thrower is not None
        call = self.action.call_of(action, match.ice.simulator.view(before))
        own = self.action.decisions_of(action) or TeamDecisions()
        home, away = match.decisions
        decisions = (own, away) if thrower is Team.HOME else (home, own)
        match = match._replace(decisions=decisions)
        if own.concede and may_concede(before.game, thrower):
            conceded = replace(before, game=concede(before.game, thrower))
            after = match._replace(state=conceded, shots=(), states=(conceded,))
            parts = {team: concession_parts(thrower, team) for team in Team}
        else:
            after, parts = self._delivered(match, call)
        game = after.state.game
        return after, {
            team: self.with_potential(parts[team], self.value(before.game, team), game, team)
            for team in Team
        }

    def _delivered(self, match: Match, call: Call) -> tuple[Match, dict[Team, GameRewardParts]]:
        """Play a delivery, and begin the next end after the last stone of one."""
        before, simulator = match.state, match.ice.simulator
        end = before.game.end
        assert end is not None
        chooser = FollowsDecisions(match.decisions[end.to_throw.other])
        paths = self.render_mode is not None
        after, shot = simulator.play(before, call, opponent=chooser, paths=paths)
        state, game = after, after.game
        if game.end is None and not game.is_over:
            decides = FollowsDecisions(match.decisions[game.last_stone])
            state = simulator.begin_end_as(after, decides)
        delivered = match._replace(
            state=state, thrown=match.thrown + 1, shots=(shot,), states=(before, after)
        )
        return delivered, {
            team: reward_parts(before.game, game, shot.team, shot.ruling, team) for team in Team
        }

    def is_too_long(self, match: Match) -> bool:
        """Return whether a game has all its deliveries, or too many ends without a winner."""
        game = match.state.game
        if game.is_over:
            return False
        if self._max_throws is not None and match.thrown >= self._max_throws:
            return True
        return len(game.line_score) >= match.ice.simulator.rules.ends + MOST_EXTRA_ENDS

    # --- what is seen ---------------------------------------------------------------------------

    def observed(self, match: Match, team: Team) -> Any:
        """Return the observation of a team; with its `action_mask` if actions are shots."""
        seen = match.ice.observation.observe([match.state], team, match.end_played_to)
        observation = row_of(seen, 0)
        if not self.has_masks:
            return observation
        return {"observation": observation, **self.masks(match, team)}

    def masks(self, match: Match, team: Team) -> dict[str, Any]:
        """Return `action_mask`, the shots available to a team, if actions are shots."""
        if not self.has_masks:
            return {}
        return {"action_mask": self.mask(match.ice.simulator.view(match.state, team))}

    def seen_by_all(self, match: Match) -> Singles:
        """Return all observations of a game, in `state_space`: the home team's flat observation."""
        self._flat = self._flat.on(match.ice.observation.known)
        return row_of(self._flat.observe([match.state], Team.HOME, match.end_played_to), 0)


class CallableState(GameState):
    """State of a game to keep and to continue from; a call returns PettingZoo's array of it."""

    __slots__ = ("core", "ice")
    core: MatchCore
    ice: GameIce

    @classmethod
    def of(cls, match: Match, core: MatchCore) -> CallableState:
        """Return the callable state of a game.

        Parameters
        ----------
        match : the game
        core : makes the array, on the ice of the game
        """
        state = match.state
        if isinstance(state, cls) and getattr(state, "ice", None) is match.ice:
            return state
        game = cls(
            game=state.game,
            seed=state.seed,
            throws=state.throws,
            clock=state.clock,
            wear=state.wear,
        )
        object.__setattr__(game, "core", core)  # frozen
        object.__setattr__(game, "ice", match.ice)
        return game

    def __call__(self) -> Singles:
        """Return all observations of the game, in `state_space`: the home team's flat
        observation.
        """
        return self.core.seen_by_all(Match(self.ice, self))
