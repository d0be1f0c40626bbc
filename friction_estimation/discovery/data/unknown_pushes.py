"""Pushes of an unknown effect on the stones of a session, per throw and over time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curling_env.typing import Floats, Indices


class UnknownPushes(NamedTuple):
    """Pushes at regular times of every throw, from its release on, interpolated linearly.

    Parameters
    ----------
    sizes : (n, 4) change of ln μ; acceleration to the left of the travel and along the sheet's x
        [m/s²]; acceleration of the spin [rad/s²]
    starts : (k + 1,) where each throw begins; none has fewer than two times
    spacing : (k,) time between two of them [s]
    """

    sizes: Floats
    starts: Indices
    spacing: Floats

    def only(self, chosen: Indices) -> UnknownPushes:
        """Those of some throws."""
        parts = [self.sizes[self.starts[i] : self.starts[i + 1]] for i in chosen.tolist()]
        counts = np.diff(self.starts)[chosen]
        return UnknownPushes(
            np.concatenate([*parts, self.sizes[:0]]),
            np.concatenate([[0], np.cumsum(counts)]).astype(np.intp),
            self.spacing[chosen],
        )

    def at(self, i: int, times: Floats) -> Floats:
        """Return the pushes of the i-th throw at some times, (n, 4)."""
        own = self.sizes[self.starts[i] : self.starts[i + 1]]
        known = self.spacing[i] * np.arange(len(own))
        return np.column_stack([np.interp(times, known, column) for column in own.T])


def no_pushes(throws: int) -> UnknownPushes:
    """Return pushes of zero for a number of throws."""
    starts = np.zeros(throws + 1, dtype=np.intp)
    return UnknownPushes(np.zeros((0, 4)), starts, np.ones(throws))
