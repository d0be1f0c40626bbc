"""`CurlingEnd-v0`: one end against an opponent, with or without the hammer."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from curling_env.envs.game.end_core import AGENT, End, EndCore, Ends
from curling_env.envs.game.observation import GameObservation
from curling_env.envs.game.rendering import GameClip, GameRenderer, check_paths, clips_of
from curling_env.envs.single import SingleEnv
from curling_env.game import Call, GameSimulator, GameState, Player
from curling_env.typing import Image

__all__ = ["AGENT", "CurlingEndEnv"]


class CurlingEndEnv(EndCore, SingleEnv[Ends]):
    """Play an end against an opponent.

    Parameters
    ----------
    ice, known_ice, ices : the ice played on and as both teams know it, as for `CurlingSheetEnv`
    opponent : a player's name, ``module:Class``, the file of a trained model, a `Player`, a policy
        (a function of observations, or something with `predict`), or a list of such, of which every
        episode draws one; `opponents` is that list, to which past selves may be appended
    hammer : the team that delivers last: "own", "opponent" or "random"
    rules : a set of rules, its name, or a mapping of a name and what differs
    skill : execution error of the agent: a name, a `Skill` or its fields; "none" for none. A
        sequence has one for each player of the team, as the rules number them (mixed doubles: two)
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
    details : whether `info` has the deliveries as well
    render_mode : "rgb_array", "rgb_array_list" (pictures of a film of what happened), "human" (a
        window; needs the extra `viewer`) or None

    Raises
    ------
    InputError : an invalid option

    Notes
    -----
    ``reset(options=…)`` takes `hammer`, `ice` and `known_ice` for one end, and in mixed doubles
    `power_play`, "left" or "right", for an end in which the agent decides (with `hammer`
    "random" it is ignored where the opponent does); or `state`, a `GameState` to start from.

    ``state`` may be kept and put back at any moment: it is frozen, so a search branches from it
    without copying. The same state and action always have the same outcome, including the
    execution error; ``dataclasses.replace(state, seed=…)`` has other execution errors.

    ``step`` leaves in `info`: `reward_…` (the parts of the reward), and `score` (own, opponent's;
    zeros before the last stone). With `details` these parts are in `reward_parts`, and the agent's
    delivery and the opponent's answer in `shots`.
    """

    title = "CurlingEnd-v0"

    @property
    def simulator(self) -> GameSimulator:
        """Simulator of the throws, on the ice of this end."""
        return self._episodes[0].ice.simulator

    @property
    def observation(self) -> GameObservation:
        """Maker of the observations, on the known ice of this end."""
        return self._episodes[0].ice.observation

    @property
    def opponent(self) -> Player:
        """The opponent of this end."""
        return self._episodes[0].opponent

    @property
    def chooser(self) -> Player:
        """Player that decides for the agent after the opponent's tick."""
        return self._episodes[0].chooser

    @property
    def state(self) -> GameState:
        """Current state of the end. Assign another one, in which the agent is to throw, to continue
        from it.

        Raises
        ------
        InputError : before the first reset; or a state in which the opponent is to throw
        """
        self._check_begun()
        return self._episodes[0].state

    @state.setter
    def state(self, state: GameState) -> None:
        checked = self.checked_state(state)
        self._episodes = (End(self._episodes[0].ice, self.opponent, checked),)
        self._was_reset = True
        self._screen.begin(())

    def call_of(self, action: ArrayLike) -> Call:
        """Return the call of an action."""
        return self.action.call_of(action, self._episodes[0].view)

    def action_masks(self) -> NDArray[np.int8]:
        """Return which shots are available to the agent, 1 or 0 each, for algorithms with masks.

        Raises
        ------
        InputError : actions are throws, which are always available
        """
        return self.mask(self._episodes[0].view)

    def frames(self, speed: float = 1.0) -> Iterator[Image]:
        """Yield the frames of a film of the last step's deliveries, at `metadata["render_fps"]`.

        Parameters
        ----------
        speed : how many times faster than they happened they are shown

        Raises
        ------
        InputError : the environment has no render mode, and so has kept no paths
        """
        check_paths(self.render_mode)
        yield from super().frames(speed)

    # --- the parts ------------------------------------------------------------------------------

    def _renderer(self) -> GameRenderer:
        return GameRenderer(self.title)

    def _clips(self) -> list[GameClip]:
        (end,) = self._episodes
        return clips_of(end.ice.simulator.known_ice, (*end.before, end.state), end.shots)
