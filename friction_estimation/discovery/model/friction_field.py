"""The friction map as a smooth Gaussian field of ln μ. ln μ deviates from the map of the ice by a
Matérn field, a sum of patterns: the strongest ones of its prior where stones ran.

Their coefficients are shared parameters with a prior, fitted together with the effects; amplitude
and correlation length maximise the likelihood. If the map is that of another day, its standard
errors are part of the prior: where it was known well, the field describes only the change since.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh
from scipy.spatial.distance import cdist

from curling_env.physics.effects import EffectCard
from curling_env.sheet import Sheet
from curling_env.typing import Floats, Indices
from friction_estimation.design.cramer_rao import matern
from friction_estimation.discovery.model.gaussian_field import GaussianField
from friction_estimation.discovery.tuning import (
    LOG_MAP_SD_SPREAD,
    MAP_AMPLITUDES,
    MAP_SHAPES,
    MAP_SHARE,
    MOST_MAP_PATTERNS,
    USUAL_MAP_SD,
)

CARD = EffectCard(
    name="friction_map",
    title="Friction map",
    readable="friction that differs from place to place",
    formula="μ → μ·exp(f(x, y)), f a smooth Gaussian field over the sheet",
    parameters=(),
    source="Matérn field; published friction differs by 2 to 5 % at 1 to 3 m",
    validity="where stones ran",
    evidence="throws over the same place, at any speed and in both directions, agree on its μ",
    acts="map",
    pushes=("along",),
    shown_over="y",
    dissipative=True,
)
"""Card of the map as a discovered effect. In an ice file it is the friction itself, not an
effect."""


NEAR = 0.002
"""Tolerance of the conversion of ln μ between fields of different correlation lengths."""
LEAST_SPACING = 0.3
"""Minimum distance between the places that describe the field [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FrictionField(GaussianField):
    """Deviation of ln μ from the map of an ice.

    Parameters
    ----------
    sheet : sheet with its cells
    length, smoothness : correlation length [m] and order of the Matérn correlation
    crossed : (m,) flat indices of the cells that stones crossed
    patterns : (cells, r) ln μ of each cell by one unit of each coefficient, at unit deviation
    known : (cells,) standard error of ln μ in the map of the ice, if that holds but for a change of
        the size of `amplitude`; None if it is no more than a first guess
    """

    name = "map"
    sheet: Sheet
    length: float
    smoothness: float
    crossed: Indices
    patterns: Floats
    amplitude: float = USUAL_MAP_SD
    known: Floats | None = None

    @property
    def amplitudes(self) -> Floats:
        """Candidate amplitudes for these patterns."""
        return MAP_AMPLITUDES if self.known is None else np.array([self.amplitude])

    @property
    def hyperprior(self) -> float:
        """−2 ln of the prior density of the amplitude, up to a constant."""
        return float((np.log(self.amplitude / USUAL_MAP_SD) / LOG_MAP_SD_SPREAD) ** 2)

    @cached_property
    def ln_mu(self) -> Floats:
        """The deviation of ln μ of every cell, (rows, columns)."""
        return (self.patterns @ self.values).reshape(self.sheet.shape)

    def near(self, ln_mu: Floats) -> FrictionField:
        """Return the field with the coefficients nearest to a deviation of ln μ where stones ran.

        Parameters
        ----------
        ln_mu : (rows, columns) that deviation
        """
        here = self.patterns[self.crossed] / NEAR
        inner = here.T @ here + np.diag(self.deviations**-2)
        values = np.linalg.solve(inner, here.T @ (ln_mu.ravel()[self.crossed] / NEAR))
        return self.at(np.asarray(values, dtype=np.float64))

    def unresolved(self) -> Floats:
        """Part of the prior variance of each cell that the patterns omit, (cells,).

        In units of the squared amplitude, as the patterns are.
        """
        whole = _relative_deviations(self.known, self.amplitude, len(self.patterns)) ** 2
        return np.maximum(whole - (self.patterns**2).sum(axis=1), 0.0)

    def unresolved_covariance(self) -> Floats:
        """Part of the prior's correlation that the patterns omit, (cells, cells)."""
        centres = _centres(self.sheet)
        size = _relative_deviations(self.known, self.amplitude, len(centres))
        whole = _correlation(centres, centres, self.length, self.smoothness)
        return size[:, None] * whole * size - self.patterns @ self.patterns.T

    def patterns_at(self, xy: Floats) -> Floats:
        """Return the patterns at points of the sheet, (n, r), bilinear between the centres of
        cells.

        Parameters
        ----------
        xy : (n, 2) sheet frame [m]
        """
        cells, weights = cells_at(self.sheet, xy)
        return np.einsum("nk,nkr->nr", weights, self.patterns[cells])


def cells_at(sheet: Sheet, xy: Floats) -> tuple[Indices, Floats]:
    """Return the four cells around points (n, 2): flat indices and weights, (n, 4) each."""
    (i, i1), (j, j1), u, v = sheet.cells_around(xy)
    columns = sheet.shape[1]
    cells = np.column_stack(
        [i * columns + j, i * columns + j1, i1 * columns + j, i1 * columns + j1]
    )
    weights = np.column_stack([(1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v])
    return cells, weights


def _relative_deviations(known: Floats | None, amplitude: float, cells: int) -> Floats:
    """Prior standard deviation of ln μ of each cell over the amplitude, (cells,)."""
    return np.ones(cells) if known is None else np.hypot(1.0, known / amplitude)


class Crossed(NamedTuple):
    """Ice on which stones ran.

    Parameters
    ----------
    places : (n, 2) places that stand for the ice there [m]
    counts : (n,) how often each was crossed, in points of paths
    cells : flat indices of the sheet's cells that were crossed
    """

    places: Floats
    counts: Indices
    cells: Indices


def crossed_by(sheet: Sheet, paths: Sequence[Floats]) -> Crossed:
    """Return the ice of a sheet on which stones ran.

    Parameters
    ----------
    sheet : sheet with its cells
    paths : positions of stones, (n, 2) each [m]
    """
    xy = np.concatenate([_filled(path) for path in paths])
    row, column = sheet.cell_of(xy)
    # The representative places are at least a stone's width apart, however small the cells.
    spacing = max(sheet.cell_size, LEAST_SPACING)
    places, counts = np.unique(np.round(xy / spacing), axis=0, return_counts=True)
    return Crossed(places * spacing, counts, np.unique(row * sheet.shape[1] + column))


def field_along(
    sheet: Sheet,
    crossed: Crossed,
    length: float,
    smoothness: float,
    *,
    known: Floats | None = None,
    change: float = USUAL_MAP_SD,
) -> FrictionField:
    """Return a field of zero with the strongest patterns where stones ran.

    Parameters
    ----------
    sheet : sheet with its cells
    crossed : where stones ran
    length, smoothness : of the field's correlation
    known : (cells,) standard error of ln μ in an earlier map, which holds but for a change
    change : standard deviation of that change; else the amplitude with which a fit begins
    """
    places, counts, cells = crossed
    # A place that was crossed twice as often does not need twice the detail.
    root = (counts / counts.mean()) ** 0.25
    size = _relative_deviations(known, change, sheet.shape[0] * sheet.shape[1])
    here = size[np.ravel_multi_index(sheet.cell_of(places), sheet.shape)]
    alike = here[:, None] * _correlation(places, places, length, smoothness) * here
    inner = root[:, None] * alike * root
    most = min(len(places), MOST_MAP_PATTERNS)
    values, vectors = eigh(inner, subset_by_index=(len(places) - most, len(places) - 1))
    values, vectors = values[::-1], vectors[:, ::-1]
    enough = int(np.searchsorted(np.cumsum(values), MAP_SHARE * np.trace(inner))) + 1
    values, vectors = values[:enough], vectors[:, :enough]
    to_cells = size[:, None] * _correlation(_centres(sheet), places, length, smoothness) * here
    patterns = to_cells @ (root[:, None] * vectors / np.sqrt(values))
    return FrictionField(
        sheet=sheet,
        length=length,
        smoothness=smoothness,
        crossed=cells,
        patterns=patterns,
        amplitude=change,
        values=np.zeros(patterns.shape[1]),
        known=known,
    )


def fields_to_try(
    sheet: Sheet, paths: Sequence[Floats], known: Floats | None = None
) -> list[FrictionField]:
    """Return fields of zero of all tried shapes.

    Parameters
    ----------
    sheet : sheet with its cells
    paths : positions of stones, (n, 2) each [m]
    known : as of `field_along`
    """
    crossed = crossed_by(sheet, paths)
    if known is None:
        return [field_along(sheet, crossed, *shape) for shape in MAP_SHAPES]
    return [
        field_along(sheet, crossed, *shape, known=known, change=change)
        for shape in MAP_SHAPES[1:4]
        for change in MAP_AMPLITUDES[2:12:2].tolist()
    ]


def _filled(path: Floats) -> Floats:
    """Return a path (n, 2) with intermediate points, so that no cell is skipped."""
    place = np.linspace(0.0, len(path) - 1.0, 12 * len(path))
    at = np.arange(len(path))
    return np.column_stack([np.interp(place, at, path[:, axis]) for axis in range(2)])


def _centres(sheet: Sheet) -> Floats:
    """Centres of all cells of a sheet, (cells, 2) [m]."""
    y, x = np.meshgrid(sheet.y_centres, sheet.x_centres, indexing="ij")
    return np.column_stack([x.ravel(), y.ravel()])


def _correlation(some: Floats, others: Floats, length: float, smoothness: float) -> Floats:
    """Correlation of the field between places (n, 2) and others (m, 2), (n, m)."""
    return matern(np.asarray(cdist(some, others), dtype=np.float64), length, smoothness)
