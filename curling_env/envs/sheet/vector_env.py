"""Many sheets of `CurlingSheet-v0` with throws simulated together."""

from __future__ import annotations

from typing import Any

from gymnasium.vector import AutoresetMode

from curling_env.envs.sheet.core import SheetCore, Sheets
from curling_env.envs.sheet.players import play_together
from curling_env.envs.vector import EnvsTogether
from curling_env.errors import InputError
from curling_env.physics.batch import MOST_STONES


class CurlingSheetVectorEnv(SheetCore, EnvsTogether[Sheets]):
    """Many sheets of `CurlingSheet-v0` at once.

    With the same seeds, sheets, throws and rewards are those of `CurlingSheetEnv`, in far less
    time. `info` holds the same entries in Gymnasium's form, as arrays with a mask each; of the
    `details` it has `trajectory` and `outcome` only with `fps`.

    Parameters
    ----------
    num_envs : number of sheets
    autoreset_mode : when an episode that is over begins again: in the next step ("NextStep"), whose
        action is then not thrown; in the same step ("SameStep"), so that every step is a throw; or
        when `reset` asks for it with a `reset_mask` ("Disabled")
    fps : samples a second of `trajectory` in `info`, which with it has the `details`. Throws are
        then simulated one by one, as slowly as in `CurlingSheetEnv`
    render_mode : None; many sheets are not drawn
    settings : options of `CurlingSheetEnv`; at most sixteen stones on a sheet

    Raises
    ------
    InputError : an invalid setting, or that only a single sheet can have
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        fps: float | None = None,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        self.place(num_envs, autoreset_mode, render_mode)
        if fps is not None:
            settings = {"details": True, **settings, "fps": fps}
        super().__init__(**settings)
        if fps is None:
            self.player = play_together
        if self.observation.slots > MOST_STONES:
            raise InputError(
                f"expected at most {MOST_STONES} stones on each sheet of a vector environment, "
                f"got {self.observation.slots} with the throws"
            )
