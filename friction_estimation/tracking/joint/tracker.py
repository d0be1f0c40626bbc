"""The joint tracker, chosen as ``friction_estimation.tracking.joint.tracker:track``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from curling_env.errors import InputError, NoThrowError
from curling_env.sheet import Sheet
from curling_env.typing import Progress, no_progress, with_progress
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.scene import Scene
from friction_estimation.film.video import Film
from friction_estimation.tracking.films.film_track import FilmTrack, TrackingOptions
from friction_estimation.tracking.films.steady_film import SteadyFilm, empty_ice, refined_by_paint
from friction_estimation.tracking.joint import numbers
from friction_estimation.tracking.joint.assembling import assemble_all
from friction_estimation.tracking.joint.detections import StoneFinder
from friction_estimation.tracking.joint.finder import NetworkFinder
from friction_estimation.tracking.joint.finding import find_stones
from friction_estimation.tracking.joint.looks import heading_of, learnt, left_open, with_focal
from friction_estimation.tracking.joint.measuring import Follower, follow, follower_of
from friction_estimation.tracking.joint.others import bare_ice, known_others

FinderFor = Callable[[Camera, Sheet, StoneModel], StoneFinder]
"""Makes what finds stones in the pictures of a camera."""


def track(
    film: Path | Film | SteadyFilm,
    scene: Scene,
    /,
    *,
    options: TrackingOptions | None = None,
    finder: FinderFor | None = NetworkFinder,
    progress: Progress = no_progress,
) -> FilmTrack:
    """Track the stones of one film.

    Parameters
    ----------
    film : path of the film, or the film itself
    scene : its camera's view of the sheet
    options : what may be chosen; the defaults if None
    finder : makes what finds stones in a camera's pictures; None: only what moves is found
    progress : called with the number of frames done and the expected number of all

    Raises
    ------
    InputError : no film, points that do not fit it, a camera that moves, or no thrown stone
    """
    options = options or TrackingOptions()
    if isinstance(film, Path):
        film = Film.open(film, scene.fps)
    steady = film if isinstance(film, SteadyFilm) else SteadyFilm(film)
    background = empty_ice(steady, scene)
    refined = refined_by_paint(steady, scene, background, options.refine)
    model = StoneModel(radius=scene.stone_radius, height=scene.stone_height)
    find = None if finder is None else finder(refined.camera, scene.sheet, model)
    stones = find_stones(steady, scene, refined.camera, background, find)
    stone = stones.thrown
    refined = with_focal(refined, scene, stone)
    look = learnt(stone, refined.camera, steady)
    if look is None:
        raise InputError("the thrown stone is nowhere wholly in the image", source=steady.path)
    appearance, crops = look
    if left_open(crops, appearance) > numbers.MAX_UNEXPLAINED:
        raise NoThrowError(
            "no thrown stone found: what slides along the ice does not look like a stone",
            source=steady.path,
        )
    path = stone.path.seen_by(stone.found_by, refined.camera, stone.model)
    thrown = Follower(
        path=path,
        appearance=appearance,
        heading=heading_of(crops, appearance, path),
        people=stone.people,
    )
    others = known_others(
        stones.resting, steady.sample, background, refined.camera, appearance, path
    )
    hit = [follower_of(one, stone.people) for one in others if one.rests.path is not None]
    gone = [one.rests for one in others if np.isfinite(one.rests.until)]
    ice = background
    if gone:
        paths = [path, *(one.path for one in hit)]
        ice = bare_ice(steady.sample, background, refined.camera, model, gone, paths)
    frames = with_progress(
        steady.frames(), f"track {steady.path.name}", progress, steady.frame_count
    )
    follow(frames, thrown, hit, others, ice, refined.camera, options)
    found = assemble_all(thrown, hit, others, refined)
    if found is None:
        raise InputError("the thrown stone is seen in fewer than five frames", source=steady.path)
    return replace(found, stabiliser=steady.stabiliser)
