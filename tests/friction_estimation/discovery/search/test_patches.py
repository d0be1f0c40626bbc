"""The rectangle that promises most is the best of all rectangles."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.sheet import PAPER_SHEET
from friction_estimation.discovery.search.patches import _best_rectangle, grid_over
from friction_estimation.discovery.tuning import MOST_CELLS_ACROSS


def gain_of(information, right, rectangle):
    i0, i1, j0, j1 = rectangle
    inner = information[i0:i1, j0:j1, i0:i1, j0:j1].sum()
    return right[i0:i1, j0:j1].sum() ** 2 / inner


@pytest.mark.parametrize("seed", range(6))
def test_the_search_finds_the_best_of_all_rectangles(seed):
    rng = np.random.default_rng(seed)
    nx, ny = 4, 6
    columns = rng.normal(size=(60, nx * ny))
    information = (columns.T @ columns).reshape(nx, ny, nx, ny)
    right = rng.normal(size=(nx, ny)) * 10
    found, gain = _best_rectangle(information, right, 3)
    every = [
        (i0, i1, j0, j1)
        for i0 in range(nx)
        for i1 in range(i0 + 1, nx + 1)
        for j0 in range(ny)
        for j1 in range(j0 + 1, min(j0 + 3, ny) + 1)
    ]
    best = max(every, key=lambda r: gain_of(information, right, r))
    assert found == best
    assert gain == pytest.approx(gain_of(information, right, best))


def test_nothing_is_found_where_nothing_was_crossed():
    assert _best_rectangle(np.zeros((2, 3, 2, 3)), np.zeros((2, 3)), 3) is None


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
