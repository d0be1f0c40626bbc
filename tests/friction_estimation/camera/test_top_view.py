"""The top view of the ice."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.sheet import PAPER_SHEET
from friction_estimation.camera import Camera, TopView


def camera(**changes):
    return Camera.looking_at(
        **(
            {
                "position": (0, -36, 9),
                "target": (0, -12, 0),
                "focal_px": 500.0,
                "size": (480, 270),
            }
            | changes
        )
    )


def test_view_and_sheet_are_inverse():
    view = TopView.of(PAPER_SHEET, 20.0)
    xy = np.array([[0.0, 0.0], [-2.25, 22.25], [1.0, -17.0]])
    assert view.to_sheet(view.to_view(xy)) == pytest.approx(xy)
    assert view.to_view(xy)[1] == pytest.approx([-0.5, -0.5])


def test_a_mark_on_the_ice_appears_where_it_lies():
    seen = camera(distortion=(-0.1, 0.02, 0, 0, 0))
    frame = np.zeros((270, 480, 3), dtype=np.uint8)
    u, v = np.round(seen.project([[0.5, -14.0, 0.0]])[0]).astype(int)
    frame[v, u] = 255
    view = TopView.of(PAPER_SHEET, 20.0)
    top = view.of_frame(frame, seen)[..., 0].astype(float)
    rows, columns = np.indices(top.shape)
    centre = np.array([[(columns * top).sum(), (rows * top).sum()]]) / top.sum()
    assert view.to_sheet(centre)[0] == pytest.approx([0.5, -14.0], abs=0.1)
