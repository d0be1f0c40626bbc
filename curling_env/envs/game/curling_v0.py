"""The two-team game in PettingZoo's turn-based form: ``curling_env.curling_v0.env()``.

The agents are ``home`` and ``away``; each step is one delivery. ``parallel_env`` makes the same
game as a parallel environment, in which only the action of the team to throw counts.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import gymnasium
from gymnasium import spaces
from gymnasium.utils import seeding
from numpy.typing import ArrayLike
from pettingzoo import AECEnv  # pyright: ignore[reportMissingTypeStubs]
from pettingzoo.utils import wrappers  # pyright: ignore[reportMissingTypeStubs]
from pettingzoo.utils.conversions import (  # pyright: ignore[reportMissingTypeStubs]
    turn_based_aec_to_parallel_wrapper,
)

from curling_env.envs.game.action import (
    Choices,
    FollowsDecisions,
    GameAction,
    Sweeping,
    TeamDecisions,
)
from curling_env.envs.game.observation import GameObservation, ObservationKind
from curling_env.envs.game.rendering import GameRenderer
from curling_env.envs.game.reward import GameRewardWeights, concession_parts, reward_parts
from curling_env.envs.rendering import FPS, RENDER_MODES, check_render_mode
from curling_env.envs.sheet.action import throw_range_for
from curling_env.errors import InputError
from curling_env.game import NO_EVOLUTION, Call, GameSimulator, GameState, IceEvolution, PlayedShot
from curling_env.game.rules import RuleSet, Team, concede, may_concede, rule_set
from curling_env.game.simulator import direction_of
from curling_env.ice import Ice
from curling_env.sheet import Direction
from curling_env.throw import Delivery, Skill, delivery_named
from curling_env.typing import Image, Singles


def env(**settings: Any) -> TurnBasedGame:
    """A game between two agents, with the order of calls checked.

    Parameters
    ----------
    settings : options of `raw_env`
    """
    return TurnBasedGame(raw_env(**settings))


def parallel_env(*, max_cycles: int | None = None, **settings: Any) -> ParallelGame:
    """The same game as a parallel environment; the action of the team not to throw is ignored.

    Parameters
    ----------
    max_cycles : number of deliveries after which the game is truncated; None for no limit
    settings : options of `raw_env`
    """
    return ParallelGame(raw_env(max_throws=max_cycles, **settings))


class TurnBasedGame(wrappers.OrderEnforcingWrapper[str, Any, Any]):
    """The game, with the order of calls checked."""

    def state(self) -> Singles:
        """All observations of the game as one array in `state_space`, whoever throws.

        ``unwrapped.state`` is the game itself, to keep and to go on from.
        """
        game = self.unwrapped
        assert isinstance(game, raw_env)
        return game.as_array()


class ParallelGame(turn_based_aec_to_parallel_wrapper[str, Any, Any]):
    """The game with the actions of both teams at every step."""

    def state(self) -> Singles:
        """All observations of the game as one array in `state_space`, whoever throws."""
        game = self.unwrapped
        assert isinstance(game, raw_env)
        return game.as_array()


class raw_env(AECEnv[str, Any, Any]):  # the names are PettingZoo's
    """A game of curling.

    Parameters
    ----------
    ice : the ice played on: an `Ice`, a file or a preset
    known_ice : the ice as both teams know it; the ice played on by default
    rules : a set of rules or its name
    ends : number of ends; by default as the rules say
    skill : execution error of both teams, or of the home and the away team
    ice_evolution : how the ice changes during the game
    sweeping : "none", "scripted" (sweepers decide) or "action" (part of the action)
    delivery : where throws begin: "hog-line", "hack" (as in Digital Curling) or a `Delivery`
    choices : "rule" (stones are put back after a tick, there are no power plays, the deciding
        team keeps the hammer, nobody concedes) or "action" (part of the action, as decisions that
        hold until a team's next delivery)
    observation : "flat", "dict" or "planes"
    weights : weights of the parts of the reward; by default the points of an end, at its last
        stone
    max_cycles : number of deliveries of each team after which the game is truncated, or None
    max_throws : number of deliveries of both teams after which the game is truncated, or None
    render_mode : "rgb_array", "human" (a window; needs the extra `viewer`) or None

    Raises
    ------
    InputError : an option that makes no sense

    Notes
    -----
    ``reset(options=…)`` takes `last_stone`, "home" or "away" (random without it), and
    `power_play`, "left" or "right", and `throw_first`, for the first end of mixed doubles; or
    `state`, a `GameState` to go on from. Other options are ignored, as PettingZoo asks.
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
        ice: Ice | str | Path = "standard",
        known_ice: Ice | str | Path | None = None,
        rules: str | RuleSet = "world_curling_2024",
        ends: int | None = None,
        skill: str | Skill | tuple[str | Skill, str | Skill] = "elite",
        ice_evolution: IceEvolution = NO_EVOLUTION,
        sweeping: Sweeping = "none",
        delivery: str | Delivery = "hog-line",
        choices: Choices = "rule",
        observation: ObservationKind = "flat",
        weights: GameRewardWeights | None = None,
        max_cycles: int | None = None,
        max_throws: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        super().__init__()
        check_render_mode(render_mode)
        for name, limit in (("max_cycles", max_cycles), ("max_throws", max_throws)):
            if limit is not None and limit < 1:
                raise InputError(f"{name} must be at least 1, got {limit}")
        self.simulator = GameSimulator(
            ice,
            known_ice=known_ice,
            rules=rule_set(rules) if ends is None else rule_set(rules, ends=ends),
            skills=skill,
            ice_evolution=ice_evolution,
            sweeping=sweeping != "none",
            delivery=delivery_named(delivery),
        )
        self.action = GameAction(
            throw_range_for(
                self.simulator.known_ice,
                Direction.AWAY,
                hits=True,
                delivery=self.simulator.delivery,
            ),
            sweeping,
            choices,
        )
        self.observation = GameObservation(
            observation, self.simulator.known_ice, self.simulator.lines
        )
        self._flat = GameObservation("flat", self.simulator.known_ice, self.simulator.lines)
        self.state_space = self._flat.space
        self.weights = weights or GameRewardWeights()
        self.render_mode = render_mode
        self.possible_agents = [team.label for team in Team]
        self.agents: list[str] = []
        limits = [limit for limit in (max_throws, 2 * max_cycles if max_cycles else None) if limit]
        self._max_throws = min(limits, default=None)
        self._spaces = {label: self.observation.space for label in self.possible_agents}
        self._actions = {label: self.action.space for label in self.possible_agents}
        self._state: GameState | None = None
        self._thrown = 0
        self._last: PlayedShot | None = None
        self._renderer = GameRenderer(self.simulator.known_ice, "curling_v0")

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The space of a team's observations; the same object at every call."""
        return self._spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The space of a team's actions; the same object at every call."""
        return self._actions[agent]

    @property
    def state(self) -> GameState:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The game at this moment, frozen; set it to go on from another.

        PettingZoo's own method of this name belongs to the environments that `env` and
        `parallel_env` make; here the array is `as_array`.

        Raises
        ------
        InputError : before the first reset, or set to a state of a game by other rules
        """
        if self._state is None:
            raise InputError("call reset() before the first step")
        return self._state

    @state.setter
    def state(self, state: GameState) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        self._go_on_from(state)

    def as_array(self) -> Singles:
        """All observations of the game, in `state_space`: the home team's flat observation."""
        return self._flat.observe(self.state.game, Team.HOME, self._end_played_to())

    def _go_on_from(self, state: GameState) -> None:
        if state.game.rules != self.simulator.rules:
            raise InputError("a state must be of a game by this environment's rules")
        if state.game.end is None and not state.game.is_over:
            state = self.simulator.begin_end(state)
        self._state, self._last = state, None
        self._begin()

    def call_of(self, action: ArrayLike) -> Call:
        """The call an action means."""
        return self.action.call_of(action)

    def action_of(self, call: Call) -> Singles:
        """The action that means a call; clipped where it is out of range."""
        return self.action.action_of(call)

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        """Begin a game."""
        if seed is not None or not hasattr(self, "_rng"):
            self._rng, _ = seeding.np_random(seed)
        options = options or {}
        if "state" in options:
            self._go_on_from(options["state"])
            return
        label = options.get("last_stone") or self.possible_agents[int(self._rng.integers(2))]
        if label not in self.possible_agents:
            raise InputError(f"last_stone must be 'home' or 'away', got {label!r}")
        new = self.simulator.new_game(
            int(self._rng.integers(2**31)), last_stone=Team(self.possible_agents.index(label))
        )
        self._state = self.simulator.begin_end(
            new,
            power_play=options.get("power_play"),
            throw_first=bool(options.get("throw_first", False)),
        )
        self._last = None
        self._begin()

    def _begin(self) -> None:
        """Set PettingZoo's attributes at the beginning, or where a state was put back."""
        over = self.state.game.is_over
        self._shown = self.state
        self._thrown = 0
        self._decisions = [TeamDecisions(), TeamDecisions()]
        if self.render_mode == "human":
            self._renderer.show_position(self.state)
        self.agents = list(self.possible_agents)
        self.rewards = dict.fromkeys(self.agents, 0.0)
        self._cumulative_rewards = dict.fromkeys(self.agents, 0.0)
        self.terminations = dict.fromkeys(self.agents, over)
        self.truncations = dict.fromkeys(self.agents, False)
        self.infos: dict[str, dict[str, Any]] = {label: {} for label in self.agents}
        self.agent_selection = self._to_act()

    def _to_act(self) -> str:
        end = self.state.game.end
        return self.agents[0] if end is None else end.to_throw.label

    def step(self, action: Any) -> None:
        """Deliver a stone."""
        agent = self.agent_selection
        if self.terminations[agent] or self.truncations[agent]:
            self._was_dead_step(action)
            return
        before = self.state
        paths = self.render_mode is not None
        call, decisions = self.action.call_of(action), self.action.decisions_of(action)
        thrower = Team(self.possible_agents.index(agent))
        self._decisions[thrower] = decisions or TeamDecisions()
        if self._decisions[thrower].concede and may_concede(before.game, thrower):
            self._concede(thrower)
            return
        chooser = FollowsDecisions(self._decisions[thrower.other])
        after, shot = self.simulator.play(before, call, opponent=chooser, paths=paths)
        self._shown = after
        if self.render_mode == "human":
            self._renderer.show(before, after, shot)
        self._thrown += 1
        self._cumulative_rewards[agent] = 0.0
        for label in self.agents:
            team = Team(self.possible_agents.index(label))
            parts = reward_parts(before.game, after.game, shot.team, shot.ruling, team)
            self.rewards[label] = self.weights.total(parts)
            self.infos[label] = {"shot": shot, "reward_parts": parts.as_dict()}
        over = after.game.is_over
        if after.game.end is None and not over:
            after = self.simulator.begin_end_as(
                after, FollowsDecisions(self._decisions[after.game.last_stone])
            )
        self._state, self._last = after, shot
        truncated = self._max_throws is not None and self._thrown >= self._max_throws and not over
        self.terminations = dict.fromkeys(self.agents, over)
        self.truncations = dict.fromkeys(self.agents, truncated)
        self.agent_selection = self._to_act() if not over else shot.team.other.label
        self._accumulate_rewards()

    def _concede(self, team: Team) -> None:
        """End the game: the other team has won."""
        self._state = replace(self.state, game=concede(self.state.game, team))
        self._cumulative_rewards[team.label] = 0.0
        for label in self.agents:
            parts = concession_parts(team, Team(self.possible_agents.index(label)))
            self.rewards[label] = self.weights.total(parts)
            self.infos[label] = {"reward_parts": parts.as_dict()}
        self.terminations = dict.fromkeys(self.agents, True)
        self.agent_selection = team.other.label
        self._accumulate_rewards()

    def observe(self, agent: str) -> Any:
        """What a team sees."""
        state = self.state
        team = Team(self.possible_agents.index(agent))
        return self.observation.observe(state.game, team, self._end_played_to())

    def _end_played_to(self) -> Direction:
        game = self.state.game
        return direction_of(len(game.line_score) - 1 if game.end is None else game.end.number)

    def render(self) -> Image | None:
        """The sheet from above as an RGB picture, with the paths of the last delivery on it."""
        if self.render_mode is None:
            gymnasium.logger.warn(
                "render() needs a render_mode: curling_v0.env(render_mode='rgb_array')"
            )
        if self.render_mode != "rgb_array":
            return None
        return self._renderer.picture(self._shown, self._last)

    def close(self) -> None:
        """Close the window, if there is one."""
        self._renderer.close()
