"""One stone that curls, or runs, unlike the others, in throws that the project did not simulate."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.trajectory import Trajectory
from friction_estimation import discover
from friction_estimation.discovery import document

GRAVITY, BAND, STEP = 9.80665, 0.0625, 0.01
CONTACTS = 2 * np.pi * (np.arange(24) + 0.5) / 24
MU, CURL, TURNING = 0.009, 0.007, 0.37
FRAME = 20
"""Steps from one measured row to the next."""


def rates(state: np.ndarray, mu: np.ndarray, curl: np.ndarray) -> np.ndarray:
    """Rates of change of (k, 6) states x, y, vx, vy, theta, omega: a ring of contacts, and a push
    to the side."""
    speed = np.hypot(state[:, 2], state[:, 3]) + 1e-9
    travel, spin = state[:, 2:4] / speed[:, None], state[:, 5]
    slip = np.stack(
        [
            speed[:, None] - BAND * spin[:, None] * np.sin(CONTACTS),
            BAND * spin[:, None] * np.cos(CONTACTS),
        ]
    )
    unit = slip / np.hypot(*slip)
    along = -GRAVITY * mu * unit[0].mean(axis=1)
    torque = (unit[0] * np.sin(CONTACTS) - unit[1] * np.cos(CONTACTS)).mean(axis=1)
    left = curl * np.tanh(spin / 0.02)
    left = np.column_stack([-travel[:, 1], travel[:, 0]]) * left[:, None]
    return np.column_stack(
        [
            state[:, 2:4],
            along[:, None] * travel + left,
            spin,
            TURNING * GRAVITY * mu * torque / BAND,
        ]
    )


def thrown(friction: np.ndarray, curl: np.ndarray, seed: int) -> list[Trajectory]:
    """Sixteen throws in both directions and with both spins; 4 mm and 1° of noise.

    Parameters
    ----------
    friction, curl : (4,) factors of the stones
    """
    rng = np.random.default_rng(seed)
    count = 16
    stones = rng.permutation(np.arange(count) % 4)
    ways = np.where(np.arange(count) % 2 == 0, 1.0, -1.0)
    speed = rng.permutation(np.linspace(1.4, 2.9, count))
    spin = rng.choice([-1.0, 1.0], count) * rng.uniform(0.9, 2.2, count)
    line, zero = rng.normal(0.0, 0.008, count), np.zeros(count)
    state = np.column_stack(
        [
            rng.uniform(-0.8, 0.8, count),
            -10.97 * ways,
            ways * speed * line,
            ways * speed,
            zero,
            spin,
        ]
    )
    mu = MU * friction[stones] * np.exp(rng.normal(0.0, 0.003, count))
    path = [state]
    while len(path) < 2_600:
        half = state + 0.5 * STEP * rates(state, mu, CURL * curl[stones])
        state = state + STEP * rates(half, mu, CURL * curl[stones])
        path.append(state)
    states = np.array(path)[::FRAME]
    tracks: list[Trajectory] = []
    for k in range(count):
        own = states[:, k]
        seen = (np.hypot(own[:, 2], own[:, 3]) > 0.02).cumprod().astype(bool)
        seen &= np.abs(own[:, 1]) < 21.5
        t = np.flatnonzero(seen).astype(np.float64) * (STEP * FRAME)
        tracks.append(
            Trajectory(
                t=t,
                xy=own[seen, :2] + rng.normal(0.0, 0.004, (len(t), 2)),
                theta=own[seen, 4] + rng.normal(0.0, 0.02, len(t)),
                throw=k,
                stone=int(stones[k]),
                clock=70.0 * k,
            )
        )
    return tracks


ALIKE = np.ones(4)
LESS_CURL = np.array([1.0, 1.0, 0.8, 1.0])
HEAVIER = np.array([1.0, 1.0, 1.05, 1.0])


@pytest.mark.parametrize(
    ("friction", "curl", "expected"),
    [
        (ALIKE, ALIKE, {}),
        (HEAVIER, LESS_CURL, {"factor": 1.05, "curl_factor": 0.8}),
    ],
    ids=("all alike", "curls less and runs heavier"),
)
def test_what_one_stone_does_is_named_beside_the_curl(friction, curl, expected):
    report = document(discover(thrown(friction, curl, seed=5)))
    named = [e["name"] for e in report["effects"]]
    assert sorted(named) == sorted(["curl", *["stone_bias"] * len(expected)])
    for e in report["effects"]:
        if e["name"] == "stone_bias":
            parameters = dict(e["parameters"])
            assert parameters.pop("stone")["value"] == 2
            ((name, found),) = parameters.items()
            assert found["value"] == pytest.approx(expected.pop(name), abs=4 * found["stderr"])
            assert 0 < found["stderr"] < 0.02
            assert ("its own curl" in report["verdict"]) or name == "factor"
    assert not expected
