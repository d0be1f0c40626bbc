"""Handles are called by the colours that people see."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.appearance import colour_name, handle_colour


@pytest.mark.parametrize(
    ("rgb", "name"),
    [
        ((200, 40, 35), "red"),
        ((150, 60, 40), "red"),
        ((230, 200, 60), "yellow"),
        ((36, 75, 59), "green"),
        ((40, 90, 190), "blue"),
        ((120, 50, 160), "purple"),
        ((20, 20, 22), "black"),
        ((120, 122, 125), "grey"),
        ((230, 230, 235), "white"),
    ],
)
def test_colours_are_named_as_people_do(rgb, name):
    assert colour_name(np.array(rgb[::-1], dtype=float)) == name


def test_what_is_around_a_handle_does_not_colour_it(rng):
    picture = rng.normal(140, 8, (24, 20, 3))
    picture[8:13, 8:13] = rng.normal((40, 190, 225), 8, (5, 5, 3))
    picture[:, :2] = (180, 90, 30)  # the blue ring beside the stone
    assert colour_name(handle_colour(np.clip(picture, 0, 255).astype(np.uint8))) == "yellow"
