"""Law of the blind sessions' ice: formulas and integrator, written without the project's own.

A ring of 24 contacts, each with Coulomb friction, and the midpoint rule at 2 ms.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np

G = 9.80665
STEP = 2e-3
CONTACTS = 24
BAND = 0.0625
STOP = 3e-4
EDGE = 21.95
HOG = 10.9725
RIPPLE_PERIOD = 5.0
"""Period of friction that ripples along the sheet [m]."""

# Places in the vector of hidden numbers.
(
    MU, COUPLING, EXPONENT, CURL, CURL_V, CURL_W,
    SLOPE_X, SLOPE_Y, WEAR, DRIFT,
    STONE, STONE_FACTOR, SWEEP,
    PATCH_X0, PATCH_X1, PATCH_Y0, PATCH_Y1, PATCH_FACTOR,
    SPIN_RATE, SPIN_POWER, AIR,
    O_SPIN, O_TROUGH, O_LEFT, O_WARM, MAP_ACROSS, O_HEADING, MAP_RIPPLE, O_BRUSHED,
    FORM, ASYMMETRY, LINEAR, SPIN_SHARE, PATCH_SOFT, WEAR_LINEAR, DRIFT_LINEAR,
    WEAR_ALONG, WEAR_UNDER, MAP_SD, MAP_LENGTH, STONE_CURL, SIZE,
) = range(42)  # fmt: skip

ACROSS, ALONG = 0.0125, 0.05
"""Sides of the squares on which passes of earlier stones are counted [m]."""
SQUARES = (401, 901)


@numba.njit(cache=True)
def square_of(x: float, y: float) -> Any:
    i = int(x / ACROSS + 0.5 * SQUARES[0])
    j = int(y / ALONG + 0.5 * SQUARES[1])
    return min(max(i, 0), SQUARES[0] - 1), min(max(j, 0), SQUARES[1] - 1)


@numba.njit(cache=True)
def worn(rate: float, passes: Any, x: float, y: float, ex: float, ey: float, phi: float) -> float:
    """Return the factor on friction at the contact at phi."""
    forward, left = BAND * math.cos(phi), BAND * math.sin(phi)
    i, j = square_of(x + forward * ex - left * ey, y + forward * ey + left * ex)
    return math.exp(rate * passes[i, j])


@numba.njit(cache=True)
def run_over(passes: Any, path: Any) -> None:
    """Count one more pass on every square that the band ran over."""
    touched = np.zeros(passes.shape, dtype=np.bool_)
    for k in range(0, path.shape[0], 5):
        low, first = square_of(path[k, 0] - BAND, path[k, 1] - BAND)
        high, last = square_of(path[k, 0] + BAND, path[k, 1] + BAND)
        for i in range(low, high + 1):
            for j in range(first, last + 1):
                x = (i + 0.5 - 0.5 * SQUARES[0]) * ACROSS - path[k, 0]
                y = (j + 0.5 - 0.5 * SQUARES[1]) * ALONG - path[k, 1]
                if x * x + y * y < BAND * BAND:
                    touched[i, j] = True
    passes += touched


@numba.njit(cache=True)
def rates(
    q: Any,
    pattern: Any,
    passes: Any,
    s: Any,
    t: float,
    clock: float,
    order: float,
    stone: float,
    swept: float,
) -> Any:
    x, y, vx, vy, theta, spin = s[0], s[1], s[2], s[3], s[4], s[5]
    v = math.sqrt(vx * vx + vy * vy) + 1e-12
    ex, ey = vx / v, vy / v
    mu = q[MU] * math.exp(q[WEAR] * order + q[DRIFT] * clock)
    mu *= (1.0 + q[WEAR_LINEAR] * order) * (1.0 + q[DRIFT_LINEAR] * clock)
    if stone == q[STONE]:
        mu *= q[STONE_FACTOR]
    if swept > 0.5:
        mu *= q[SWEEP]
    if q[PATCH_SOFT] > 0.0:
        u = (2.0 * x - q[PATCH_X0] - q[PATCH_X1]) / (q[PATCH_X1] - q[PATCH_X0])
        w = (2.0 * y - q[PATCH_Y0] - q[PATCH_Y1]) / (q[PATCH_Y1] - q[PATCH_Y0])
        mu *= 1.0 + (q[PATCH_FACTOR] - 1.0) * math.exp(-1.5 * (u * u + w * w))
    elif q[PATCH_X0] < x < q[PATCH_X1] and q[PATCH_Y0] < y < q[PATCH_Y1]:
        mu *= q[PATCH_FACTOR]
    log_map = 0.0
    for k in range(pattern.shape[0]):
        log_map += math.cos(pattern[k, 0] * x + pattern[k, 1] * y + pattern[k, 2])
    if pattern.shape[0] > 0:
        mu *= math.exp(q[MAP_SD] * math.sqrt(2.0 / pattern.shape[0]) * log_map)
    mu *= 1.0 + q[O_SPIN] * (abs(spin) - 1.5)
    mu *= 1.0 - q[O_WARM] * t
    mu *= 1.0 + q[MAP_ACROSS] * x
    mu *= 1.0 + q[O_HEADING] * math.sin(theta)
    mu *= 1.0 + q[MAP_RIPPLE] * math.sin(2.0 * math.pi * y / RIPPLE_PERIOD)
    mu *= 1.0 + q[O_BRUSHED] * (1.0 if vy > 0 else -1.0) * math.exp(-v)
    if q[WEAR_ALONG] != 0.0:
        mean = 0.0
        for k in range(CONTACTS):
            phi = 2.0 * math.pi * (k + 0.5) / CONTACTS
            mean += worn(q[WEAR_ALONG], passes, x, y, ex, ey, phi) / CONTACTS
        mu *= mean
    along = 0.0
    across = 0.0
    torque = 0.0
    for k in range(CONTACTS):
        phi = 2.0 * math.pi * (k + 0.5) / CONTACTS
        ux = v - spin * BAND * math.sin(phi)
        uy = spin * BAND * math.cos(phi)
        slip = math.sqrt(ux * ux + uy * uy) + 1e-9
        local = mu
        if q[EXPONENT] != 0.0:
            if q[FORM] == 1.0:  # 1/(v + 0.06), as in the Digital Curling simulator
                local *= 1.0 - q[EXPONENT] + q[EXPONENT] * 1.0638578 / (slip + 0.0638578)
            else:
                local *= max(slip, 0.02) ** (-q[EXPONENT])
        local *= 1.0 + q[LINEAR] * (1.5 - slip)
        local *= 1.0 - q[ASYMMETRY] * math.cos(phi)
        if q[WEAR_UNDER] != 0.0:
            local *= worn(q[WEAR_UNDER], passes, x, y, ex, ey, phi)
        along -= local * ux / slip
        across -= local * uy / slip
        torque -= local * (-math.sin(phi) * ux + math.cos(phi) * uy) / slip
    along *= G / CONTACTS
    across *= G / CONTACTS
    turn = q[COUPLING] * G / BAND * torque / CONTACTS
    sense = math.tanh(spin / 0.02)
    along -= q[AIR] * v * v
    curl = q[CURL] * v ** q[CURL_V] * (abs(spin) / 1.5 + 1e-9) ** q[CURL_W]
    if stone == q[STONE]:
        curl *= q[STONE_CURL]
    across += sense * curl
    across += q[O_LEFT]
    turn -= sense * q[SPIN_RATE] * max(v, 0.05) ** (-q[SPIN_POWER])
    turn -= q[SPIN_SHARE] * spin
    ax = along * ex - across * ey + G * q[SLOPE_X] - q[O_TROUGH] * x
    ay = along * ey + across * ex + G * q[SLOPE_Y]
    return ax, ay, turn


@numba.njit(cache=True)
def throw_path(
    q: Any,
    pattern: Any,
    passes: Any,
    start: Any,
    clock: float,
    order: float,
    stone: float,
    sweep: Any,
    out: Any,
) -> int:
    """Compute states every `STEP` until rest or the edge; return their number."""
    s = start.copy()
    middle = np.empty(6)
    n = 0
    for n in range(out.shape[0]):
        t = n * STEP
        out[n] = s
        v = math.sqrt(s[2] ** 2 + s[3] ** 2)
        if v < STOP or abs(s[1]) > EDGE:
            return n + 1
        swept = 1.0 if sweep[0] <= t < sweep[1] else 0.0
        ax, ay, at = rates(q, pattern, passes, s, t, clock + t, order, stone, swept)
        # The last millimetre per second would be overshot by a whole step.
        h = min(STEP, 0.5 * v / math.sqrt(ax * ax + ay * ay + 1e-18))
        half = 0.5 * h
        middle[0] = s[0] + half * s[2]
        middle[1] = s[1] + half * s[3]
        middle[4] = s[4] + half * s[5]
        middle[2] = s[2] + half * ax
        middle[3] = s[3] + half * ay
        middle[5] = s[5] + half * at
        ax, ay, at = rates(q, pattern, passes, middle, t + half, clock + t, order, stone, swept)
        s[0] += h * middle[2]
        s[1] += h * middle[3]
        s[4] += h * middle[5]
        s[2] += h * ax
        s[3] += h * ay
        s[5] += h * at
    return n + 1
