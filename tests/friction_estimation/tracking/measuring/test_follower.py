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


def follower_on(times, behind=0.0):
    """A follower of the stone, which is detected at some times, some metres behind its place."""
    nothing = np.zeros(len(times), dtype=bool)
    seen = Detections(
        frame=np.arange(len(times)),
        t=times,
        xy=sliding(times) - np.column_stack([0 * times, behind + 0 * times]),
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


ICE = SimpleNamespace(channels=None, origin_px=(0, 0))


def camera():
    spec = FilmSpec(camera="gantry", size=(480, 270)).resolved()
    return camera_from_scene(scene_of(spec), spec.size)


def fit_at(xy):
    return StoneFit(xy=xy, theta=0.0, covariance=1e-6 * np.eye(3), visible=1.0, inside=1.0)


def test_a_shoe_that_was_taken_for_the_stone_at_first_is_left(monkeypatch):
    one = follower_on(np.arange(1.5, 8.0, 0.5))  # in the hand before
    shoe = np.array([0.05, -14.6])

    def fit(frame, channels, origin, camera, look, start, others, people):
        xy = shoe if np.hypot(*(start[:2] - shoe)) < 1.0 else start[:2]
        return fit_at(xy)

    monkeypatch.setattr(follower, "measure_occluded", fit)
    frames = np.arange(0.0, 7.0, 0.1)
    fits = [one.measure(t, None, ICE, camera(), TrackingOptions()) for t in frames.tolist()]
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


@pytest.mark.parametrize("corrected", [True, False])
def test_frames_before_the_first_detection_are_measured_at_the_stone(monkeypatch, corrected):
    """The first detections are 6 cm off; a fit that starts 8 cm off finds another place."""
    found = np.arange(1.5, 8.0, 0.5)
    one = follower_on(found, behind=0.06 * np.exp(1.5 - found))
    now = 0.0

    def fit(frame, channels, origin, camera, look, start, others, people):
        stone = sliding(np.array([now if frame is None else frame]))[0]
        wrong = stone - np.array([0.0, 0.14])
        return fit_at(stone if np.hypot(*(start[:2] - stone)) < 0.08 else wrong)

    monkeypatch.setattr(follower, "measure_occluded", fit)
    seen_by = camera()
    if corrected:
        sample = {t: t for t in found.tolist()}
        one.correct_path(sample, ICE, seen_by, TrackingOptions(), [])
    off = []
    for now in np.arange(0.0, 1.5, 0.1).tolist():
        seen = one.measure(now, None, ICE, seen_by, TrackingOptions())
        off.append(np.hypot(*(seen.xy - sliding(np.array([now]))[0])))
    assert (max(off) < 1e-9) == corrected
