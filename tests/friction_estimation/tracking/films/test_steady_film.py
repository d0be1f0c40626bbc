"""Frames looked at before a stone is followed."""

from __future__ import annotations

import pytest

from friction_estimation.tracking.films.steady_film import sample_size


@pytest.mark.parametrize(
    ("size", "count"),
    [
        ((1280, 720), 40),
        ((1920, 1080), 40),
        ((3840, 2160), 15),
        ((5312, 2988), 7),
        ((9, 10**6), 13),
    ],
)
def test_large_frames_are_fewer(size, count):
    assert sample_size(size) == count
    # A median needs several, and memory has an end.
    assert count * 3 * size[0] * size[1] < 450e6
