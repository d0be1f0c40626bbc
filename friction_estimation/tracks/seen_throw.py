"""Measurements of a throw from its track: line crossings, line of delivery, place of rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, HOG_TO_TEE, TEE_Y, Direction, to_delivery
from curling_env.trajectory import Trajectory
from curling_env.typing import Flags, Floats
from friction_estimation.tracks.free_slide import FreeSlide
from friction_estimation.tracks.measured import Measured, times, together
from friction_estimation.tracks.outliers import wild_rows
from friction_estimation.tracks.tuning import (
    CROSSING_WINDOW,
    LINE_WINDOW,
    MAX_CROSSING_GAP,
    MAX_EXTRAPOLATION,
    MAX_LATE_RELEASE,
    SPIN_WINDOW,
    STILL_SECONDS,
    STILL_WITHIN,
)

NEAR_BACK, NEAR_TEE, NEAR_HOG = (-TEE_Y - line for line in (BACK_LINE_Y, TEE_Y, HOG_LINE_Y))
"""Lines at the thrower's end, along the direction of play from the tee played to [m]."""
FAR_HOG, FAR_TEE = -HOG_TO_TEE, 0.0
"""The lines at the end played to [m]."""


class SeenThrow:
    """Rows of a track without outliers, in the delivery frame.

    Parameters
    ----------
    track : the track
    slide : its free slide, or that of its first part
    """

    def __init__(self, track: Trajectory, slide: FreeSlide) -> None:
        wild, self._noise = wild_rows(track.t, track.xy)
        kept = np.flatnonzero(~wild)
        self.direction = Direction.AWAY if slide.xy[-1, 1] >= slide.xy[0, 1] else Direction.HOME
        self._t, self._xy = track.t[kept], to_delivery(track.xy[kept], self.direction)
        self._theta = track.theta[kept]
        self._sigma = track.sigma_xy[kept] if track.sigma_xy.size else None
        self._sigma_theta = track.sigma_theta[kept] if track.sigma_theta.size else None
        self._slide = slide

    def _sigma_at(self, t: float) -> float | None:
        """Return the stated standard error of a coordinate [m]."""
        if self._sigma is None:
            return None
        known = np.isfinite(self._sigma)
        return float(np.interp(t, self._t[known], self._sigma[known])) if known.any() else None

    def _sigma_of_heading(self, rows: Flags) -> float | None:
        """Return the stated standard error of the heading in some rows [rad]."""
        if self._sigma_theta is None:
            return None
        known = self._sigma_theta[rows & np.isfinite(self._sigma_theta)]
        return float(np.median(known)) if known.size else None

    def crossing(self, line: float) -> Measured | None:
        """Return the time at which the centre crosses a line across the sheet [s].

        Parameters
        ----------
        line : position along the direction of play, from the tee played to [m]
        """
        t, ahead = self._t, self._xy[:, 1]
        past = np.flatnonzero(ahead >= line)
        if not past.size:
            return None
        k = int(past[0])
        if k == 0:
            # The track may begin at the line, or a frame after it.
            if ahead[0] - line > MAX_EXTRAPOLATION:
                return None
            low = high = float(t[0])
        else:
            low, high = float(t[k - 1]), float(t[k])
        if high - low > MAX_CROSSING_GAP:
            return None
        near = (t >= low - CROSSING_WINDOW) & (t <= high + CROSSING_WINDOW)
        if near.sum() < 5:
            return None
        middle = (low + high) / 2
        fit = _fit(t[near] - middle, ahead[near], self._noise)
        here = _root(fit.value[0] - line, *fit.value[1:], about=(high - low) / 2 + 0.2)
        if here is None:
            return None
        speed = fit.value[1] + 2 * fit.value[2] * here
        when = middle + here
        sigma = together(fit.sigma_at(here), self._sigma_at(when))
        return Measured(when, times(sigma, 1 / speed))

    def line(self, hog: float) -> tuple[Floats, Measured, Measured, Measured] | None:
        """Return origin, speed, angle and the crossing with the far tee line of the line of
        delivery.

        Parameters
        ----------
        hog : time at which the stone crosses the first hog line [s]
        """
        if self._slide.released_at > hog + MAX_LATE_RELEASE:
            return None  # still pushed beyond the line
        # The rules require the release by now; before, the hand may still steer the stone.
        near = (self._t >= hog - 1e-9) & (self._t <= hog + LINE_WINDOW)
        if near.sum() < 8 or self._t[near][0] - hog > CROSSING_WINDOW:
            return None
        u = self._t[near] - hog
        across, ahead = (_fit(u, self._xy[near, k], self._noise) for k in (0, 1))
        vx, vy = across.value[1], ahead.value[1]
        speed = float(np.hypot(vx, vy))
        angle = float(np.arctan2(-vx, vy))
        # A stated error persists: it tilts the line by its change along the path, and a parabola
        # read at its end doubles that.
        stated, half = self._sigma_at(hog), 0.5 * speed * float(np.ptp(u))
        tilt = together(across.slope_sigma / speed, times(stated, 2 / half))
        origin = np.array([across.value[0], ahead.value[0]])
        run = FAR_TEE - origin[1]
        at_tee = float(origin[0] - run * np.tan(angle))
        sigma = together(times(tilt, run), stated, across.sigma_at(0.0))
        return (
            origin,
            Measured(speed, together(ahead.slope_sigma, times(stated, 2 * speed / half))),
            Measured(angle, tilt),
            Measured(at_tee, sigma),
        )

    def spin(self, hog: float) -> Measured | None:
        """Return the spin over the first hog line [rad/s]."""
        known = np.isfinite(self._theta)
        near = known & (self._t >= hog - 1e-9) & (self._t <= hog + SPIN_WINDOW)
        if near.sum() < 8 or np.ptp(self._t[near]) < 0.5 * SPIN_WINDOW:
            return None
        u = self._t[near] - hog
        fit = _fit(u, self._theta[near], 0.0)
        # As for the line: a stated error persists.
        lasting = times(self._sigma_of_heading(near), 4 / float(np.ptp(u)))
        return Measured(float(fit.value[1]), together(fit.slope_sigma, lasting))

    def turns(self, hog: float) -> Measured | None:
        """Return full turns from the first hog line until the stone rests."""
        rest = self.time_of_rest()
        t, theta = self._t[np.isfinite(self._theta)], self._theta[np.isfinite(self._theta)]
        during = t >= hog - 1e-9
        if rest is None or during.sum() < 8:
            return None
        t, theta = t[during], theta[during]
        # A heading seen from the line on but lost long before the rest shows no turns.
        if t[-1] < rest.value - 1.0 or t[0] > hog + 1.0:
            return None
        sigma = times(self._sigma_of_heading(self._t >= hog), 2**0.5 / (2 * np.pi))
        return Measured(abs(float(theta[-1] - theta[0])) / (2 * np.pi), sigma)

    def time_of_rest(self) -> Measured | None:
        """Return the time of undisturbed rest [s]."""
        if not self._slide.rests:
            return None
        # The last centimetres take long: the place is known far better than the moment.
        return Measured(float(self._slide.t[-1]), 0.3)

    def place_of_rest(self) -> tuple[Floats, float | None] | None:
        """Return the place of undisturbed rest, (2,) [m], and the standard error of a coordinate.

        It may be pushed aside or picked up afterwards.
        """
        if not self._slide.rests:
            return self.last_place()
        end = float(self._slide.t[-1])
        lies = self._still_until(min(end + STILL_SECONDS, float(self._t[-1])))
        return lies or self._place(end - 0.1, end)

    def last_place(self) -> tuple[Floats, float | None] | None:
        """Return its final place, even if it was moved by something else."""
        end = float(self._t[-1])
        rests = self._slide.rests and self._slide.t[-1] >= end - 1e-6
        return self._still_until(end) or (self._place(end - 0.1, end) if rests else None)

    def _still_until(self, end: float) -> tuple[Floats, float | None] | None:
        """Return its place at rest up to a time [s]; None if it moves."""
        last = (self._t >= end - STILL_SECONDS) & (self._t <= end)
        if last.sum() < 4 or float(np.hypot(*np.ptp(self._xy[last], axis=0))) >= STILL_WITHIN:
            return None
        return self._place(end - 0.5, end)

    def _place(self, begin: float, end: float) -> tuple[Floats, float | None]:
        """Return its place from one time to another [s]."""
        rows = np.flatnonzero((self._t >= begin) & (self._t <= end))
        stated = self._sigma_at(end)
        place = np.median(self._xy[rows], axis=0)
        return place, self._noise / np.sqrt(len(rows)) if stated is None else stated


class _Fit(NamedTuple):
    """Parabola through values: its coefficients and their covariance."""

    value: Floats
    covariance: Floats

    def sigma_at(self, u: float) -> float:
        basis = np.array([1.0, u, u * u])
        return float(np.sqrt(basis @ self.covariance @ basis))

    @property
    def slope_sigma(self) -> float:
        return float(np.sqrt(self.covariance[1, 1]))


def _fit(u: Floats, values: Floats, noise: float) -> _Fit:
    """Fit a parabola; the noise is at least the given one."""
    basis = np.column_stack([np.ones_like(u), u, u * u])
    inverse: Floats = np.asarray(np.linalg.pinv(basis.T @ basis), dtype=np.float64)
    value = inverse @ (basis.T @ values)
    left = values - basis @ value
    spread = np.sqrt(float(left @ left) / max(len(u) - 3, 1))
    return _Fit(value, inverse * float(max(noise, spread) ** 2))


def _root(c: float, b: float, a: float, about: float) -> float | None:
    """Return the upward root of c + b·u + a·u² within ±about; None if absent."""
    roots = np.roots([a, b, c]) if abs(a) > 1e-12 else np.array([-c / b if b else np.nan])
    rising = [float(r.real) for r in roots if abs(r.imag) < 1e-9 and b + 2 * a * r.real > 0.05]
    near = [r for r in rising if abs(r) <= about]
    return min(near, key=abs) if near else None
