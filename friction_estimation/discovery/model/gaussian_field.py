"""Coefficients that are fitted with a Gaussian prior, whose width is found beside them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from curling_env.typing import Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class GaussianField:
    """A sum of patterns with independent Gaussian coefficients.

    Parameters
    ----------
    amplitude : prior standard deviation of each coefficient
    values : (n,) coefficients
    held : whether the coefficients stay as they are, and are no parameters of a fit
    """

    name: ClassVar[str]
    amplitude: float
    values: Floats
    held: bool = False

    def __len__(self) -> int:
        """Number of coefficients that a fit may change."""
        return 0 if self.held else len(self.values)

    @property
    def amplitudes(self) -> Floats:
        """Amplitudes that are tried; the stated one by default."""
        return np.array([self.amplitude])

    @property
    def deviations(self) -> Floats:
        """Prior standard deviation of each coefficient, (n,)."""
        return np.full(len(self.values), self.amplitude)

    @property
    def hyperprior(self) -> float:
        """−2 ln of the prior density of the amplitude, up to a constant: all are alike."""
        return 0.0

    def at(self, values: Floats) -> Self:
        """The same with other coefficients."""
        return replace(self, values=values)

    def with_amplitude(self, amplitude: float) -> Self:
        """The same with another amplitude."""
        return replace(self, amplitude=amplitude)


class CameraField(GaussianField):
    """A field that displaces what a camera sees."""

    def columns(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements of places (rows, 2) with headings (rows,), (rows, 2, n), per coefficient.

        In metres by metres.
        """
        raise NotImplementedError

    def displacement(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements of places (rows, 2) with headings (rows,), (rows, 2) [m]."""
        return self.columns(xy, theta) @ self.values
