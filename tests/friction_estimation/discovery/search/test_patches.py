"""The rectangle that promises most is the best of all rectangles."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.discovery.search import patches
from friction_estimation.discovery.search.patches import _best_rectangle


def gain_of(information, right, rectangle):
    i0, i1, j0, j1 = rectangle
    inner = information[i0:i1, j0:j1, i0:i1, j0:j1].sum()
    return right[i0:i1, j0:j1].sum() ** 2 / inner


@pytest.mark.parametrize("seed", range(6))
def test_the_search_finds_the_best_of_all_rectangles(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    nx, ny = 4, 6
    monkeypatch.setattr(patches, "LONGEST_PATCH", 3)
    columns = rng.normal(size=(60, nx * ny))
    information = (columns.T @ columns).reshape(nx, ny, nx, ny)
    right = rng.normal(size=(nx, ny)) * 10
    found = _best_rectangle(information, right)
    every = [
        (i0, i1, j0, j1)
        for i0 in range(nx)
        for i1 in range(i0 + 1, nx + 1)
        for j0 in range(ny)
        for j1 in range(j0 + 1, min(j0 + 3, ny) + 1)
    ]
    best = max(every, key=lambda r: gain_of(information, right, r))
    assert found == best


def test_nothing_is_found_where_nothing_was_crossed():
    assert _best_rectangle(np.zeros((2, 3, 2, 3)), np.zeros((2, 3))) is None
