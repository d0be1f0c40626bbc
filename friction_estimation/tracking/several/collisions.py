"""Tracks of stones that touched each other, smoothed up to each contact and on from it.

At a contact the velocity of a stone jumps. A smoother that did not know of it would round the
corner off, so every stretch between contacts is smoothed on its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.appearance import Appearance
from friction_estimation.camera.refinement import RefinedCamera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.resting_stones import FilmedRestingStone
from friction_estimation.tracking.films.film_track import FilmTrack
from friction_estimation.tracking.joint.heading import KnownHeading
from friction_estimation.tracking.joint.uncertainty import systematic_sigma
from friction_estimation.tracking.path.assembly import Measurements, assemble_track
from friction_estimation.tracking.path.smoothing import smooth
from friction_estimation.tracking.several.expected_path import time_to_touch
from friction_estimation.tracking.several.later_look import views_on_the_way
from friction_estimation.tracking.several.moving_stones import MovingStone
from friction_estimation.tracking.several.unexplained import unexplained


def assemble_tracks(
    stones: Sequence[MovingStone], resting: Sequence[FilmedRestingStone], refined: RefinedCamera
) -> FilmTrack | None:
    """The thrown stone's track with those of all others beside it.

    The thrown stone has number 0; the others are numbered along the sheet in its direction. A stone
    that was hit has rows from the contact on; one that stays untouched has a row in the first and
    one in the last frame.

    Parameters
    ----------
    stones : the thrown stone, then those that left their places
    resting : all other stones that lay on the sheet

    Returns
    -------
    None where the thrown stone was hardly seen
    """
    contacts = _contacts(stones)
    thrown = assemble_pieces(stones[0].measured, contacts[0], stones[0], refined)
    if thrown is None:
        return None
    forward = np.sign(thrown.trajectory.xy[-1, 1] - thrown.trajectory.xy[0, 1]) or 1.0
    others: list[tuple[float, FilmTrack]] = []
    tracks: list[Trajectory | None] = [thrown.trajectory]
    for stone, times in zip(stones[1:], contacts[1:], strict=True):
        tracks.append(None)
        if stone.rested is None or not times:
            continue  # it was seen to be gone, but not how it went
        measured = _seen_on_its_way(_after(stone.measured, min(times)), stone, stones[0].appearance)
        track = assemble_pieces(measured, sorted(times)[1:], stone, refined)
        if track is not None:
            tracks[-1] = track.trajectory
            track = replace(track, contacts=tuple(sorted(times)))
            others.append((forward * float(stone.rested.xy[1]), track))
    for stone in resting:
        if stone.stays and not _is_passed_through(stone, tracks):
            at_rest = _at_rest(stone, stones[0].measured, refined)
            others.append((forward * float(stone.xy[1]), at_rest))
    others.sort(key=lambda item: item[0])
    numbered = [
        replace(other, trajectory=replace(other.trajectory, stone=number))
        for number, (_, other) in enumerate(others, start=1)
    ]
    told = unexplained(refined.camera, stones, contacts, tracks, resting)
    return replace(thrown, others=tuple(numbered), unexplained=told)


def _is_passed_through(stone: FilmedRestingStone, tracks: Sequence[Trajectory | None]) -> bool:
    """Return whether a moving stone's centre came within a radius of a stone at rest.

    Then no stone lies there, but paint that was taken for one.
    """
    radius = stone.posed.look.model.radius
    return any(
        track is not None and np.linalg.norm(track.xy - stone.xy, axis=1).min() < radius
        for track in tracks
    )


def _contacts(stones: Sequence[MovingStone]) -> list[list[float]]:
    """The times at which each stone hit or was hit [s]."""
    contacts: list[list[float]] = [[] for _ in stones]
    for k, stone in enumerate(stones):
        if stone.left is None or stone.rested is None:
            continue
        strikers = [j for j, other in enumerate(stones) if stone.left in other.hits]
        later = min((t for t in stone.hits if t > stone.left), default=np.inf)
        time = contact_time(stone.measured, stone.rested.xy, stone.left, later)
        for j in strikers:
            touching = 2 * stone.appearance.model.radius
            own = stones[j].left
            since = -np.inf if own is None else own
            about = stone.left
            if stone.expected is not None:
                about = min(about, stone.expected[0] + tuning.MAX_CONTACT_DELAY / 2)
            met = meeting_time(stones[j].measured, stone.rested.xy, touching, since, about)
            time = time if met is None else met
            contacts[j].append(time)
        contacts[k].append(time)
    return contacts


def contact_time(
    measured: Measurements, rested: Floats, left: float, until: float = np.inf
) -> float:
    """When a stone was hit [s]: its first measurements followed back to where it lay.

    Parameters
    ----------
    rested : (2,) place at which it lay [m]
    left : when it was seen to have left [s]
    until : when it hit another stone [s]
    """
    after = _places(measured, left, until)[: tuning.CONTACT_FITS]
    if len(after) < 3:
        return left
    t = np.array([time for time, _ in after])
    way = np.array([xy for _, xy in after]) - rested
    aim = way[-1] / np.linalg.norm(way[-1])
    at_left, speed = np.polynomial.polynomial.polyfit(t - left, way @ aim, 1)
    back = at_left / max(float(speed), 1e-3)
    return float(left - np.clip(back, 0.0, tuning.MAX_CONTACT_DELAY))


def meeting_time(
    striker: Measurements, rested: Floats, touching: float, since: float, left: float
) -> float | None:
    """When a stone came so near to one at rest that they touched [s].

    Parameters
    ----------
    striker : measurements of the stone that came
    rested : (2,) where the other one lay [m]
    touching : how far their centres are apart then [m]
    since : when its path began, such as when it was hit itself [s]
    left : when the other one was seen to have left [s]

    Returns
    -------
    None where its path up to then is not known, or passes by
    """
    before = [
        (t, xy)
        for t, xy in _places(striker, since, left)
        if np.linalg.norm(xy - rested) > touching + tuning.CLEAR_OF_CONTACT
    ][-tuning.CONTACT_FITS :]
    if len(before) < 3 or before[-1][0] < left - 2 * tuning.MAX_CONTACT_DELAY:
        return None
    t = np.array([time for time, _ in before])
    places = np.array([xy for _, xy in before])
    start, speed = np.polynomial.polynomial.polyfit(t - left, places - rested, 1)
    wait = time_to_touch(start, speed, touching)
    if wait is None:  # by a hair's breadth it passes by
        wait = time_to_touch(start, speed, touching + tuning.CLEAR_OF_CONTACT)
    if wait is None:
        return None
    return float(left + np.clip(wait, -tuning.MAX_CONTACT_DELAY, 0.0))


def _places(measured: Measurements, since: float, until: float) -> list[tuple[float, Floats]]:
    """Times [s] and measured places (2,) [m] in a span of time [s]."""
    return [
        (t, fit.xy)
        for t, fit in zip(measured.t, measured.fits, strict=True)
        if fit is not None and since <= t < until
    ]


def assemble_pieces(
    measured: Measurements, contacts: Sequence[float], stone: MovingStone, refined: RefinedCamera
) -> FilmTrack | None:
    """One track from the stretches between contacts [s]; None where the stone was hardly seen."""
    pieces: list[tuple[int, FilmTrack]] = []
    known: KnownHeading | None = None
    for first, last in _stretches(measured, contacts):
        part = Measurements(
            t=measured.t[first:last],
            fits=measured.fits[first:last],
            views=measured.views.between(measured.t[first], measured.t[last - 1] + 1e-9),
            ages=measured.ages,
        )
        piece = assemble_track(part, stone.appearance, refined, known)
        if piece is not None:
            pieces.append((first, piece))
            known = _at_its_end(piece)
    if not pieces:
        return None
    paths = [piece.trajectory for _, piece in pieces]
    trajectory = Trajectory(
        t=np.concatenate([p.t for p in paths]),
        xy=np.concatenate([p.xy for p in paths]),
        theta=_unwrapped([p.theta for p in paths]),
        sigma_xy=np.concatenate([p.sigma_xy for p in paths]),
        sigma_theta=np.concatenate([p.sigma_theta for p in paths]),
    )
    return replace(
        pieces[0][1],
        trajectory=trajectory,
        frame=np.concatenate([first + piece.frame for first, piece in pieces]),
        velocity=np.concatenate([piece.velocity for _, piece in pieces]),
        spin=np.concatenate([piece.spin for _, piece in pieces]),
        frame_count=len(measured.t),
        contacts=tuple(sorted(contacts)),
    )


def _at_its_end(piece: FilmTrack) -> KnownHeading | None:
    """The heading with which a stretch of a path ends; None where it is not seen there."""
    path = piece.trajectory
    seen = np.flatnonzero(np.isfinite(path.theta))
    if not len(seen) or path.t[seen[-1]] < path.t[-1] - tuning.MAX_CONTACT_DELAY:
        return None
    last = seen[-1]
    return KnownHeading(
        t=float(path.t[-1]), theta=float(path.theta[last]), spin=float(piece.spin[last])
    )


def _stretches(measured: Measurements, contacts: Sequence[float]) -> list[tuple[int, int]]:
    """First and past-last index of the frames between contacts."""
    at = np.searchsorted(np.array(measured.t), sorted(contacts)).tolist()
    edges = [0, *at, len(measured.t)]
    return [(a, b) for a, b in pairwise(edges) if b > a]


def _after(measured: Measurements, time: float) -> Measurements:
    """The same frames without the measurements before a time [s]."""
    fits = [fit if t >= time else None for t, fit in zip(measured.t, measured.fits, strict=True)]
    return replace(measured, fits=fits)


def _seen_on_its_way(
    measured: Measurements, stone: MovingStone, thrown: Appearance
) -> Measurements:
    """What shows the heading of a stone that was hit, by the colours that it has on its way."""
    seen = [(t, f) for t, f in zip(measured.t, measured.fits, strict=True) if f is not None]
    if len(seen) < tuning.MIN_FITS or not measured.pictures:
        return measured
    t = np.array([time for time, _ in seen])
    sigma = [np.sqrt(np.diag(fit.covariance)[:2]) for _, fit in seen]
    xy, error = np.array([fit.xy for _, fit in seen]), np.array(sigma)
    speed = np.hypot(*(smooth(t, xy[:, k], error[:, k]).rate for k in range(2)))
    views = views_on_the_way(measured.pictures, stone.appearance, thrown, t, speed)
    return replace(measured, views=views)


def _unwrapped(pieces: Sequence[Floats]) -> Floats:
    """Headings of pieces one after the other; a contact does not turn a stone at once."""
    found: list[Floats] = []
    before = np.nan
    for theta in pieces:
        known = theta[np.isfinite(theta)]
        if len(known) and np.isfinite(before):
            theta = theta + 2 * np.pi * np.round((before - known[0]) / (2 * np.pi))
        if len(known):
            before = float(theta[np.isfinite(theta)][-1])
        found.append(theta)
    return np.concatenate(found)


def _at_rest(
    stone: FilmedRestingStone, measured: Measurements, refined: RefinedCamera
) -> FilmTrack:
    """The track of a stone that nobody touched, in the first and in the last frame."""
    appearance = stone.posed.look
    xy = np.array([stone.xy, stone.xy])
    if appearance.doubt is not None:
        xy = xy + appearance.doubt.shift_at(xy)
    common = systematic_sigma(refined, xy, appearance.model, doubt=appearance.doubt)
    trajectory = Trajectory(
        t=np.array([measured.t[0], measured.t[-1]]),
        xy=xy,
        theta=np.full(2, stone.heading),
        sigma_xy=np.hypot(stone.sigma, common),
    )
    return FilmTrack(
        trajectory=trajectory,
        frame=np.array([0, len(measured.t) - 1]),
        velocity=np.zeros((2, 2)),
        spin=np.zeros(2),
        frame_count=len(measured.t),
        camera=refined.camera,
        appearance=appearance,
        refined=refined,
    )
