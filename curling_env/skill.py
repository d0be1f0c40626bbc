"""Skill: how closely a player's throws follow what was meant.

Execution error is Gaussian and independent in speed, line and spin. That is how the simulators of
Digital Curling throw; real players' errors have heavier tails, which nobody has published.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Skill:
    """Standard deviations of a player's execution.

    Parameters
    ----------
    name : by which it is asked for
    sigma_speed : of the release speed [m/s]
    sigma_angle : of the line of delivery [rad]
    sigma_spin : of the spin [rad/s]
    source : where the numbers come from

    Raises
    ------
    InputError : a standard deviation that is negative or not finite
    """

    name: str
    sigma_speed: float = 0.0
    sigma_angle: float = 0.0
    sigma_spin: float = 0.0
    source: str = ""

    def __post_init__(self) -> None:
        for name in ("sigma_speed", "sigma_angle", "sigma_spin"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise InputError(f"skill {self.name}: {name} must be at least 0, got {value}")

    @property
    def is_exact(self) -> bool:
        """Whether every throw is exactly the one that was meant."""
        return self.sigma_speed == self.sigma_angle == self.sigma_spin == 0.0

    def error(self, rng: np.random.Generator) -> tuple[float, float, float]:
        """Error of one throw: speed [m/s], angle [rad], spin [rad/s]."""
        speed, angle, spin = rng.standard_normal(3).tolist()
        return self.sigma_speed * speed, self.sigma_angle * angle, self.sigma_spin * spin

    def errors(self, n: int, rng: np.random.Generator) -> Floats:
        """Errors of n throws, (n, 3): speed [m/s], angle [rad], spin [rad/s].

        They come in opposite pairs, so that their mean is zero for an even n and an expectation
        over them needs fewer throws.
        """
        half = rng.standard_normal((-(-n // 2), 3))
        return np.concatenate([half, -half])[:n] * [
            self.sigma_speed,
            self.sigma_angle,
            self.sigma_spin,
        ]


_SPIN = "spread of the spin: a choice, about a tenth of a usual spin; nobody has measured it"

SKILLS = {
    skill.name: skill
    for skill in (
        Skill(name="none", source="every throw is exactly as meant"),
        Skill(
            name="elite",
            sigma_speed=0.0076,
            sigma_angle=0.0018,
            sigma_spin=0.1,
            source="the settings simulators give their elite players; " + _SPIN,
        ),
        Skill(
            name="champion",
            sigma_speed=0.015,
            sigma_angle=0.0026,
            sigma_spin=0.1,
            source="estimates of elite people, 0.01-0.02 m/s and 0.1-0.2° (0.15°); " + _SPIN,
        ),
        Skill(
            name="club",
            sigma_speed=0.03,
            sigma_angle=0.0052,
            sigma_spin=0.2,
            source="a choice: twice `champion`; no measurement of club players is published",
        ),
    )
}
"""Skills by name, from exact to club player."""


def skill_named(name: str | Skill) -> Skill:
    """The skill of that name; a `Skill` is returned as it is.

    Raises
    ------
    InputError : a name that is not in `SKILLS`
    """
    if isinstance(name, Skill):
        return name
    if name not in SKILLS:
        raise InputError(f"no skill is named {name!r}; there are {', '.join(SKILLS)}")
    return SKILLS[name]
