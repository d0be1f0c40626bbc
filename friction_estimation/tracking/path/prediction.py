"""Where to look for a stone in the next frame, and whether what is found there can be right.

A stone that nothing touches hardly changes its speed from one frame to the next: its last two
places tell the next one to a fraction of a pixel. Where they are not known, optical flow tells it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance import Appearance, StoneFit
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame
from friction_estimation.tracking import tuning
from friction_estimation.tracking.films.film_track import TrackingOptions
from friction_estimation.tracking.joint.heading import HeadingCurve
from friction_estimation.tracking.path.optical_flow import LocalFlow


class ExpectedPath(Protocol):
    """Roughly where a stone should be, whether it is seen or not."""

    def at(self, t: float) -> Floats:
        """Place at a time [s], (2,) [m]."""
        ...

    def leads(self, t: float) -> bool:
        """Whether it tells better than optical flow where the stone is at a time [s]."""
        ...

    def doubt(self, t: float) -> float:
        """How far the stone may be from there, because it is not seen any more [m]."""
        ...


class Predictor:
    """Predicts a stone's pose by its motion or by optical flow, and else by the expected path.

    Parameters
    ----------
    path : the path that the stone is expected to take
    camera : the film's camera
    appearance : appearance of the followed stone
    options : what may be accepted
    heading : the heading over the whole film, where it is known
    turned : the heading at the beginning, where only that is known [rad]
    alone : whether nothing can hit the stone; else optical flow predicts from frame to frame
    """

    def __init__(
        self,
        *,
        path: ExpectedPath,
        camera: Camera,
        appearance: Appearance,
        options: TrackingOptions,
        heading: HeadingCurve | None,
        turned: float = np.nan,
        alone: bool = False,
    ) -> None:
        self._path, self._camera, self._appearance = path, camera, appearance
        self._options, self._heading_curve = options, heading
        self._flow = LocalFlow(options.flow)
        self._alone = alone
        self._frames: tuple[Frame | None, Frame | None] = (None, None)
        self._last: StoneFit | None = None
        self._seen: list[tuple[float, Floats]] = []
        self._by_motion = False
        self._seen_at = np.inf
        self._last_t = 0.0
        self._theta, self._spin = 0.0, 0.0
        self._doubt = (tuning.HEADING_SIGMA**2, 0.0, tuning.SPIN_CHANGE_AT_CONTACT**2)
        self._headings = 0
        if np.isfinite(turned):
            self._theta, self._headings = float(turned), 1

    def predict(self, t: float, frame: Frame) -> Floats:
        """The pose in the next frame, (3,): x, y [m] and heading [rad]."""
        self._frames = (self._frames[1], frame)
        self._by_motion = self._alone and len(self._seen) == 2 and not self._path.leads(t)
        if not self._by_motion:
            return self._by_flow(t)
        (earlier, there), (later, here) = self._seen
        place = here + (here - there) * ((t - later) / (later - earlier))
        if math.dist(place, self._path.at(t)) > self._options.gate + self._path.doubt(t):
            # What goes elsewhere may be somebody who walks: motion alone would go on with them.
            self._by_motion = False
            return self._by_flow(t)
        self._flow.forget()
        return np.array([*place, self._heading(t)])

    def _by_flow(self, t: float) -> Floats:
        """The pose in the last frame, by optical flow from the one before, or by the path."""
        theta = self._heading(t)
        before, frame = self._frames
        if self._last is None or before is None or frame is None or self._path.leads(t):
            return np.array([*self._path.at(t), theta])
        corners = self._appearance.model.extent_px(self._camera, self._last.xy)
        shift = self._flow.shift(before, frame, corners)
        if shift is None:
            return np.array([*self._path.at(t), theta])
        middle = self._appearance.model.height / 2
        here = self._camera.project([[*self._last.xy, middle]])
        there = self._camera.on_plane(here + shift, middle)[0]
        return np.array([*there, theta])

    def find(
        self,
        t: float,
        start: Floats,
        fit_at: Callable[[Floats], StoneFit | None],
        allowed: Callable[[StoneFit], bool] = lambda fit: True,
        or_at: Floats | None = None,
    ) -> StoneFit | None:
        """The stone in a frame, measured from the predicted pose or else from other ones.

        Parameters
        ----------
        t : time of the frame [s]
        start : (3,) predicted pose
        fit_at : measures the stone in the frame from a pose to start with
        allowed : what else a measurement must fulfil
        or_at : (2,) another place where it may be [m]
        """
        turned = [fit_at(start + np.array([0.0, 0.0, turn])) for turn in self._turns_to_try]
        fit = min(
            (found for found in turned if found is not None),
            key=lambda found: found.misfit / max(found.visible, 1e-3),
            default=None,
        )
        if fit is not None and self._accepts(t, fit, start) and allowed(fit):
            return fit
        if self._by_motion:
            self._by_motion = False
            return self.find(t, self._by_flow(t), fit_at, allowed, or_at)
        for place in (self._path.at(t), or_at):
            if place is None or np.linalg.norm(place - start[:2]) < tuning.MIN_RETRY_DISTANCE:
                continue
            again = np.array([*place, self._heading(t)])
            fit = fit_at(again)
            if fit is not None and self._accepts(t, fit, again) and allowed(fit):
                return fit
        return None

    def update(self, t: float, fit: StoneFit | None) -> None:
        """Take in what was measured in a frame; None where the stone was not seen."""
        self._last = fit
        self._seen_at = self._seen_at if fit is None else t
        self._seen = [] if fit is None else [*self._seen[-1:], (t, fit.xy)]
        if fit is None or not self._appearance.has_handle or not np.isfinite(fit.theta):
            return
        if self._headings == 0:
            self._theta = fit.theta
        else:
            self._take_in_heading(t - self._last_t if self._headings > 1 else 0.0, fit.theta)
        self._last_t = t
        self._headings += 1

    def note_contact(self) -> None:
        """The stone was hit: it may turn otherwise from now on."""
        own, *_ = self._doubt
        self._doubt = (own, 0.0, tuning.SPIN_CHANGE_AT_CONTACT**2)

    def _take_in_heading(self, dt: float, theta: float) -> None:
        """Correct heading and spin by a measured heading: a Kalman filter of the two."""
        own, shared, spin = self._doubt
        own += dt * (2 * shared + dt * spin)
        shared += dt * spin
        spin += tuning.SPIN_DRIFT**2 * dt
        self._theta += self._spin * dt
        miss = math.remainder(theta - self._theta, math.tau)
        if abs(miss) < tuning.MAX_HEADING_MISS:
            total = own + tuning.HEADING_SIGMA**2
            self._theta += own / total * miss
            self._spin += shared / total * miss
            own, shared, spin = (
                own - own * own / total,
                shared - own * shared / total,
                spin - shared * shared / total,
            )
        self._doubt = (own, shared, spin)

    @property
    def _turns_to_try(self) -> Floats:
        """Angles from the expected heading [rad] to start fits at: all round until one is known."""
        known = self._heading_curve is not None or self._headings
        if not self._appearance.has_handle or known:
            return np.zeros(1)
        return np.arange(8, dtype=np.float64) * (np.pi / 4)

    def _heading(self, t: float) -> float:
        if self._heading_curve is not None:
            return float(self._heading_curve.at(t))
        return self._theta + self._spin * (t - self._last_t)

    def _accepts(self, t: float, fit: StoneFit, start: Floats) -> bool:
        """Whether enough of the stone is seen, and near enough to where the fit was started."""
        least = self._options.min_visible
        if t - self._seen_at > tuning.SEEN_AGAIN_AFTER:
            least = max(least, tuning.SEEN_AGAIN_SHARE)
        if fit.visible < least or fit.inside < self._options.min_inside:
            return False
        away = math.dist(fit.xy, start[:2])
        gate = self._options.gate
        if self._path.leads(t):
            gate = min(gate, tuning.LED_GATE)
        if away <= gate:
            return True
        scale = self._camera.px_per_metre(fit.xy)
        if not np.isfinite(scale).all():  # a fit that has gone beyond all bounds
            return False
        two_pixels = 2.0 / np.linalg.norm(scale, -2)  # [m]
        return bool(away <= gate + two_pixels)
