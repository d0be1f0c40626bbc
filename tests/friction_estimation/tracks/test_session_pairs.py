"""Throws in the films of several cameras are matched by their times."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.tracks import same_throws


def session(seed, count=12):
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.uniform(25.0, 70.0, count)), rng


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("ahead", [-300.0, 0.0, 41.5])
def test_throws_are_matched_whenever_a_camera_was_started(seed, ahead):
    begin, rng = session(seed)
    away = begin + ahead + rng.uniform(6.0, 13.0, len(begin))
    assert same_throws([begin, away]) == [[k, k] for k in range(len(begin))]


@pytest.mark.parametrize("seed", range(5))
def test_a_throw_that_one_camera_missed_is_that_of_the_other_alone(seed):
    begin, rng = session(seed)
    away = np.delete(begin + 100 + rng.uniform(6.0, 13.0, len(begin)), [2, 7])
    home = np.delete(begin, 4)
    found = same_throws([home, away])
    assert len(found) == len(begin)
    assert found[2] == [2, None]
    assert found[4] == [None, 3]
    assert found[-1] == [len(home) - 1, len(away) - 1]


def test_films_of_one_throw_are_that_throw_and_three_cameras_may_be_joined():
    assert same_throws([np.array([0.0]), np.array([0.0]), np.array([3.0])]) == [[0, 0, 0]]
