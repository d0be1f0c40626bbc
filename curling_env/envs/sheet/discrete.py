"""Actions out of a list: for agents that choose rather than aim."""

from __future__ import annotations

from itertools import product
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from curling_env.errors import InputError


class DiscreteThrows(
    gymnasium.ActionWrapper[Any, Any, NDArray[np.float32]], gymnasium.utils.RecordConstructorArgs
):
    """Throws from a grid over the range of throws, numbered by speed, then line, then spin.

    Parameters
    ----------
    env : `CurlingSheet-v0` or `CurlingEnd-v0` whose action is a throw alone
    speeds, angles, spins : steps over each range, ends included

    Raises
    ------
    InputError : fewer than one step, or an environment whose action is more than a throw
    """

    def __init__(
        self, env: gymnasium.Env[Any, Any], *, speeds: int = 25, angles: int = 25, spins: int = 2
    ) -> None:
        gymnasium.utils.RecordConstructorArgs.__init__(
            self, speeds=speeds, angles=angles, spins=spins
        )
        super().__init__(env)
        for name, steps in (("speeds", speeds), ("angles", angles), ("spins", spins)):
            if steps < 1:
                raise InputError(f"{name} must be at least 1, got {steps}")
        if env.action_space.shape != (3,):
            raise InputError("only an action of speed, line and spin can be chosen from a list")
        steps = (_steps(speeds), _steps(angles), _steps(spins))
        self.throws = np.array(list(product(*steps)), dtype=np.float32)
        """(n, 3) the actions of the environment that are chosen from."""
        self.action_space: Any = spaces.Discrete(len(self.throws))

    def action(self, action: Any) -> NDArray[np.float32]:
        """The environment's action of that number."""
        return self.throws[int(action)]


def _steps(count: int) -> NDArray[np.float64]:
    return np.zeros(1) if count == 1 else np.linspace(-1.0, 1.0, count)
