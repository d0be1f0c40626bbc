"""Discrete actions: an agent chooses a throw from a list."""

from __future__ import annotations

from itertools import product
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from curling_env.errors import InputError
from curling_env.typing import Floats, Singles


class DiscreteThrows(
    gymnasium.ActionWrapper[Any, Any, Singles], gymnasium.utils.RecordConstructorArgs
):
    """Throws from a grid over the range of throws, numbered by speed, then line, then spin.

    Parameters
    ----------
    env : `CurlingSheet-v0`, or `CurlingEnd-v0` whose action is a throw alone
    speeds, angles, spins : number of grid points over each range, both ends included

    Raises
    ------
    InputError : a number below one, or an environment whose action is more than a throw
    """

    def __init__(
        self, env: gymnasium.Env[Any, Any], *, speeds: int = 25, angles: int = 25, spins: int = 2
    ) -> None:
        gymnasium.utils.RecordConstructorArgs.__init__(
            self, speeds=speeds, angles=angles, spins=spins
        )
        super().__init__(env)
        for name, number in (("speeds", speeds), ("angles", angles), ("spins", spins)):
            if number < 1:
                raise InputError(f"{name} must be at least 1, got {number}")
        if env.action_space.shape != (3,):
            raise InputError("only an action of speed, line and spin can be chosen from a list")
        grid = product(_grid_points(speeds), _grid_points(angles), _grid_points(spins))
        self.throws = np.array(list(grid), dtype=np.float32)
        """(n, 3) the environment's actions to choose from."""
        self.action_space: Any = spaces.Discrete(len(self.throws))

    def action(self, action: Any) -> Singles:
        """Return the environment's action with that number."""
        return self.throws[int(action)]


def _grid_points(number: int) -> Floats:
    return np.zeros(1) if number == 1 else np.linspace(-1.0, 1.0, number)
