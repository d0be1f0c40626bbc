"""Warnings about the tracks of a film, in words, and the larger errors that they mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.typing import Floats, Image
from friction_estimation.appearance import Appearance, StoneFit
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import numbers
from friction_estimation.tracking.association.finding import FilmStones
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.films.film_track import FilmTrack
from friction_estimation.tracking.measuring.follower import Follower
from friction_estimation.tracking.measuring.others import (
    OtherStone,
    RestingStone,
    measured_at_rest,
)
from friction_estimation.tracking.smoothing.losses import left_behind, sudden_loss
from friction_estimation.tracking.smoothing.scatter import (
    Scattered,
    scatter_sigma,
    scattered,
    without_wild,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Scatter:
    """Stretches in which the places of the stones scatter as those of no stone do.

    Parameters
    ----------
    thrown : those of the thrown stone
    hit : those of each stone that was hit
    """

    thrown: Sequence[Scattered]
    hit: Sequence[Sequence[Scattered]]


def without_scatter(thrown: Follower, hit: Sequence[Follower], camera: Camera) -> Scatter:
    """Drop measurements in stretches that say nothing; returns all stretches that scatter."""
    found: list[Sequence[Scattered]] = []
    for one in (thrown, *hit):
        measured = one.measured
        t = np.array(measured.t)
        height = one.appearance.model.height / 2
        stretches = scattered(t, measured.fits, camera, height)
        measured.fits = _without_islands(t, without_wild(t, measured.fits, stretches))
        found.append(stretches)
    return Scatter(thrown=found[0], hit=found[1:])


def _without_islands(t: Floats, fits: Sequence[StoneFit | None]) -> list[StoneFit | None]:
    """The measurements without the few that a long gap parts from all others: paint, or a shoe."""
    seen = np.array([k for k, fit in enumerate(fits) if fit is not None], dtype=np.int64)
    apart = np.flatnonzero(np.diff(t[seen]) > numbers.ISLAND_GAP) + 1
    kept = [part for part in np.split(seen, apart) if len(part) >= numbers.MIN_FITS]
    few = set(seen.tolist()) - {k for part in kept for k in part.tolist()} if kept else set[int]()
    return [None if k in few else fit for k, fit in enumerate(fits)]


def arrived(
    stones: FilmStones,
    sample: Sequence[tuple[float, Image]],
    ice: Background,
    camera: Camera,
    look: Appearance,
) -> list[Floats]:
    """Places (2,) at which stones lie when the film ends that moved before [m].

    Parameters
    ----------
    stones : all that the sampled frames show
    sample : times [s] and frames
    ice : the ice without stones that leave
    camera : the film's camera
    look : of the thrown stone, whose shape others share
    """
    at_last = sample[-numbers.END_FRAMES :]
    rests = [RestingStone(xy=xy, until=np.inf) for xy in stones.arrived]
    found = [measured_at_rest(one, at_last, ice, camera, look, ()) for one in rests]
    return [one.fit.xy for one in found if one is not None]


def with_warnings(
    found: FilmTrack,
    thrown: Follower,
    hit: Sequence[Follower],
    others: Sequence[OtherStone],
    scatter: Scatter,
    came: Sequence[Floats],
) -> FilmTrack:
    """The tracks with what should be looked at in the film, and with the errors that it means.

    Parameters
    ----------
    found : the tracks of all stones
    thrown, hit : their measurements
    others : the stones that rested at first
    scatter : where places scatter
    came : where stones lie at the end that moved before, each (2,) [m]
    """
    camera = found.camera
    measured = thrown.measured
    t, height = np.array(measured.t), thrown.appearance.model.height / 2
    said = [
        scatter_in_words(one)
        for one in scatter.thrown
        if one.is_wild
        or (
            one.last - one.first > numbers.SCATTER_REPORTED
            and not any(one.first - 1 < c < one.last + 1 for c in found.contacts)
        )
    ]
    behind = left_behind(t, measured.fits, camera, height, scatter.thrown)
    if behind is not None and not found.contacts:
        said.append(
            f"from {behind.since:.1f} s on it slows down more than ice slows a stone: the "
            "track may have stayed behind"
        )
    when = sudden_loss(t, measured.fits, camera, height, found.contacts)
    if when is not None:
        said.append(
            f"at {when:.1f} s it loses speed as if it hit a stone, and none is found there: from "
            "then on the track may be that of another stone"
        )
    followed = {id(one.path): one.measured.seen for one in hit}
    said += [
        f"the stone that lay at {place_in_words(one.fit.xy)} left unseen and has no track"
        for one in others
        if np.isfinite(one.rests.until) and followed.get(id(one.rests.path), 0) < numbers.MIN_FITS
    ]
    lay = {id(one.rests.path): one.fit.xy for one in others}
    said += [
        f"the stone that lay at {place_in_words(lay[id(one.path)])}: {scatter_in_words(part)}"
        for one, stretches in zip(hit, scatter.hit, strict=True)
        for part in stretches
        if part.is_wild
    ]
    ends = [one.xy[-1] for one in found.trajectories]
    said += [
        f"a stone lies at {place_in_words(xy)} at the end, and no track leads there"
        for xy in came
        if all(np.hypot(*(xy - end)) > 2 * numbers.SAME_PLACE for end in ends)
    ]
    track = found.trajectory
    doubt = scatter_sigma(track.t, scatter.thrown)
    if behind is not None:
        doubt = np.hypot(doubt, behind.by(track.t, track.xy))
    track = replace(track, sigma_xy=np.hypot(track.sigma_xy, doubt))
    return replace(found, trajectory=track, unexplained=tuple(said))


def scatter_in_words(one: Scattered) -> str:
    said = (
        f"from {one.first:.1f} to {one.last:.1f} s its places scatter by {one.by:.2f} m: something "
        "beside it may have been taken for it"
    )
    return f"{said}, and they are left out" if one.is_wild else said


def place_in_words(xy: Floats) -> str:
    return f"({xy[0]:.2f}, {xy[1]:.2f}) m"
