"""Coverage of the rests of draws on a discovered ice by its standard errors.

Throws both ways and with both spins slide on the discovered ice and on the sealed truth. Their
distance is compared with the spread of the plausible ices.
"""

from __future__ import annotations

import numpy as np
from blind.families import Task
from blind.law import HOG
from blind.sessions import true_ice

from curling_env import load_ice
from curling_env.analysis import plausible_ices
from curling_env.ice import Ice
from curling_env.physics import SlideEnd, release_table, throw_batch
from curling_env.sheet import TEE_Y
from curling_env.throw import Release
from curling_env.typing import Flags, Floats
from friction_estimation.discovery.discover import discover

ICES = 200
"""Number of sampled ices of each discovered one."""
SPEEDS = np.linspace(1.6, 2.7, 56)
"""Speeds from which draws are chosen [m/s]."""
PAST_TEE = (-1.5, 0.5)
"""Range past the tee in which chosen draws rest on the discovered ice [m]."""
SPIN = 1.5
"""Rotation, in either sense [rad/s]."""
Thrown = tuple[float, float, float]
"""Direction, speed and spin."""


def rest_errors(task: Task, seed: int) -> tuple[Floats, Floats]:
    """Return errors and standard errors along the sheet of draws on a discovered ice, (n,) [m]."""
    tracks, sealed = task.make(seed)
    ice = discover(tracks, load_ice("standard") if task.given else None).improved_ice()
    throws = _draws_on(ice)
    truth = true_ice(sealed)
    true = [truth.path(_release(*thrown))[-1, :2] for thrown in throws]
    off = np.array(true) - _rests([ice], throws)[0][0]
    xy, rested = _rests(plausible_ices(ice, ICES, np.random.default_rng(0)), throws)
    spread = np.nanstd(np.where(rested[..., None], xy, np.nan), axis=0)
    return off[:, 1], spread[:, 1]


def _draws_on(ice: Ice) -> list[Thrown]:
    """Return draws both ways with both spins that rest near the tee on an ice."""
    chosen: list[Thrown] = []
    for way in (1.0, -1.0):
        for spin in (SPIN, -SPIN):
            throws = [(way, float(speed), spin) for speed in SPEEDS]
            xy, rested = _rests([ice], throws)
            past = np.where(rested[0], way * xy[0, :, 1] - TEE_Y, np.inf)
            if rested.any():
                chosen += [throws[int(np.argmin(np.abs(past - place)))] for place in PAST_TEE]
    return chosen


def _release(way: float, speed: float, spin: float) -> Release:
    return Release(x=0.0, y=-way * HOG, vx=0.0, vy=way * speed, theta=0.0, omega=spin)


def _rests(ices: list[Ice], throws: list[Thrown]) -> tuple[Floats, Flags]:
    """Return resting places on ices, (ices, throws, 2) [m], and flags of throws that rest."""
    releases = release_table([_release(*thrown) for thrown in throws])
    which = np.repeat(np.arange(len(ices)), len(throws))
    found = throw_batch(ices, np.tile(releases, len(ices)), which=which)
    shape = len(ices), len(throws)
    xy = np.stack([found.x, found.y], axis=-1).reshape(*shape, 2)
    return xy, (found.end == SlideEnd.REST).reshape(shape)
