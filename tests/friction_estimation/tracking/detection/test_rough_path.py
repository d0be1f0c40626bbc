"""Where a stone is expected that is no longer seen."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.tracking.detection.thrown_stone import RoughPath, Sighting


def slid(t, slowing, speed=2.2):
    """Place of a stone that slows evenly, (2,) [m]; it is thrown at a small angle."""
    t = np.minimum(t, speed / slowing)
    return (speed * t - 0.5 * slowing * t**2) * np.array([0.05, 1.0]) - np.array([0.0, 11.0])


def path_until(t, slowing, rng, *, since=0.0):
    """Sightings every 0.8 s, 3 cm off."""
    times = np.arange(since, t, 0.8)
    return RoughPath(
        sightings=tuple(
            Sighting(
                frame=k, t=float(s), xy=slid(s, slowing) + rng.normal(0, 0.03, 2), likeness=1.0
            )
            for k, s in enumerate(times)
        )
    )


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("slowing", [0.08, 0.1, 0.13])
def test_a_stone_that_is_lost_on_its_way_comes_to_rest_where_it_would(slowing, seed):
    rest = 2.2 / slowing
    path = path_until(rest - 5.0, slowing, np.random.default_rng(seed))
    left = np.linalg.norm(slid(rest, slowing) - slid(path.sightings[-1].t, slowing))
    assert left > 1.0
    for later in (1.0, 3.0, 6.0, 20.0):
        t = path.sightings[-1].t + later
        off = np.linalg.norm(path.at(t) - slid(t, slowing))
        assert off < 0.3 * left
        assert off < path.doubt(t) + 0.15


@pytest.mark.parametrize("seed", range(4))
def test_a_stone_that_was_seen_at_rest_stays_there(seed):
    path = path_until(2.2 / 0.1 + 4.0, 0.1, np.random.default_rng(seed))
    assert np.linalg.norm(path.at(60.0) - slid(60.0, 0.1)) < 0.1
    assert path.doubt(60.0) < 0.02


@pytest.mark.parametrize("seen", [2, 4])
def test_a_stone_that_was_seen_for_a_moment_goes_on_as_stones_do(seen):
    path = path_until(8.0 + 0.8 * seen, 0.1, np.random.default_rng(0), since=8.01)
    assert len(path.sightings) == seen
    t = path.sightings[-1].t
    assert np.array_equal(path.at(t), path.sightings[-1].xy)
    gone = np.linalg.norm(path.at(t + 30.0) - path.at(t))
    assert 3.0 < gone < 15.0
