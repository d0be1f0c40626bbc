"""The line that a stone followed, and how far along it each row is."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.trajectory import Trajectory
from friction_estimation.inversion.throw.path import PATH_STEP, fit_path
from friction_estimation.tracks.free_slide import FreeSlide


def slide_along(xy: np.ndarray, fps: float = 15.0) -> FreeSlide:
    t = np.arange(len(xy)) / fps
    return FreeSlide(
        track=Trajectory(t=t, xy=xy),
        rows=np.arange(len(xy)),
        released_at=0.0,
        rests=True,
        wild=0,
        noise=0.001,
    )


@pytest.mark.parametrize("angle", [0.0, 0.1, 3.2, -1.7])
def test_a_straight_line_is_measured_by_its_length(angle):
    along = np.array([np.cos(angle), np.sin(angle)])
    s = 20 * (1 - (1 - np.linspace(0, 1, 200)) ** 2)
    path, distance = fit_path(slide_along(np.array([0.3, -4.0]) + s[:, None] * along))
    assert distance == pytest.approx(s, abs=1e-6)
    assert path.at(distance) == pytest.approx(np.array([0.3, -4.0]) + s[:, None] * along, abs=1e-6)
    assert path.heading_at(distance) == pytest.approx(np.tile(along, (200, 1)), abs=1e-6)
    # It goes on straight beyond both ends.
    beyond = path.at(np.array([-1.0, s[-1] + 1.0]))
    assert beyond[0] == pytest.approx(np.array([0.3, -4.0]) - along, abs=1e-6)
    assert beyond[1] == pytest.approx(np.array([0.3, -4.0]) + (s[-1] + 1) * along, abs=1e-6)


def test_a_curve_is_measured_by_its_arc():
    radius, turned = 60.0, np.linspace(0, 0.35, 300)
    xy = radius * np.column_stack([1 - np.cos(turned), np.sin(turned)])
    path, distance = fit_path(slide_along(xy))
    assert distance == pytest.approx(radius * turned, abs=2e-4)
    heading = np.column_stack([np.sin(turned), np.cos(turned)])
    assert path.heading_at(distance) == pytest.approx(heading, abs=2e-3)
    steps = np.hypot(*np.diff(path.points, axis=0).T)
    assert steps == pytest.approx(PATH_STEP, abs=1e-6)
    assert np.hypot(*path.heading.T) == pytest.approx(1.0)


def test_wild_rows_and_noise_across_hardly_bend_it(rng):
    s = np.linspace(0, 18, 400)
    xy = np.column_stack([np.zeros(400), s])
    xy[:, 0] += rng.normal(0, 0.003, 400)
    xy[[50, 51, 200, 333], 0] += 0.5
    path, distance = fit_path(slide_along(xy))
    inside = np.linspace(0.5, 17.5, 50)
    assert np.abs(path.at(inside)[:, 0]).max() < 2e-3
    assert np.median(np.abs(distance - s)) < 1e-3


def test_distance_counts_along_the_line_not_across_it():
    """A row beside the line is as far along as the nearest point of the line."""
    radius, turned = 40.0, np.linspace(0, 0.4, 300)
    xy = radius * np.column_stack([1 - np.cos(turned), np.sin(turned)])
    outward = np.column_stack([-np.cos(turned), np.sin(turned)])
    beside = xy.copy()
    beside[100] += 0.005 * outward[100]
    _, straight = fit_path(slide_along(xy))
    _, distance = fit_path(slide_along(beside))
    assert distance[100] == pytest.approx(straight[100], abs=2e-4)
