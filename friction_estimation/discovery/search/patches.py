"""The search for effects within a rectangle of the sheet, such as a patch of other friction.

Around a fit, more friction over one cell shortens the rest of a path. The linear response to it is
a column of sensitivities per cell. The gain of any rectangle then follows from sums over its cells,
so that all rectangles can be tried.
"""

from __future__ import annotations

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.model.candidates import Term, known_effects
from friction_estimation.discovery.model.elimination import (
    eliminate_factor,
    eliminate_states,
    gram_matrices,
)
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.quadratic import prior_gram
from friction_estimation.discovery.model.sensitivity import linearised_paths, sensitivities
from friction_estimation.discovery.tuning import LONGEST_PATCH, PATCH_CELL

Rectangle = tuple[float, float, float, float]
"""Least and greatest x, least and greatest y [m]."""


def find_patches(fitted: SessionFit) -> list[Term]:
    """Effects within the rectangle that promises most, as terms at their neutral values.

    They are the effects of the catalogue whose card names an area, unless the model has them.
    """
    present = {term.name for term in fitted.model.terms}
    cards = [
        card
        for card in known_effects(fitted.session.measurements).values()
        if card.search.area is not None and card.name not in present
    ]
    rectangle = _find_rectangle(fitted) if cards else None
    if rectangle is None:
        return []
    return [
        Term(
            card=card,
            values={**dict(zip(card.search.area or (), rectangle, strict=True)), **card.neutral},
            free=card.first,
        )
        for card in cards
    ]


def _find_rectangle(fitted: SessionFit) -> Rectangle | None:
    """The rectangle whose friction, if it were free, would improve the fit most."""
    session, model = fitted.session, fitted.model
    cell_x, cell_y = PATCH_CELL
    predicted, columns = sensitivities(model, session, fitted.states, fitted.ln_factors)
    paths = linearised_paths(model, session, fitted.states, fitted.ln_factors)
    x_low, y_low = predicted[:, 0].min(), predicted[:, 1].min()
    nx = max(1, int(np.ceil((predicted[:, 0].max() - x_low) / cell_x)))
    ny = max(1, int(np.ceil((predicted[:, 1].max() - y_low) / cell_y)))
    size = nx * ny
    information, right_side = np.zeros((size, size)), np.zeros(size)
    shared = len(model.vector)
    prior = prior_gram(model, shared + 1)
    cross_all, inner_all, right_all = np.zeros((size, shared)), prior[:-1, :-1], prior[:-1, -1]
    residual = fitted.residuals
    for i in range(len(session)):
        rows = session.rows(i)
        at = paths.instants_of_throw(i)
        x, y = paths.xy[at].T
        cell = np.clip(((x - x_low) / cell_x).astype(int), 0, nx - 1) * ny
        cell += np.clip(((y - y_low) / cell_y).astype(int), 0, ny - 1)
        crossed = np.unique(cell)
        inside = (cell[:, None] == crossed).astype(np.float64)
        response = paths.responses_of_throw(i, paths.friction[at], inside)
        stacked = np.concatenate([columns[rows], response, residual[rows][:, :, None]], axis=2)
        grams = eliminate_states(gram_matrices(session.only([i]), fitted.noise, stacked))
        reduced = eliminate_factor(grams, fitted.ln_factors[[i]], model.spread)[0][0]
        cells = slice(shared, -1)
        information[np.ix_(crossed, crossed)] += reduced[cells, cells]
        cross_all[crossed] += reduced[cells, :shared]
        inner_all += reduced[:shared, :shared]
        right_all += reduced[:shared, -1]
        right_side[crossed] += reduced[cells, -1]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(inner_all), 1e-300))
    scaled = inner_all * scale[:, None] * scale + 1e-10 * np.eye(shared)
    half = np.linalg.solve(scaled, scale[:, None] * cross_all.T)
    information -= (cross_all * scale) @ half
    right_side -= half.T @ (scale * right_all)
    found = _best_rectangle(information.reshape(nx, ny, nx, ny), right_side.reshape(nx, ny))
    if found is None:
        return None
    i0, i1, j0, j1 = found
    # Beside the outermost stones a rectangle may go on: nothing tells.
    sides = (
        x_low + i0 * cell_x - (0.5 if i0 == 0 else 0.0),
        x_low + i1 * cell_x + (0.5 if i1 == nx else 0.0),
        y_low + j0 * cell_y,
        y_low + j1 * cell_y,
    )
    x_edge, y_edge = model.ice.sheet.width / 2, model.ice.sheet.length / 2
    left, right = np.clip(sides[:2], -x_edge, x_edge).tolist()
    near, far = np.clip(sides[2:], -y_edge, y_edge).tolist()
    return (left, right, near, far) if left < right and near < far else None


def _best_rectangle(information: Floats, right_side: Floats) -> tuple[int, int, int, int] | None:
    """First cell and cell after the last, across and along, of the rectangle that gains most."""
    nx, ny = right_side.shape
    best, found = 0.0, None
    for i0 in range(nx):
        inner = np.zeros((ny, ny))
        right = np.zeros(ny)
        for i1 in range(i0 + 1, nx + 1):
            new = i1 - 1
            right = right + right_side[new]
            cross = information[new, :, i0:new].sum(axis=1) if new > i0 else 0.0
            inner = inner + information[new, :, new] + cross + np.transpose(cross)
            sums = np.zeros((ny + 1, ny + 1))
            sums[1:, 1:] = inner.cumsum(axis=0).cumsum(axis=1)
            heads = np.concatenate([[0.0], right.cumsum()])
            a, b = np.triu_indices(ny + 1, 1)
            short = b - a <= LONGEST_PATCH
            a, b = a[short], b[short]
            numerator = heads[b] - heads[a]
            denominator = sums[b, b] - sums[a, b] - sums[b, a] + sums[a, a]
            gains = np.where(denominator > 1e-6, numerator**2 / np.maximum(denominator, 1e-6), 0.0)
            k = int(np.argmax(gains))
            if gains[k] > best:
                best, found = float(gains[k]), (i0, i1, int(a[k]), int(b[k]))
    return found
