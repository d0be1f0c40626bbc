"""`CurlingEnd-v0`: one end against an opponent, with or without the hammer."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Literal

import gymnasium
from numpy.typing import ArrayLike

from curling_env.envs.game.action import (
    Choices,
    FollowsDecisions,
    GameAction,
    Sweeping,
    TeamDecisions,
)
from curling_env.envs.game.observation import GameObservation, ObservationKind
from curling_env.envs.game.rendering import GameRenderer
from curling_env.envs.game.reward import GameRewardParts, GameRewardWeights, reward_parts
from curling_env.envs.rendering import FPS, RENDER_MODES, check_render_mode
from curling_env.envs.sheet.action import throw_range_for
from curling_env.errors import InputError
from curling_env.game import (
    NO_EVOLUTION,
    Call,
    GameSimulator,
    GameState,
    IceEvolution,
    PlayedShot,
    Player,
    player_named,
)
from curling_env.game.rules import RuleSet, Team, rule_set
from curling_env.game.rules.placement import Side
from curling_env.game.simulator import direction_of
from curling_env.ice import Ice
from curling_env.sheet import Direction
from curling_env.throw import Delivery, Skill, delivery_named
from curling_env.typing import Image, Singles

Hammer = Literal["own", "opponent", "random"]
AGENT = Team.HOME
"""The agent plays the home team's stones."""


class CurlingEndEnv(gymnasium.Env[Any, Singles]):
    """Play an end against an opponent.

    Parameters
    ----------
    ice : the ice played on: an `Ice`, a file or a preset
    known_ice : the ice as both teams know it; the ice played on by default
    opponent : name of a player, ``module:Class``, or a `Player`
    hammer : who delivers last: "own", "opponent" or "random"
    rules : a set of rules or its name
    skill : execution error of the agent; "none" for none
    opponent_skill : execution error of the opponent; by default the agent's
    ice_evolution : how the ice changes during the end
    sweeping : "none", "scripted" (sweepers decide) or "action" (part of the action)
    delivery : where throws begin: "hog-line", "hack" (as in Digital Curling) or a `Delivery`
    choices : whether after an opponent's tick the stones are put back or left by "rule" (whichever
        counts for more), or as the agent's last "action" says
    observation : "flat", "dict" or "planes"
    weights : weights of the parts of the reward
    render_mode : "rgb_array", "human" (a window; needs the extra `viewer`) or None

    Raises
    ------
    InputError : an option that makes no sense

    Notes
    -----
    ``reset(options=…)`` takes `hammer` for one end, and in mixed doubles `power_play`, "left" or
    "right", for an end in which the agent decides; or `state`, a `GameState` to go on from.

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
        ice: Ice | str | Path = "standard",
        *,
        known_ice: Ice | str | Path | None = None,
        opponent: str | Player = "draw",
        hammer: Hammer = "random",
        rules: str | RuleSet = "world_curling_2024",
        skill: str | Skill = "elite",
        opponent_skill: str | Skill | None = None,
        ice_evolution: IceEvolution = NO_EVOLUTION,
        sweeping: Sweeping = "none",
        delivery: str | Delivery = "hog-line",
        choices: Choices = "rule",
        observation: ObservationKind = "flat",
        weights: GameRewardWeights | None = None,
        render_mode: str | None = None,
    ) -> None:
        check_render_mode(render_mode)
        self.simulator = GameSimulator(
            ice,
            known_ice=known_ice,
            rules=rule_set(rules, ends=1),
            skills=(skill, skill if opponent_skill is None else opponent_skill),
            ice_evolution=ice_evolution,
            sweeping=sweeping != "none",
            delivery=delivery_named(delivery),
        )
        self.opponent = player_named(opponent)
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
        self.weights = weights or GameRewardWeights()
        self.render_mode = render_mode
        self.action_space = self.action.space
        self.observation_space = self.observation.space
        self._hammer: Hammer = _checked_hammer(hammer)
        self._state: GameState | None = None
        self._shots: tuple[PlayedShot, ...] = ()
        self._decisions: TeamDecisions | None = None
        self._renderer = GameRenderer(self.simulator.known_ice, "CurlingEnd-v0")

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
        end = state.game.end
        if state.game.rules != self.simulator.rules:
            raise InputError("a state must be of a game by this environment's rules")
        if end is not None and end.to_throw is not AGENT:
            raise InputError("a state must have the agent (the home team) to throw")
        self._state, self._shots, self._decisions = state, (), None

    @property
    def chooser(self) -> Player:
        """The player that decides for the agent after the opponent's tick."""
        return self.opponent if self._decisions is None else FollowsDecisions(self._decisions)

    def call_of(self, action: ArrayLike) -> Call:
        """The call an action means."""
        return self.action.call_of(action)

    def action_of(self, call: Call) -> Singles:
        """The action that means a call; clipped where it is out of range."""
        return self.action.action_of(call)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an end; the opponent delivers first if the agent has the hammer."""
        super().reset(seed=seed)
        options = options or {}
        unknown = sorted(options.keys() - {"hammer", "power_play", "state"})
        if unknown:
            raise InputError(
                f"unknown option {unknown[0]!r}; options are hammer, power_play, state"
            )
        if "state" in options:
            self.state = options["state"]
            return self._observe(), {"shots": ()}
        self._state = self.new_state(options.get("hammer"), options.get("power_play"))
        self._shots, self._decisions = (), None
        self._answer()
        if self.render_mode == "human":
            self._renderer.show_position(self.state)
        return self._observe(), {"shots": self._shots}

    def new_state(self, hammer: Hammer | None = None, power_play: Side | None = None) -> GameState:
        """An end before its first stone, with a seed from the environment's random generator.

        Parameters
        ----------
        hammer : who delivers last; by default as the environment was made
        power_play : the agent's power play; the opponent decides on its own

        Raises
        ------
        InputError : a power play that these rules do not allow
        """
        chosen = self._hammer if hammer is None else _checked_hammer(hammer)
        own = chosen == "own" or (chosen == "random" and self.np_random.random() < 0.5)
        state = self.simulator.new_game(
            int(self.np_random.integers(2**31)), last_stone=AGENT if own else AGENT.other
        )
        if not own:
            free = state.game.may_power_play
            view = self.simulator.view(state)
            power_play = self.opponent.power_play(view) if free else None
        return self.simulator.begin_end(state, power_play=power_play)

    def step(self, action: Singles) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Deliver a stone, and let the opponent answer."""
        if self.state.game.end is None:
            raise InputError("the end is over; call reset()")
        self._shots = ()
        self._decisions = self.action.decisions_of(action)
        parts = self._play(self.action.call_of(action)) + self._answer()
        state = self.state
        over = state.game.end is None
        info: dict[str, Any] = {"shots": self._shots, "reward_parts": parts.as_dict()}
        if over:
            info["score"] = state.game.line_score[-1]
        return self._observe(), self.weights.total(parts), over, False, info

    def render(self) -> Image | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """The sheet from above as an RGB picture, with the paths of the last delivery on it."""
        if self.render_mode is None:
            gymnasium.logger.warn(
                "render() needs a render_mode: gym.make('CurlingEnd-v0', render_mode='rgb_array')"
            )
        if self.render_mode != "rgb_array":
            return None
        return self._renderer.picture(self.state, self._shots[-1] if self._shots else None)

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

    def _observe(self) -> Any:
        return self.observation.observe(self.state.game, AGENT, direction_of(0))


def _checked_hammer(hammer: Any) -> Hammer:
    if hammer not in ("own", "opponent", "random"):
        raise InputError(f"hammer must be 'own', 'opponent' or 'random', got {hammer!r}")
    return hammer
