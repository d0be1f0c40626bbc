"""The stone: its measured properties and their sources."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Stone:
    """A curling stone.

    Parameters
    ----------
    mass : with handle [kg]
    radius : of the body seen from above [m]
    height : from the ice to the top of the body, without the handle [m]
    band_radius : of the running band, the ring that touches the ice [m]; 0 makes the contact a
        point, so that friction acts on the centre's velocity alone and never turns the stone
    inertia : about the vertical axis [kg m²]; only mass·band_radius²/inertia moves a lone stone
    restitution : of a stone-stone collision, 0 to 1
    stone_friction : Coulomb friction between two stones

    Raises
    ------
    InputError : a value that no stone can have

    Source
    ------
    Mass 19.1 kg with handle, radius 0.145 m (circumference ≤0.914 m), height ≥0.1143 m: rule book
    C1. Running band about 12 cm across. Inertia ½mR², known to ±10 %. Restitution 0.85: no
    measurement is published, simulators use 0.5 to 1. Stone friction 0.2: other simulators' choice.
    """

    mass: float = 19.1
    radius: float = 0.145
    height: float = 0.1143
    band_radius: float = 0.0625
    inertia: float = 0.2008
    restitution: float = 0.85
    stone_friction: float = 0.2

    def __post_init__(self) -> None:
        for name in ("mass", "radius", "height", "inertia"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"stone {name} must be positive, got {value}")
        if not 0 <= self.band_radius <= self.radius:
            raise InputError(
                f"stone band_radius must lie within 0 and the radius {self.radius} m, "
                f"got {self.band_radius}"
            )
        if not 0 <= self.restitution <= 1:
            raise InputError(f"stone restitution must lie within 0 and 1, got {self.restitution}")
        if not (np.isfinite(self.stone_friction) and self.stone_friction >= 0):
            raise InputError(f"stone_friction must not be negative, got {self.stone_friction}")

    @property
    def spin_coupling(self) -> float:
        """mass·band_radius²/inertia: how strongly sliding friction turns the stone."""
        return self.mass * self.band_radius**2 / self.inertia


RULE_BOOK_STONE = Stone()
"""The World Curling rule book's stone."""
PAPER_STONE = Stone(mass=19.96, radius=0.105, height=0.15, inertia=0.5 * 19.96 * 0.105**2)
"""The paper's table 2: 19.96 kg, 0.21 m across, 0.15 m high with the handle.

The diameter is far from the rule book's 0.29 m; it is kept because the paper's tables used it.
"""
