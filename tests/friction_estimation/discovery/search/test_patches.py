"""The rectangle of other friction that promises most, and the cells that it consists of."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.sheet import PAPER_SHEET
from friction_estimation.discovery import (
    base_model,
    find_patches,
    fit_with_noise,
    open_session,
    score_candidates,
)
from friction_estimation.discovery.search.patches import grid_over
from friction_estimation.discovery.tuning import MOST_CELLS_ACROSS

from ..conftest import effect


def test_no_rectangle_nearby_promises_more(make_session):
    """The score test of a patch says so, which knows nothing of the cells."""
    sides = {"x_min": -0.6, "x_max": 0.4, "y_min": -4.0, "y_max": 1.0}
    session = open_session(make_session([effect("friction_patch", **sides, factor=1.1)], throws=8))
    fitted = fit_with_noise(base_model(None, session), session)
    (found,) = find_patches(fitted)
    for side, place in sides.items():
        assert found.values[side] == pytest.approx(place, abs=0.4 if side[0] == "x" else 1.1)

    def gain(patch):
        return score_candidates(fitted, [patch])[0].gain

    best = gain(found)
    for side, place in sides.items():
        for step in (-2, -1, 1, 2):
            moved = found.values[side] + step * (0.25 if side[0] == "x" else 1.0)
            assert gain(found.with_values(**{side: moved})) < 1.02 * best, (side, place, step)


def test_a_cell_holds_the_points_between_its_sides(rng):
    xy = rng.uniform([-1.0, -15.0], [1.5, 18.0], (200, 2))
    grid = grid_over(xy, (0.25, 1.0))
    assert grid.size == (0.25, 1.0)
    cells = grid.cells_of(xy)
    assert 0 <= cells.min() <= cells.max() < np.prod(grid.shape)
    column, row = np.divmod(cells, grid.shape[1])
    sides = [
        grid.rectangle((i, i + 1, j, j + 1), PAPER_SHEET) for i, j in zip(column, row, strict=True)
    ]
    for (x, y), (left, right, near, far) in zip(xy, sides, strict=True):
        assert left <= x <= right
        assert near <= y <= far


def test_of_wide_ice_the_cells_are_wider():
    xy = np.array([[-2.2, 0.0], [2.2, 10.0]])
    grid = grid_over(xy, (0.01, 0.5))
    assert grid.shape[0] == MOST_CELLS_ACROSS
    assert grid.size == (pytest.approx(4.4 / MOST_CELLS_ACROSS), 0.5)


def test_a_rectangle_goes_on_beside_the_outermost_stones_and_ends_with_the_sheet():
    grid = grid_over(np.array([[-1.0, -30.0], [1.0, 5.0]]), (0.25, 1.0))
    assert grid.rectangle((0, 2, 30, 35), PAPER_SHEET) == (-1.5, -0.5, 0.0, 5.0)
    assert grid.rectangle((2, 8, 0, 10), PAPER_SHEET) == (-0.5, 1.5, -22.25, -20.0)
    assert grid.rectangle((2, 8, 0, 7), PAPER_SHEET) is None
