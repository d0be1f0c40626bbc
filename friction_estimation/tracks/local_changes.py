"""Sudden changes along a track: local fits with one acceleration or velocity before, another after.

A push that ends changes the acceleration, a contact changes the velocity.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curling_env.physics.compiled import compiled
from curling_env.typing import Floats


class LocalChanges(NamedTuple):
    """Fits about some times.

    Parameters
    ----------
    after : (m,) acceleration after each time [m/s²]
    change : (m,) excess before it, of velocity [m/s] or acceleration [m/s²]
    spread : (m,) standard deviation of the rows about the fit [m]
    gain : (m,) standard error of the change for rows of unit noise; infinite if there are too few
        rows
    """

    after: Floats
    change: Floats
    spread: Floats
    gain: Floats

    def deviations(self, noise: float) -> Floats:
        """Return the changes in standard errors, (m,).

        Parameters
        ----------
        noise : least standard deviation of a row [m]
        """
        return self.change / (np.maximum(self.spread, noise) * self.gain)


def changes_about(
    times: Floats,
    t: Floats,
    values: Floats,
    *,
    span: tuple[float, float],
    order: int,
    least_rows: tuple[int, int],
) -> LocalChanges:
    """Fit a parabola to the rows about each time, with one more derivative before it.

    Parameters
    ----------
    times : (m,) increasing times [s]
    t, values : (n,) times of the rows [s] and coordinates [m]
    span : time before and after within which rows are fitted [s]
    order : derivative that changes: 1 the velocity, 2 the acceleration
    least_rows : minimum number of rows before and after
    """
    grams, counts = np.zeros((len(times), 5, 5)), np.zeros((len(times), 2))
    first = np.searchsorted(t, times - span[0])
    last = np.searchsorted(t, times + span[1])
    _sum_products(times, t, values, first, last, order, np.empty(5), grams, counts)
    enough = (counts[:, 0] >= least_rows[0]) & (counts[:, 1] >= least_rows[1])
    known = np.flatnonzero(enough & (counts.sum(axis=1) > 5))
    after, change, spread = np.zeros((3, len(times)))
    gain = np.full(len(times), np.inf)
    inverse, right = np.linalg.inv(grams[known, :4, :4]), grams[known, :4, 4]
    solution = np.einsum("kij,kj->ki", inverse, right)
    left = np.maximum(grams[known, 4, 4] - np.einsum("ki,ki->k", solution, right), 0.0)
    after[known], change[known] = solution[:, 2], solution[:, 3]
    spread[known] = np.sqrt(left / (counts[known].sum(axis=1) - 4))
    gain[known] = np.sqrt(inverse[:, 3, 3])
    return LocalChanges(after, change, spread, gain)


@compiled
def _sum_products(
    times: Floats,
    t: Floats,
    values: Floats,
    first: Floats,
    last: Floats,
    order: int,
    row: Floats,
    grams: Floats,
    counts: Floats,
) -> None:
    """Compute sums of products of a fit's columns, and the values, about each time.

    Parameters
    ----------
    times : (m,) times [s]
    t, values : (n,) times of the rows [s] and values
    first, last : (m,) first and past-last row that is fitted
    order : derivative that changes, 1 or 2
    row : (5,) work array for a row of the fit: 1, u, u²/2, the change before the time, value
    grams : (m, 5, 5) zeros, to which the sums are added
    counts : (m, 2) zeros, to which the numbers of rows before and after are added
    """
    for k in range(len(times)):
        for i in range(first[k], last[k]):
            u = t[i] - times[k]
            if u < 0:
                counts[k, 0] += 1
            elif u > 0:
                counts[k, 1] += 1
            before = min(u, 0.0)
            row[0], row[1], row[2] = 1.0, u, 0.5 * u**2
            row[3] = before if order == 1 else 0.5 * before**2
            row[4] = values[i] - values[first[k]]
            for p in range(5):
                for q in range(5):
                    grams[k, p, q] += row[p] * row[q]
