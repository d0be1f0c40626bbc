"""Ice hidden from estimators and planner, and the paths of stones on it.

Formulas and integrator (fourth-order Runge–Kutta at fixed steps over a ring of contacts) share
nothing with `curling_env.physics`, so estimators and planner are tested on throws of another
engine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from curling_env.ice import ActiveEffect, FrictionMap, Ice
from curling_env.physics.compiled import compiled
from curling_env.physics.motion import GRAVITY
from curling_env.sheet import PAPER_SHEET, RULE_BOOK_STONE, Direction, Sheet
from curling_env.throw import Release, Throw
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats

WAVES = 24
"""Number of sine waves that make up the field of friction."""
WAVE_SCALE_ALONG, WAVE_SCALE_ACROSS = 4.0, 1.6
"""Distances over which the field of friction changes along and across the sheet [m]."""
TRUTH_CELL = 0.25
"""Cell size of the true ice as an `Ice` [m]; so fine that a draw's rest differs by millimetres."""
STEP = 1e-2
"""Step of the integrator [s]."""
CONTACTS = 16
"""Contact points on the running band."""
RESTING_SPEED = 1e-4
"""Speed below which a stone is at rest [m/s]; it would slide on by less than 0.1 µm."""
MAX_TIME = 90.0
"""Longest throw that is followed [s]."""
MIN_SLIP = 0.01
"""Slip below which friction rises no further [m/s]."""
SECONDS_BETWEEN_THROWS = 60.0
POSITION_NOISE, HEADING_NOISE = 0.005, 0.02
"""Standard deviations of a measured coordinate [m] and heading [rad], frame by frame."""


@dataclass(frozen=True, kw_only=True)
class HiddenIce:
    """True properties of a hidden ice.

    Parameters
    ----------
    mu : mean friction at 1 m/s
    waves : (n, 4) amplitude in ln μ, wave numbers across and along the sheet [1/m], and phase
    exponent : friction is proportional to slip^(−exponent)
    curl, curl_exponent : sideways acceleration curl·v^curl_exponent [m/s²]
    slope : fall of the ice towards +x and +y [m/m]
    inertia : moment of inertia of the stones [kg m²]
    """

    mu: float
    waves: Floats
    exponent: float = 0.0
    curl: float = 0.0
    curl_exponent: float = 0.2
    slope: tuple[float, float] = (0.0, 0.0)
    inertia: float = RULE_BOOK_STONE.inertia

    def friction(self, x: Any, y: Any) -> Any:
        """μ at places of the sheet frame [m]."""
        total = np.zeros(np.broadcast(x, y).shape)
        for amplitude, across, along, phase in self.waves:
            total += amplitude * np.sin(across * x + along * y + phase)
        return self.mu * np.exp(total)

    @property
    def spread(self) -> float:
        """Standard deviation of ln μ over the sheet."""
        x, y = np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres)
        return float(np.log(self.friction(x, y)).std())

    def truth(self) -> Ice:
        """Return the same ice as an `Ice` with fine cells."""
        sheet = Sheet(length=PAPER_SHEET.length, width=PAPER_SHEET.width, cell_size=TRUTH_CELL)
        mu = self.friction(*np.meshgrid(sheet.x_centres, sheet.y_centres))
        effects: list[ActiveEffect] = []
        if self.exponent:
            law = {"exponent": self.exponent}
            effects.append(ActiveEffect(name="speed_dependent_friction", parameters=law))
        if self.curl:
            bend = {"strength": self.curl, "speed_exponent": self.curl_exponent}
            effects.append(ActiveEffect(name="curl", parameters=bend))
        if any(self.slope):
            fall = {"x": self.slope[0], "y": self.slope[1]}
            effects.append(ActiveEffect(name="slope", parameters=fall))
        return Ice(
            sheet=sheet,
            friction=FrictionMap(
                mu=mu, sigma=np.zeros(mu.shape), observed=np.ones(mu.shape, dtype=bool)
            ),
            effects=tuple(effects),
            stone=replace(RULE_BOOK_STONE, inertia=self.inertia),
        )


def draw_hidden_ice(rng: np.random.Generator, *, effects: bool = True) -> HiddenIce:
    """Draw an ice that is uneven by 5 to 8 %, with or without effects."""
    waves = np.column_stack(
        [
            rng.rayleigh(1.0, WAVES),
            rng.normal(0.0, 1.0 / WAVE_SCALE_ACROSS, WAVES),
            rng.normal(0.0, 1.0 / WAVE_SCALE_ALONG, WAVES),
            rng.uniform(0.0, 2 * np.pi, WAVES),
        ]
    )
    ice = HiddenIce(mu=float(rng.uniform(0.007, 0.0095)), waves=waves)
    waves[:, 0] *= rng.uniform(0.05, 0.08) / ice.spread
    inertia = RULE_BOOK_STONE.inertia * float(rng.uniform(0.95, 1.05))
    turn, fall = rng.uniform(0, 2 * np.pi), rng.uniform(0.5e-4, 3e-4)
    strengths = rng.uniform([0.12, 0.005, 0.1], [0.3, 0.01, 0.4])
    if not effects:
        return replace(ice, waves=waves, inertia=inertia)
    exponent, curl, curl_exponent = (float(value) for value in strengths)
    return replace(
        ice,
        waves=waves,
        exponent=exponent,
        curl=curl,
        curl_exponent=curl_exponent,
        slope=(float(fall * np.cos(turn)), float(fall * np.sin(turn))),
        inertia=inertia,
    )


def mixed_practice(n: int, rng: np.random.Generator) -> list[Release]:
    """Return releases of n throws to both ends, both handles, weights from guard to takeout.

    Most have draw weight, because that is where the ice has to be known best.
    """
    slowest, fastest = 1.8, 3.0
    share = np.linspace(0.0, 1.0, n) ** 1.7
    speeds = rng.permutation(slowest + (fastest - slowest) * share)
    releases: list[Release] = []
    for k in range(n):
        spin = (1.0 if k % 4 < 2 else -1.0) * rng.uniform(0.8, 1.8)
        # A counter-clockwise stone curls to the left by about a metre.
        aim = rng.uniform(-1.3, 1.3) + np.sign(spin) * 0.8 * (2.0 / speeds[k]) ** 2
        throw = Throw(
            speed=float(speeds[k]), angle=float(-np.arctan2(aim, 28.35)), spin=float(spin)
        )
        direction = Direction.AWAY if k % 2 == 0 else Direction.HOME
        releases.append(throw.release(direction, clock=SECONDS_BETWEEN_THROWS * k, order=k))
    return releases


def noisy_track(
    ice: HiddenIce, release: Release, throw: int, rng: np.random.Generator, *, fps: float = 30.0
) -> Trajectory:
    """Return the track of one throw with white noise in every frame.

    It ends when the stone touches the edge of the ice, or a second after it comes to rest.
    """
    path = run_stone(ice, release)
    frames = np.arange(0.0, path[-1, 0] + (1.0 if comes_to_rest(path) else 0.0), 1 / fps)
    seen = np.column_stack([np.interp(frames, path[:, 0], path[:, j]) for j in (1, 2, 5)])
    seen += rng.normal(size=seen.shape) * [POSITION_NOISE, POSITION_NOISE, HEADING_NOISE]
    return Trajectory(t=frames, xy=seen[:, :2], theta=seen[:, 2], throw=throw, clock=release.clock)


def run_stone(ice: HiddenIce, release: Release) -> Floats:
    """Follow a stone on the hidden ice until it rests or leaves the ice.

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
    edge = np.array([PAPER_SHEET.width, PAPER_SHEET.length]) / 2 - RULE_BOOK_STONE.radius
    n = _run(law, ice.waves, state, edge, rows)
    return rows[:n].copy()


def comes_to_rest(path: Floats) -> bool:
    """Return true if a path of `run_stone` ends with the stone at rest."""
    return bool(np.hypot(path[-1, 3], path[-1, 4]) < 1e-3)


@compiled(allocates=True)
def _rates(law: Any, waves: Any, state: Any, out: Any) -> None:
    """Return the time derivative of (x, y, vx, vy, theta, omega)."""
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
def _run(law: Any, waves: Any, s: Any, edge: Any, rows: Any) -> int:
    """Fill `rows` from the state `s` on; return the number of rows filled."""
    k1, k2, k3, k4 = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    t = 0.0
    for n in range(rows.shape[0]):
        rows[n, 0] = t
        rows[n, 1:] = s
        v = math.sqrt(s[2] * s[2] + s[3] * s[3])
        if v < RESTING_SPEED or abs(s[0]) > edge[0] or abs(s[1]) > edge[1]:
            return n + 1
        _rates(law, waves, s, k1)
        # Near its end a whole step would carry a stone past the point where it stops.
        h = min(STEP, 0.25 * v / math.sqrt(k1[2] * k1[2] + k1[3] * k1[3] + 1e-18))
        _rates(law, waves, s + 0.5 * h * k1, k2)
        _rates(law, waves, s + 0.5 * h * k2, k3)
        _rates(law, waves, s + h * k3, k4)
        s += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        t += h
    return rows.shape[0]
