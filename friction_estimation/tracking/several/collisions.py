"""Tracks of stones that touched: each goes on as itself, and is smoothed up to a contact and on.

At a contact a stone's velocity jumps. A smoother that knows nothing of it would round the corner
off, so every stretch between contacts is joined by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from curling_env.errors import InputError
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.camera.refinement import RefinedCamera
from friction_estimation.tracking.detection.resting_stones import Bystander
from friction_estimation.tracking.film_track import FilmTrack
from friction_estimation.tracking.path.assembly import MIN_FITTED, Record, join_frames
from friction_estimation.tracking.path.uncertainty import systematic_sigma
from friction_estimation.tracking.several.moving_stones import Mover

LEADING = 8
"""Measurements after a contact whose straight line is followed back to it."""
LOOK_BACK = 0.4
"""A contact is at most so long before a stone was seen to have left [s]."""


def tracks_of(
    movers: Sequence[Mover],
    lying: Sequence[Bystander],
    landmarks: RefinedCamera,
    throw: int,
    path: str | Path,
) -> FilmTrack:
    """The thrown stone's track with those of all others beside it.

    Stones are numbered along the sheet as the thrown one, number 0, comes by. One that is struck
    has rows from the contact on, one that lies untouched a row in the first and in the last frame.
    """
    cuts: list[list[float]] = [[] for _ in movers]
    for k, mover in enumerate(movers):
        if mover.struck is None or mover.lay is None:
            continue
        moment = contact_moment(mover.record, mover.lay.xy, mover.struck)
        cuts[k].append(moment)
        for j, other in enumerate(movers):
            if mover.struck in other.strikes:
                cuts[j].append(moment)
    thrown = join_pieces(movers[0].record, cuts[0], movers[0], landmarks, throw, path)
    if thrown is None:
        raise InputError("the thrown stone is seen in fewer than five frames", source=path)
    forward = np.sign(thrown.trajectory.xy[-1, 1] - thrown.trajectory.xy[0, 1]) or 1.0
    others: list[tuple[float, FilmTrack]] = []
    for mover, moments in zip(movers[1:], cuts[1:], strict=True):
        if mover.lay is None or not moments:
            continue  # seen to have gone, but not how
        kept = _after(mover.record, min(moments))
        joined = join_pieces(kept, sorted(moments)[1:], mover, landmarks, throw, path)
        if joined is not None:
            joined = replace(joined, contacts=tuple(sorted(moments)))
            others.append((forward * float(mover.lay.xy[1]), joined))
    record = movers[0].record
    for stone in lying:
        if stone.stays:
            at_rest = _at_rest(stone, record, landmarks, throw)
            others.append((forward * float(stone.xy[1]), at_rest))
    others.sort(key=lambda item: item[0])
    numbered = [
        replace(other, trajectory=replace(other.trajectory, stone=number))
        for number, (_, other) in enumerate(others, start=1)
    ]
    return replace(thrown, others=tuple(numbered))


def contact_moment(record: Record, lay: Floats, seen: float) -> float:
    """When a stone was struck: its first measurements followed back to where it lay [s].

    Parameters
    ----------
    record : its measurements
    lay : (2,) where it lay [m]
    seen : when it was seen to have left [s]
    """
    after = [
        (t, fit.xy)
        for t, fit in zip(record.t, record.fits, strict=True)
        if fit is not None and t >= seen
    ][:LEADING]
    if len(after) < 3:
        return seen
    t = np.array([moment for moment, _ in after])
    way = np.array([xy for _, xy in after]) - lay
    aim = way[-1] / np.linalg.norm(way[-1])
    at_seen, speed = np.polynomial.polynomial.polyfit(t - seen, way @ aim, 1)
    back = at_seen / max(float(speed), 1e-3)
    return float(seen - np.clip(back, 0.0, LOOK_BACK))


def join_pieces(
    record: Record,
    cuts: Sequence[float],
    mover: Mover,
    landmarks: RefinedCamera,
    throw: int,
    path: str | Path,
) -> FilmTrack | None:
    """One track from the stretches between contacts; None where the stone was hardly seen.

    Parameters
    ----------
    cuts : moments of the contacts [s]
    """
    pieces: list[tuple[int, FilmTrack]] = []
    for first, last in _stretches(record, cuts):
        part = Record(
            t=record.t[first:last],
            fits=record.fits[first:last],
            glimpses=record.glimpses.between(record.t[first], record.t[last - 1] + 1e-9),
            lag_px=record.lag_px,
        )
        if sum(fit is not None for fit in part.fits) >= MIN_FITTED:
            pieces.append((first, join_frames(part, mover.look, landmarks, throw, path)))
    if not pieces:
        return None
    one = pieces[0][1]
    paths = [piece.trajectory for _, piece in pieces]
    trajectory = Trajectory(
        t=np.concatenate([p.t for p in paths]),
        xy=np.concatenate([p.xy for p in paths]),
        theta=_unwrapped([p.theta for p in paths]),
        sigma_xy=np.concatenate([p.sigma_xy for p in paths]),
        sigma_theta=np.concatenate([p.sigma_theta for p in paths]),
        throw=throw,
    )
    return replace(
        one,
        trajectory=trajectory,
        frame=np.concatenate([first + piece.frame for first, piece in pieces]),
        velocity=np.concatenate([piece.velocity for _, piece in pieces]),
        spin=np.concatenate([piece.spin for _, piece in pieces]),
        frame_count=len(record.t),
        contacts=tuple(sorted(cuts)),
    )


def _stretches(record: Record, cuts: Sequence[float]) -> list[tuple[int, int]]:
    """First and past-last index of the frames between contacts."""
    at = np.searchsorted(np.array(record.t), sorted(cuts)).tolist()
    edges = [0, *at, len(record.t)]
    return [(a, b) for a, b in pairwise(edges) if b > a]


def _after(record: Record, moment: float) -> Record:
    """The record with nothing measured before a moment; its frames keep their numbers."""
    fits = [fit if t >= moment else None for t, fit in zip(record.t, record.fits, strict=True)]
    return Record(t=record.t, fits=fits, glimpses=record.glimpses, lag_px=record.lag_px)


def _unwrapped(pieces: Sequence[Floats]) -> Floats:
    """Headings one after the other: a contact turns no stone, and no handle end for end."""
    found: list[Floats] = []
    before = np.nan
    for theta in pieces:
        known = theta[np.isfinite(theta)]
        if len(known) and np.isfinite(before):
            theta = theta + np.pi * np.round((before - known[0]) / np.pi)
        if len(known):
            before = float(theta[np.isfinite(theta)][-1])
        found.append(theta)
    return np.concatenate(found)


def _at_rest(stone: Bystander, record: Record, landmarks: RefinedCamera, throw: int) -> FilmTrack:
    """A stone that nobody touched, in the first and in the last frame."""
    look = stone.posed.look
    xy = np.array([stone.xy, stone.xy])
    common = systematic_sigma(landmarks, xy, look.model.height)
    trajectory = Trajectory(
        t=np.array([record.t[0], record.t[-1]]),
        xy=xy,
        theta=np.full(2, stone.heading),
        sigma_xy=np.hypot(stone.sigma, common),
        throw=throw,
    )
    return FilmTrack(
        trajectory=trajectory,
        frame=np.array([0, len(record.t) - 1]),
        velocity=np.zeros((2, 2)),
        spin=np.zeros(2),
        frame_count=len(record.t),
        camera=landmarks.camera,
        look=look,
        landmarks=landmarks,
    )
