"""A stone is followed along its own path, whatever looks like it elsewhere."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from friction_estimation.appearance import StoneFit
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.synthetic import FilmSpec, scene_of
from friction_estimation.tracking import TrackingOptions
from friction_estimation.tracking.association.coarse import coarse_path
from friction_estimation.tracking.association.paths import most_likely_paths
from friction_estimation.tracking.detection.detections import Detections
from friction_estimation.tracking.measuring import follower


def sliding(times):
    """Places (n, 2) of a stone from the hack on."""
    return np.column_stack([0 * times, -15.0 + 2.2 * times - 0.045 * times**2])


def follower_on(times):
    """A follower of the stone, which the sampled frames show at some times."""
    nothing = np.zeros(len(times), dtype=bool)
    seen = Detections(
        frame=np.arange(len(times)),
        t=times,
        xy=sliding(times),
        sigma=np.full((len(times), 2), 0.03),
        score=np.ones(len(times)),
        likeness=np.ones(len(times)),
        still=nothing,
        alone=~nothing,
        times=times,
    )
    (path,) = most_likely_paths(seen, 200.0)
    way = coarse_path(path.at, path.mode, seen, 8.0)
    return follower.Follower(path=way, appearance=None, heading=None, people=True)


def fit_at(xy):
    return StoneFit(xy=xy, theta=0.0, covariance=1e-6 * np.eye(3), visible=1.0, inside=1.0)


def test_a_shoe_that_was_taken_for_the_stone_at_first_is_left(monkeypatch):
    one = follower_on(np.arange(1.5, 8.0, 0.5))  # in the hand before
    shoe = np.array([0.05, -14.6])

    def fit(frame, channels, origin, camera, look, start, others, people):
        xy = shoe if np.hypot(*(start[:2] - shoe)) < 1.0 else start[:2]
        return fit_at(xy)

    monkeypatch.setattr(follower, "measure_occluded", fit)
    spec = FilmSpec(camera="gantry", size=(480, 270)).resolved()
    camera = camera_from_scene(scene_of(spec), spec.size)
    ice = SimpleNamespace(channels=None, origin_px=(0, 0))
    frames = np.arange(0.0, 7.0, 0.1)
    fits = [one.measure(t, None, ice, camera, TrackingOptions()) for t in frames.tolist()]
    assert any(fit is not None and np.allclose(fit.xy, shoe) for fit in fits)
    late = frames > 2.5
    off = [np.hypot(*(fits[k].xy - sliding(frames)[k])) for k in np.flatnonzero(late)]
    assert max(off) < 0.1


@pytest.mark.parametrize(("since", "on_its_way"), [(1.5, True), (4.0, True), (6.0, False)])
def test_a_stone_is_measured_where_it_was_found(since, on_its_way):
    """The path of a sweeper leads to a stone, and only that stone is measured."""
    one = follower_on(np.arange(1.0, 8.0, 0.5))
    times = np.arange(0.0, 8.0, 0.1)
    one.measured.t = times.tolist()
    places = sliding(times)
    one.measured.fits = [
        fit_at(xy) if t >= since else None for t, xy in zip(times, places, strict=True)
    ]
    assert one.measured_on_its_way == on_its_way
