"""What has come to rest at the end of a film."""

from __future__ import annotations

import numpy as np

from friction_estimation.camera import Camera
from friction_estimation.tracking.detection.expected_motion import ExpectedMotion
from friction_estimation.tracking.detection.thrown_stone import Sighting
from friction_estimation.tracking.detection.what_rests import at_rest

CAMERA = Camera.looking_at(
    position=(0.3, 0.0, 9.0), target=(0.0, 0.1, 0.0), focal_px=420.0, size=(560, 300),
    up=(-1.0, 0.0, 0.0),
)  # fmt: skip
STEP = 0.2


def seen(place, times, likeness=0.9):
    return [
        Sighting(frame=k, t=float(t), xy=np.array(place(t), dtype=float), likeness=likeness)
        for k, t in enumerate(times)
    ]


def test_a_stone_that_has_come_to_rest_is_found_and_a_mark_on_the_ice_is_not():
    times = np.arange(0.0, 12.0, STEP)
    stone = seen(lambda t: (0.2, 6.0 - 0.05 * max(10.0 - t, 0.0) ** 2), times[5:])
    mark = seen(lambda t: (-1.0, 3.0), times)
    walks = seen(lambda t: (1.0, 0.4 * t), times)
    (found,) = at_rest([*mark, *stone, *walks], float(times[-1]), CAMERA)
    assert all(s.xy[0] == 0.2 and s.xy[1] > 5.9 for s in found)
    assert found[0].t < 10.0


def test_nothing_rests_where_nothing_is_seen():
    assert at_rest([], 4.0, CAMERA) == []


def test_a_stone_that_rests_is_sought_back_where_it_must_have_come_from():
    for end in (-1.0, 1.0):
        motion = ExpectedMotion()
        for t in (10.6, 10.4, 10.2, 10.0):
            motion.add(t, np.array([0.2, end * 15.0, 0.0]), np.array([0.02, 0.05]))
        before = motion.at(8.5)
        assert end * before[1] < 15.0
