"""Where a stone is looked for in the next frame."""

from __future__ import annotations

import numpy as np

from friction_estimation.appearance import Appearance, StoneFit, StoneModel
from friction_estimation.camera import Camera
from friction_estimation.tracking import TrackingOptions
from friction_estimation.tracking.path.prediction import Predictor

CAMERA = Camera.looking_at(
    position=(0.0, 0.0, 10.0),
    target=(0.0, 0.0, 0.0),
    up=(0.0, 1.0, 0.0),
    focal_px=600.0,
    size=(320, 240),
)
LOOK = Appearance(
    model=StoneModel(radius=0.143, height=0.1143),
    colours=np.zeros((5, 3)),
    noise=np.ones(3),
    has_handle=False,
)
SPEED = np.array([0.0, 0.5])
"""Of the stone [m/s]."""


class RoughPath:
    """A path that is beside the stone's, and may be off [m]."""

    def __init__(self, beside, off):
        self.beside, self.off = np.array([beside, 0.0]), off

    def at(self, t):
        return SPEED * t + self.beside

    def leads(self, t):
        return False

    def doubt(self, t):
        return self.off


class NeverLookedAt:
    def __getitem__(self, part):
        raise AssertionError("optical flow is not needed here")


def fit_of(xy, visible=1.0):
    return StoneFit(
        xy=np.asarray(xy), theta=np.nan, covariance=np.eye(3), misfit=1.0, visible=visible, inside=1
    )


def predictor(*, alone, beside=0.2, off=0.0):
    return Predictor(
        path=RoughPath(beside, off),
        camera=CAMERA,
        appearance=LOOK,
        options=TrackingOptions(),
        heading=None,
        alone=alone,
    )


def after_two_frames(follower, frames):
    """What is predicted for the third of three frames, 0.1 s apart."""
    for k, frame in enumerate(frames):
        start = follower.predict(0.1 * k, frame)
        if k < 2:
            follower.update(0.1 * k, fit_of(SPEED * 0.1 * k))
    return start[:2]


def texture(moved_px):
    """A picture of speckles that are moved up."""
    speckles = np.random.default_rng(5).integers(0, 255, (300, 320, 1), dtype=np.uint8)
    return np.repeat(np.roll(speckles, -moved_px, axis=0)[:240], 3, axis=2)


def test_a_stone_that_nothing_can_hit_is_predicted_by_its_motion():
    found = after_two_frames(predictor(alone=True), [texture(0), texture(3), NeverLookedAt()])
    np.testing.assert_allclose(found, SPEED * 0.2, atol=1e-12)


def test_a_stone_that_may_be_hit_is_predicted_by_optical_flow():
    frames = [texture(moved) for moved in (0, 3, 9)]  # it gains speed in between
    found = after_two_frames(predictor(alone=False), frames)
    np.testing.assert_allclose(found, SPEED * 0.1 + np.array([0.0, 6 / 60]), atol=0.004)


def test_what_goes_elsewhere_than_the_stone_is_not_predicted_by_its_motion():
    """A walker who was taken for the stone before it came would be followed as far as they go."""
    frames = [texture(moved) for moved in (0, 3, 9)]
    found = after_two_frames(predictor(alone=True, beside=1.0), frames)
    np.testing.assert_allclose(found, SPEED * 0.1 + np.array([0.0, 6 / 60]), atol=0.004)


def test_where_the_path_is_in_doubt_the_motion_of_the_stone_tells_more():
    frames = [texture(0), texture(3), NeverLookedAt()]
    found = after_two_frames(predictor(alone=True, beside=1.0, off=0.8), frames)
    np.testing.assert_allclose(found, SPEED * 0.2, atol=1e-12)


def test_where_its_motion_leads_astray_optical_flow_is_asked_and_then_the_path():
    follower = predictor(alone=True)
    after_two_frames(follower, [texture(moved) for moved in (0, 3, 9)])
    starts: list[np.ndarray] = []

    def never_seen(start):
        starts.append(start[:2])
        return fit_of(start[:2], visible=0.0)

    expected = (SPEED * 0.2, SPEED * 0.1 + np.array([0.0, 0.1]), SPEED * 0.2 + np.array([0.2, 0.0]))
    assert follower.find(0.2, np.array([*expected[0], 0.0]), never_seen) is None
    np.testing.assert_allclose(starts, expected, atol=0.004)


def test_a_stone_that_was_long_unseen_must_show_most_of_itself():
    """Half of a stone's picture fits beside a sweeper's foot as well."""

    def found(t, visible):
        follower = predictor(alone=True)
        after_two_frames(follower, [texture(0), texture(3), texture(6)])
        start = np.append(SPEED * 0.1, 0.0)
        return follower.find(t, start, lambda pose: fit_of(pose[:2], visible)) is not None

    assert found(0.8, visible=0.55)
    assert not found(2.0, visible=0.55)
    assert found(2.0, visible=0.65)
