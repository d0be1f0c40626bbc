"""The two-team game in PettingZoo's turn-based form: ``curling_env.curling_v0.env()``.

The agents are ``home`` and ``away``; each step is one delivery. ``parallel_env`` makes the same
game as a parallel environment, in which only the action of the team to throw counts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, cast

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from numpy.typing import ArrayLike
from pettingzoo import AECEnv  # pyright: ignore[reportMissingTypeStubs]
from pettingzoo.utils import wrappers  # pyright: ignore[reportMissingTypeStubs]
from pettingzoo.utils.conversions import (  # pyright: ignore[reportMissingTypeStubs]
    turn_based_aec_to_parallel_wrapper,
)

from curling_env.envs.core import row_of
from curling_env.envs.game.action import Choices, FollowsDecisions, Sweeping, TeamDecisions
from curling_env.envs.game.core import (
    DeliveryOption,
    EvolutionOption,
    GameCore,
    RulesOption,
    SkillOption,
    checked_power_play,
    score_of,
)
from curling_env.envs.game.observation import GameObservation, ObservationKind
from curling_env.envs.game.rendering import GameClip, GameRenderer, check_paths, clips_of
from curling_env.envs.game.reward import (
    GameRewardParts,
    GameRewardWeights,
    concession_parts,
    reward_parts,
)
from curling_env.envs.ices import IceOption
from curling_env.envs.options import brief, rules_from, whole_number
from curling_env.envs.rendering import FPS, RENDER_MODES, Screen
from curling_env.errors import InputError
from curling_env.game import NO_EVOLUTION, Call, GameSimulator, GameState, PlayedShot
from curling_env.game.rules import Team, concede, may_concede
from curling_env.game.simulator import direction_of
from curling_env.infrastructure.keywords import knows_its_options
from curling_env.typing import Image, Singles

MOST_EXTRA_ENDS = 20
"""Extra ends of a level game after which it is truncated: two teams may blank ends for ever."""
TEAMS = {team.label: team for team in Team}


def env(**settings: Any) -> wrappers.OrderEnforcingWrapper[str, Any, Any]:
    """A game between two agents, with the order of calls checked.

    Parameters
    ----------
    settings : options of `raw_env`
    """
    return wrappers.OrderEnforcingWrapper(raw_env(**settings))


def parallel_env(
    *, max_cycles: int | None = None, **settings: Any
) -> turn_based_aec_to_parallel_wrapper[str, Any, Any]:
    """The same game as a parallel environment; the action of the team not to throw is ignored.

    Parameters
    ----------
    max_cycles : number of deliveries after which the game is truncated; None for no limit
    settings : options of `raw_env`
    """
    return turn_based_aec_to_parallel_wrapper(raw_env(max_throws=max_cycles, **settings))


class CallableState(GameState):
    """A game to keep and to go on from, which when called returns PettingZoo's array of it."""

    __slots__ = ("seen",)
    seen: GameObservation

    @classmethod
    def of(cls, state: GameState, seen: GameObservation) -> CallableState:
        """A state as one that may be called.

        Parameters
        ----------
        state : the game
        seen : makes the array: flat observations on the ice of the game as it is known
        """
        if isinstance(state, cls) and getattr(state, "seen", None) is seen:
            return state
        game = cls(
            game=state.game,
            seed=state.seed,
            throws=state.throws,
            clock=state.clock,
            wear=state.wear,
        )
        object.__setattr__(game, "seen", seen)  # frozen
        return game

    def __call__(self) -> Singles:
        """All observations of the game, in `state_space`: the home team's flat observation."""
        return row_of(self.seen.observe([self], Team.HOME, end_played_to(self)), 0)


def end_played_to(state: GameState) -> Any:
    """The end of the sheet played to; between ends that of the last."""
    game = state.game
    return direction_of(len(game.line_score) - 1 if game.end is None else game.end.number)


@knows_its_options("curling_v0")
class raw_env(GameCore, AECEnv[str, Any, Any]):  # the names are PettingZoo's
    """A game of curling.

    Parameters
    ----------
    ice, known_ice, ices : the ice played on and as both teams know it, as for `CurlingSheetEnv`
    rules : a set of rules, its name, or a mapping of a name and what differs
    ends : number of ends; by default as the rules say
    skill : execution error of both teams, or a pair for the home and the away team: a name, a
        `Skill` or its fields
    ice_evolution : how the ice changes during the game: "none", "typical", or an `IceEvolution` or
        its fields
    sweeping : "none", "scripted" (sweepers decide) or "action" (part of the action)
    delivery : where throws begin: "hog-line", "tee-line", "hack" (as in Digital Curling), a
        `Delivery` or its fields
    choices : "rule" (stones are put back after a tick, there are no power plays, the deciding
        team keeps the hammer, nobody concedes) or "action" (part of the action, as decisions that
        hold until a team's next delivery)
    actions : "throws", or "shots": the number of a shot of a list, see `shots`; `infos` then have
        an `action_mask`
    observation : "flat", "dict" or "planes"
    weights : weights of the parts of the reward, or those that differ; by default the points of an
        end, at its last stone
    potential : value of positions, whose rise is part of the reward, as for `CurlingEndEnv`
    max_cycles : number of deliveries of each team after which the game is truncated, or None
    max_throws : number of deliveries of both teams after which the game is truncated, or None; a
        game that is level after `MOST_EXTRA_ENDS` extra ends is truncated as well
    render_mode : "rgb_array", "rgb_array_list" (pictures of a film of what happened), "human" (a
        window; needs the extra `viewer`) or None

    Raises
    ------
    InputError : an option that makes no sense

    Notes
    -----
    ``reset(options=…)`` takes `last_stone`, "home" or "away" (random without it), and
    `power_play`, "left" or "right", and `throw_first`, for the first end of mixed doubles; `ice`
    and `known_ice` for one game; or `state`, a `GameState` to go on from. Other options are
    ignored, as PettingZoo asks.
    ``state`` may be kept and put back at any moment.
    """

    metadata: ClassVar[dict[str, Any]] = {  # pyright: ignore[reportIncompatibleVariableOverride]
        "name": "curling_v0",
        "render_modes": list(RENDER_MODES),
        "render_fps": FPS,
    }

    def __init__(
        self,
        *,
        ice: IceOption = "standard",
        known_ice: IceOption | None = None,
        ices: Any = None,
        rules: RulesOption = "world_curling_2024",
        ends: int | None = None,
        skill: SkillOption | Sequence[SkillOption] = "elite",
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
        render_mode: str | None = None,
    ) -> None:
        AECEnv.__init__(self)  # pyright: ignore[reportUnknownMemberType]
        for name, limit in (("ends", ends), ("max_cycles", max_cycles), ("max_throws", max_throws)):
            if limit is not None:
                whole_number(name, limit, least=1)
        alike = not isinstance(skill, Sequence) or isinstance(skill, str)
        pair = (skill, skill) if alike else tuple(cast("Sequence[SkillOption]", skill))
        if len(pair) != 2:
            raise InputError(f"skill must be one for both teams or a pair, got {brief(skill)}")
        GameCore.__init__(
            self,
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
        self._ice = self.usual
        usual = self.usual.observation
        self._flat = GameObservation("flat", usual.known, usual.lines)
        self.state_space = self._flat.space
        self.render_mode = render_mode
        self.possible_agents = list(TEAMS)
        self.agents: list[str] = []
        limits = [limit for limit in (max_throws, 2 * max_cycles if max_cycles else None) if limit]
        self._max_throws = min(limits, default=None)
        space: Any = usual.space
        if self.has_masks:
            size = (cast("spaces.Discrete", self.action.space).n,)
            masks = spaces.Box(0, 1, size, dtype=np.int8)
            space = spaces.Dict({"observation": space, "action_mask": masks})
        self._spaces: dict[str, Any] = {label: space for label in TEAMS}
        self._actions: dict[str, Any] = {label: self.action.space for label in TEAMS}
        self._state: GameState | None = None
        self._thrown = 0
        self._shots: tuple[PlayedShot, ...] = ()
        call = "curling_v0.env(render_mode='rgb_array')"
        self._screen = Screen(render_mode, GameRenderer("curling_v0"), call)

    @property
    def simulator(self) -> GameSimulator:
        """What plays the throws, on the ice of this game."""
        return self._ice.simulator

    @property
    def observation(self) -> GameObservation:
        """What makes the observations, on the ice of this game as it is known."""
        return self._ice.observation

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The space of a team's observations; the same object at every call."""
        return self._spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The space of a team's actions; the same object at every call."""
        return self._actions[agent]

    @property
    def state(self) -> CallableState:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The game at this moment, frozen; set it to go on from another.

        Called as PettingZoo's method, ``state()``, it is all observations as one array in
        `state_space`.

        Raises
        ------
        InputError : before the first reset, or set to a state of a game by other rules
        """
        if self._state is None:
            raise InputError("call reset() before the first step")
        self._flat = self._flat.on(self.observation.known)
        state = self._state = CallableState.of(self._state, self._flat)
        return state

    @state.setter
    def state(self, state: GameState) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        self._begin(self.checked_state(state))

    def call_of(self, action: ArrayLike) -> Call:
        """The call an action means."""
        return self.action.call_of(action, self.simulator.view(self.state))

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        """Begin a game."""
        if seed is not None or not hasattr(self, "_rng"):
            given = None if seed is None else whole_number("seed", seed, least=0)
            self._rng, _ = seeding.np_random(given)
        options = dict(options or {})
        self._ice = self.ices.draw(self._rng, self.ices.given(options))
        if "state" in options:
            self._begin(self.checked_state(options["state"]))
            return
        power_play = checked_power_play(options.get("power_play"))
        label = options.get("last_stone") or self.possible_agents[int(self._rng.integers(2))]
        if label not in TEAMS:
            raise InputError(f"last_stone must be 'home' or 'away', got {label!r}")
        new = self.simulator.new_game(int(self._rng.integers(2**31)), last_stone=TEAMS[label])
        throw_first = bool(options.get("throw_first", False))
        self._begin(self.simulator.begin_end(new, power_play=power_play, throw_first=throw_first))

    def _begin(self, state: GameState) -> None:
        """Set PettingZoo's attributes at the beginning, or where a state was put back."""
        if state.game.end is None and not state.game.is_over:
            state = self.simulator.begin_end(state)
        self._state = state
        self._thrown, self._shots, self._states = 0, (), (state,)
        self._decisions = [TeamDecisions(), TeamDecisions()]
        self._screen.begin(self._clips())
        self.agents = list(TEAMS)
        self.rewards = dict.fromkeys(TEAMS, 0.0)
        self._cumulative_rewards = dict.fromkeys(TEAMS, 0.0)
        self.terminations = dict.fromkeys(TEAMS, state.game.is_over)
        self.truncations = dict.fromkeys(TEAMS, False)
        self.infos: dict[str, dict[str, Any]] = {label: self._masks(label) for label in TEAMS}
        end = state.game.end
        self.agent_selection = self.agents[0] if end is None else end.to_throw.label

    def step(self, action: Any) -> None:
        """Deliver a stone."""
        before, agent = self.state, self.agent_selection
        if self.terminations[agent] or self.truncations[agent]:
            self._was_dead_step(action)
            return
        thrower = TEAMS[agent]
        call = self.action.call_of(action, self.simulator.view(before))
        decisions = self.action.decisions_of(action) or TeamDecisions()
        self._decisions[thrower] = decisions
        self._cumulative_rewards[agent] = 0.0
        if decisions.concede and may_concede(before.game, thrower):
            self._shots, self._state = (), replace(before, game=concede(before.game, thrower))
            parts = {team: concession_parts(thrower, team) for team in Team}
        else:
            parts = self._deliver(before, call)
        after = self.state.game
        self.rewards, self.infos = {}, {}
        for label, team in TEAMS.items():
            held = self.value(before.game, team)
            earned = self.with_potential(parts[team], held, after, team)
            self.rewards[label] = self.weights.total(earned)
            self.infos[label] = {"shots": self._shots, "reward_parts": earned.as_dict()}
            if len(after.line_score) > len(before.game.line_score):
                self.infos[label]["score"] = score_of(after, team)
            self.infos[label] |= self._masks(label)
        too_long = not after.is_over and self._is_too_long()
        self.terminations = dict.fromkeys(self.agents, after.is_over)
        self.truncations = dict.fromkeys(self.agents, too_long)
        end = after.end
        self.agent_selection = thrower.other.label if end is None else end.to_throw.label
        self._accumulate_rewards()

    def _deliver(self, before: GameState, call: Call) -> dict[Team, GameRewardParts]:
        """Play a delivery, and begin the next end after the last stone of one."""
        end = before.game.end
        assert end is not None
        chooser = FollowsDecisions(self._decisions[end.to_throw.other])
        paths = self.render_mode is not None
        after, shot = self.simulator.play(before, call, opponent=chooser, paths=paths)
        self._shots, self._states = (shot,), (before, after)
        self._screen.add(self._clips())
        self._thrown += 1
        self._state, game = after, after.game
        if game.end is None and not game.is_over:
            decides = FollowsDecisions(self._decisions[game.last_stone])
            self._state = self.simulator.begin_end_as(after, decides)
        return {
            team: reward_parts(before.game, game, shot.team, shot.ruling, team) for team in Team
        }

    def _is_too_long(self) -> bool:
        """True for a game with all its deliveries, or of too many ends without a winner."""
        if self._max_throws is not None and self._thrown >= self._max_throws:
            return True
        return len(self.state.game.line_score) >= self.simulator.rules.ends + MOST_EXTRA_ENDS

    def observe(self, agent: str) -> Any:
        """What a team observes; where actions are shots, with its `action_mask`."""
        state = self.state
        seen = self.observation.observe([state], TEAMS[agent], end_played_to(state))
        observation = row_of(seen, 0)
        return {"observation": observation, **self._masks(agent)} if self.has_masks else observation

    def _masks(self, agent: str) -> dict[str, Any]:
        """`action_mask`, the shots that a team has, where actions are shots."""
        if not self.has_masks:
            return {}
        return {"action_mask": self.mask(self.simulator.view(self.state, TEAMS[agent]))}

    def render(self) -> Any:
        """The sheet from above as an RGB picture, with the paths of the last delivery on it.

        With the render mode ``rgb_array_list``, the pictures of a film of the deliveries since the
        last call, at `metadata["render_fps"]` a second and four times as fast as they were.
        """
        return self._screen.render(self._clips()[-1])

    def frames(self, speed: float = 1.0) -> Iterator[Image]:
        """The last delivery as a film: pictures at `metadata["render_fps"]`.

        Parameters
        ----------
        speed : how many times faster than it happened it is shown

        Raises
        ------
        InputError : the environment has no render mode, and so has kept no paths
        """
        check_paths(self.render_mode)
        yield from self._screen.frames(self._clips(), speed)

    def close(self) -> None:
        """Close the window, if there is one."""
        self._screen.close()

    def _clips(self) -> list[GameClip]:
        return clips_of(self.simulator.known_ice, self._states, self._shots)
