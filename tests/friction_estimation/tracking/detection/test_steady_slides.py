"""What slides far and slows down as a stone does is joined; who walks is left out."""

from __future__ import annotations

import numpy as np

from friction_estimation.synthetic import named_camera
from friction_estimation.tracking.detection.steady_slides import long_slides
from friction_estimation.tracking.detection.thrown_stone import Sighting

CAMERA = named_camera("gantry", (640, 360))
T = np.arange(0.0, 14.0, 0.2)


def seen(x, y, likeness, *, every=1, rng=None):
    jitter = np.zeros((len(T), 2)) if rng is None else 0.02 * rng.standard_normal((len(T), 2))
    return [
        Sighting(frame=k, t=float(T[k]), xy=np.array([x, y[k]]) + jitter[k], likeness=likeness)
        for k in range(0, len(T), every)
    ]


def test_a_stone_is_joined_all_its_way_among_walkers_who_look_more_like_one():
    rng = np.random.default_rng(4)
    stone = seen(0.3, -9 + 2.2 * T - 0.05 * T**2, 0.3, rng=rng)
    walker = seen(-1.2, -9 + 1.5 * T, 0.9, rng=rng)
    standing = seen(1.5, np.full(len(T), 12.0), 0.9, rng=rng)
    anywhere = [
        Sighting(frame=k, t=float(t), xy=rng.uniform((-2, -20), (2, 20)), likeness=0.3)
        for k, t in enumerate(T)
    ]
    (slide,) = long_slides([*anywhere, *walker, *standing, *stone], CAMERA)
    own = set(map(id, stone))
    assert sum(id(s) in own for s in slide) > 0.9 * len(stone)
    assert sum(id(s) not in own for s in slide) <= 2


def test_what_slides_for_some_seconds_only_is_not_joined():
    short = seen(0.3, -9 + 2.2 * T - 0.05 * T**2, 0.9)[:25]
    assert not list(long_slides(short, CAMERA))


def test_a_slide_goes_on_where_it_was_hidden_for_a_moment():
    stone = seen(0.3, -9 + 2.2 * T - 0.05 * T**2, 0.3)
    hidden = [s for s in stone if not 5.0 < s.t < 6.0]
    assert [len(slide) for slide in long_slides(hidden, CAMERA)] == [len(hidden)]
