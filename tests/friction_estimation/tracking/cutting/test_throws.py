"""A practice film is cut into its throws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.trajectory import Trajectory
from friction_estimation.camera import camera_from_scene
from friction_estimation.film import Film
from friction_estimation.synthetic import named_camera
from friction_estimation.tracking import track_each
from friction_estimation.tracking.cutting.looks import Look
from friction_estimation.tracking.cutting.pace import (
    is_beside_a_stone,
    is_thrown,
    slides_until,
    stops_before_its_hog_line,
    without_resting,
    without_walkers,
)
from friction_estimation.tracking.cutting.paths import (
    LostPath,
    vanishes_behind_its_hog_line,
    with_groups,
    without_returns,
)
from friction_estimation.tracking.cutting.pieces import cut
from friction_estimation.tracking.cutting.throws import find_throws, shows_several, stretches
from friction_estimation.tracking.detection.thrown_stone import RoughPath, Sighting

GANTRY = named_camera("gantry", (640, 360))
FPS = 8.0
"""Frames per second of the practice film."""


def path_of(t, y):
    places = [np.array([0.1, value]) for value in y]
    sightings = (
        Sighting(frame=k, t=float(moment), xy=xy, likeness=1.0)
        for k, (moment, xy) in enumerate(zip(t, places, strict=True))
    )
    return RoughPath(sightings=tuple(sightings))


def test_every_throw_is_found_and_nothing_else(practice):
    film = Film.open(practice.path)
    camera = camera_from_scene(practice.scene, film.size)
    throws = find_throws(film, practice.scene, camera)
    assert len(throws) == 3
    for throw, begin, truth in zip(throws, practice.begins, practice.truths, strict=True):
        assert begin - 3 < throw.begin < begin + 1
        moving = truth.t[np.hypot(*truth.velocity.T) > 0.2][-1]
        assert begin + moving < throw.end < begin + truth.t[-1] + 5
    ends = [throw.end for throw in throws]
    assert all(later.begin >= end for later, end in zip(throws[1:], ends, strict=False))


def test_each_throw_has_its_own_track_clock_and_stone(practice):
    found = list(track_each([practice.path], practice.scene))
    assert [one.thrown.throw for one in found] == [0, 1, 2]
    # The red one was picked up and is thrown again past the yellow one, which stays where it is.
    assert [one.thrown.stone for one in found] == [0, 1, 0]
    assert [[k.stone for k in one.tracks[1:]] for one in found] == [[], [], [1]]
    for one, begin, truth in zip(found, practice.begins, practice.truths, strict=True):
        t = one.thrown.clock + one.thrown.t - begin
        assert -0.01 < t[0] < 1.5
        assert len(t) > 0.8 * len(truth)
        # The first stone vanishes when it has come to rest, the others stay in the picture.
        assert t[-1] < truth.t[-1] + (0.01 if one is found[0] else 4.01)
        rows = np.minimum(np.rint(FPS * t).astype(int), len(truth) - 1)
        assert np.hypot(*(one.thrown.xy - truth.xy[rows]).T).max() < 0.03


def test_a_short_film_of_several_throws_is_cut_too(practice, monkeypatch):
    monkeypatch.setattr("friction_estimation.tracking.cutting.tuning.SHORT_SECONDS", 100.0)
    monkeypatch.setattr("friction_estimation.tracking.cutting.tuning.ONE_THROW_SECONDS", 100.0)
    assert len(cut(Film.open(practice.path), practice.scene)) == 1
    found = list(track_each([practice.path], practice.scene))
    assert len(found) == 3
    clocks = [one.thrown.clock + one.thrown.t[0] for one in found]
    assert clocks == pytest.approx(practice.begins, abs=1.5)


def test_two_quick_takeouts_are_two_throws_and_a_stone_that_is_hit_is_none():
    t = np.arange(0.0, 8.0, 0.7)
    first, second = path_of(t, -11 + 3.4 * t - 0.05 * t**2), path_of(t + 12, -11 + 3.6 * t)
    rest = first.sightings[-1].xy[1]
    hit = path_of(8.4 + t[:6], rest + 2.0 * t[:6] - 0.05 * t[:6] ** 2)
    slid_back = path_of(12 + t, rest - 1.6 * t + 0.04 * t**2)

    def seen(*paths):
        sightings = sorted((s for path in paths for s in path.sightings), key=lambda s: s.t)
        return [replace(s, frame=round(s.t / 0.7)) for s in sightings]

    assert shows_several(seen(first, second))
    for other in (hit, slid_back):
        assert not shows_several(seen(first, other))


def test_a_stone_that_is_slid_back_is_left_out_and_that_is_told():
    t = np.arange(0.0, 20.0, 0.7)
    there = LostPath.of(path_of(t, 15.0 - 0.075 * (20.0 - t) ** 2))
    back = LostPath.of(path_of(t + 40.0, 15.0 - 1.2 * t))
    again = LostPath.of(path_of(t + 80.0, 15.0 - 0.075 * (20.0 - t) ** 2))
    told = []
    kept = list(without_returns([there, back, again], lambda *when: told.append(when)))
    assert kept == [there, again]
    assert told == [(back.begin, back.end)]


def test_a_short_film_of_one_throw_is_tracked_as_it_is(practice):
    film = Film.open(practice.path).part(3.0, 14.0)
    (piece,) = cut(film, practice.scene)
    assert piece.begin is None
    assert piece.film is film


def test_a_long_film_without_a_throw_is_refused(practice, monkeypatch):
    monkeypatch.setattr("friction_estimation.tracking.cutting.tuning.ONE_THROW_SECONDS", 2.0)
    film = Film.open(practice.path).part(0.0, 4.5)
    with pytest.raises(InputError, match=r"practice\.mp4: no throw found in 0:04\.6 of film"):
        cut(film, practice.scene)


@pytest.mark.parametrize(("slows", "thrown"), [(0.09, True), (0.0, False), (-0.05, False)])
def test_what_keeps_its_pace_is_carried_and_what_slows_down_is_thrown(slows, thrown):
    t = np.arange(0.0, 12.0, 0.5)
    jitter = 0.05 * np.random.default_rng(1).standard_normal(len(t))
    assert is_thrown(path_of(t, 1.4 * t - slows * t**2 / 2 + jitter)) == thrown


def test_a_stone_that_is_pushed_aside_is_no_throw():
    t = np.arange(0.0, 3.0, 0.4)
    assert not is_thrown(path_of(t, 1.0 * t - 0.16 * t**2))


def test_a_stone_that_is_lost_between_sweepers_may_slide_on():
    t = np.arange(0.0, 4.1, 0.4)
    lost = path_of(t, -11 + 2.0 * t - 0.045 * t**2)
    assert 20 < slides_until(lost, 22.25) < 30
    fast = path_of(t, -11 + 4.0 * t)
    assert slides_until(fast, 22.25) == pytest.approx(4 + 17.25 / 4, abs=1)
    slow = path_of(np.arange(0.0, 10.1, 0.4), 2.0 * np.exp(-np.arange(0.0, 10.1, 0.4)))
    assert slides_until(slow, 22.25) == slow.sightings[-1].t


@pytest.mark.parametrize(
    ("begins", "ends", "rests", "moved"),
    [
        (-19.6, -15.8, True, True),
        (22.6, 18.6, True, True),
        (-19.6, -12.0, False, False),
        (-12.0, 16.0, True, False),
        (14.0, -17.0, True, False),
        (4.0, 16.0, True, False),
    ],
)
def test_what_stops_before_its_own_hog_line_was_not_thrown(begins, ends, rests, moved):
    """A camera over the house may lose a thrown stone there, but it does not stop."""
    t = np.linspace(0.0, 10.0, 101)
    way = 1 - (1 - t / 6).clip(0) ** 2 if rests else t / 10
    track = Trajectory(t=t, xy=np.column_stack([0.2 * way, begins + (ends - begins) * way]))
    assert stops_before_its_hog_line(track) == moved


def test_who_walks_at_one_pace_is_left_out_and_what_slows_down_is_not():
    t = np.arange(0.0, 12.0, 0.4)
    jitter = 0.02 * np.random.default_rng(2).standard_normal(len(t))
    head = path_of(t, -9 + 1.6 * t + jitter).sightings
    foot = path_of(t, -9.4 + 1.4 * t + jitter).sightings
    stone = path_of(t, 12 - 2.0 * t + 0.045 * t**2 + jitter).sightings
    left = without_walkers([*head, *foot, *stone], GANTRY)
    # Where they meet, the stone is seen too near to somebody.
    assert len(left) >= len(stone) - 8
    assert all(any(s is own for own in stone) for s in left)


def test_a_stone_that_is_seen_once_in_a_while_does_not_lie_still():
    looked = np.arange(0.0, 20.0, 0.4)
    path = path_of([6.0, 6.4, 13.2], [-9.0, -8.2, 3.0]).sightings
    lying = path_of(looked, np.full(len(looked), 16.0)).sightings
    assert without_resting([*path, *lying], looked)[: len(path)] == list(path)
    assert len(without_resting(lying, looked)) < len(lying) / 2


@pytest.mark.parametrize(
    ("slows", "lasts", "sweeps"), [(0.09, 20.0, True), (0.0, 20.0, False), (0.09, 3.0, False)]
)
def test_people_who_slow_down_as_a_stone_does_sweep_one(slows, lasts, sweeps):
    t = np.arange(0.0, lasts, 0.4)
    jitter = 0.3 * np.random.default_rng(3).standard_normal(len(t))
    assert is_beside_a_stone(path_of(t, -11 + 2.0 * t - slows * t**2 / 2 + jitter)) == sweeps


def test_a_throw_lasts_as_long_as_people_sweep_beside_its_stone():
    seen = LostPath.of(path_of([10.0, 10.4, 10.8], [-9.0, -8.2, -7.4]), 11.0)
    t = np.arange(8.0, 32.0, 0.4)
    beside, alone = path_of(t, 22 - 0.06 * (32 - t) ** 2), path_of(t + 50, t)
    first, second = with_groups([seen], [beside, alone], 22.25)
    assert first.path is seen.path
    assert first.begin < 10.0
    assert t[-1] <= first.until < t[-1] + 3
    assert first.seen
    assert not second.seen
    assert second.begin == pytest.approx(58.0, abs=2)
    assert second.end == alone.sightings[-1].t


@pytest.mark.parametrize(
    ("ends", "hidden", "moved"), [(-15, False, True), (-15, True, False), (5, False, False)]
)
def test_what_is_seen_no_more_behind_its_hog_line_was_not_thrown(ends, hidden, moved):
    path = path_of(np.linspace(0, 2, 6), np.linspace(-20, ends, 6))
    lost = LostPath.of(path, 20.0, hidden=hidden)
    assert vanishes_behind_its_hog_line(lost, GANTRY) == moved


def test_stretches_around_motion_are_joined_where_they_meet():
    moves = {30.0, 31.0, 37.5, 60.0}
    seen = ((Look(t=t, stored=None), t in moves) for t in np.arange(0.0, 80.0, 0.5))
    found = [[look.t for look in stretch] for stretch in stretches(seen)]
    assert [(s[0], s[-1]) for s in found] == [(25.0, 40.5), (55.0, 63.0)]
    assert all(len(s) == 2 * (s[-1] - s[0]) + 1 for s in found)
