"""Where to look for the stone in the next frame: optical flow predicts, and gates what is found."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance import Appearance, StoneFit
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame
from friction_estimation.tracking.film_track import TrackingOptions
from friction_estimation.tracking.optical_flow import LocalFlow
from friction_estimation.tracking.path.heading import Turn

MAX_HEADING_MISS = 0.7
"""A heading further from where the spin leads [rad] is a misread handle, not a turn."""
HEADING_GAIN = 0.35
"""How far the expected heading gives way to each frame's; the spin by half its square."""


class Led(Protocol):
    """Says where a stone should be."""

    def at(self, t: float) -> Floats:
        """Place at a time [s], (2,) [m]."""
        ...


class Pilot:
    """Says where to look next: by flow while the stone is seen, by the rough path else."""

    def __init__(
        self,
        *,
        rough: Led,
        camera: Camera,
        look: Appearance,
        options: TrackingOptions,
        turn: Turn | None,
    ) -> None:
        self._rough, self._camera, self._look = rough, camera, look
        self._options, self._turn = options, turn
        self._flow = LocalFlow(options.flow)
        self._frame: Frame | None = None
        self._last: StoneFit | None = None
        self._last_t = 0.0
        self._theta, self._spin = 0.0, 0.0
        self._headings = 0

    def predict(self, t: float, frame: Frame) -> Floats:
        before, self._frame = self._frame, frame
        theta = self._heading(t)
        if self._last is None or before is None:
            return np.array([*self._rough.at(t), theta])
        corners = self._look.model.extent_px(self._camera, self._last.xy)
        shift = self._flow.shift(before, frame, corners)
        if shift is None:
            return np.array([*self._rough.at(t), theta])
        middle = self._look.model.height / 2
        here = self._camera.project([[*self._last.xy, middle]])
        there = self._camera.on_plane(here + shift, middle)[0]
        return np.array([*there, theta])

    @property
    def headings_to_try(self) -> Floats:
        """Turns from the expected heading [rad] to begin a fit at; many until one is known."""
        if not self._look.has_handle or self._turn is not None or self._headings:
            return np.zeros(1)
        return np.arange(8, dtype=np.float64) * (np.pi / 4)

    def fallback(self, t: float) -> Floats:
        return np.array([*self._rough.at(t), self._heading(t)])

    def _heading(self, t: float) -> float:
        if self._turn is not None:
            return float(self._turn.at(t))
        return self._theta + self._spin * (t - self._last_t)

    def accepts(self, fit: StoneFit, start: Floats) -> bool:
        if fit.visible < self._options.min_visible or fit.inside < self._options.min_inside:
            return False
        away = math.dist(fit.xy, start[:2])
        if away <= self._options.gate:
            return True
        footprint = 2.0 / np.linalg.norm(self._camera.px_per_metre(fit.xy), -2)  # of two pixels [m]
        return bool(away <= self._options.gate + footprint)

    def note(self, t: float, fit: StoneFit | None) -> None:
        """Remember a frame, and what its heading says of the next one's."""
        self._last = fit
        if fit is None or not self._look.has_handle or not np.isfinite(fit.theta):
            return
        dt = t - self._last_t
        expected = self._theta + self._spin * dt if self._headings else self._theta
        miss = math.remainder(fit.theta - expected, math.tau)
        if self._headings == 0:
            self._theta = fit.theta
        else:
            gain = HEADING_GAIN if abs(miss) < MAX_HEADING_MISS else 0.0
            self._theta = expected + gain * miss
            self._spin += gain**2 / 2 * miss / max(dt, 1e-3)
        self._last_t = t
        self._headings += 1
