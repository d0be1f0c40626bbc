"""The two-team game in PettingZoo's turn-based form: ``curling_env.curling_v0.env()``.

The agents are ``home`` and ``away``; each step is one delivery. ``parallel_env`` makes the same
game as a parallel environment, in which only the action of the team to throw counts.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import wraps
from typing import Any

from gymnasium import spaces
from gymnasium.utils import seeding
from numpy.typing import ArrayLike
from pettingzoo import AECEnv  # pyright: ignore[reportMissingTypeStubs]
from pettingzoo.utils import wrappers  # pyright: ignore[reportMissingTypeStubs]
from pettingzoo.utils.conversions import (  # pyright: ignore[reportMissingTypeStubs]
    turn_based_aec_to_parallel_wrapper,
)

from curling_env.envs.game.core import score_of
from curling_env.envs.game.match_core import TEAMS, CallableState, Match, MatchCore
from curling_env.envs.game.observation import GameObservation
from curling_env.envs.game.rendering import GameClip, GameRenderer, check_paths, clips_of
from curling_env.envs.options import whole_number
from curling_env.envs.rendering import FPS, RENDER_MODES, Screen
from curling_env.errors import InputError
from curling_env.game import Call, GameSimulator, GameState
from curling_env.typing import Image


def env(**settings: Any) -> wrappers.OrderEnforcingWrapper[str, Any, Any]:
    """Make a game between two agents, with the order of calls checked.

    Parameters
    ----------
    settings : options of `raw_env`
    """
    return wrappers.OrderEnforcingWrapper(raw_env(**settings))


def parallel_env(
    *, max_cycles: int | None = None, **settings: Any
) -> turn_based_aec_to_parallel_wrapper[str, Any, Any]:
    """Make the same game as a parallel environment; the action of the other team is ignored.

    Parameters
    ----------
    max_cycles : number of deliveries after which the game is truncated; None for no limit
    settings : options of `raw_env`
    """
    return turn_based_aec_to_parallel_wrapper(raw_env(max_throws=max_cycles, **settings))


class raw_env(MatchCore, AECEnv[str, Any, Any]):  # the names are PettingZoo's
    """A game of curling.

    Parameters
    ----------
    ice, known_ice, ices : the ice played on and as both teams know it, as for `CurlingSheetEnv`
    rules : a set of rules, its name, or a mapping of a name and what differs
    ends : number of ends; by default as the rules say
    skill : execution error of both teams, or a pair for the home and the away team: a name, a
        `Skill` or its fields. Each of the pair may be a sequence with one for each player
    ice_evolution : how the ice changes during the game: "none", "typical", or an `IceEvolution` or
        its fields
    sweeping : "none", "scripted" (sweepers decide) or "action" (part of the action)
    delivery : where throws begin: "hog-line", "tee-line", "hack" (as in Digital Curling), a
        `Delivery` or its fields
    choices : "rule" (stones are put back after a tick, there are no power plays, the deciding
        team keeps the hammer, no one concedes) or "action" (part of the action, as decisions that
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
    details : whether `infos` have the deliveries as well
    render_mode : "rgb_array", "rgb_array_list" (pictures of a film of what happened), "human" (a
        window; needs the extra `viewer`) or None

    Raises
    ------
    InputError : an invalid option

    Notes
    -----
    ``reset(options=…)`` takes `last_stone`, "home" or "away" (random without it), and
    `power_play`, "left" or "right", and `throw_first`, for the first end of mixed doubles; `ice`
    and `known_ice` for one game; or `state`, a `GameState` to start from. Other options are
    ignored, as PettingZoo requires. ``state`` may be kept and restored at any time.
    """

    metadata = {  # noqa: RUF012  # pyright: ignore[reportIncompatibleVariableOverride]
        "name": "curling_v0",
        "render_modes": list(RENDER_MODES),
        "render_fps": FPS,
    }

    @wraps(MatchCore.__init__)
    def __init__(self, **settings: Any) -> None:
        AECEnv.__init__(self)  # pyright: ignore[reportUnknownMemberType]
        MatchCore.__init__(self, **settings)
        self.possible_agents = list(TEAMS)
        self.agents: list[str] = []
        # The same objects at every call, as PettingZoo requires.
        self._spaces: dict[str, Any] = {label: self.team_space for label in TEAMS}
        self._actions: dict[str, Any] = {label: self.action.space for label in TEAMS}
        self._match: Match | None = None
        call = "curling_v0.env(render_mode='rgb_array')"
        self._screen = Screen(self.render_mode, GameRenderer("curling_v0"), call)

    @property
    def _game(self) -> Match:
        if self._match is None:
            raise InputError("call reset() before the first step")
        return self._match

    @property
    def simulator(self) -> GameSimulator:
        """Simulator of the throws, on the ice of this game."""
        return (self.usual if self._match is None else self._match.ice).simulator

    @property
    def observation(self) -> GameObservation:
        """Maker of the observations, on the known ice of this game."""
        return (self.usual if self._match is None else self._match.ice).observation

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Return the space of a team's observations; the same object at every call."""
        return self._spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Return the space of a team's actions; the same object at every call."""
        return self._actions[agent]

    @property
    def state(self) -> CallableState:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Current state of the game, immutable; assign another one to continue from it.

        Called as PettingZoo's method, ``state()``, it returns all observations as one array in
        `state_space`.

        Raises
        ------
        InputError : before the first reset, or set to a state of a game by other rules
        """
        state = CallableState.of(self._game, self)
        self._match = self._game._replace(state=state)
        return state

    @state.setter
    def state(self, state: GameState) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        ice = self.usual if self._match is None else self._match.ice
        self._begin(self.continued(ice, self.checked_state(state)))

    def call_of(self, action: ArrayLike) -> Call:
        """Return the call of an action."""
        return self.action.call_of(action, self.simulator.view(self._game.state))

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        """Begin a game."""
        if seed is not None or not hasattr(self, "_rng"):
            given = None if seed is None else whole_number("seed", seed, least=0)
            self._rng, _ = seeding.np_random(given)
        self._begin(self.begun(self._rng, options or {}))

    def _begin(self, match: Match) -> None:
        """Set PettingZoo's attributes at the beginning, or after a state was assigned."""
        self._match = match
        self._screen.begin(self._clips())
        self.agents = list(TEAMS)
        self.rewards = dict.fromkeys(TEAMS, 0.0)
        self._cumulative_rewards = dict.fromkeys(TEAMS, 0.0)
        self.terminations = dict.fromkeys(TEAMS, match.state.game.is_over)
        self.truncations = dict.fromkeys(TEAMS, False)
        self.infos: dict[str, dict[str, Any]] = {
            label: self.masks(match, team) for label, team in TEAMS.items()
        }
        self.agent_selection = (match.to_throw or TEAMS[self.agents[0]]).label

    def step(self, action: Any) -> None:
        """Deliver a stone."""
        before, agent = self._game, self.agent_selection
        if self.terminations[agent] or self.truncations[agent]:
            self._was_dead_step(action)
            return
        after, earned = self.played(before, action)
        self._match, game = after, after.state.game
        if after.thrown > before.thrown:
            self._screen.add(self._clips())
        self._cumulative_rewards[agent] = 0.0
        self.rewards, self.infos = {}, {}
        for label, team in TEAMS.items():
            self.rewards[label] = self.weights.total(earned[team])
            self.infos[label] = {"reward_parts": earned[team].as_dict()}
            if self.details:
                self.infos[label]["shots"] = after.shots
            if len(game.line_score) > len(before.state.game.line_score):
                self.infos[label]["score"] = score_of(game, team)
            self.infos[label] |= self.masks(after, team)
        self.terminations = dict.fromkeys(self.agents, game.is_over)
        self.truncations = dict.fromkeys(self.agents, self.is_too_long(after))
        self.agent_selection = (after.to_throw or TEAMS[agent].other).label
        self._accumulate_rewards()

    def observe(self, agent: str) -> Any:
        """Return the observation of a team; with its `action_mask` if actions are shots."""
        return self.observed(self._game, TEAMS[agent])

    def render(self) -> Any:
        """Return the sheet from above as an RGB picture, with the paths of the last delivery.

        With the render mode ``rgb_array_list`` return the frames of a film of the deliveries since
        the last call, at `metadata["render_fps"]` and four times the true speed.
        """
        return self._screen.render(self._clips()[-1])

    def frames(self, speed: float = 1.0) -> Iterator[Image]:
        """Yield the frames of a film of the last delivery, at `metadata["render_fps"]`.

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
        """Close the window, if any."""
        self._screen.close()

    def _clips(self) -> list[GameClip]:
        match = self._game
        return clips_of(match.ice.simulator.known_ice, match.states, match.shots)
