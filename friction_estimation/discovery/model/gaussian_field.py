"""Coefficients with a Gaussian prior, whose width is fitted too.

Errors of the lens, the pose and the stone's outline that remain after calibration displace every
stone at a place by the same millimetres, and no number of throws averages them away. They are a
smooth Gaussian field over the sheet, whose amplitude is limited to the residual of a good
calibration: a lens error of centimetres must be found, not absorbed.

A ripple is a shorter displacement b(y) along the sheet. To a throw at speed v it looks like a
friction that is off by b''v²/g, with opposite signs for throws in opposite directions. But it
depends on v² and the direction, and μ on neither, so that throws at several speeds and in both
directions distinguish them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import eigh

from curling_env.sheet import TEE_Y
from curling_env.typing import Floats
from friction_estimation.design.cramer_rao import matern
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.tuning import (
    RELATIVE_AMPLITUDES,
    RIPPLE_LENGTHS,
    SYSTEMATIC_AMPLITUDES,
    SYSTEMATIC_LENGTH,
    SYSTEMATIC_LIMITS,
    SYSTEMATIC_NODE_SPACING,
    SYSTEMATIC_OVER_CLAIMED,
    USUAL_RIPPLE,
)


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
        """Number of free coefficients."""
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
        """Return the same with other coefficients; itself if they are its own."""
        return self if np.array_equal(values, self.values) else replace(self, values=values)

    def with_amplitude(self, amplitude: float) -> Self:
        """Return the same with another amplitude."""
        return replace(self, amplitude=amplitude)


class CameraField(GaussianField):
    """A field that displaces measured positions."""

    def columns(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements of places (rows, 2) with headings (rows,), (rows, 2, n), per coefficient.

        In metres by metres.
        """
        raise NotImplementedError

    def displacement(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements of places (rows, 2) with headings (rows,), (rows, 2) [m]."""
        return self.columns(xy, theta) @ self.values


@dataclass(frozen=True, kw_only=True, eq=False)
class SystematicError(CameraField):
    """Displacement of measured positions [m]: smooth along the sheet and linear across it, with an
    error of scale and a bend over the whole sheet, and a part that turns with the stone.

    Its `values` are 4 n + 6 coefficients; the last six are scale and bend over the whole sheet, of
    x and of y, and the displacements ahead of the centre and to the left of the heading.

    Parameters
    ----------
    nodes : (n,) places along the sheet [m]
    claimed : standard error of a coordinate that the tracks claim [m]
    """

    name = "systematic_error"
    nodes: Floats
    claimed: float

    @property
    def amplitudes(self) -> Floats:
        """Amplitudes that are tried [m]."""
        claimed = np.array(SYSTEMATIC_OVER_CLAIMED) * self.claimed
        least, most = np.minimum(claimed, SYSTEMATIC_LIMITS).tolist()
        return np.geomspace(least, most, SYSTEMATIC_AMPLITUDES)

    @cached_property
    def _root(self) -> Floats:
        """Inverse square root of the field's correlation between its nodes."""
        values, vectors = np.linalg.eigh(_correlation(self.nodes, self.nodes))
        return vectors / np.sqrt(np.maximum(values, 1e-6))

    def columns(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements per unit of each coefficient, (rows, 2, 4 n + 6)."""
        shape = _correlation(xy[:, 1], self.nodes) @ self._root
        shape = np.concatenate([shape, shape * xy[:, :1]], axis=1)
        whole, count = xy[:, 1] / TEE_Y, shape.shape[1]
        out = np.zeros((len(xy), 2, 2 * count + 6))
        out[:, 0, :count] = out[:, 1, count : 2 * count] = shape
        out[:, 0, -6:-4] = out[:, 1, -4:-2] = np.column_stack([whole, whole**2])
        out[:, 0, -2], out[:, 1, -2] = np.cos(theta), np.sin(theta)
        out[:, 0, -1], out[:, 1, -1] = -np.sin(theta), np.cos(theta)
        return out

    @property
    def deviations(self) -> Floats:
        """Prior standard deviation of each coefficient, (4 n + 6,) [m].

        The parts that span the whole sheet hardly show in throws, and have the stated size of the
        tracks' errors. The two that turn with the stone keep the minimum amplitude: a larger one is
        a tracked point beside the centre, which is an effect to be found.
        """
        out = np.full(len(self.values), self.amplitude)
        out[-6:-2] = np.clip(self.claimed, *SYSTEMATIC_LIMITS)
        out[-2:] = self.amplitudes[0]
        return out


def _correlation(y: Floats, nodes: Floats) -> Floats:
    """Return the correlation of displacements at places (k,) and (n,) along the sheet, (k, n)."""
    return np.exp(-0.5 * ((y[:, None] - nodes) / SYSTEMATIC_LENGTH) ** 2)


@dataclass(frozen=True, kw_only=True, eq=False)
class GatePlaces(CameraField):
    """Displacements along the sheet of the positions of light gates [m].

    The height of a beam, hence the length of the stone there, and the distance of the gate from its
    line are known to about a centimetre. Each edge of the stone at each gate has a separate
    displacement.

    Parameters
    ----------
    places : (n,) places along the sheet [m]
    """

    name = "systematic_error"
    places: Floats

    def columns(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements per unit of each coefficient, (rows, 2, n)."""
        del theta  # gates do not measure the heading
        nearest = np.argmin(np.abs(xy[:, 1, None] - self.places), axis=1)
        out = np.zeros((len(xy), 2, len(self.places)))
        out[np.arange(len(xy)), 1, nearest] = 1.0
        return out


def systematic_error_of(session: Session) -> CameraField | None:
    """Return a systematic error of zero over all places of a session; None for tracks without
    one.
    """
    gates = session.gates
    if gates is not None:
        none = np.zeros(len(gates.places))
        return GatePlaces(places=gates.places, amplitude=gates.place_sigma, values=none)
    if session.claimed <= 0.0:
        return None
    low, high = float(session.xy[:, 1].min()), float(session.xy[:, 1].max())
    nodes = np.linspace(low, high, max(3, int(np.ceil((high - low) / SYSTEMATIC_NODE_SPACING)) + 1))
    error = SystematicError(
        nodes=nodes, claimed=session.claimed, amplitude=0.0, values=np.zeros(4 * len(nodes) + 6)
    )
    return error.with_amplitude(float(error.amplitudes[0]))


@dataclass(frozen=True, kw_only=True, eq=False)
class CameraRipple(CameraField):
    """Displacement of measured positions towards positive y, smooth along the sheet [m].

    Parameters
    ----------
    nodes : (n,) places along the sheet [m]
    length : distance over which it changes [m]
    """

    name = "ripple"
    nodes: Floats
    length: float
    amplitude: float = USUAL_RIPPLE

    @cached_property
    def root(self) -> Floats:
        """Displacement of the nodes by one unit of each coefficient, (n, n).

        A constant and a linear displacement are excluded: releases absorb the first, and the second
        is an error of scale, which throws cannot distinguish from friction and speed.
        """
        correlation = matern(np.abs(self.nodes[:, None] - self.nodes), self.length, 2.5)
        even, _ = np.linalg.qr(np.column_stack([np.ones_like(self.nodes), self.nodes]))
        correlation -= even @ (even.T @ correlation)
        correlation -= (correlation @ even) @ even.T
        values, vectors = eigh(correlation)
        return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))

    @cached_property
    def _spline(self) -> CubicSpline:
        return CubicSpline(self.nodes, self.root, bc_type="natural")

    def patterns_at(self, y: Floats) -> Floats:
        """Displacement at places along the sheet by one unit of each coefficient, (k, n).

        Beyond the last nodes the displacement is constant.
        """
        return np.asarray(self._spline(np.clip(y, self.nodes[0], self.nodes[-1])))

    def columns(self, xy: Floats, theta: Floats) -> Floats:
        """Displacements of places (rows, 2) per unit of each coefficient, (rows, 2, n)."""
        del theta  # a ripple does not turn with the stone
        patterns = self.patterns_at(xy[:, 1])
        return np.stack([np.zeros_like(patterns), patterns], axis=1)

    @property
    def amplitudes(self) -> Floats:
        """Amplitudes that may be tried [m]."""
        return USUAL_RIPPLE * RELATIVE_AMPLITUDES

    @property
    def hyperprior(self) -> float:
        """−2 ln of the prior density of the amplitude, a half-Cauchy, up to a constant."""
        return 2.0 * float(np.log1p((self.amplitude / USUAL_RIPPLE) ** 2))


def ripple_over(places: Sequence[Floats], length: float) -> CameraRipple:
    """Return a ripple of zero over all places where stones were seen.

    Parameters
    ----------
    places : positions (k, 2) of stones, one array for each throw [m]
    length : distance over which it changes [m]
    """
    low = min(float(xy[:, 1].min()) for xy in places)
    high = max(float(xy[:, 1].max()) for xy in places)
    count = max(int(np.ceil((high - low) / min(RIPPLE_LENGTHS))) + 1, 6)
    return CameraRipple(nodes=np.linspace(low, high, count), length=length, values=np.zeros(count))
