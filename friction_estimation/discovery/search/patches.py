"""The search for effects within a rectangle of the sheet, such as a patch of different friction.

Around a fit, higher friction in one cell shortens the rest of a path. The linear response to it is
a column of sensitivities per cell. The gain of any rectangle then follows from sums over its cells,
so that all rectangles can be tried. The effect of a side along the sheet changes only when it
passes a stone's path, so that no derivative finds its position. The linear response to a small
change of friction beside it gives F at every position.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from curling_env.sheet import Sheet
from curling_env.typing import Floats, Indices
from friction_estimation.discovery.model.candidates import Term, known_effects
from friction_estimation.discovery.model.fit import SessionFit, refit
from friction_estimation.discovery.model.linearisation import Linearisation
from friction_estimation.discovery.model.minimum import projected
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.sensitivity import friction_along
from friction_estimation.discovery.tuning import (
    LEAST_GAIN,
    LONGEST_PATCH,
    NARROWEST_PATCH,
    PATCH_CELL,
    SIDE_SHIFTS,
)

Rectangle = tuple[float, float, float, float]
"""Least and greatest x, least and greatest y [m]."""
Block = tuple[int, int, int, int]
"""First cell and cell after the last, across and along."""


class Grid(NamedTuple):
    """Grid of cells for rectangles.

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
        """Return a block of cells as a rectangle of a sheet; None if it lies outside.

        Beyond the outermost stones it extends to the side of the sheet.
        """
        (i0, i1, j0, j1), (x, y), (width, length) = block, self.low, self.size
        x_edge, y_edge = sheet.width / 2, sheet.length / 2
        beside = (0.5 if i0 == 0 else 0.0, 0.5 if i1 == self.shape[0] else 0.0)
        sides = (x + i0 * width - beside[0], x + i1 * width + beside[1])
        left, right = np.clip(sides, -x_edge, x_edge).tolist()
        near, far = np.clip((y + j0 * length, y + j1 * length), -y_edge, y_edge).tolist()
        return (left, right, near, far) if left < right and near < far else None


def grid_over(xy: Floats, size: tuple[float, float]) -> Grid:
    """Return the grid of cells of a size over points (n, 2)."""
    low, span = xy.min(axis=0), np.ptp(xy, axis=0)
    shape = np.maximum(1, np.ceil(span / size)).astype(int)
    return Grid((float(low[0]), float(low[1])), size, (int(shape[0]), int(shape[1])))


def find_patches(fitted: SessionFit) -> list[Term]:
    """Return effects within the most promising rectangle, as terms at their neutral values.

    They are the effects of the catalogue whose card names an area, unless the model has them. Gate
    times show no differences from place to place.
    """
    present = {term.name for term in fitted.model.terms}
    known = known_effects(fitted.session.measurements).values()
    cards = [card for card in known if card.search.area is not None and card.name not in present]
    if not cards or fitted.session.gates is not None:
        return []
    sheet = fitted.model.ice.sheet
    edge = np.array([sheet.width, sheet.length]) / 2
    grid = grid_over(np.clip(fitted.session.xy, -edge, edge), PATCH_CELL)
    rectangle = find_rectangle(fitted, grid)
    if rectangle is None:
        return []
    areas = [dict(zip(card.search.area or (), rectangle, strict=True)) for card in cards]
    return [
        Term(card=card, values={**area, **card.neutral}, free=card.first)
        for card, area in zip(cards, areas, strict=True)
    ]


def find_rectangle(fitted: SessionFit, grid: Grid) -> Rectangle | None:
    """Return the rectangle with the largest gain from free friction.

    Parameters
    ----------
    fitted : the fit
    grid : cells of which it consists
    """
    session, paths, (nx, ny) = fitted.session, fitted.paths, grid.shape
    shared = nx * ny + np.arange(len(fitted.model.vector))
    whole = np.zeros((nx * ny + len(shared) + 1,) * 2)
    whole[nx * ny :, nx * ny :] = fitted.linear.prior
    for i in range(len(session)):
        rows, at = session.rows(i), paths.instants_of_throw(i)
        cell = grid.cells_of(paths.xy[at])
        crossed = np.unique(cell)
        inside = (cell[:, None] == crossed).astype(np.float64)
        response = paths.responses_of_throw(i, paths.friction[at], inside)
        residual = fitted.residuals[rows][:, :, None]
        columns = np.concatenate([fitted.columns[rows], response, residual], axis=2)
        one = session.only([i]), fitted.noise, fitted.model
        linear = Linearisation.of(*one, fitted.states[[i]], fitted.ln_factors[[i]], [columns])
        places = np.concatenate([shared, crossed, [len(whole) - 1]])
        whole[np.ix_(places, places)] += linear.each()[0][0]
    anywhere = np.flatnonzero(whole.diagonal()[: nx * ny])
    own = projected(whole, anywhere, shared)
    information, right_side = np.zeros((nx * ny, nx * ny)), np.zeros(nx * ny)
    information[np.ix_(anywhere, anywhere)] = own[:-1, :-1]
    right_side[anywhere] = own[:-1, -1]
    longest = round(LONGEST_PATCH / grid.size[1])
    block = _best_rectangle(
        information.reshape(nx, ny, nx, ny), right_side.reshape(nx, ny), longest
    )
    return None if block is None else grid.rectangle(block, fitted.model.ice.sheet)


def _best_rectangle(information: Floats, right_side: Floats, longest: int) -> Block | None:
    """Return the block of cells with the largest gain, up to a maximum length; None below the
    gain that an effect needs.
    """
    nx, ny = right_side.shape
    best, found = LEAST_GAIN, None
    a, b = np.triu_indices(ny + 1, 1)
    short = b - a <= longest
    a, b = a[short], b[short]
    # Information of the blocks from each column to the present one, row by row.
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
            # If no stone ran there, the side extends to the left.
            wider = found is not None and found[1] == last + 1 and gains[k] == best
            if gains[k] > best or wider:
                best, found = float(gains[k]), (i0, last + 1, int(a[k]), int(b[k]))
    return found


# --- the sides that run along the sheet ----------------------------------------------------------


class SideScan(NamedTuple):
    """A side of a patch at several positions, to first order around a fit.

    Parameters
    ----------
    shifts : (n,) distances from where it is [m]
    deviances : (n,) F there
    steps : (n, P) steps of the shared parameters that are best there
    """

    shifts: Floats
    deviances: Floats
    steps: Floats


def place_sides(fitted: SessionFit) -> SessionFit:
    """Move the sides of patches that run along the sheet to where they fit best."""
    for label, side in sides_along(fitted.model):
        scan = scan_side(fitted, label, side)
        shift = float(scan.shifts[int(np.argmin(scan.deviances))])
        if shift != 0.0:
            trial = refit(fitted, _with_side(fitted.model, label, side, shift), iterations=5)
            fitted = trial if trial.deviance < fitted.deviance - 1.0 else fitted
    return fitted


def sides_along(model: Model) -> list[tuple[str, str]]:
    """Term and parameter of every side of a patch that runs along the sheet and is not fitted."""
    return [
        (term.label, side)
        for term in model.terms
        for side in (term.card.search.area or ())[:2]
        if side not in term.free
    ]


def scan_side(fitted: SessionFit, label: str, side: str) -> SideScan:
    """Return F with a side of a patch at several places.

    Parameters
    ----------
    fitted : fit with the patch
    label, side : as of `sides_along`
    """
    edge, term = fitted.model.ice.sheet.width / 2, fitted.model.term(label)
    models = {0.0: fitted.model}
    for shift in SIDE_SHIFTS:
        model = _with_side(fitted.model, label, side, shift)
        if abs(term.values[side] + shift) <= edge and _width(model.term(label)) >= NARROWEST_PATCH:
            models[shift] = model
    paths, always = fitted.paths, np.ones((len(fitted.paths.path), 1))
    moved = [
        paths.responses(
            friction_along(model, fitted.session, fitted.ln_factors, paths) - paths.friction, always
        )
        for model in models.values()
    ]
    wide = np.concatenate([fitted.columns, *moved], axis=2)
    grams = fitted.linear_in(fitted.model, wide, fitted.residuals).grams
    count = fitted.columns.shape[2]
    own = [*range(count), grams.shape[1] - 1]
    deviances: list[float] = []
    steps: list[Floats] = []
    for k in range(len(models)):
        # The residual of that model is the residual minus the predicted change.
        around, change = grams[:, own][:, :, own], grams[:, own, count + k]
        around[:, :, -1] -= change
        around[:, -1, :] -= change
        around[:, -1, -1] += grams[:, count + k, count + k]
        linear = replace(fitted.linear, grams=around)
        deviances.append(linear.least())
        steps.append(linear.minimum().step)
    order = np.argsort(list(models))
    shifts = np.array(list(models))[order]
    return SideScan(shifts, np.array(deviances)[order], np.array(steps)[order])


def _width(term: Term) -> float:
    area = term.card.search.area
    assert area is not None
    return term.values[area[1]] - term.values[area[0]]


def _with_side(model: Model, label: str, side: str, shift: float) -> Model:
    """Return the model with one side of a patch elsewhere."""
    term = model.term(label)
    moved = term.with_values(**{side: term.values[side] + shift})
    return model.without(label).with_terms(moved)
