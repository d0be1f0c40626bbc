"""The two-team game in PettingZoo's turn-based form: ``curling_env.curling_v0.env()``.

The agents are ``home`` and ``away``; each step is one delivery. ``parallel_env`` makes the same
game as a parallel environment, in which only the action of the team to throw counts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, cast

import gymnasium
from gymnasium import spaces
from gymnasium.utils import seeding
from numpy.typing import ArrayLike
from pettingzoo import AECEnv  # pyright: ignore[reportMissingTypeStubs]
from pettingzoo.utils import wrappers  # pyright: ignore[reportMissingTypeStubs]
from pettingzoo.utils.conversions import (  # pyright: ignore[reportMissingTypeStubs]
    turn_based_aec_to_parallel_wrapper,
)

from curling_env.envs.game.action import Choices, FollowsDecisions, Sweeping, TeamDecisions
from curling_env.envs.game.observation import GameObservation, ObservationKind
from curling_env.envs.game.potential import potential_from
from curling_env.envs.game.rendering import Delivered, GameRenderer
from curling_env.envs.game.reward import GameRewardWeights, concession_parts, reward_parts
from curling_env.envs.game.table import (
    DeliveryOption,
    EvolutionOption,
    GameTable,
    RulesOption,
    SkillOption,
)
from curling_env.envs.ices import IceOption
from curling_env.envs.options import brief, dataclass_from, one_of, rules_from, whole_number
from curling_env.envs.rendering import FILM_SPEED, FPS, RENDER_MODES, check_render_mode
from curling_env.errors import InputError
from curling_env.game import NO_EVOLUTION, Call, GameSimulator, GameState, PlayedShot
from curling_env.game.rules import Team, concede, may_concede
from curling_env.game.simulator import direction_of
from curling_env.infrastructure.keywords import knows_its_options
from curling_env.sheet import Direction
from curling_env.typing import Image, Singles

MOST_EXTRA_ENDS = 20
"""Extra ends of a level game after which it is truncated: two teams may blank ends for ever."""


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


@knows_its_options("curling_v0")
class raw_env(AECEnv[str, Any, Any]):  # the names are PettingZoo's
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
        super().__init__()
        check_render_mode(render_mode)
        for name, limit in (("ends", ends), ("max_cycles", max_cycles), ("max_throws", max_throws)):
            if limit is not None:
                whole_number(name, limit, least=1)
        alike = not isinstance(skill, Sequence) or isinstance(skill, str)
        pair = (skill, skill) if alike else tuple(cast("Sequence[SkillOption]", skill))
        if len(pair) != 2:
            raise InputError(f"skill must be one for both teams or a pair, got {brief(skill)}")
        self.table = GameTable(
            ice=ice,
            known_ice=known_ice,
            ices=ices,
            rules=rules_from(rules, ends),
            skills=pair,
            ice_evolution=ice_evolution,
            sweeping=sweeping,
            delivery=delivery,
            choices=choices,
            observation=observation,
            actions=actions,
        )
        self.action = self.table.action
        self.weights = dataclass_from(
            GameRewardWeights, "weights", GameRewardWeights() if weights is None else weights
        )
        self.potential = potential_from(potential)
        self._flat = GameObservation("flat", self.observation.known, self.simulator.lines)
        self.state_space = self._flat.space
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
        self._film: list[Delivered] = []
        self._renderer = GameRenderer(self.simulator.known_ice, "curling_v0")

    @property
    def simulator(self) -> GameSimulator:
        """What plays the throws, on the ice of this game."""
        return self.table.simulator

    @property
    def observation(self) -> GameObservation:
        """What makes the observations, on the ice of this game as it is known."""
        return self.table.observation

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
        flat = self._flat if self._flat.known is self.observation.known else None
        if flat is None:
            flat = self._flat = self._flat.on(self.observation.known)
        return self._observed(flat, Team.HOME)

    def _go_on_from(self, state: Any) -> None:
        if not isinstance(state, GameState):
            raise InputError(f"state must be a GameState, as env.unwrapped.state, got {state!r}")
        if state.game.rules != self.simulator.rules:
            raise InputError("a state must be of a game by this environment's rules")
        if state.game.end is None and not state.game.is_over:
            state = self.simulator.begin_end(state)
        self._state, self._last = state, None
        self._begin()

    def call_of(self, action: ArrayLike) -> Call:
        """The call an action means."""
        return self.action.call_of(action, self.simulator.view(self.state))

    def action_of(self, call: Call) -> Singles:
        """The action that means a call; clipped where it is out of range."""
        return self.action.action_of(call)

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        """Begin a game."""
        if seed is not None or not hasattr(self, "_rng"):
            given = None if seed is None else whole_number("seed", seed, least=0)
            self._rng, _ = seeding.np_random(given)
        options = dict(options or {})
        self.table.draw(self._rng, self.table.ices.given(options))
        self._renderer.ice = self.simulator.known_ice
        if "state" in options:
            self._go_on_from(options["state"])
            return
        if options.get("power_play") is not None:
            one_of("power_play", options["power_play"], ("left", "right"))
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
        self._film, self._last_step = [], []
        self._decisions = [TeamDecisions(), TeamDecisions()]
        if self.render_mode == "human":
            self._renderer.show_position(self.state)
        self.agents = list(self.possible_agents)
        self.rewards = dict.fromkeys(self.agents, 0.0)
        self._cumulative_rewards = dict.fromkeys(self.agents, 0.0)
        self.terminations = dict.fromkeys(self.agents, over)
        self.truncations = dict.fromkeys(self.agents, False)
        self.infos: dict[str, dict[str, Any]] = {label: {} for label in self.agents}
        self._tell_masks()
        self.agent_selection = self._to_act()

    def _tell_masks(self) -> None:
        """Put `action_mask` into the infos, where actions are shots."""
        for label in self.agents:
            team = Team(self.possible_agents.index(label))
            self.infos[label] |= self.table.mask(self.simulator.view(self.state, team))

    def _to_act(self) -> str:
        end = self.state.game.end
        return self.agents[0] if end is None else end.to_throw.label

    def step(self, action: Any) -> None:
        """Deliver a stone."""
        if self._state is None:
            raise InputError("call reset() before the first step")
        agent = self.agent_selection
        if self.terminations[agent] or self.truncations[agent]:
            self._was_dead_step(action)
            return
        before = self.state
        paths = self.render_mode is not None
        call = self.action.call_of(action, self.simulator.view(before))
        decisions = self.action.decisions_of(action)
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
        self._last_step = [(before, after, shot)] if paths else []
        if self.render_mode == "rgb_array_list":
            self._film.append((before, after, shot))
        self._thrown += 1
        self._cumulative_rewards[agent] = 0.0
        played, over = after.game, after.game.is_over
        if after.game.end is None and not over:
            after = self.simulator.begin_end_as(
                after, FollowsDecisions(self._decisions[after.game.last_stone])
            )
        for label in self.agents:
            team = Team(self.possible_agents.index(label))
            parts = reward_parts(before.game, played, shot.team, shot.ruling, team)
            if self.potential:
                held = self.potential.value(before.game, team)
                parts = replace(parts, potential=self.potential.rise(held, after.game, team))
            self.rewards[label] = self.weights.total(parts)
            self.infos[label] = {"shot": shot, "reward_parts": parts.as_dict()}
        self._state, self._last = after, shot
        truncated = not over and self._is_too_long(len(played.line_score))
        self._tell_masks()
        self.terminations = dict.fromkeys(self.agents, over)
        self.truncations = dict.fromkeys(self.agents, truncated)
        self.agent_selection = self._to_act() if not over else shot.team.other.label
        self._accumulate_rewards()

    def _is_too_long(self, ends: int) -> bool:
        """Whether a game has reached its number of deliveries, or goes on and on without points."""
        if self._max_throws is not None and self._thrown >= self._max_throws:
            return True
        return ends >= self.simulator.rules.ends + MOST_EXTRA_ENDS

    def _concede(self, team: Team) -> None:
        """End the game: the other team has won."""
        before = self.state.game
        self._state = replace(self.state, game=concede(before, team))
        self._cumulative_rewards[team.label] = 0.0
        for label in self.agents:
            whose = Team(self.possible_agents.index(label))
            parts = concession_parts(team, whose)
            if self.potential:
                parts = replace(parts, potential=-self.potential.value(before, whose))
            self.rewards[label] = self.weights.total(parts)
            self.infos[label] = {"reward_parts": parts.as_dict()}
        self.terminations = dict.fromkeys(self.agents, True)
        self.agent_selection = team.other.label
        self._accumulate_rewards()

    def observe(self, agent: str) -> Any:
        """What a team sees."""
        return self._observed(self.observation, Team(self.possible_agents.index(agent)))

    def _observed(self, observation: GameObservation, team: Team) -> Any:
        state = self.state
        return observation.observe(
            state.game,
            team,
            self._end_played_to(),
            clock=state.clock,
            throws=state.throws,
            wear=state.wear,
        )

    def _end_played_to(self) -> Direction:
        game = self.state.game
        return direction_of(len(game.line_score) - 1 if game.end is None else game.end.number)

    def render(self) -> Any:
        """The sheet from above as an RGB picture, with the paths of the last delivery on it.

        With the render mode ``rgb_array_list``, the pictures of a film of the deliveries since the
        last call, at `metadata["render_fps"]` a second and four times as fast as they were.
        """
        if self.render_mode is None:
            gymnasium.logger.warn(
                "render() needs a render_mode: curling_v0.env(render_mode='rgb_array')"
            )
        if self.render_mode == "rgb_array_list":
            film = list(self._renderer.film(self._film, self._shown, FILM_SPEED, self._last))
            self._film = []
            return film
        if self.render_mode != "rgb_array":
            return None
        return self._renderer.picture(self._shown, self._last)

    def frames(self, speed: float = 1.0) -> Iterator[Image]:
        """The last delivery as a film: pictures at `metadata["render_fps"]`.

        Parameters
        ----------
        speed : how many times faster than it happened it is shown

        Raises
        ------
        InputError : the environment has no render mode, and so has kept no paths
        """
        if self.render_mode is None:
            raise InputError("a film needs a render_mode: render_mode='rgb_array'")
        yield from self._renderer.film(self._last_step, self._shown, speed)

    def close(self) -> None:
        """Close the window, if there is one."""
        self._renderer.close()
