"""How a stone runs on a `HiddenIce`, with formulas and steps of its own.

The integrator (fourth-order Runge–Kutta at fixed steps over a ring of contacts) shares nothing
with `curling_env.physics`. So the estimators and the planner are judged on throws that their own
engine did not make.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from agents.closed_loop.hidden_ice import HiddenIce
from curling_env.physics.compiled import compiled
from curling_env.physics.motion import GRAVITY
from curling_env.sheet import PAPER_SHEET, RULE_BOOK_STONE
from curling_env.throw import Release
from curling_env.typing import Floats

STEP = 1e-2
"""Step of the integrator [s]."""
CONTACTS = 16
"""Contact points on the running band."""
RESTING_SPEED = 1e-4
"""A stone slower than this is at rest [m/s]; it would slide on by less than 0.1 µm."""
MAX_TIME = 90.0
"""Longest throw that is followed [s]."""
MIN_SLIP = 0.01
"""Slip below which friction rises no further [m/s]."""


def run_stone(ice: HiddenIce, release: Release, stones: Floats | None = None) -> Floats:
    """Follow a stone on the hidden ice until it rests, leaves the ice or touches another.

    Parameters
    ----------
    stones : (k, 2) centres of resting stones [m]

    Returns
    -------
    (n, 7) t, x, y, vx, vy, theta, omega at every step
    """
    state = np.array(
        [release.x, release.y, release.vx, release.vy, release.theta, release.omega], dtype=float
    )
    band = RULE_BOOK_STONE.band_radius
    spin_up = RULE_BOOK_STONE.mass * band / ice.inertia
    law = np.array([ice.mu, ice.exponent, ice.curl, ice.curl_exponent, *ice.slope, spin_up, band])
    rows = np.empty((int(MAX_TIME / STEP), 7))
    others = np.empty((0, 2)) if stones is None else np.ascontiguousarray(stones, dtype=float)
    edge = np.array([PAPER_SHEET.width, PAPER_SHEET.length]) / 2 - RULE_BOOK_STONE.radius
    n = _run(law, ice.waves, state, others, 2 * RULE_BOOK_STONE.radius, edge, rows)
    return rows[:n].copy()


def comes_to_rest(path: Floats) -> bool:
    """Whether a path of `run_stone` ends with the stone at rest."""
    return bool(np.hypot(path[-1, 3], path[-1, 4]) < 1e-3)


@compiled(allocates=True)
def _rates(law: Any, waves: Any, state: Any, out: Any) -> None:
    """Time derivative of (x, y, vx, vy, theta, omega)."""
    mu, exponent, curl, curl_exponent = law[0], law[1], law[2], law[3]
    slope_x, slope_y, spin_up, band = law[4], law[5], law[6], law[7]
    vx, vy, spin = state[2], state[3], state[5]
    v = math.sqrt(vx * vx + vy * vy) + 1e-12
    uneven = 0.0
    for i in range(waves.shape[0]):
        uneven += waves[i, 0] * math.sin(
            waves[i, 1] * state[0] + waves[i, 2] * state[1] + waves[i, 3]
        )
    here = mu * math.exp(uneven)
    along = across = torque = 0.0
    for k in range(CONTACTS):
        phi = 2.0 * math.pi * (k + 0.5) / CONTACTS
        forward = v - spin * band * math.sin(phi)
        left = spin * band * math.cos(phi)
        slip = math.sqrt(forward * forward + left * left) + 1e-12
        local = here * GRAVITY / CONTACTS * max(slip, MIN_SLIP) ** (-exponent)
        along -= local * forward / slip
        across -= local * left / slip
        torque -= local * (math.cos(phi) * left - math.sin(phi) * forward) / slip
    across += math.tanh(spin / 0.01) * curl * v**curl_exponent
    out[0] = vx
    out[1] = vy
    out[2] = (along * vx - across * vy) / v + GRAVITY * slope_x
    out[3] = (along * vy + across * vx) / v + GRAVITY * slope_y
    out[4] = spin
    out[5] = torque * spin_up


@compiled(allocates=True)
def _run(law: Any, waves: Any, s: Any, stones: Any, touch: float, edge: Any, rows: Any) -> int:
    """Fill `rows` from the state `s` on; the number of rows that were filled."""
    k1, k2, k3, k4 = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    t = 0.0
    for n in range(rows.shape[0]):
        rows[n, 0] = t
        rows[n, 1:] = s
        v = math.sqrt(s[2] * s[2] + s[3] * s[3])
        if v < RESTING_SPEED or abs(s[0]) > edge[0] or abs(s[1]) > edge[1]:
            return n + 1
        for k in range(stones.shape[0]):
            dx, dy = stones[k, 0] - s[0], stones[k, 1] - s[1]
            if dx * dx + dy * dy <= touch * touch and dx * s[2] + dy * s[3] > 0.0:
                return n + 1
        _rates(law, waves, s, k1)
        # Near its end a whole step would carry a stone past the point where it stops.
        h = min(STEP, 0.25 * v / math.sqrt(k1[2] * k1[2] + k1[3] * k1[3] + 1e-18))
        for k in range(stones.shape[0]):  # nor may it step into another stone
            gap = math.sqrt((stones[k, 0] - s[0]) ** 2 + (stones[k, 1] - s[1]) ** 2) - touch
            if 0.0 < gap < 2.0 * v * h:
                h = min(h, max(0.5 * gap / v, 1e-5))
        _rates(law, waves, s + 0.5 * h * k1, k2)
        _rates(law, waves, s + 0.5 * h * k2, k3)
        _rates(law, waves, s + h * k3, k4)
        s += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        t += h
    return rows.shape[0]
