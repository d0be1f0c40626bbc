"""From a stone's measurements to its track: smoothed positions, headings and standard errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.appearance import Appearance, StoneFit
from friction_estimation.camera.refined import RefinedCamera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.films.film_track import FilmTrack
from friction_estimation.tracking.measuring.contacts import contact_time
from friction_estimation.tracking.measuring.follower import Follower
from friction_estimation.tracking.measuring.heading import (
    HeadingViews,
    KnownHeading,
    fit_heading_curve,
    headings_near,
    unseen_turn,
)
from friction_estimation.tracking.measuring.measurements import Measurements
from friction_estimation.tracking.measuring.others import OtherStone
from friction_estimation.tracking.smoothing.misfits import (
    left_behind,
    loss_in_words,
    misfit_sigma,
    misfits,
    misfits_in_words,
    smoothed_with_jump,
)
from friction_estimation.tracking.smoothing.smoother import (
    SmoothPath,
    smooth_heading,
    smooth_path,
)
from friction_estimation.tracking.smoothing.uncertainty import (
    block_sigma,
    heading_sigma,
    hidden_sigma,
    smoothed_occlusion,
    systematic_sigma,
    unseen_displacement,
)


def assemble_all(
    thrown: Follower, hit: Sequence[Follower], others: Sequence[OtherStone], refined: RefinedCamera
) -> FilmTrack | None:
    """Return the tracks of all stones, the thrown one with the others.

    The others are numbered along the sheet in the direction of the throw. A stone that was hit has
    rows from the contact on; an untouched one has one in the first and one in the last frame.

    Returns
    -------
    None where the thrown stone was hardly seen
    """
    contacts = _contacts(thrown, hit, others)
    found = assemble(
        thrown.measured,
        thrown.appearance,
        refined,
        released=thrown.path.released,
        contacts=contacts[0],
        touched=bool(contacts[0]),
    )
    if found is None:
        return None
    forward = np.sign(found.trajectory.xy[-1, 1] - found.trajectory.xy[0, 1]) or 1.0
    tracks: list[tuple[float, FilmTrack]] = []
    for one, times in zip(hit, contacts[1:], strict=True):
        after = without_before(one.measured, min(times))
        track = assemble(after, one.appearance, refined, contacts=sorted(times)[1:], touched=True)
        if track is not None:
            track = replace(track, contacts=tuple(sorted(times)))
            tracks.append((forward * float(one.path.xy[0, 1]), track))
    times = thrown.measured.t
    for other in others:
        if np.isinf(other.rests.until):
            track = at_rest(other, (times[0], times[-1]), len(times), refined)
            tracks.append((forward * float(other.fit.xy[1]), track))
    tracks.sort(key=lambda one: one[0])
    numbered = tuple(
        replace(track, trajectory=replace(track.trajectory, stone=k))
        for k, (_, track) in enumerate(tracks, start=1)
    )
    return replace(found, others=numbered)


def _contacts(
    thrown: Follower, hit: Sequence[Follower], others: Sequence[OtherStone]
) -> list[list[float]]:
    """Times at which the thrown stone and each that was hit touch others [s]."""
    movers = [thrown, *hit]
    contacts: list[list[float]] = [[] for _ in movers]
    lay = {id(one.rests.path): one.fit.xy for one in others}
    for k, one in sorted(enumerate(hit, start=1), key=lambda item: item[1].since):
        xy = lay[id(one.path)]
        touching = thrown.appearance.model.radius + one.appearance.model.radius
        found: list[tuple[float, int, float]] = []
        for j, striker in enumerate(movers):
            if j == k or striker.since > one.since:
                continue
            latest = one.since + 2 * tuning.DENSE_STEP
            t = contact_time(striker.measured, xy, touching, latest)
            if t is not None:
                found.append((abs(t - one.since), j, t))
        if found:
            _, j, t = min(found)
            contacts[j].append(t)
            contacts[k].append(t)
        else:
            contacts[k].append(one.since)
    return contacts


def without_before(measured: Measurements, time: float) -> Measurements:
    """Return the same frames without the measurements before a time [s]."""
    fits = [fit if t >= time else None for t, fit in zip(measured.t, measured.fits, strict=True)]
    return replace(measured, fits=fits, views=measured.views.between(time, np.inf))


def at_rest(
    other: OtherStone, ends: tuple[float, float], frames: int, refined: RefinedCamera
) -> FilmTrack:
    """Return the track of an untouched stone.

    Parameters
    ----------
    ends : times of the first and of the last frame [s]
    frames : number of frames
    """
    xy = np.array([other.fit.xy, other.fit.xy])
    if other.look.uncertainty is not None:
        xy = xy + other.look.uncertainty.shift_at(xy)
    common = systematic_sigma(refined, xy, other.look.model, shape=other.look.uncertainty)
    noise = float(np.sqrt(np.trace(other.fit.covariance[:2, :2]) / 2))
    trajectory = Trajectory(
        t=np.array(ends),
        xy=xy,
        theta=np.full(2, other.heading),
        sigma_xy=np.hypot(noise, common),
    )
    return FilmTrack(
        trajectory=trajectory,
        frame=np.array([0, frames - 1]),
        velocity=np.zeros((2, 2)),
        spin=np.zeros(2),
        frame_count=frames,
        camera=refined.camera,
        appearance=other.look,
        refined=refined,
    )


def assemble(
    measured: Measurements,
    appearance: Appearance,
    refined: RefinedCamera,
    *,
    released: float = -np.inf,
    contacts: Sequence[float] = (),
    touched: bool = False,
) -> FilmTrack | None:
    """Smooth the measurements, and keep the rows in which the stone was seen.

    Parameters
    ----------
    released : when the thrower lets go [s]
    contacts : when the stone hits or is hit [s]
    touched : whether it touches others at all, so that no other jump of its velocity is sought

    Returns
    -------
    None where it was seen in fewer than `tuning.MIN_FITS` frames
    """
    fitted = [i for i, fit in enumerate(measured.fits) if fit is not None]
    if len(fitted) < tuning.MIN_FITS:
        return None
    model, camera = appearance.model, refined.camera
    first, last = fitted[0], fitted[-1]
    t, fits = np.array(measured.t[first : last + 1]), measured.fits[first : last + 1]
    kept = np.array([fit is not None for fit in fits])
    xy, single = np.full((2, len(t), 2), np.nan)
    xy[kept] = [fit.xy for fit in fits if fit is not None]
    single[kept] = [np.sqrt(np.diag(fit.covariance)[:2]) for fit in fits if fit is not None]
    hidden = np.array([0.0 if fit is None else fit.hidden for fit in fits])
    sigma = np.hypot(single, hidden_sigma(camera, xy, hidden, model)) if hidden.any() else single

    def smoothed(*jumps: float) -> SmoothPath:
        return smooth_path(t, xy, sigma, released=released, contacts=(*contacts, *jumps))

    path, jump = (smoothed(), None) if touched else smoothed_with_jump(smoothed, released)
    off = misfits(path)
    behind = None if touched or jump is not None else left_behind(path)
    ages = measured.ages.seen().around(t)
    place = path.place
    if appearance.uncertainty is not None:
        place = place + appearance.uncertainty.shift_at(place)
    theta, spin, sigma_theta = _headings(measured, t, fits, path, ages.whole, appearance, contacts)
    sigma_theta = np.hypot(sigma_theta, heading_sigma(camera, place, model))
    unseen = np.hypot(unseen_displacement(t, path.velocity, ages.rim), ages.dropped)
    unseen = np.hypot(unseen, block_sigma(single, ages.repeated))[kept]
    common = systematic_sigma(
        refined,
        place[kept],
        model,
        unseen,
        appearance.uncertainty,
        smoothed_occlusion(t[kept], hidden[kept]),
    )
    noise = np.sqrt((path.sigma[kept] ** 2).mean(axis=1))
    trajectory = Trajectory(
        t=t[kept],
        xy=place[kept],
        theta=theta[kept],
        sigma_xy=np.sqrt(noise**2 + common**2 + misfit_sigma(path, off, behind)[kept] ** 2),
        sigma_theta=sigma_theta[kept] if appearance.has_handle else np.empty(0),
    )
    return FilmTrack(
        trajectory=trajectory,
        frame=np.arange(first, last + 1)[kept],
        velocity=path.velocity[kept],
        spin=spin[kept],
        frame_count=len(measured.t),
        camera=camera,
        appearance=appearance,
        refined=refined,
        contacts=tuple(contacts),
        unexplained=(
            *loss_in_words(path, jump, behind),
            *misfits_in_words(off, contacts),
        ),
    )


def _headings(
    measured: Measurements,
    t: Floats,
    fits: Sequence[StoneFit | None],
    path: SmoothPath,
    age: Floats,
    appearance: Appearance,
    contacts: Sequence[float],
) -> tuple[Floats, Floats, Floats]:
    """Smoothed heading, spin, and the standard error of the heading, each (n,).

    Stretches between contacts are smoothed one by one: a contact changes the spin, not the heading.
    """
    theta, spin, sigma = np.full((3, len(t)), np.nan)
    if not appearance.has_handle:
        return theta, spin, sigma
    speed = np.hypot(*path.velocity.T)
    known: KnownHeading | None = None
    for low, high in pairwise([-np.inf, *sorted(contacts), np.inf]):
        part = np.flatnonzero((t >= low) & (t < high))
        if len(part) < tuning.MIN_FITS:
            continue
        views = measured.views.between(low, high)
        own = [fits[k] for k in part.tolist()]
        found = _headings_between(views, t[part], own, speed[part], age[part], known)
        if found is None:
            known = None
            continue
        theta[part], spin[part], sigma[part] = found
        seen = part[np.isfinite(theta[part])]
        known = None
        if len(seen) and t[seen[-1]] > t[part[-1]] - tuning.HEADING_VIEW_INTERVAL:
            last = seen[-1]
            known = KnownHeading(t=float(t[last]), theta=float(theta[last]), spin=float(spin[last]))
    return theta, spin, sigma


def _headings_between(
    views: HeadingViews,
    t: Floats,
    fits: Sequence[StoneFit | None],
    speed: Floats,
    age: Floats,
    known: KnownHeading | None,
) -> tuple[Floats, Floats, Floats] | None:
    """Return heading, spin and standard error of a stretch; None if the pictures show no
    heading.
    """
    curve = fit_heading_curve(views, t, speed, known)
    if curve is None:
        return None
    unseen = unseen_turn(curve, t, speed, age)
    stale = unseen > tuning.HEADING_MATCH
    fresh = HeadingViews()
    for moment, cost in zip(views.t, views.cost, strict=True):
        if not stale[min(int(np.searchsorted(t, moment)), len(t) - 1)]:
            fresh.add(moment, cost)
    if len(fresh.t) < len(views.t):
        curve = fit_heading_curve(fresh, t, speed, known)
        if curve is None:
            return None
    own = np.array([np.nan if fit is None else fit.theta for fit in fits])
    error = np.array([np.nan if fit is None else np.sqrt(fit.covariance[2, 2]) for fit in fits])
    theta, error = headings_near(curve, t, np.where(stale, np.nan, own), error)
    seen = np.isfinite(theta)
    if seen.sum() < tuning.MIN_FITS:
        return None
    if known is None:
        theta = theta - 2 * np.pi * np.round(theta[seen][0] / (2 * np.pi))
    value, rate, noise = smooth_heading(t, theta, np.clip(error, 1e-3, 1.0))
    away = np.abs(t[:, None] - t[seen]).min(axis=1)
    expected = curve.at(t)
    off = np.angle(np.exp(1j * (value - expected)))
    found = (away <= tuning.LONG) & (np.abs(off) < tuning.HEADING_MATCH) & ~stale
    # If single frames scatter more than the error of the curve, the curve is used.
    miss = np.angle(np.exp(1j * (theta - expected)))[seen]
    scatter = float(np.median(np.abs(miss))) / 0.6745
    drift = tuning.HEADING_DRIFT
    share = drift**2 / (drift**2 + scatter**2)
    heading = np.where(found, value - (1 - share) * off, np.nan)
    rate = np.where(found, rate, np.nan)
    error = np.hypot(noise * share, (1 - share) * drift)
    sigma = np.where(found, np.hypot(error, unseen), np.nan)
    return heading, rate, sigma
