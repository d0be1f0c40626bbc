"""How far a track may be misplaced where something hides a part of the stone."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.appearance import StoneModel
from friction_estimation.camera import Camera, unrefined
from friction_estimation.tracking.path.uncertainty import (
    block_sigma,
    heading_sigma,
    hidden_for_long,
    hidden_sigma,
    systematic_sigma,
)

CAMERA = Camera.looking_at(
    position=(0.0, -36.0, 8.0), target=(0.0, 0.0, 0.0), focal_px=1500.0, size=(1280, 720)
)
STONE = StoneModel(radius=0.145, height=0.1143)


def test_a_stone_that_is_half_hidden_is_less_certain_most_of_all_along_the_view():
    xy = np.array([[0.0, 10.0], [0.0, 10.0], [np.nan, np.nan]])
    free, half, unseen = hidden_sigma(CAMERA, xy, np.array([0.0, 0.5, 0.0]), STONE)
    assert not free.any()
    assert not unseen.any()
    assert half[1] > 3 * half[0] > 0
    camera = unrefined(CAMERA)
    seen, hidden = systematic_sigma(camera, xy[:2], STONE, hidden=np.array([0.0, 0.5]))
    assert hidden**2 - seen**2 == pytest.approx(0.7 * half[1] ** 2, rel=0.05)


def test_what_hides_a_stone_for_a_moment_counts_less_than_what_stays():
    t = np.arange(40) / 15
    moment, stays = np.zeros(40), np.where(t > 1.0, 0.5, 0.0)
    moment[20] = 0.5
    assert hidden_for_long(t, moment).max() < 0.1
    assert hidden_for_long(t, stays)[-1] == 0.5
    assert not hidden_for_long(t, np.zeros(40)).any()


def test_a_heading_is_less_certain_seen_from_low_down():
    """One end of a handle that stands a little higher looks as if it were turned."""
    steep = Camera.looking_at(
        position=(0.0, -4.0, 8.0), target=(0.0, 0.0, 0.0), focal_px=1e5, size=(1280, 720)
    )
    low = Camera.looking_at(
        position=(0.0, -36.0, 8.0), target=(0.0, 0.0, 0.0), focal_px=1e6, size=(1280, 720)
    )
    from_above, from_afar = (heading_sigma(one, np.zeros((1, 2)), STONE)[0] for one in (steep, low))
    assert from_above < 0.03
    assert from_afar == pytest.approx(9 * from_above, rel=0.3)


def test_pixels_that_were_not_sent_err_together():
    single = np.array([[0.01, 0.002]] * 3)
    none, quarter, all_of_it = block_sigma(single, np.array([0.0, 0.25, 1.0]))
    assert not none.any()
    assert all_of_it == pytest.approx(2 * quarter)
    assert all_of_it[0] == pytest.approx(5 * all_of_it[1])
    assert (all_of_it > 3 * single[0]).all()
