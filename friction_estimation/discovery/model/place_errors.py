"""Errors of measured places that all throws share: what a place does to a track, not the ice.

What is left of a lens, a pose and a stone's outline displaces every stone that passes a place by
the same millimetres, and no number of throws averages that away. The displacement is taken for a
smooth field over the sheet, Gaussian, as wide as the throws themselves say: its coefficients are
shared parameters with a prior, found beside those of the ice, and its amplitude is the likeliest.
Beside it the look learnt for the stone may be off its centre, by as little.
An amplitude beyond that of a good calibration is not allowed: a lens that is wrong by centimetres
is to be found, not to be swallowed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session

LENGTH = 7.0
"""Over which the field changes along the sheet [m]: lenses, poses and outlines bend no faster."""
SPACING = 4.5
"""Between the nodes along the sheet that span the field [m]."""
TIMES_CLAIMED = (0.5, 3.0)
"""Least and largest amplitude over the standard error that the tracks claim. What is shared by all
throws looks like ice in part, so that the throws alone never rule it out."""
WIDEST = (2e-3, 8e-3)
"""The same in metres at most. A tracker that notices that its lens is wrong claims decimetres."""
STEPS = 6
"""Amplitudes tried."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Misplacement:
    """A displacement of measured places: smooth along the sheet, linear across it; and one that
    turns with the stone.

    Parameters
    ----------
    nodes : (n,) along the sheet [m]
    amplitudes : that may be tried [m]
    amplitude : standard deviation of each coordinate on the centre line [m]
    values : (4 n + 2,) coefficients; the last two are ahead of the centre and to the left of the
        heading
    held : whether the coefficients stay as they are, and are no parameters of a fit
    """

    nodes: Floats
    amplitudes: Floats
    amplitude: float
    values: Floats
    held: bool = False

    def __len__(self) -> int:
        """Coefficients that a fit may change."""
        return 0 if self.held else len(self.values)

    @cached_property
    def _root(self) -> Floats:
        """Inverse square root of the field's correlation between its nodes."""
        values, vectors = np.linalg.eigh(_correlation(self.nodes, self.nodes))
        return vectors / np.sqrt(np.maximum(values, 1e-6))

    def columns(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements per unit of each coefficient, (rows, 2, 4 n + 2)."""
        shape = self._shape(xy)
        count = shape.shape[1]
        out = np.zeros((len(xy), 2, 2 * count + 2))
        out[:, 0, :count] = out[:, 1, count : 2 * count] = shape
        out[:, 0, -2], out[:, 1, -2] = np.cos(theta), np.sin(theta)
        out[:, 0, -1], out[:, 1, -1] = -np.sin(theta), np.cos(theta)
        return out

    def displacement(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements of places, (rows, 2) [m]."""
        ahead, left = self.values[-2:]
        cosine, sine = np.cos(theta), np.sin(theta)
        turning = np.column_stack([ahead * cosine - left * sine, ahead * sine + left * cosine])
        return self._shape(xy) @ self.values[:-2].reshape(2, -1).T + turning

    def _shape(self, xy: Floats) -> Floats:
        along = _correlation(xy[:, 1], self.nodes) @ self._root
        return np.concatenate([along, along * xy[:, :1]], axis=1)

    @property
    def deviations(self) -> Floats:
        """Prior standard deviation of each coefficient, (4 n + 2,) [m].

        That which turns with the stone stays at the least amplitude: more is a tracked point beside
        the centre, and to be found.
        """
        out = np.full(len(self.values), self.amplitude)
        out[-2:] = self.amplitudes[0]
        return out

    def at(self, values: Floats) -> Misplacement:
        """With other coefficients."""
        return replace(self, values=values)


def _correlation(y: Floats, nodes: Floats) -> Floats:
    return np.exp(-0.5 * ((y[:, None] - nodes) / LENGTH) ** 2)


def misplacement_of(session: Session) -> Misplacement | None:
    """A field that is still zero, over all places of a session; None where tracks do not err so."""
    if session.claimed <= 0.0:
        return None
    low, high = float(session.xy[:, 1].min()), float(session.xy[:, 1].max())
    nodes = np.linspace(low, high, max(3, int(np.ceil((high - low) / SPACING)) + 1))
    least, most = np.minimum(np.array(TIMES_CLAIMED) * session.claimed, WIDEST)
    amplitudes = np.geomspace(least, most, STEPS)
    return Misplacement(
        nodes=nodes,
        amplitudes=amplitudes,
        amplitude=float(amplitudes[0]),
        values=np.zeros(4 * len(nodes) + 2),
    )
