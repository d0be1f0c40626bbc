"""The search for an area of other friction.

Around a fit, more friction over one cell pushes the rest of a path back: a column of sensitivities
per cell, by integrating the deceleration twice. The gain of any rectangle is then a sum over its
cells, and all rectangles are tried at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats
from friction_estimation.discovery.model.candidates import Term, forms
from friction_estimation.discovery.model.fit import Fit, gram_matrices, prior_gram
from friction_estimation.discovery.model.model import sensitivities

CELL_X = 0.25
"""Width of the search's cells [m]: stones rarely run closer side by side."""
CELL_Y = 1.0
"""Length of the search's cells [m]."""
SHORTEST = 1
LONGEST = 16
"""Length of the rectangles tried, in cells: a longer one is the sheet, not a patch."""


def find_patch(fitted: Fit) -> Term | None:
    """The rectangle of other friction that would gain most, as a term at its neutral factor."""
    form = forms().get("friction_patch")
    if form is None:
        return None
    session, model = fitted.session, fitted.model
    predicted, columns = sensitivities(model, session, fitted.states, fitted.ln_factors)
    x_low, y_low = predicted[:, 0].min(), predicted[:, 1].min()
    nx = max(1, int(np.ceil((predicted[:, 0].max() - x_low) / CELL_X)))
    ny = max(1, int(np.ceil((predicted[:, 1].max() - y_low) / CELL_Y)))
    size = nx * ny
    information, pull = np.zeros((size, size)), np.zeros(size)
    shared = len(model.vector)
    prior = prior_gram(model, shared + 1)
    cross_all, inner_all, right_all = np.zeros((size, shared)), prior[:-1, :-1], prior[:-1, -1]
    residual = fitted.residuals
    for i in range(len(session)):
        rows = session.rows(i)
        path, t = predicted[rows], session.times[rows]
        cell = np.clip(((path[:, 0] - x_low) / CELL_X).astype(int), 0, nx - 1) * ny
        cell += np.clip(((path[:, 1] - y_low) / CELL_Y).astype(int), 0, ny - 1)
        crossed, owner = np.unique(cell, return_inverse=True)
        response = _responses(path, t, owner, len(crossed), columns[rows, :, 6])
        stacked = np.concatenate([columns[rows], response, residual[rows][:, :, None]], axis=2)
        gram = gram_matrices(session.only([i]), fitted.noise, stacked)[0]
        own = gram[:7, :7].copy()
        if model.spread > 0:
            own[6, 6] += model.spread**-2
        else:
            own[6, 6] *= 1e9
        scale = 1.0 / np.sqrt(np.maximum(np.diag(own), 1e-300))
        own = own * scale[:, None] * scale + 1e-12 * np.eye(7)
        across = scale[:, None] * gram[:7, 7:]
        left = gram[7:, 7:] - across.T @ np.linalg.solve(own, across)
        cells = slice(shared, -1)
        information[np.ix_(crossed, crossed)] += left[cells, cells]
        cross_all[crossed] += left[cells, :shared]
        inner_all += left[:shared, :shared]
        right_all += left[:shared, -1]
        pull[crossed] += left[cells, -1]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(inner_all), 1e-300))
    scaled = inner_all * scale[:, None] * scale + 1e-10 * np.eye(shared)
    half = np.linalg.solve(scaled, scale[:, None] * cross_all.T)
    information -= (cross_all * scale) @ half
    pull -= half.T @ (scale * right_all)
    found = _best_rectangle(information.reshape(nx, ny, nx, ny), pull.reshape(nx, ny))
    if found is None:
        return None
    i0, i1, j0, j1 = found
    values = {
        "x_min": x_low + i0 * CELL_X - (0.5 if i0 == 0 else 0.0),
        "x_max": x_low + i1 * CELL_X + (0.5 if i1 == nx else 0.0),
        "y_min": y_low + j0 * CELL_Y,
        "y_max": y_low + j1 * CELL_Y,
        "factor": 1.0,
    }
    return Term(form=form, values={k: float(v) for k, v in values.items()}, free=("factor",))


def _responses(
    path: Floats, t: Floats, owner: NDArray[np.intp], count: int, unit: Floats
) -> Floats:
    """Columns (n, 3, count): paths' change for more friction in each cell.

    Parameters
    ----------
    unit : (n, 3) their change for more friction everywhere, which the columns sum up to
    """
    speed = np.maximum(np.hypot(path[:, 2], path[:, 3]), 1e-6)
    brake = -np.maximum(-np.gradient(speed, t), 0.0)
    active = np.zeros((len(t), count))
    active[np.arange(len(t)), owner] = brake
    steps = np.diff(t, prepend=t[0])[:, None]
    velocity = np.cumsum(active * steps, axis=0)
    moving = (speed > 0.02)[:, None]
    along = np.cumsum(velocity * steps * moving, axis=0)
    travel = path[:, 2:4] / speed[:, None]
    out = np.zeros((len(t), 3, count))
    out[:, 0], out[:, 1] = travel[:, :1] * along, travel[:, 1:] * along
    # The share of the whole response scales the heading's likewise.
    whole = along.sum(axis=1, keepdims=True)
    out[:, 2] = unit[:, 2:] * along / np.where(np.abs(whole) > 1e-9, whole, 1.0)
    return out


def _best_rectangle(information: Floats, pull: Floats) -> tuple[int, int, int, int] | None:
    """First and past-last cell across and along of the rectangle that gains most."""
    nx, ny = pull.shape
    best, found = 0.0, None
    for i0 in range(nx):
        inner = np.zeros((ny, ny))
        right = np.zeros(ny)
        for i1 in range(i0 + 1, nx + 1):
            new = i1 - 1
            right = right + pull[new]
            cross = information[new, :, i0:new].sum(axis=1) if new > i0 else 0.0
            inner = inner + information[new, :, new] + cross + np.transpose(cross)
            sums = np.zeros((ny + 1, ny + 1))
            sums[1:, 1:] = inner.cumsum(axis=0).cumsum(axis=1)
            heads = np.concatenate([[0.0], right.cumsum()])
            a, b = np.triu_indices(ny + 1, SHORTEST)
            short = b - a <= LONGEST
            a, b = a[short], b[short]
            numerator = heads[b] - heads[a]
            denominator = sums[b, b] - sums[a, b] - sums[b, a] + sums[a, a]
            gains = np.where(denominator > 1e-6, numerator**2 / np.maximum(denominator, 1e-6), 0.0)
            k = int(np.argmax(gains))
            if gains[k] > best:
                best, found = float(gains[k]), (i0, i1, int(a[k]), int(b[k]))
    return found
