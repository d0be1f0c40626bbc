"""From measurements in single frames to a track: smoothed places, one heading, honest errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from curling_env.errors import InputError
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.appearance import Appearance, StoneFit, heading_costs
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.refinement import RefinedCamera
from friction_estimation.film.frame import Frame
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.film_track import FilmTrack
from friction_estimation.tracking.path.heading import (
    LONGEST_GAP,
    Glimpses,
    Turn,
    heading_about,
    turn_through,
)
from friction_estimation.tracking.path.smoothing import smooth
from friction_estimation.tracking.path.uncertainty import HANDLE_PX, heading_sigma, systematic_sigma

MIN_FITTED = 5
"""Frames in which a stone must be measured to have a track."""
GLIMPSE_EVERY = 0.4
"""Time between pictures that tell the heading [s]."""


@dataclass(eq=False)
class Record:
    """What was measured of a stone, frame by frame.

    Parameters
    ----------
    t, fits : (n,) times [s] and measurements; None where it was not seen
    glimpses : pictures that tell its heading
    lag_px : how far the film's compression may have left its picture behind [px]
    """

    t: list[float] = field(default_factory=list)
    fits: list[StoneFit | None] = field(default_factory=list)
    glimpses: Glimpses = field(default_factory=Glimpses)
    lag_px: float = 0.0

    def glimpse(
        self, frame: Frame, ice: Floats, background: Background, camera: Camera, look: Appearance
    ) -> None:
        """Keep what the last frame noted shows of the handle, if it is time for it."""
        fit, t = self.fits[-1], self.t[-1]
        if fit is None or not look.has_handle:
            return
        if self.glimpses.t and t < self.glimpses.t[-1] + GLIMPSE_EVERY:
            return
        cost = heading_costs(frame, fit.xy, ice, background.origin_px, camera, look)
        if cost is not None:
            self.glimpses.add(t, cost)

    def turn(self, until: float = np.inf) -> Turn | None:
        """The turn that its glimpses show up to a time [s]; None where they show none."""
        t = np.array(self.t)
        seen = [fit is not None for fit in self.fits]
        glimpses = self.glimpses.between(-np.inf, until)
        if sum(seen) < MIN_FITTED or not glimpses.t:
            return None
        places = np.array([fit.xy for fit in self.fits if fit is not None])
        sigma = np.array([np.sqrt(np.diag(f.covariance)[:2]) for f in self.fits if f is not None])
        rate = [smooth(t[seen], places[:, k], sigma[:, k]).rate for k in range(2)]
        return turn_through(glimpses, t[seen], np.hypot(*rate))


def join_frames(
    record: Record, look: Appearance, landmarks: RefinedCamera, throw: int, path: str | Path
) -> FilmTrack:
    """Smooth the frames' measurements, and keep the rows in which the stone was seen."""
    fitted = [i for i, fit in enumerate(record.fits) if fit is not None]
    if len(fitted) < MIN_FITTED:
        raise InputError("the thrown stone is seen in fewer than five frames", source=path)
    first, last = fitted[0], fitted[-1]
    t = np.array(record.t[first : last + 1])
    fits = record.fits[first : last + 1]
    xy = np.array([[np.nan, np.nan] if fit is None else fit.xy for fit in fits])
    sigma = np.array(
        [[np.nan] * 2 if f is None else np.sqrt(np.diag(f.covariance)[:2]) for f in fits]
    )
    smoothed = [smooth(t, xy[:, axis], sigma[:, axis]) for axis in range(2)]
    kept = np.isfinite(xy[:, 0])  # wild frames did not pull; their rows carry the joint estimate
    theta = spin = sigma_theta = np.full(len(t), np.nan)
    if look.has_handle and record.lag_px < HANDLE_PX:
        speed = np.hypot(smoothed[0].rate, smoothed[1].rate)
        theta, spin, sigma_theta = _heading(t, fits, speed, record.glimpses)
    place = np.column_stack([axis.value for axis in smoothed])
    sigma_theta = np.hypot(sigma_theta, heading_sigma(landmarks.camera, place, look.model))
    noise = np.hypot(smoothed[0].sigma, smoothed[1].sigma)[kept] / np.sqrt(2)
    common = systematic_sigma(landmarks, place[kept], look.model.height, record.lag_px)
    trajectory = Trajectory(
        t=t[kept],
        xy=place[kept],
        theta=theta[kept],
        sigma_xy=np.hypot(noise, common),
        sigma_theta=sigma_theta[kept] if look.has_handle else np.empty(0),
        throw=throw,
    )
    return FilmTrack(
        trajectory=trajectory,
        frame=np.arange(first, last + 1)[kept],
        velocity=np.column_stack([axis.rate for axis in smoothed])[kept],
        spin=spin[kept],
        frame_count=len(record.t),
        camera=landmarks.camera,
        look=look,
        landmarks=landmarks,
    )


def _heading(
    t: Floats,
    fits: Sequence[StoneFit | None],
    speed: Floats,
    glimpses: Glimpses,
) -> tuple[Floats, Floats, Floats]:
    """Smoothed heading, spin and the heading's standard error, each (n,)."""
    sigma = np.array([np.nan if fit is None else np.sqrt(fit.covariance[2, 2]) for fit in fits])
    measured = np.array([np.nan if fit is None else fit.theta for fit in fits])
    turn = turn_through(glimpses, t, speed)
    theta = np.full(len(t), np.nan) if turn is None else heading_about(turn, t, measured)
    if np.isfinite(theta).sum() < MIN_FITTED:
        nothing = np.full(len(t), np.nan)
        return nothing, nothing, nothing
    theta = theta - 2 * np.pi * np.round(theta[np.isfinite(theta)][0] / (2 * np.pi))
    result = smooth(t, theta, np.clip(sigma, 1e-3, 1.0))
    known = t[np.isfinite(theta)]
    nearest = np.clip(np.searchsorted(known, t), 1, len(known) - 1)
    away = np.minimum(np.abs(t - known[nearest - 1]), np.abs(t - known[nearest]))
    found = away <= LONGEST_GAP / 2
    return (
        np.where(found, result.value, np.nan),
        np.where(found, result.rate, np.nan),
        np.where(found, result.sigma, np.nan),
    )
