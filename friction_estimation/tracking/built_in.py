"""The built-in tracker: from the film of one throw to the tracks of all its stones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from curling_env.errors import InputError, NoThrowError
from curling_env.typing import Progress, no_progress, with_progress
from friction_estimation.appearance import Appearance, Crop, unexplained_share
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.refined import RefinedCamera
from friction_estimation.camera.scene import Scene
from friction_estimation.film.video import Film
from friction_estimation.tracking import tuning
from friction_estimation.tracking.association.finding import find_stones
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.films.film_track import FilmTrack, TrackingOptions
from friction_estimation.tracking.films.steady_film import (
    SteadyFilm,
    camera_of,
    empty_ice,
    scene_mismatch_error,
)
from friction_estimation.tracking.measuring.follower import Follower, follow, follower_of
from friction_estimation.tracking.measuring.looks import (
    SeenStone,
    heading_of,
    learn_look,
    unexplained_by_look,
    with_focal,
)
from friction_estimation.tracking.measuring.others import bare_ice, known_others
from friction_estimation.tracking.smoothing.assembling import assemble_all
from friction_estimation.tracking.smoothing.warnings import arrived, with_warnings


def track_film(
    film: str | Path | Film | SteadyFilm,
    scene: Scene,
    /,
    *,
    throw: int = 0,
    options: TrackingOptions | None = None,
    camera: RefinedCamera | None = None,
    progress: Progress = no_progress,
) -> FilmTrack:
    """Track the thrown stone of one film, and all other stones on the sheet.

    Parameters
    ----------
    film : path of the film, or the film itself, which may be a part of a longer one or be sampled
        already
    scene : its camera's view of the sheet
    throw : number of the throw, for the tracks
    options : what may be chosen; the defaults if None
    camera : the scene's camera, if it was solved before; where the paint is not where it sees it,
        the camera has moved and is solved again for this film
    progress : called with the number of frames done and the expected number of all

    Raises
    ------
    InputError : no film, points that do not fit it, a camera that moves, or no thrown stone
    """
    options = options or TrackingOptions()
    if isinstance(film, str | Path):
        film = Film.open(film, scene.fps, options.slow)
    steady = film if isinstance(film, SteadyFilm) else SteadyFilm(film)
    background = empty_ice(steady, scene)
    refined, moved_px = camera_of(steady, scene, background, camera, options.refine)
    try:
        candidates = find_stones(steady, scene, refined.camera, background)
    except InputError as error:
        if refined.measured or not options.refine:
            raise
        raise scene_mismatch_error(refined, steady.path) from error
    found_by = refined
    refused: list[InputError] = []
    for stones in candidates:
        stone = stones.thrown
        if found_by is not camera:
            refined = with_focal(found_by, scene, [stone])
        look = learn_look(stone, refined.camera, steady)
        if look is not None and _shows_stone(*look, background.strong_grain):
            break
        refused.append(_no_stone(look, steady.path))
    else:
        raise refused[0]
    appearance, crops = look
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
        ice = bare_ice(steady.sample, background, refined.camera, stone.model, gone, paths)
    thrown.correct_path(stone.sample, ice, refined.camera, options, others)
    frames = with_progress(
        steady.frames(), f"track {steady.path.name}", progress, steady.frame_count
    )
    follow(frames, thrown, hit, others, ice, refined.camera, options)
    if not thrown.measured_on_its_way:
        raise _no_stone(appearance, steady.path)
    found = assemble_all(thrown, hit, others, refined)
    if found is None:
        raise InputError("the thrown stone is seen in fewer than five frames", source=steady.path)
    came = arrived(stones, steady.sample, ice, refined.camera, appearance)
    found = with_warnings(found, hit, others, came)
    found = replace(
        found,
        stabiliser=steady.stabiliser,
        moved_px=moved_px,
        unexplained=(*found.unexplained, *steady.remarks),
    )
    return found.numbered(throw)


def find_thrown(
    film: SteadyFilm, scene: Scene, camera: Camera, background: Background
) -> SeenStone:
    """Find the thrown stone of a film in its sampled frames.

    Raises
    ------
    NoThrowError : nothing slides along the ice
    """
    return next(find_stones(film, scene, camera, background)).thrown


def _shows_stone(look: Appearance, crops: Sequence[Crop], grain: float) -> bool:
    """Return whether a look explains the pictures from which it was learnt, as a stone's does."""
    unexplained = min(
        unexplained_share(crops, look, grain), unexplained_by_look(crops, look, grain)
    )
    return unexplained <= tuning.MAX_UNEXPLAINED


def _no_stone(look: object | None, path: Path) -> InputError:
    """Return the reason why a path is not a thrown stone's."""
    if look is None:
        return InputError("the thrown stone is never completely in the picture", source=path)
    return NoThrowError(
        "no thrown stone found: no sliding object looks like a stone",
        source=path,
    )
