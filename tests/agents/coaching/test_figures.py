"""Figures of coaching are drawn, in metres and in feet, with any names of stones."""

from __future__ import annotations

import cv2
import numpy as np
import simulated_club as club

from agents.coaching import draw_stones, match_stones
from curling_env.units import Units, shown_in


def test_a_set_of_stones_is_drawn_in_either_unit(tmp_path):
    rng = np.random.default_rng(2)
    stones = {k: (1.0 + 0.005 * k, 1.0) for k in range(4)}
    evening = club.evening(rng, throws=8, stones=stones)
    found = match_stones(evening.tracks, evening.ice.as_ice(rng, sigma=0.003), evening.notes)
    drawn = []
    for units in Units:
        with shown_in(units):
            draw_stones(found, tmp_path / f"{units}.png")
        drawn.append(cv2.imread(str(tmp_path / f"{units}.png")))
    assert all(picture.shape[1] > 600 and picture.std() > 10 for picture in drawn)
    assert drawn[0].shape != drawn[1].shape or (drawn[0] != drawn[1]).any()
