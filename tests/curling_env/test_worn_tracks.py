"""Passes of bands, on narrow cells."""

import numpy as np
import pytest

from curling_env.sheet import PAPER_SHEET
from curling_env.worn_tracks import WORN_WIDTH, WornTracks

PATH = np.array([[0.21, -9.0], [0.21, 3.0], [0.86, 7.0]])


def test_the_area_of_a_track_is_that_covered_by_the_band():
    fresh = WornTracks.none(PAPER_SHEET)
    tracks = fresh.after([PATH, PATH[::-1]])
    width, length = tracks.spacing
    covered = tracks.passes.sum() * width * length
    assert covered == pytest.approx(2 * WORN_WIDTH * (12.0 + np.hypot(0.65, 4.0)), rel=1e-9)
    x, y = tracks.origin
    row = round((-2.0 - y) / length)
    under = x + width * np.flatnonzero(tracks.passes[row] > 1.0)
    assert under.min() == pytest.approx(0.21 - WORN_WIDTH / 2, abs=width)
    assert under.max() == pytest.approx(0.21 + WORN_WIDTH / 2, abs=width)
    assert not fresh.passes.any()


def test_between_cells_a_track_is_as_wide_as_the_band():
    fresh = WornTracks.none(PAPER_SHEET)
    (width, length), origin = fresh.spacing, fresh.origin
    spreads = []
    for place in width * np.arange(8) / 8:  # of the sides within the cells
        tracks = fresh.after([np.array([[place, -1.0], [place, 1.0]])])
        row = tracks.passes[round(-origin[1] / length)]
        aside = origin[0] + width * np.arange(len(row)) - place
        # Straight lines between values have the second moment of these, and a sixth of a cell's.
        spreads.append(row @ aside**2 / row.sum() + width**2 / 6)
    assert np.mean(spreads) == pytest.approx(WORN_WIDTH**2 / 12, rel=3e-3)
