"""The running band on worn tracks, compared with a sum over very many contacts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env import simulate
from curling_env.ice import ActiveEffect, Ice
from curling_env.physics import GRAVITY, IceInUse, acceleration, play_batch, slide
from curling_env.throw import Release, Throw
from curling_env.worn_tracks import WORN_WIDTH

MU, WEAR = 0.009, -0.1
ICE = Ice.uniform(
    MU, effects=(ActiveEffect(name="pebble_wear", parameters={"under_contacts": WEAR}),)
)
LANES = ((0.0, 0.004), (0.05, 0.0), (-0.1, -0.006))
"""Tracks of earlier stones: x in mid-sheet [m], and the change of x with y."""
HEAVY = np.array([0.0, -11.0, 0.0, 2.1, 0.0, 1.6])


def worn() -> Ice:
    in_use = IceInUse(ICE)
    y = np.linspace(-16.0, 20.0, 200)
    for x, tilt in LANES:
        in_use.ran(np.column_stack([x + tilt * y, y]))
    return in_use.now


def by_contacts(state, contacts: int = 240):
    """Acceleration and turning where each contact has the friction of the tracks under it."""
    x, y, vx, vy, _, spin = state
    radius = ICE.stone.band_radius
    phi = 2 * np.pi * (np.arange(contacts) + 0.5) / contacts
    speed = np.hypot(vx, vy)
    forward, left = radius * np.cos(phi), radius * np.sin(phi)
    at_x = x + (forward * vx - left * vy) / speed
    at_y = y + (forward * vy + left * vx) / speed
    passes = sum(abs(at_x - x0 - tilt * at_y) < WORN_WIDTH / 2 for x0, tilt in LANES)
    mu = MU * np.exp(WEAR * passes)
    u = np.array([speed - spin * left, spin * forward])
    push = -GRAVITY * mu * u / np.hypot(*u)
    along, aside = push.mean(axis=1)
    torque = (forward * push[1] - left * push[0]).mean() * ICE.stone.mass
    turn = torque / ICE.stone.inertia
    return np.array([along * vx - aside * vy, along * vy + aside * vx, turn * speed]) / speed


def by_small_steps(state, step: float = 0.01):
    """The state at rest, by the midpoint rule."""
    s = np.array(state)
    while (speed := np.hypot(s[2], s[3])) > 2e-3:
        a = by_contacts(s)
        h = min(step, 0.3 * speed / np.hypot(a[0], a[1]))
        middle = s + 0.5 * h * np.array([s[2], s[3], *a[:2], s[5], a[2]])
        a = by_contacts(middle)
        s = s + h * np.array([middle[2], middle[3], *a[:2], middle[5], a[2]])
    return s


@pytest.mark.parametrize("spin", [1.5, -1.5, 20.0, 0.0])
def test_each_contact_has_the_friction_under_it(spin):
    x = np.linspace(-0.3, 0.3, 61)
    states = np.column_stack([x, np.full(61, 3.0), np.full(61, 0.02), np.full(61, 0.9)])
    states = np.column_stack([states, np.full(61, spin)])
    exact = np.array([by_contacts([*s[:4], 0.0, s[4]], 2400) for s in states])
    off = acceleration(worn(), states) - exact
    plain = acceleration(ICE, states) - exact
    # Sides of a track are as soft as the cells are wide, and few contacts stand for the ring.
    assert np.abs(off[:, 1]).max() < 0.12 * np.abs(plain[:, 1]).max()
    assert np.abs(off[:, 2]).max() < 0.2 * np.abs(plain[:, 2]).max()
    assert np.abs(off.mean(axis=0)).max() < 0.02 * np.abs(plain[:, 1]).max()


def test_a_stone_on_tracks_goes_where_the_sum_over_its_contacts_takes_it():
    x, y, vx, vy, _, omega = HEAVY
    release = Release(x=x, y=y, vx=vx, vy=vy, omega=omega)
    there = by_small_steps(HEAVY)
    on_tracks, even = slide(worn(), release), slide(ICE, release)
    assert abs(even.y - there[1]) > 2.0
    assert abs(even.theta - there[4]) > 0.5
    assert (on_tracks.x, on_tracks.y) == pytest.approx(tuple(there[:2]), abs=0.03)
    assert on_tracks.theta == pytest.approx(there[4], abs=0.1)
    among = play_batch(worn(), np.empty((1, 0, 2)), [release])
    assert among.xy[0, -1] == pytest.approx([on_tracks.x, on_tracks.y], abs=2e-3)


def test_before_the_first_stone_nothing_is_felt():
    throw = Throw(speed=2.0, spin=1.3)
    plain = replace(ICE, effects=())
    one, other = simulate(ICE, [throw])[0], simulate(plain, [throw])[0]
    assert np.array_equal(one.xy, other.xy)
    assert np.array_equal(one.theta, other.theta)
