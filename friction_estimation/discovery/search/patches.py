"""The search for effects within a rectangle of the sheet, such as a patch of other friction.

Around a fit, more friction over one cell shortens the rest of a path. The linear response to it is
a column of sensitivities per cell. The gain of any rectangle then follows from sums over its cells,
so that all rectangles can be tried.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curling_env.physics.effects import EffectCard
from curling_env.sheet import Sheet
from curling_env.typing import Floats, Indices
from friction_estimation.discovery.model.candidates import Term, known_effects
from friction_estimation.discovery.model.elimination import (
    eliminate_factor,
    eliminate_states,
    gram_matrix,
)
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.quadratic import prior_gram
from friction_estimation.discovery.model.response import LinearisedPaths
from friction_estimation.discovery.tuning import LONGEST_PATCH, MOST_CELLS_ACROSS, PATCH_CELL

Rectangle = tuple[float, float, float, float]
"""Least and greatest x, least and greatest y [m]."""
Block = tuple[int, int, int, int]
"""First cell and cell after the last, across and along."""


class Grid(NamedTuple):
    """Cells of which a rectangle consists.

    Parameters
    ----------
    low : least x and y [m]
    size : width and length of a cell [m]
    shape : number of cells across and along
    """

    low: tuple[float, float]
    size: tuple[float, float]
    shape: tuple[int, int]

    def cells_of(self, xy: Floats) -> Indices:
        """Flat indices of the cells in which points (n, 2) lie, (n,)."""
        (nx, ny), place = self.shape, ((xy - self.low) / self.size).astype(int)
        return np.clip(place[:, 0], 0, nx - 1) * ny + np.clip(place[:, 1], 0, ny - 1)

    def rectangle(self, block: Block, sheet: Sheet) -> Rectangle | None:
        """A block of cells as a rectangle of a sheet; None where it lies outside.

        Beside the outermost stones it goes on: nothing tells.
        """
        (i0, i1, j0, j1), (x, y), (width, length) = block, self.low, self.size
        x_edge, y_edge = sheet.width / 2, sheet.length / 2
        beside = (0.5 if i0 == 0 else 0.0, 0.5 if i1 == self.shape[0] else 0.0)
        sides = (x + i0 * width - beside[0], x + i1 * width + beside[1])
        left, right = np.clip(sides, -x_edge, x_edge).tolist()
        near, far = np.clip((y + j0 * length, y + j1 * length), -y_edge, y_edge).tolist()
        return (left, right, near, far) if left < right and near < far else None


def grid_over(xy: Floats, size: tuple[float, float]) -> Grid:
    """The grid of cells of a size over points (n, 2)."""
    low, span = xy.min(axis=0), np.ptp(xy, axis=0)
    width = max(size[0], float(span[0]) / MOST_CELLS_ACROSS)
    shape = np.maximum(1, np.ceil(span / (width, size[1]))).astype(int)
    return Grid((float(low[0]), float(low[1])), (width, size[1]), (int(shape[0]), int(shape[1])))


def find_patches(fitted: SessionFit) -> list[Term]:
    """Effects within the rectangle that promises most, as terms at their neutral values.

    They are the effects of the catalogue whose card names an area, unless the model has them. Gates
    time the way between them as a whole, and show no places.
    """
    cards = cards_of_areas(fitted)
    if not cards or fitted.session.gates is not None:
        return []
    grid = grid_over(fitted.predicted[:, :2], PATCH_CELL)
    cells = responses_of_cells(fitted.paths, grid)
    found = rectangle_beside(fitted, fitted.model, fitted.columns, fitted.residuals, cells, grid)
    return [] if found is None else [term_within(card, found.rectangle) for card in cards]


def cards_of_areas(fitted: SessionFit) -> list[EffectCard]:
    """Effects whose card names an area, and that the model of a fit does not have."""
    present = {term.name for term in fitted.model.terms}
    known = known_effects(fitted.session.measurements).values()
    return [card for card in known if card.search.area is not None and card.name not in present]


def term_within(card: EffectCard, rectangle: Rectangle) -> Term:
    """An effect within a rectangle, at its neutral values."""
    sides = dict(zip(card.search.area or (), rectangle, strict=True))
    return Term(card=card, values={**sides, **card.neutral}, free=card.first)


def responses_of_cells(paths: LinearisedPaths, grid: Grid) -> list[tuple[Indices, Floats]]:
    """For every throw the cells that it crosses, (c,), and how its rows respond, (rows, 3, c)."""
    found: list[tuple[Indices, Floats]] = []
    for i in range(len(paths.session)):
        at = paths.instants_of_throw(i)
        cell = grid.cells_of(paths.xy[at])
        crossed = np.unique(cell)
        inside = (cell[:, None] == crossed).astype(np.float64)
        found.append((crossed, paths.responses_of_throw(i, paths.friction[at], inside)))
    return found


class Promised(NamedTuple):
    """A rectangle with its promised gain.

    Parameters
    ----------
    rectangle : the rectangle
    gain : fall of −2 ln likelihood if everything stays linear
    """

    rectangle: Rectangle
    gain: float


def rectangle_beside(
    fitted: SessionFit,
    model: Model,
    columns: Floats,
    residual: Floats,
    cells: list[tuple[Indices, Floats]],
    grid: Grid,
) -> Promised | None:
    """The rectangle whose friction, if it were free, would improve a fit most.

    Parameters
    ----------
    fitted : the fit
    model : its model, or one that is linear around it
    columns, residual : (rows, 3, 7 + P), (rows, 3) sensitivities of that model, and what it leaves
    cells, grid : the cells and the responses to them, as of `responses_of_cells`
    """
    session, (nx, ny) = fitted.session, grid.shape
    shared = len(model.vector)
    information, right_side = np.zeros((nx * ny, nx * ny)), np.zeros(nx * ny)
    prior = prior_gram(model, shared + 1)
    cross_all, inner_all, right_all = np.zeros((nx * ny, shared)), prior[:-1, :-1], prior[:-1, -1]
    for i, (crossed, response) in enumerate(cells):
        rows = session.rows(i)
        stacked = np.concatenate([columns[rows], response, residual[rows][:, :, None]], axis=2)
        grams = eliminate_states(gram_matrix(session, fitted.noise, i, stacked)[None])
        reduced = eliminate_factor(grams, fitted.ln_factors[[i]], fitted.model.spread)[0][0]
        own = slice(shared, -1)
        information[np.ix_(crossed, crossed)] += reduced[own, own]
        cross_all[crossed] += reduced[own, :shared]
        inner_all += reduced[:shared, :shared]
        right_all += reduced[:shared, -1]
        right_side[crossed] += reduced[own, -1]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(inner_all), 1e-300))
    scaled = inner_all * scale[:, None] * scale + 1e-10 * np.eye(shared)
    anywhere = np.unique(np.concatenate([crossed for crossed, _ in cells]))
    cross = cross_all[anywhere] * scale
    half = np.linalg.solve(scaled, cross.T)
    information[np.ix_(anywhere, anywhere)] -= cross @ half
    right_side[anywhere] -= half.T @ (scale * right_all)
    longest = round(LONGEST_PATCH / grid.size[1])
    found = _best_rectangle(
        information.reshape(nx, ny, nx, ny), right_side.reshape(nx, ny), longest
    )
    if found is None:
        return None
    rectangle = grid.rectangle(found[0], model.ice.sheet)
    return None if rectangle is None else Promised(rectangle, found[1])


def _best_rectangle(
    information: Floats, right_side: Floats, longest: int
) -> tuple[Block, float] | None:
    """The block of cells that gains most, no longer than some cells, and its gain."""
    nx, ny = right_side.shape
    best, found = 0.0, None
    a, b = np.triu_indices(ny + 1, 1)
    short = b - a <= longest
    a, b = a[short], b[short]
    # Of the blocks from each column to the present one: what they tell, row by row.
    inner, right = np.zeros((nx, ny, ny)), np.zeros((nx, ny))
    sums = np.zeros((ny + 1, ny + 1))
    for last in range(nx):
        added = information[last, :, last].copy()
        for i0 in range(last, -1, -1):
            if i0 < last:
                cross = information[last, :, i0]
                added += cross
                added += cross.T
            inner[i0] += added
            right[i0] += right_side[last]
            sums[1:, 1:] = inner[i0].cumsum(axis=0).cumsum(axis=1)
            heads = np.concatenate([[0.0], right[i0].cumsum()])
            numerator = heads[b] - heads[a]
            denominator = sums[b, b] - sums[a, b] - sums[b, a] + sums[a, a]
            gains = np.where(denominator > 1e-6, numerator**2 / np.maximum(denominator, 1e-6), 0.0)
            k = int(np.argmax(gains))
            # Where no stone ran, the side goes on to the left: nothing tells.
            wider = found is not None and found[1] == last + 1 and gains[k] == best
            if gains[k] > best or wider:
                best, found = float(gains[k]), (i0, last + 1, int(a[k]), int(b[k]))
    return None if found is None else (found, best)
