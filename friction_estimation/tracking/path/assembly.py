"""From measurements in single frames to a track: smoothed places, a heading, honest errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.appearance import (
    Appearance,
    Crop,
    PosedStone,
    StoneFit,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.refinement import RefinedCamera
from friction_estimation.film.frame import Frame
from friction_estimation.tracking import tuning
from friction_estimation.tracking.background import Background
from friction_estimation.tracking.films.film_track import FilmTrack
from friction_estimation.tracking.joint.heading import (
    HeadingCurve,
    HeadingViews,
    KnownHeading,
    fit_heading_curve,
    headings_near,
    unseen_turn,
)
from friction_estimation.tracking.joint.losses import left_behind
from friction_estimation.tracking.joint.measurements import Measurements as FrameMeasurements
from friction_estimation.tracking.joint.scatter import scatter_sigma, scattered, without_wild
from friction_estimation.tracking.joint.uncertainty import (
    block_sigma,
    heading_sigma,
    hidden_for_long,
    hidden_sigma,
    systematic_sigma,
    unseen_way,
)
from friction_estimation.tracking.path.smoothing import smooth


@dataclass(eq=False)
class Measurements(FrameMeasurements):
    """Measurements of a stone that also keep its pictures.

    Parameters
    ----------
    pictures : those that show its heading, where they are kept
    keeps_pictures : whether these are kept, to learn the colours of the stone from them
    """

    pictures: list[Crop] = field(default_factory=list)
    keeps_pictures: bool = False

    def add(
        self,
        t: float,
        fit: StoneFit | None,
        frame: Frame,
        background: Background,
        camera: Camera,
        appearance: Appearance,
        others: Sequence[PosedStone] = (),
    ) -> Crop | None:
        crop = super().add(t, fit, frame, background, camera, appearance, others)
        if crop is not None and self.keeps_pictures:
            self.pictures.append(replace(crop, t=t))
        return crop

    def heading_curve(self, until: float = np.inf) -> HeadingCurve | None:
        """The heading that the pictures show up to a time [s]; None where they show none."""
        t = np.array(self.t)
        seen = [fit is not None for fit in self.fits]
        views = self.views.between(-np.inf, until)
        if self.seen < tuning.MIN_FITS or not views.t:
            return None
        places = np.array([fit.xy for fit in self.fits if fit is not None])
        sigma = np.array([np.sqrt(np.diag(f.covariance)[:2]) for f in self.fits if f is not None])
        rate = [smooth(t[seen], places[:, k], sigma[:, k]).rate for k in range(2)]
        return fit_heading_curve(views, t[seen], np.hypot(*rate))


def assemble_track(
    measured: Measurements,
    appearance: Appearance,
    refined: RefinedCamera,
    known: KnownHeading | None = None,
) -> FilmTrack | None:
    """Smooth the measurements, and keep the rows in which the stone was seen.

    Parameters
    ----------
    known : the heading at the beginning, where it is known

    Returns
    -------
    None where it was seen in fewer than `tuning.MIN_FITS` frames
    """
    model, camera = appearance.model, refined.camera
    moments = np.array(measured.t)
    stretches = scattered(moments, measured.fits, camera, model.height / 2)
    all_fits = without_wild(moments, measured.fits, stretches)
    fitted = [i for i, fit in enumerate(all_fits) if fit is not None]
    if len(fitted) < tuning.MIN_FITS:
        return None
    first, last = fitted[0], fitted[-1]
    t, fits = moments[first : last + 1], all_fits[first : last + 1]
    xy = np.array([[np.nan, np.nan] if fit is None else fit.xy for fit in fits])
    sigma = np.array(
        [[np.nan] * 2 if f is None else np.sqrt(np.diag(f.covariance)[:2]) for f in fits]
    )
    single = sigma.copy()
    kept = np.isfinite(xy[:, 0])
    hidden = np.array([0.0 if fit is None else fit.hidden for fit in fits])
    if hidden.any():
        sigma[kept] = np.hypot(sigma[kept], hidden_sigma(camera, xy, hidden, model)[kept])
    smoothed = [smooth(t, xy[:, axis], sigma[:, axis]) for axis in range(2)]
    # Outliers keep their rows too, with the place that all other measurements give.
    theta = spin = sigma_theta = np.full(len(t), np.nan)
    velocity = np.column_stack([axis.rate for axis in smoothed])
    ages = measured.ages.seen().around(t)
    if appearance.has_handle:
        speed = np.hypot(*velocity.T)
        theta, spin, sigma_theta = _heading(t, fits, speed, measured.views, known, ages.whole)
    place = np.column_stack([axis.value for axis in smoothed])
    if appearance.doubt is not None:
        place = place + appearance.doubt.shift_at(place)
    sigma_theta = np.hypot(sigma_theta, heading_sigma(camera, place, model))
    noise = np.hypot(smoothed[0].sigma, smoothed[1].sigma)[kept] / np.sqrt(2)
    noise = np.hypot(noise, scatter_sigma(t, stretches)[kept])
    behind = left_behind(t, fits, camera, model.height / 2, stretches)
    if behind is not None:
        noise = np.hypot(noise, behind.by(t[kept], place[kept]))
    unseen = np.hypot(unseen_way(t, velocity, ages.rim), ages.dropped)
    unseen = np.hypot(unseen, block_sigma(single, ages.repeated))[kept]
    common = systematic_sigma(
        refined,
        place[kept],
        model,
        unseen,
        appearance.doubt,
        hidden_for_long(t[kept], hidden[kept]),
    )
    trajectory = Trajectory(
        t=t[kept],
        xy=place[kept],
        theta=theta[kept],
        sigma_xy=np.hypot(noise, common),
        sigma_theta=sigma_theta[kept] if appearance.has_handle else np.empty(0),
    )
    return FilmTrack(
        trajectory=trajectory,
        frame=np.arange(first, last + 1)[kept],
        velocity=velocity[kept],
        spin=spin[kept],
        frame_count=len(measured.t),
        camera=camera,
        appearance=appearance,
        refined=refined,
    )


def _heading(
    t: Floats,
    fits: Sequence[StoneFit | None],
    speed: Floats,
    views: HeadingViews,
    known: KnownHeading | None,
    age: Floats,
) -> tuple[Floats, Floats, Floats]:
    """Smoothed heading, spin, and the standard error of the heading, each (n,)."""
    sigma = np.array([np.nan if fit is None else np.sqrt(fit.covariance[2, 2]) for fit in fits])
    measured = np.array([np.nan if fit is None else fit.theta for fit in fits])
    curve = fit_heading_curve(views, t, speed, known)
    nothing = np.full(len(t), np.nan)
    if curve is None:
        return nothing, nothing, nothing
    unseen = unseen_turn(curve, t, speed, age)
    stale = unseen > tuning.MAX_UNSEEN_TURN
    fresh = HeadingViews()
    for moment, cost in zip(views.t, views.cost, strict=True):
        if not stale[min(int(np.searchsorted(t, moment)), len(t) - 1)]:
            fresh.add(moment, cost)
    if len(fresh.t) < len(views.t):
        curve = fit_heading_curve(fresh, t, speed, known)
        if curve is None:
            return nothing, nothing, nothing
    measured = np.where(stale, np.nan, measured)
    theta, sigma = headings_near(curve, t, measured, sigma)
    if np.isfinite(theta).sum() < tuning.MIN_FITS:
        return nothing, nothing, nothing
    theta = theta - 2 * np.pi * np.round(theta[np.isfinite(theta)][0] / (2 * np.pi))
    result = smooth(t, theta, np.clip(sigma, 1e-3, 1.0))
    shown = t[np.isfinite(theta)]
    nearest = np.clip(np.searchsorted(shown, t), 1, len(shown) - 1)
    away = np.minimum(np.abs(t - shown[nearest - 1]), np.abs(t - shown[nearest]))
    # Between and beyond measured headings the smoother may leave what the pictures show together.
    strayed = np.abs(np.angle(np.exp(1j * (result.value - curve.at(t)))))
    found = (away <= tuning.MAX_HEADING_GAP / 2) & (strayed < tuning.HEADING_MATCH) & ~stale
    return (
        np.where(found, result.value, np.nan),
        np.where(found, result.rate, np.nan),
        np.where(found, np.hypot(result.sigma, unseen), np.nan),
    )
