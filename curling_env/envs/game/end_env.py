"""`CurlingEnd-v0`: one end against an opponent, with or without the hammer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, ClassVar, Literal

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from curling_env.envs.game.action import Choices, FollowsDecisions, Sweeping, TeamDecisions
from curling_env.envs.game.observation import GameObservation, ObservationKind
from curling_env.envs.game.opponents import Opponents
from curling_env.envs.game.potential import potential_from
from curling_env.envs.game.rendering import Delivered, GameRenderer
from curling_env.envs.game.reward import GameRewardParts, GameRewardWeights, reward_parts
from curling_env.envs.game.shots import mask_of
from curling_env.envs.game.table import (
    DeliveryOption,
    EvolutionOption,
    GameTable,
    RulesOption,
    SkillOption,
)
from curling_env.envs.ices import GivenIce, IceOption
from curling_env.envs.options import (
    dataclass_from,
    one_of,
    reset_options,
    rules_from,
    whole_number,
)
from curling_env.envs.rendering import FILM_SPEED, FPS, RENDER_MODES, check_render_mode
from curling_env.errors import InputError
from curling_env.game import (
    NO_EVOLUTION,
    Call,
    GameSimulator,
    GameState,
    PlayedShot,
    Player,
    PlayerView,
)
from curling_env.game.rules import Team
from curling_env.game.simulator import direction_of
from curling_env.infrastructure.keywords import knows_its_options
from curling_env.typing import Image, Singles

Hammer = Literal["own", "opponent", "random"]
HAMMERS = ("own", "opponent", "random")
RESET_OPTIONS = ("hammer", "power_play", "state", "ice", "known_ice")
"""What `reset` may be asked for in its `options`."""
AGENT = Team.HOME
"""The agent plays the home team's stones."""


@knows_its_options("CurlingEnd-v0")
class CurlingEndEnv(gymnasium.Env[Any, Singles]):
    """Play an end against an opponent.

    Parameters
    ----------
    ice, known_ice, ices : the ice played on and as both teams know it, as for `CurlingSheetEnv`
    opponent : a player's name, ``module:Class``, the file of a trained model, a `Player`, a policy
        (a function of observations, or something with `predict`), or a list of such, of which every
        episode draws one; `opponents` is that list, to which past selves may be appended
    hammer : who delivers last: "own", "opponent" or "random"
    rules : a set of rules, its name, or a mapping of a name and what differs
    skill : execution error of the agent: a name, a `Skill` or its fields; "none" for none
    opponent_skill : execution error of the opponent; by default the agent's
    ice_evolution : how the ice changes during the end: "none", "typical", or an `IceEvolution` or
        its fields
    sweeping : "none", "scripted" (sweepers decide) or "action" (part of the action)
    delivery : where throws begin: "hog-line", "tee-line", "hack" (as in Digital Curling), a
        `Delivery` or its fields
    choices : whether after an opponent's tick the stones are put back or left by "rule" (whichever
        counts for more), or as the agent's last "action" says
    actions : "throws", or "shots": the number of a shot of a list, see `shots`; `info` then has an
        `action_mask`
    observation : "flat", "dict" or "planes"
    weights : weights of the parts of the reward, or those that differ
    potential : value of positions, whose rise is part of the reward: a function of a game and a
        team, a declared name such as "value-network", or a mapping of `of` and `discount`
    render_mode : "rgb_array", "rgb_array_list" (pictures of a film of what happened), "human" (a
        window; needs the extra `viewer`) or None

    Raises
    ------
    InputError : an option that makes no sense

    Notes
    -----
    ``reset(options=…)`` takes `hammer`, `ice` and `known_ice` for one end, and in mixed doubles
    `power_play`, "left" or "right", for an end in which the agent decides (with `hammer`
    "random" it is left out where the opponent does); or `state`, a `GameState` to go on from.

    ``state`` may be kept and put back at any moment: it is frozen, so a search branches from it
    without copying. The same state and action always have the same outcome, including the
    execution error; ``dataclasses.replace(state, seed=…)`` has other execution errors.

    ``step`` leaves in `info`: `shots` (the agent's delivery and the opponent's answer),
    `reward_parts`, and after the last stone `score` (own, opponent's).
    """

    metadata: ClassVar[dict[str, Any]] = {  # pyright: ignore[reportIncompatibleVariableOverride]
        "render_modes": list(RENDER_MODES),
        "render_fps": FPS,
    }

    def __init__(
        self,
        ice: IceOption = "standard",
        *,
        known_ice: IceOption | None = None,
        ices: Any = None,
        opponent: Any = "draw",
        hammer: Hammer = "random",
        rules: RulesOption = "world_curling_2024",
        skill: SkillOption = "elite",
        opponent_skill: SkillOption | None = None,
        ice_evolution: EvolutionOption = NO_EVOLUTION,
        sweeping: Sweeping = "none",
        delivery: DeliveryOption = "hog-line",
        choices: Choices = "rule",
        actions: str = "throws",
        observation: ObservationKind = "flat",
        weights: GameRewardWeights | Mapping[str, Any] | None = None,
        potential: Any = None,
        render_mode: str | None = None,
    ) -> None:
        check_render_mode(render_mode)
        self.table = GameTable(
            ice=ice,
            known_ice=known_ice,
            ices=ices,
            rules=rules_from(rules, ends=1),
            skills=(skill, skill if opponent_skill is None else opponent_skill),
            ice_evolution=ice_evolution,
            sweeping=sweeping,
            delivery=delivery,
            choices=choices,
            observation=observation,
            actions=actions,
        )
        self.action = self.table.action
        self.opponents = Opponents(opponent, self.table)
        self.opponent = self.opponents[0]
        self.weights = dataclass_from(
            GameRewardWeights, "weights", GameRewardWeights() if weights is None else weights
        )
        self.potential = potential_from(potential)
        self.render_mode = render_mode
        self.action_space = self.action.space
        self.observation_space = self.table.observation.space
        self._hammer: Hammer = one_of("hammer", hammer, HAMMERS)
        self._state: GameState | None = None
        self._shots: tuple[PlayedShot, ...] = ()
        self._film: list[Delivered] = []
        self._last_step: list[Delivered] = []
        self._decisions: TeamDecisions | None = None
        self._renderer = GameRenderer(self.simulator.known_ice, "CurlingEnd-v0")

    @property
    def simulator(self) -> GameSimulator:
        """What plays the throws, on the ice of this end."""
        return self.table.simulator

    @property
    def observation(self) -> GameObservation:
        """What makes the observations, on the ice of this end as it is known."""
        return self.table.observation

    @property
    def state(self) -> GameState:
        """The end at this moment. Set it to go on from another, in which the agent is to throw.

        Raises
        ------
        InputError : before the first reset; or a state in which the opponent is to throw
        """
        if self._state is None:
            raise InputError("call reset() before the first step")
        return self._state

    @state.setter
    def state(self, state: GameState) -> None:
        self._state, self._shots, self._decisions = self.checked(state), (), None
        self._film, self._last_step = [], []

    def checked(self, state: Any) -> GameState:
        """A state to go on from.

        Raises
        ------
        InputError : something else, a game by other rules, or one in which the opponent is to throw
        """
        if not isinstance(state, GameState):
            raise InputError(f"state must be a GameState, as env.unwrapped.state, got {state!r}")
        end = state.game.end
        if state.game.rules != self.simulator.rules:
            raise InputError("a state must be of a game by this environment's rules")
        if end is not None and end.to_throw is not AGENT:
            raise InputError("a state must have the agent (the home team) to throw")
        return state

    @property
    def chooser(self) -> Player:
        """The player that decides for the agent after the opponent's tick."""
        return self.opponent if self._decisions is None else FollowsDecisions(self._decisions)

    def call_of(self, action: ArrayLike) -> Call:
        """The call an action means."""
        return self.action.call_of(action, self._view())

    def action_masks(self) -> NDArray[np.int8]:
        """The shots that the agent has, 1 or 0 each, as algorithms with masks ask for them.

        Raises
        ------
        InputError : actions are throws, all of which there always are
        """
        mask = mask_of(self.action, self._view())
        if mask is None:
            raise InputError("only shots have a mask: make the environment with actions='shots'")
        return mask

    def action_of(self, call: Call) -> Singles:
        """The action that means a call; clipped where it is out of range."""
        return self.action.action_of(call)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an end; the opponent delivers first if the agent has the hammer.

        Raises
        ------
        InputError : an option that is unknown or makes no sense
        """
        super().reset(seed=None if seed is None else whole_number("seed", seed, least=0))
        asked = reset_options(options, RESET_OPTIONS)
        given = self.table.ices.given(asked)
        self._shots, self._decisions, self._film, self._last_step = (), None, [], []
        self._state = self.begin(asked, given)
        if "state" not in asked:
            self._answer()
        if self.render_mode == "human":
            self._renderer.show_position(self.state)
        return self._observe(), {"shots": self._shots, **self.table.mask(self._view())}

    def begin(self, asked: Mapping[str, Any], given: GivenIce = (None, None)) -> GameState:
        """An end before its first stone, on its ice, against its opponent.

        All that is random follows from the environment's random generator.

        Parameters
        ----------
        asked : what `reset` was asked for, besides the ice
        given : the ice that it was asked for, and what is known of it

        Raises
        ------
        InputError : a power play that these rules do not allow, or a state to go on from that is
            none of this environment
        """
        wanted = asked.get("hammer")
        hammer = one_of("hammer", self._hammer if wanted is None else wanted, HAMMERS)
        state, power_play = asked.get("state"), asked.get("power_play")
        if power_play is not None:
            one_of("power_play", power_play, ("left", "right"))
            if hammer == "opponent":
                raise InputError(
                    "where the hammer is the opponent's, the opponent decides on a power play; ask "
                    "for it with hammer 'own'"
                )
        if "state" in asked:
            state = self.checked(state)
        self.table.draw(self.np_random, given)
        self._renderer.ice = self.simulator.known_ice
        self.opponent = self.opponents.draw(self.np_random)
        if state is not None:
            return state
        own = hammer == "own" or (hammer == "random" and self.np_random.random() < 0.5)
        state = self.simulator.new_game(
            int(self.np_random.integers(2**31)), last_stone=AGENT if own else AGENT.other
        )
        if not own:
            free = state.game.may_power_play
            view = self.simulator.view(state)
            power_play = self.opponent.power_play(view) if free else None
        return self.simulator.begin_end(state, power_play=power_play)

    def step(self, action: Singles) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Deliver a stone, and let the opponent answer.

        Raises
        ------
        InputError : before the first reset, after the end, or an action that is none
        """
        if self.state.game.end is None:
            raise InputError("the end is over; call reset()")
        call = self.action.call_of(action, self._view())
        self._shots, self._last_step = (), []
        self._decisions = self.action.decisions_of(action)
        before = self.potential.value(self.state.game, AGENT) if self.potential else 0.0
        parts = self._play(call) + self._answer()
        state = self.state
        if self.potential:
            parts = replace(parts, potential=self.potential.rise(before, state.game, AGENT))
        over = state.game.end is None
        info: dict[str, Any] = {"shots": self._shots, "reward_parts": parts.as_dict()}
        info |= self.table.mask(self._view())
        if over:
            info["score"] = state.game.line_score[-1]
        return self._observe(), self.weights.total(parts), over, False, info

    def render(self) -> Any:
        """The sheet from above as an RGB picture, with the paths of the last delivery on it.

        With the render mode ``rgb_array_list``, the pictures of a film of the deliveries since the
        last call, at `metadata["render_fps"]` a second and four times as fast as they were.
        """
        if self.render_mode is None:
            gymnasium.logger.warn(
                "render() needs a render_mode: gym.make('CurlingEnd-v0', render_mode='rgb_array')"
            )
        if self.render_mode == "rgb_array_list":
            film = list(self._renderer.film(self._film, self.state, FILM_SPEED))
            self._film = []
            return film
        if self.render_mode != "rgb_array":
            return None
        return self._renderer.picture(self.state, self._shots[-1] if self._shots else None)

    def frames(self, speed: float = 1.0) -> Iterator[Image]:
        """The deliveries of the last step as a film: pictures at `metadata["render_fps"]`.

        Parameters
        ----------
        speed : how many times faster than they happened they are shown

        Raises
        ------
        InputError : the environment has no render mode, and so has kept no paths
        """
        if self.render_mode is None:
            raise InputError("a film needs a render_mode: render_mode='rgb_array'")
        yield from self._renderer.film(self._last_step, self.state, speed)

    def close(self) -> None:
        """Close the window, if there is one."""
        self._renderer.close()

    # --- the parts ------------------------------------------------------------------------------

    def _play(self, call: Call) -> GameRewardParts:
        before = self.state
        paths = self.render_mode is not None
        end = before.game.end
        ours = end is not None and end.to_throw is AGENT
        chooser = self.opponent if ours else self.chooser
        self._state, shot = self.simulator.play(before, call, opponent=chooser, paths=paths)
        self._shots = (*self._shots, shot)
        if paths:
            self._last_step.append((before, self._state, shot))
        if self.render_mode == "rgb_array_list":
            self._film.append(self._last_step[-1])
        if self.render_mode == "human":
            self._renderer.show(before, self._state, shot)
        return reward_parts(before.game, self._state.game, shot.team, shot.ruling, AGENT)

    def _answer(self) -> GameRewardParts:
        """The opponent delivers while it is its turn."""
        parts = GameRewardParts()
        while True:
            end = self.state.game.end
            if end is None or end.to_throw is AGENT:
                return parts
            parts = parts + self._play(self.opponent.call(self.simulator.view(self.state)))

    def _view(self) -> PlayerView:
        return self.simulator.view(self.state, AGENT)

    def _observe(self) -> Any:
        return observed(self.observation, self.state)


def observed(observation: GameObservation, state: GameState) -> Any:
    """What the agent sees of an end."""
    return observation.observe(
        state.game,
        AGENT,
        direction_of(0),
        clock=state.clock,
        throws=state.throws,
        wear=state.wear,
    )
