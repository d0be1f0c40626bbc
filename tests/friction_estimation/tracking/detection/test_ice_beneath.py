"""The ice beneath stones on the rings, which no other frame shows."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.sheet import PAPER_SHEET, RULE_BOOK_STONE
from friction_estimation.appearance import Appearance, StoneModel, channels_of
from friction_estimation.synthetic import HANDLE_COLOURS, FilmRenderer, FilmSpec, StoneOnIce
from friction_estimation.synthetic.tuning import GRANITE_COLOUR
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.detection.ice_beneath import (
    fill_from_mirrors,
    footprint,
    mirrors,
    places_on_ice,
)

SPEC = FilmSpec(camera="end", size=(720, 405), people=False)
MODEL = StoneModel(radius=RULE_BOOK_STONE.radius, height=RULE_BOOK_STONE.height)
STAYS, LEAVES, COMES = (0.5, -16.6), (-0.1, -17.0), (-1.2, -18.1)
"""Places on the rings of the near house; one of them is beside the button."""


def picture(*places):
    """The sheet with stones, and the camera."""
    stones = [
        StoneOnIce(x=x, y=y, theta=1.0, colour=HANDLE_COLOURS[k]) for k, (x, y) in enumerate(places)
    ]
    renderer = FilmRenderer(SPEC, resting=stones)
    return renderer.still, renderer.camera


@pytest.fixture(scope="module")
def seen():
    """The bare ice, that at the film's beginning and that at its end, and the camera."""
    bare, camera = picture()
    return bare, picture(STAYS, LEAVES)[0], picture(STAYS, COMES)[0], camera


@pytest.mark.parametrize("place", [STAYS, LEAVES])
def test_paint_beneath_a_stone_is_that_of_the_other_side(seen, place):
    bare, first, _, camera = seen
    masks = [footprint(first.shape, (0, 0), camera, MODEL, np.array(p)) for p in (STAYS, LEAVES)]
    covered = np.maximum(*masks)
    own = footprint(first.shape, (0, 0), camera, MODEL, np.array(place))
    reflected = mirrors(first.shape, (0, 0), camera, PAPER_SHEET)
    found, guessed = fill_from_mirrors(first, covered, covered, reflected)
    assert not guessed.any()
    off = np.abs(found - bare).max(axis=2)[own > 0]
    assert np.median(off) < 4
    assert np.mean(off > 30) < 0.1  # the edges of paint may be a pixel aside
    assert np.mean(np.abs(first.astype(float) - bare).max(axis=2)[own > 0] > 30) > 0.3


def test_what_comes_goes_and_stays_on_the_rings_is_found_and_paint_is_not(seen):
    bare, first, last, camera = seen
    granite = channels_of(np.array([[GRANITE_COLOUR]], dtype=np.float32))[0, 0]
    look = Appearance(
        model=MODEL, colours=np.tile(granite, (5, 1)), noise=np.ones(3), has_handle=False
    )
    ice = Background(origin_px=(0, 0), image=first.astype(np.float32), noise=2.0)
    found = places_on_ice([first, first, last], ice, camera, look, PAPER_SHEET)
    for there, expected in zip(found.found, [(STAYS, LEAVES)] * 2 + [(STAYS, COMES)], strict=True):
        for xy in expected:
            assert min(np.linalg.norm(xy - p) for p in there) < 0.2
        near_house = [p for p in there if p[1] < -12.0]
        assert all(min(np.linalg.norm(xy - p) for xy in expected) < 0.4 for p in near_house)
    off = np.abs(found.empty - bare).max(axis=2)
    assert np.mean(off > 30) < 0.0005
