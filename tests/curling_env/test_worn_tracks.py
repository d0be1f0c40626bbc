"""Where bands have passed, on narrow cells."""

import numpy as np
import pytest

from curling_env.sheet import PAPER_SHEET
from curling_env.worn_tracks import WORN_WIDTH, WornTracks

PATH = np.array([[0.21, -9.0], [0.21, 3.0], [0.86, 7.0]])


def test_a_track_is_as_large_as_what_the_band_covered():
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
