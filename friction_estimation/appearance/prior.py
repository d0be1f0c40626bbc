"""Prior of a learnt shape and of its colours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance.fit import Appearance
from friction_estimation.appearance.model import StoneModel
from friction_estimation.appearance.shape import PARTS

SHAPE_PRIOR = {
    "foot_inset": (0.03, -0.005, 0.12),
    "foot_height": (0.015, 0.002, 0.06),
    "bevel_height": (0.015, 0.001, 0.06),
    "bevel_inset": (0.02, 0.0, 0.09),
    "handle_rise": (0.015, 0.0, 0.09),
    "handle_back": (0.015, -0.13, 0.05),
    "handle_front": (0.015, 0.05, 0.15),
    "handle_width": (0.006, 0.008, 0.05),
    "blur_px": (0.4, 0.3, 4.0),
    "colour_blur_px": (0.6, 0.3, 5.0),
    "shadow_x": (0.05, -np.inf, np.inf),
    "shadow_y": (0.05, -np.inf, np.inf),
    "shadow_radius": (0.02, 0.05, 0.3),
    "shadow_blur": (0.02, 0.01, 0.1),
    "shadow": (0.15, 0.0, 0.9),
    "handle_depth": (0.01, 0.001, 0.08),
    "roundness": (0.5, 1.0, 3.0),
    "contact": (0.2, 0.0, 0.9),
    "contact_reach": (0.02, 0.01, 0.12),
    "mirror": (0.4, 0.0, 1.5),
    "collar_radius": (0.025, 0.0, 0.1),
    "collar_rise": (0.006, 0.0, 0.03),
    "foot_roundness": (0.7, 1.0, 4.0),
    "neck_length": (0.015, 0.0, 0.06),
    "light_x": (0.2, -0.8, 0.8),
    "light_y": (0.2, -0.8, 0.8),
    "gloss": (0.05, 0.0, 0.3),
}
"""Prior standard deviation of each shape parameter about its typical value, and its minimum and
maximum (units of `StoneModel`).

Radius and height are not fitted; the scene gives them.
"""
HANDLE_PREFIXES = ("handle", "collar", "neck")
"""Parameters with these prefixes change only the handle."""
COLOUR_DIFFERENCES = (
    ("foot", "side", (30.0, 4.0, 4.0)),
    ("bevel", "side", (30.0, 4.0, 4.0)),
    ("top", "side", (30.0, 4.0, 4.0)),
)
"""Pairs of parts whose colours differ little, because both are granite in different light, with the
prior standard deviation of the difference in each colour channel [grey levels]."""
Tie = tuple[str, str, float]
UPRIGHT: tuple[Tie, ...] = (("foot_height", "bevel_height", 0.006),)
"""Pairs of shape parameters that differ little, with the prior standard deviation of the difference
(units of `StoneModel`): a stone's striking band lies at half its height."""
TURNED_ALIKE: tuple[Tie, ...] = (
    *UPRIGHT,
    ("foot_inset", "bevel_inset", 0.01),
    ("foot_roundness", "roundness", 0.3),
)
"""The same for reversible stones, which are alike above and below."""
REVERSIBLE = {
    "foot_inset": (0.08, 0.012, -0.005, 0.12),
    "bevel_inset": (0.08, 0.03, 0.0, 0.12),
    "foot_height": (0.035, 0.015, 0.002, 0.06),
    "bevel_height": (0.035, 0.015, 0.001, 0.06),
    "foot_roundness": (3.0, 1.0, 1.0, 8.0),
    "roundness": (3.0, 1.0, 1.0, 8.0),
}
"""Typical value, spread, minimum and maximum for stones that can be turned over, as curling stones
are made: alike above and below ("Know the Score", truenorthbill.blogspot.com, 2014). The ring on
which one rests is about 130 mm across, 80 mm inside the widest place. They weigh 17.24 to 19.96 kg
(World Curling Federation, Rules of Curling, C1): with granite of 2.65 g/cm³ that leaves
superellipses with exponents of 2 to 4, the greater the higher they are."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ShapePrior:
    """Prior of a stone's shape.

    Parameters
    ----------
    typical : its middle
    ties : pairs of parameters that differ little
    limits : spread, minimum and maximum of each parameter, see `SHAPE_PRIOR`
    """

    typical: StoneModel
    ties: tuple[Tie, ...] = UPRIGHT
    limits: Mapping[str, tuple[float, float, float]] = field(default_factory=lambda: SHAPE_PRIOR)

    @staticmethod
    def reversible(typical: StoneModel) -> ShapePrior:
        """Return the prior of a stone that can be turned over; otherwise that of `typical`."""
        return ShapePrior(
            typical=replace(typical, **{name: row[0] for name, row in REVERSIBLE.items()}),
            ties=TURNED_ALIKE,
            limits=SHAPE_PRIOR | {name: row[1:] for name, row in REVERSIBLE.items()},
        )

    def of(self, look: Appearance) -> FreeShape:
        """Return the prior of the free parameters of an appearance."""
        names = [n for n in SHAPE_PRIOR if look.has_handle or not n.startswith(HANDLE_PREFIXES)]
        spread, low, high = np.array([self.limits[n] for n in names]).T
        parts = PARTS if look.has_handle else PARTS[:-1]
        count = len(names)
        unit = np.eye(count + 3 * len(parts))
        typical = np.array([getattr(self.typical, name) for name in names])
        rows = list(unit[:count] / spread[:, None])
        for name, other, sigma in self.ties:
            rows.append((unit[names.index(name)] - unit[names.index(other)]) / sigma)
        for name, other, sigmas in COLOUR_DIFFERENCES:
            one, two = (count + 3 * parts.index(part) for part in (name, other))
            rows += [(unit[one + k] - unit[two + k]) / sigma for k, sigma in enumerate(sigmas)]
        middle = np.r_[typical / spread, np.zeros(len(rows) - count)]
        nearest = np.linalg.lstsq(np.array(rows), middle)[0]
        return FreeShape(
            names=names,
            spread=spread,
            low=low,
            high=high,
            parts=len(parts),
            rows=np.array(rows),
            middle=middle,
            least=float(np.sum((rows @ nearest - middle) ** 2)),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeShape:
    """The m parameters of a fit, n of the shape and the colours of parts, and their prior.

    Parameters
    ----------
    names : of the shape parameters
    spread, low, high : (n,) standard deviation and bounds of each
    parts : number of parts with a colour
    rows, middle : (k, m) and (k,) linear functions of the parameters, shape first, then colours,
        and what they are on average [standard deviations]
    least : minimum of their squared deviations, above 0 if typical values are tied to others that
        differ
    """

    names: list[str]
    spread: Floats
    low: Floats
    high: Floats
    parts: int
    rows: Floats
    middle: Floats
    least: float

    def values(self, look: Appearance) -> Floats:
        """Return the parameters of an appearance, (m,)."""
        shape = [getattr(look.model, name) for name in self.names]
        return np.r_[shape, look.colours[: self.parts].ravel()]

    def with_values(self, look: Appearance, values: Floats) -> Appearance:
        """Return an appearance with these parameters (m,)."""
        count, colours = len(self.names), look.colours.copy()
        colours[: self.parts] = values[count:].reshape(-1, 3)
        shape = dict(zip(self.names, values[:count].tolist(), strict=True))
        return replace(look, model=replace(look.model, **shape), colours=colours)

    def misfit(self, look: Appearance) -> float:
        """Return the prior cost of an appearance above the minimum [squared standard
        deviations].
        """
        away = self.rows @ self.values(look) - self.middle
        return float(away @ away) - self.least

    def equations(self, look: Appearance) -> tuple[Floats, Floats]:
        """Normal equations of `misfit`, (m, m) and (m,)."""
        away = self.rows @ self.values(look) - self.middle
        return self.rows.T @ self.rows, -self.rows.T @ away
