"""An ice on which many throws are simulated together, for the vector environments."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.batch import BatchEngine, IceVariants, Positions
from curling_env.physics.engine import Status, is_hogged, left_over_side_line
from curling_env.physics.slides import play_bounds
from curling_env.physics.tuning import QUICK_TOLERANCE
from curling_env.sheet import Direction
from curling_env.typing import Floats, Indices


class Field:
    """Simulator of many throws towards one end, as exact as the engine of a single environment.

    Parameters
    ----------
    ice : the ice thrown on, or the usual one of several
    variants : where throws are on several ices of a family, these
    """

    ice: Ice

    def __init__(self, ice: Ice, variants: IceVariants | None = None) -> None:
        self.ice, self._variants = ice, variants

    @cached_property
    def _engine(self) -> BatchEngine:
        return BatchEngine(self._variants or self.ice, tolerance=QUICK_TOLERANCE)

    @cached_property
    def _bounds(self) -> dict[int, Floats]:
        return {int(end): play_bounds(self.ice, end) for end in Direction}

    def play(
        self,
        stones: Floats,
        identifiers: Sequence[int],
        releases: NDArray[Any],
        direction: int,
        *,
        which: Indices | None = None,
    ) -> Positions:
        """Return the positions after throws.

        Parameters
        ----------
        stones : (n, k, 2) the stones before, sheet frame; NaN for missing ones [m]
        identifiers : (k,) of these stones
        releases : (n,) from `curling_env.physics.batch.releases_of`
        direction : the end played to, 1 or -1
        which : (n,) index of the ice of each throw, where there are several

        Raises
        ------
        InputError : stones outside the lines or in one place, or ice on which one never stops
        """
        bounds = self._bounds[direction]
        after = self._engine.play(
            stones, releases, which=which, identity=identifiers, bounds=bounds
        )
        if (after.collisions < 0).any():
            raise InputError("a stone never stops on this ice; check its friction and slope")
        return after

    def statuses(self, after: Positions, direction: int) -> NDArray[np.str_]:
        """Return the name of each stone's `Status`, (n, k + 1), the delivered one last.

        Parameters
        ----------
        after : the positions after throws; stones that were never there count as out
        direction : the end played to
        """
        x, y = after.last[..., 0], after.last[..., 1]
        by_side = left_over_side_line(x, y, self._bounds[direction])
        out = np.where(by_side, Status.OUT_SIDE.value, Status.OUT_BACK.value)
        status = np.where(np.isnan(after.xy[..., 0]), out, Status.REST.value)
        hogged = is_hogged(y[:, -1], direction, self.ice.stone.radius) & (after.collisions == 0)
        status[(status[:, -1] == Status.REST.value) & hogged, -1] = Status.HOGGED.value
        return status
