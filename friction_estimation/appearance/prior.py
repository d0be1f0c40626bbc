"""Prior of a learnt shape and of its colours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance.fit import Appearance
from friction_estimation.appearance.model import StoneModel
from friction_estimation.appearance.shape import PARTS, SHAPE_PARAMETERS

SHAPE_SPREAD = {
    "foot_inset": 0.03,
    "foot_height": 0.015,
    "bevel_height": 0.015,
    "bevel_inset": 0.02,
    "handle_rise": 0.015,
    "handle_back": 0.015,
    "handle_front": 0.015,
    "handle_width": 0.006,
    "blur_px": 0.4,
    "colour_blur_px": 0.6,
    "shadow_x": 0.05,
    "shadow_y": 0.05,
    "shadow_radius": 0.02,
    "shadow_blur": 0.02,
    "shadow": 0.15,
    "handle_depth": 0.01,
    "roundness": 0.5,
    "contact": 0.2,
    "contact_reach": 0.02,
    "mirror": 0.4,
    "collar_radius": 0.025,
    "collar_rise": 0.006,
    "foot_roundness": 0.7,
    "neck_length": 0.015,
    "light_x": 0.2,
    "light_y": 0.2,
    "gloss": 0.05,
}
"""Prior standard deviation of each shape parameter about its typical value (units of `StoneModel`).

Radius and height are not fitted; the scene gives them.
"""
SHAPE_BOUNDS = {
    "foot_inset": (-0.005, 0.12),
    "foot_height": (0.002, 0.06),
    "bevel_height": (0.001, 0.06),
    "bevel_inset": (0.0, 0.09),
    "handle_rise": (0.0, 0.09),
    "handle_back": (-0.13, 0.05),
    "handle_front": (0.05, 0.15),
    "handle_width": (0.008, 0.05),
    "blur_px": (0.3, 4.0),
    "colour_blur_px": (0.3, 5.0),
    "shadow_radius": (0.05, 0.3),
    "shadow_blur": (0.01, 0.1),
    "shadow": (0.0, 0.9),
    "handle_depth": (0.001, 0.08),
    "roundness": (1.0, 3.0),
    "contact": (0.0, 0.9),
    "contact_reach": (0.01, 0.12),
    "mirror": (0.0, 1.5),
    "collar_radius": (0.0, 0.1),
    "collar_rise": (0.0, 0.03),
    "foot_roundness": (1.0, 4.0),
    "neck_length": (0.0, 0.06),
    "light_x": (-0.8, 0.8),
    "light_y": (-0.8, 0.8),
    "gloss": (0.0, 0.3),
}
"""Minimum and maximum of the shape parameters; the others are unbounded."""
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
    "foot_inset": (0.08, 0.012),
    "bevel_inset": (0.08, 0.03),
    "foot_height": (0.035, 0.015),
    "bevel_height": (0.035, 0.015),
    "foot_roundness": (3.0, 1.0),
    "roundness": (3.0, 1.0),
}
"""Typical value and spread for stones that can be turned over, as curling stones are made: alike
above and below ("Know the Score", truenorthbill.blogspot.com, 2014). The ring on which one rests
is about 130 mm across, 80 mm inside the widest place. They weigh 17.24 to 19.96 kg (World Curling
Federation, Rules of Curling, C1): with granite of 2.65 g/cm³ that leaves superellipses with
exponents of 2 to 4, the greater the higher they are."""
ROUNDEST = 8.0
"""Maximum exponent of foot and bevel of such stones."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ShapePrior:
    """Prior of a stone's shape.

    Parameters
    ----------
    typical : its middle
    ties : pairs of parameters that differ little
    spread, bounds : see `SHAPE_SPREAD` and `SHAPE_BOUNDS`
    """

    typical: StoneModel
    ties: tuple[Tie, ...] = UPRIGHT
    spread: Mapping[str, float] = field(default_factory=lambda: SHAPE_SPREAD)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=lambda: SHAPE_BOUNDS)

    @staticmethod
    def reversible(typical: StoneModel) -> ShapePrior:
        """Return the prior of a stone that can be turned over; otherwise that of `typical`."""
        wider = dict.fromkeys(("roundness", "foot_roundness"), (1.0, ROUNDEST))
        return ShapePrior(
            typical=replace(typical, **{name: middle for name, (middle, _) in REVERSIBLE.items()}),
            ties=TURNED_ALIKE,
            spread=SHAPE_SPREAD | {name: spread for name, (_, spread) in REVERSIBLE.items()},
            bounds=SHAPE_BOUNDS | wider | {"bevel_inset": (0.0, SHAPE_BOUNDS["foot_inset"][1])},
        )

    def of(self, look: Appearance) -> FreeShape:
        """Return the prior of the free parameters of an appearance."""
        names = [n for n in SHAPE_SPREAD if look.has_handle or not n.startswith(HANDLE_PREFIXES)]
        low, high = np.array([self.bounds.get(n, (-np.inf, np.inf)) for n in names]).T
        index = [SHAPE_PARAMETERS.index(n) for n in names]
        ties = np.zeros((len(self.ties), len(names)))
        for row, (name, other, spread) in enumerate(self.ties):
            ties[row, names.index(name)] = 1 / spread
            ties[row, names.index(other)] = -1 / spread
        return FreeShape(
            index=index,
            typical=self.typical.shape()[index],
            spread=np.array([self.spread[n] for n in names]),
            ties=ties,
            low=low,
            high=high,
            parts=len(PARTS) if look.has_handle else len(PARTS) - 1,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeShape:
    """Parameters of a fit: n shape parameters, by index, and the colours of parts.

    Parameters
    ----------
    index : (n,) see `SHAPE_PARAMETERS`
    typical, spread : (n,) middle and standard deviation of each
    ties : (k, n) linear functions that are near zero [standard deviations]
    low, high : (n,) bounds
    parts : number of parts with a colour
    """

    index: list[int]
    typical: Floats
    spread: Floats
    ties: Floats
    low: Floats
    high: Floats
    parts: int

    @property
    def shared(self) -> int:
        """Number of parameters that all crops share."""
        return len(self.index) + 3 * self.parts

    def misfit(self, look: Appearance) -> float:
        """Return the prior cost of an appearance above the minimum [squared standard
        deviations].
        """
        shape = look.model.shape()[self.index]
        away, uneven = (shape - self.typical) / self.spread, self.ties @ shape
        differences = np.array(
            [
                (look.colours[PARTS.index(name)] - look.colours[PARTS.index(other)]) / spread
                for name, other, spread in COLOUR_DIFFERENCES
            ]
        )
        # If typical values are tied to others that differ, even the most likely shape deviates from
        # both.
        odd = self.ties @ self.typical
        spread = np.eye(len(odd)) + (self.ties * self.spread**2) @ self.ties.T
        least = odd @ np.linalg.solve(spread, odd)
        return float(away @ away + uneven @ uneven + np.sum(differences * differences) - least)

    def equations(self, look: Appearance) -> tuple[Floats, Floats]:
        """Normal equations of `misfit`, shape first, then colours: (m, m) and (m,)."""
        count = len(self.index)
        matrix, vector = np.zeros((self.shared, self.shared)), np.zeros(self.shared)
        shape = look.model.shape()[self.index]
        matrix[:count, :count] = self.ties.T @ self.ties
        matrix[np.diag_indices(count)] += 1 / self.spread**2
        vector[:count] = (self.typical - shape) / self.spread**2 - self.ties.T @ (self.ties @ shape)
        for name, other, spread in COLOUR_DIFFERENCES:
            one, two = PARTS.index(name), PARTS.index(other)
            for channel in range(3):
                i, j = count + 3 * one + channel, count + 3 * two + channel
                weight = 1 / spread[channel] ** 2
                pull = weight * (look.colours[two] - look.colours[one])[channel]
                matrix[i, i] += weight
                matrix[j, j] += weight
                matrix[i, j] -= weight
                matrix[j, i] -= weight
                vector[i] += pull
                vector[j] -= pull
        return matrix, vector
