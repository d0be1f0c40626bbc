"""Warnings about the tracks of a film, in words, and the corresponding larger errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from curling_env.typing import Floats, Image
from friction_estimation.appearance import Appearance
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.association.finding import FilmStones
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.films.film_track import FilmTrack
from friction_estimation.tracking.measuring.follower import Follower
from friction_estimation.tracking.measuring.others import (
    OtherStone,
    RestingStone,
    measured_at_rest,
)


def arrived(
    stones: FilmStones,
    sample: Sequence[tuple[float, Image]],
    ice: Background,
    camera: Camera,
    look: Appearance,
) -> list[Floats]:
    """Return final resting places (2,) of stones that moved [m].

    Parameters
    ----------
    stones : all that the sampled frames show
    sample : times [s] and frames
    ice : the ice without stones that leave
    camera : the film's camera
    look : of the thrown stone, whose shape others share
    """
    at_last = sample[-tuning.END_FRAMES :]
    rests = [RestingStone(xy=xy, until=np.inf) for xy in stones.arrived]
    found = [measured_at_rest(one, at_last, ice, camera, look, ()) for one in rests]
    return [one.fit.xy for one in found if one is not None]


def with_warnings(
    found: FilmTrack, hit: Sequence[Follower], others: Sequence[OtherStone], came: Sequence[Floats]
) -> FilmTrack:
    """Return the tracks of all stones, with warnings about the film.

    Parameters
    ----------
    found : the tracks of all stones, with warnings about each
    hit : measurements of those that were hit
    others : the stones that rested at first
    came : where stones lie at the end that moved before, each (2,) [m]
    """
    followed = {id(one.path): one.measured.seen for one in hit}
    warnings = [
        f"the stone at {place_in_words(one.fit.xy)} disappeared unseen and has no track"
        for one in others
        if np.isfinite(one.rests.until) and followed.get(id(one.rests.path), 0) < tuning.MIN_FITS
    ]
    warnings += [
        f"the stone that came from {place_in_words(one.trajectory.xy[0])}: {words}"
        for one in found.others
        for words in one.unexplained
    ]
    ends = [one.xy[-1] for one in found.trajectories]
    warnings += [
        f"a stone lies at {place_in_words(xy)} at the end, and no track leads there"
        for xy in came
        if all(np.hypot(*(xy - end)) > 2 * tuning.SAME_PLACE for end in ends)
    ]
    return replace(found, unexplained=(*found.unexplained, *warnings))


def place_in_words(xy: Floats) -> str:
    return f"({xy[0]:.2f}, {xy[1]:.2f}) m"
