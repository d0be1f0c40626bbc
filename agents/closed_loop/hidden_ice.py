"""Ice that neither the estimators nor the planner know: it is drawn at random.

`HiddenIce` is a continuous field of friction with effects, whose stones `integrator` moves.
`patchy_ice` is an ordinary ice with a few heavy and keen areas, as the demo films it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from curling_env.ice import ActiveEffect, FrictionMap, Ice, load_ice
from curling_env.sheet import PAPER_SHEET, RULE_BOOK_STONE, Sheet
from curling_env.typing import Floats

WAVES = 24
"""Number of sine waves that make up the field of friction."""
WAVE_SCALE_ALONG, WAVE_SCALE_ACROSS = 4.0, 1.6
"""Distances over which the field of friction changes along and across the sheet [m]."""
TRUTH_CELL = 0.25
"""Cell size of the true ice as an `Ice` [m]; so fine that a draw's rest differs by millimetres."""
PATCH_STRENGTH = (0.07, 0.11)
"""Range of the relative difference of friction in the middle of a patch.

Players complain about such ice: wear and frost in a game make about 8 %.
"""
PATCH_LENGTH, PATCH_BREADTH = (2.0, 3.2), (0.7, 1.1)
"""Ranges of a patch's Gaussian half-length along and half-breadth across the sheet [m]."""


@dataclass(frozen=True, kw_only=True)
class HiddenIce:
    """The true properties of a hidden ice.

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
        """The same ice as an `Ice` in fine cells."""
        sheet = Sheet(length=PAPER_SHEET.length, width=PAPER_SHEET.width, cell_size=TRUTH_CELL)
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
            friction=_certain(self.friction(*np.meshgrid(sheet.x_centres, sheet.y_centres))),
            effects=tuple(effects),
            stone=replace(RULE_BOOK_STONE, inertia=self.inertia),
        )

    def as_dict(self) -> dict[str, float]:
        """The hidden numbers, for the report at the end."""
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


def patchy_ice(rng: np.random.Generator, *, base: str = "standard") -> Ice:
    """Draw an ice with four areas, heavy and keen in turn, in places where throws pass.

    Parameters
    ----------
    base : ice file or preset that has the law and the mean friction
    """
    ice = load_ice(base)
    x, y = np.meshgrid(ice.sheet.x_centres, ice.sheet.y_centres)
    difference = np.zeros(ice.sheet.shape)
    sign = rng.choice([-1.0, 1.0])
    side = rng.choice([-1.0, 1.0])
    for middle in (-6.5, -0.5, 5.5, 12.0):
        centre_x = side * rng.uniform(0.2, 0.9)
        centre_y = middle + rng.uniform(-1.0, 1.0)
        shape = ((x - centre_x) / rng.uniform(*PATCH_BREADTH)) ** 2
        shape = shape + ((y - centre_y) / rng.uniform(*PATCH_LENGTH)) ** 2
        difference += sign * rng.uniform(*PATCH_STRENGTH) * np.exp(-0.5 * shape)
        sign, side = -sign, -side
    return replace(ice, friction=_certain(ice.friction.mu * (1.0 + difference)))


def _certain(mu: Floats) -> FrictionMap:
    """A map that is known everywhere without error."""
    return FrictionMap(mu=mu, sigma=np.zeros(mu.shape), observed=np.ones(mu.shape, dtype=bool))
