"""An ice that no part of the chain is told, and how stones really run on it.

The field of friction is a sum of waves, not cells; formulas and integrator (Runge–Kutta of fourth
order at fixed steps over a ring of contacts) are written here anew. So the chain is judged on
throws that its own model and engine did not make.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from curling_env.ice import ActiveEffect, FrictionMap, Ice
from curling_env.physics.compiled import compiled
from curling_env.sheet import PAPER_SHEET, RULE_BOOK_STONE, Sheet
from curling_env.throw import Release
from curling_env.typing import Floats

G = 9.80665
STEP = 1e-2
"""Of the integrator [s]; a tenth of it, with four times the contacts, moves rests by 0.1 mm."""
CONTACTS = 16
STOP = 1e-4
"""A stone this slow rests [m/s]: it has less than 0.1 µm to go."""
LONGEST = 90.0
"""Seconds after which a throw is given up."""
SLOWEST_SLIP = 0.01
"""Slip below which friction rises no more [m/s]."""

WAVES = 24
LENGTH, BREADTH = 4.0, 1.6
"""Over which the field of friction changes along and across the sheet [m]."""
FINE = 0.25
"""Cells in which the true ice is handed to those who may know it [m]."""


@dataclass(frozen=True, kw_only=True)
class HiddenIce:
    """What the ice is like in truth.

    Parameters
    ----------
    mu : mean friction at 1 m/s
    waves : (n, 4) amplitude in ln μ, wave numbers across and along [1/m], phase
    exponent : of friction ∝ slip^(−exponent)
    curl, curl_exponent : sideways acceleration curl·v^curl_exponent [m/s²]
    slope : fall of the ice towards +x and +y [m/m]
    inertia : of the stones [kg m²]
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
        """The same as an `Ice`, in cells so fine that a draw's rest differs by millimetres."""
        sheet = Sheet(length=PAPER_SHEET.length, width=PAPER_SHEET.width, cell_size=FINE)
        x, y = np.meshgrid(sheet.x_centres, sheet.y_centres)
        mu = self.friction(x, y)
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

    def as_dict(self) -> dict[str, float]:
        """What was hidden, for the report that is written when all is over."""
        return {
            "mu": self.mu,
            "map_sd": self.spread,
            "speed_exponent": self.exponent,
            "curl_strength": self.curl,
            "curl_speed_exponent": self.curl_exponent,
            "slope_x": self.slope[0],
            "slope_y": self.slope[1],
            "inertia": self.inertia,
        }


def draw_hidden_ice(rng: np.random.Generator, *, effects: bool = True) -> HiddenIce:
    """Ice as it may be: uneven by 5 to 8 %, and with effects unless it is to have none."""
    waves = np.column_stack(
        [
            rng.rayleigh(1.0, WAVES),
            rng.normal(0.0, 1.0 / BREADTH, WAVES),
            rng.normal(0.0, 1.0 / LENGTH, WAVES),
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


def run(ice: HiddenIce, release: Release, stones: Floats | None = None) -> Floats:
    """How a stone runs on the hidden ice, until it rests, leaves the ice or touches another.

    Parameters
    ----------
    stones : (k, 2) centres of resting stones [m]

    Returns
    -------
    (n, 7) t, x, y, vx, vy, theta, omega at every step
    """
    start = np.array(
        [release.x, release.y, release.vx, release.vy, release.theta, release.omega], dtype=float
    )
    numbers = np.array(
        [
            ice.mu, ice.exponent, ice.curl, ice.curl_exponent, *ice.slope,
            RULE_BOOK_STONE.mass * RULE_BOOK_STONE.band_radius / ice.inertia,
            RULE_BOOK_STONE.band_radius,
        ]
    )  # fmt: skip
    out = np.empty((int(LONGEST / STEP), 7))
    others = np.empty((0, 2)) if stones is None else np.ascontiguousarray(stones, dtype=float)
    edge = np.array([PAPER_SHEET.width, PAPER_SHEET.length]) / 2 - RULE_BOOK_STONE.radius
    n = _run(numbers, ice.waves, start, others, 2 * RULE_BOOK_STONE.radius, edge, out)
    return out[:n].copy()


@compiled(allocates=True)
def _rates(q: Any, waves: Any, s: Any, out: Any) -> None:
    vx, vy, spin = s[2], s[3], s[5]
    v = math.sqrt(vx * vx + vy * vy) + 1e-12
    uneven = 0.0
    for i in range(waves.shape[0]):
        uneven += waves[i, 0] * math.sin(waves[i, 1] * s[0] + waves[i, 2] * s[1] + waves[i, 3])
    mu = q[0] * math.exp(uneven)
    along = across = torque = 0.0
    for k in range(CONTACTS):
        phi = 2.0 * math.pi * (k + 0.5) / CONTACTS
        forward = v - spin * q[7] * math.sin(phi)
        left = spin * q[7] * math.cos(phi)
        slip = math.sqrt(forward * forward + left * left) + 1e-12
        local = mu * G / CONTACTS * max(slip, SLOWEST_SLIP) ** (-q[1])
        along -= local * forward / slip
        across -= local * left / slip
        torque -= local * (math.cos(phi) * left - math.sin(phi) * forward) / slip
    across += math.tanh(spin / 0.01) * q[2] * v ** q[3]
    out[0] = vx
    out[1] = vy
    out[2] = (along * vx - across * vy) / v + G * q[4]
    out[3] = (along * vy + across * vx) / v + G * q[5]
    out[4] = spin
    out[5] = torque * q[6]


@compiled(allocates=True)
def _run(q: Any, waves: Any, s: Any, stones: Any, reach: float, edge: Any, out: Any) -> int:
    k1, k2, k3, k4 = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    t = 0.0
    for n in range(out.shape[0]):
        out[n, 0] = t
        out[n, 1:] = s
        v = math.sqrt(s[2] * s[2] + s[3] * s[3])
        if v < STOP or abs(s[0]) > edge[0] or abs(s[1]) > edge[1]:
            return n + 1
        for k in range(stones.shape[0]):
            dx, dy = stones[k, 0] - s[0], stones[k, 1] - s[1]
            if dx * dx + dy * dy <= reach * reach and dx * s[2] + dy * s[3] > 0.0:
                return n + 1
        _rates(q, waves, s, k1)
        # Near its end a stone would be carried past it by a whole step.
        h = min(STEP, 0.25 * v / math.sqrt(k1[2] * k1[2] + k1[3] * k1[3] + 1e-18))
        for k in range(stones.shape[0]):  # nor may it step into another
            gap = math.sqrt((stones[k, 0] - s[0]) ** 2 + (stones[k, 1] - s[1]) ** 2) - reach
            if 0.0 < gap < 2.0 * v * h:
                h = min(h, max(0.5 * gap / v, 1e-5))
        _rates(q, waves, s + 0.5 * h * k1, k2)
        _rates(q, waves, s + 0.5 * h * k2, k3)
        _rates(q, waves, s + h * k3, k4)
        s += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        t += h
    return out.shape[0]
