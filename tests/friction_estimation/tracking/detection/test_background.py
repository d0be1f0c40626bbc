"""The part of a picture that is searched for stones."""

from __future__ import annotations

import pytest

from curling_env.sheet import PAPER_SHEET
from friction_estimation.camera import Camera
from friction_estimation.tracking.detection.background import sheet_region


@pytest.mark.parametrize("y", [14.5, 15.0, 15.5, 16.5])
def test_all_rows_of_a_picture_filled_with_ice_are_kept(y):
    camera = Camera.looking_at(
        position=(0.05, y, 8.6),
        target=(0.05, y, 0.0),
        up=(0.0, -1.0, 0.0),
        focal_px=1364.0,
        size=(1920, 1080),
        distortion=(0.295, -1.268, 0.0, 0.0, 0.0),
    )
    rows, columns = sheet_region(camera, PAPER_SHEET)
    assert rows == slice(0, 1080)
    assert 0 < columns.start < columns.stop < 1920
