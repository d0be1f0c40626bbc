"""Many ends of `CurlingEnd-v0` at once, with throws simulated together."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from curling_env.envs.game.batch import play_together
from curling_env.envs.game.end_core import EndCore, Ends
from curling_env.envs.vector import EnvsTogether
from curling_env.game import GameState


class CurlingEndVectorEnv(EndCore, EnvsTogether[Ends]):
    """Many ends of `CurlingEnd-v0` at once.

    With the same seeds, ends are those of `CurlingEndEnv`, in less time: the throws of a step are
    simulated together. Before the first contact, both agree to a tenth of a millimetre; contacts
    magnify the difference. `info` holds the same entries in Gymnasium's form; the outcomes of its
    `shots` have no contacts and no paths. If stones wear the ice, or every game has its own set of
    stones, no two ends share an ice; they are then played one after another, as slowly as by
    `CurlingEndEnv`, and with its outcomes.

    Parameters
    ----------
    num_envs : number of ends
    autoreset_mode : when an end that is over begins again: in the next step ("NextStep"), whose
        action is then not played; in the same step ("SameStep"); or when `reset` asks for it with a
        `reset_mask` ("Disabled")
    render_mode : None; many ends are not drawn
    settings : options of `CurlingEndEnv`; the option `state` of `reset` may also be a list with one
        for each end

    Raises
    ------
    InputError : an invalid setting, or that only a single end can have
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        self.place(num_envs, autoreset_mode, render_mode)
        super().__init__(**settings)
        self.player = play_together

    @property
    def states(self) -> tuple[GameState, ...]:
        """Current states of the ends."""
        return tuple(end.state for end in self._episodes)

    def action_masks(self) -> NDArray[np.int8]:
        """Return which shots are available to the agent in each end, (num_envs, n): 1 or 0; see
        `CurlingEndEnv`.
        """
        return np.array([self.mask(end.view) for end in self._episodes])
