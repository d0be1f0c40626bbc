"""Contacts between stones, and the free slides before and after them.

The paths come from the engine and, without contacts, from the generator of the tests, which shares
no code with it.
"""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.physics import Engine, StoneState
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory
from friction_estimation import estimate_ice
from friction_estimation.comparison.rethrow import compare_tracks
from friction_estimation.tracks import contacts_of, free_slides, rough_friction

MU = 0.0095


def noisy(path, rng, *, fps=30, noise=0.004, **columns):
    every = 240 // fps
    xy = path.xy[::every]
    return Trajectory(
        t=path.t[::every],
        xy=xy + rng.normal(0, noise, xy.shape),
        theta=path.theta[::every],
        **columns,
    )


def hit(speed, *stones):
    """Return the path of a thrown stone that hits others, those of the others, and the times of the
    hits.
    """
    lying = [StoneState(x=x, y=y, stone=k) for k, (x, y) in enumerate(stones, start=1)]
    outcome = Engine(Ice.uniform(MU)).play(Throw(speed=speed, spin=1.2).release(), lying, fps=240)
    *others, thrown = outcome.trajectories
    own = len(lying)
    times = [c.time for c in outcome.contacts if own in (c.first, c.second)]
    return thrown, others, times


HITS = {
    "full": (3.0, (0.02, 16.0)),
    "half": (2.6, (0.12, 14.0)),
    "glancing": (2.8, (0.275, 12.0)),
    "late": (2.4, (0.05, 17.3)),
    "two stones": (3.1, (0.2, 11.5), (-0.25, 14.0)),
}


@pytest.mark.parametrize("fps", [10, 30])
@pytest.mark.parametrize("noise", [0.002, 0.006])
@pytest.mark.parametrize("name", HITS)
def test_a_track_alone_shows_its_contacts(name, noise, fps, rng):
    thrown, _, times = hit(*HITS[name])
    track = noisy(thrown, rng, fps=fps, noise=noise)
    (found,) = contacts_of([track])
    assert times
    if fps == 30:
        for time in times:
            assert np.abs(np.array(found) - time).min() < 0.1
    slides, _ = free_slides([track])
    for slide in slides:
        assert not any(slide.t[0] < time < slide.t[-1] for time in times)


@pytest.mark.parametrize("name", HITS)
def test_friction_is_fitted_on_free_slides_only(name, rng):
    """The fit across the contact was several times too high, or 29 % off after a late one."""
    thrown, _, _ = hit(*HITS[name])
    track = noisy(thrown, rng)
    found = estimate_ice([track], uniform=True)
    assert found.mu == pytest.approx(MU, rel=0.01)
    assert abs(found.mu - MU) < 4 * found.sigma
    assert found.throws == 1
    assert rough_friction(track) == pytest.approx(MU, rel=0.1)


def test_a_stone_slides_freely_before_and_after_a_contact(rng):
    thrown, _, (time,) = hit(2.35, (0.275, 14.0))
    track = noisy(thrown, rng, noise=0.003)
    slides, reasons = free_slides([track])
    assert not reasons
    before, after = slides
    assert before.t[-1] < time < after.t[0]
    assert not before.rests
    assert after.rests
    found = estimate_ice([track], uniform=True)
    assert len(found.slides) == 2
    assert {found.place(slide) for slide in found.slides} == {0, 1}
    assert found.summary()["throws"] == 1
    compared = compare_tracks([track], Ice.uniform(MU))
    assert len(compared.rethrows) == 2
    error = compared.rethrows[1].rest_error
    assert error is not None
    assert error < 0.1
    assert compared.rethrows[0].rest is None


def test_stones_that_come_within_a_diameter_touch(rng):
    """In noise that hides a slight contact, the track of the other stone shows it."""
    thrown, (struck,), (time,) = hit(2.4, (0.28, 14.0))
    tracks = [
        noisy(thrown, rng, noise=0.02, fps=15, throw=3),
        noisy(struck, rng, noise=0.02, fps=15, throw=3, stone=1),
    ]
    for found in contacts_of(tracks):
        assert np.abs(np.array(found) - time).min() < 0.15
    apart = [tracks[0], Trajectory(t=tracks[1].t, xy=tracks[1].xy, throw=4)]
    assert len(contacts_of(apart)[1]) < len(contacts_of(tracks)[1])


def test_stones_that_pass_each_other_do_not_touch():
    t = np.arange(0, 4, 1 / 30)
    thrown = Trajectory(t=t, xy=np.column_stack([0 * t, 12 + 1.5 * t - 0.05 * t**2]), throw=0)
    lying = Trajectory(t=t[[0, -1]], xy=np.array([[0.33, 15.0], [0.33, 15.0]]), throw=0, stone=1)
    assert contacts_of([thrown, lying]) == [[], []]


@pytest.mark.parametrize("noise", [0.002, 0.01])
@pytest.mark.parametrize("fps", [10, 30])
def test_no_contact_is_found_without_one(sliding, rng, noise, fps):
    """Rough ice, strong curl and friction that follows the speed change no velocity suddenly."""
    field = sliding.random_field(rng, mu=0.009, spread=0.15, length=1.5)
    starts = sliding.varied_starts(rng, 24)
    tracks = sliding.measured_throws(
        field, starts, rng, noise=noise, fps=fps, curl=0.02, exponent=0.2, rest=3.0
    )
    assert not any(contacts_of(tracks))


def test_a_stone_that_is_moved_after_it_rested_was_not_hit_on_its_way(filmed, rng):
    track, _ = filmed(rng)
    t = np.arange(1, 40) / 30
    aside = track.xy[-1] + np.column_stack([0.8 * t, 0.3 * t])
    moved = Trajectory(t=np.append(track.t, track.t[-1] + t), xy=np.vstack([track.xy, aside]))
    (slide,), _ = free_slides([moved])
    assert slide.rests
    assert slide.t[-1] < track.t[-1] + 0.1


def test_a_stone_that_a_hand_slows_is_no_free_slide(filmed, rng):
    """Two metres of braking by hand between two kicks are not a slide on ice alone."""
    track, _ = filmed(rng, rest=0.0)
    cut = int(np.argmax(track.t >= 8.0))
    speed = 2.0 - 0.09 * 8.0
    u = np.arange(1, 70) / 30
    brake = 0.5
    along = np.where(u < speed / brake, speed * u - brake * u**2 / 2, speed**2 / (2 * brake))
    xy = track.xy[cut] + np.column_stack([0 * u, along]) + rng.normal(0, 0.003, (len(u), 2))
    held = Trajectory(
        t=np.append(track.t[: cut + 1], track.t[cut] + u), xy=np.vstack([track.xy[: cut + 1], xy])
    )
    slides, _ = free_slides([held])
    assert max(slide.t[-1] for slide in slides) < 8.3
