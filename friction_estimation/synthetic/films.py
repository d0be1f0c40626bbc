"""Writer of rendered films, with the true paths of their stones next to them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import Ice, save_ice
from curling_env.infrastructure.files.schema import FileFormat
from curling_env.infrastructure.files.storage import write_json, write_table
from curling_env.infrastructure.files.writing import check_writable, make_directory, together
from curling_env.physics.session import slides_in_turn
from curling_env.sheet import PAPER_SHEET, RULE_BOOK_STONE, Sheet, Stone
from curling_env.throw import Release
from curling_env.trajectory import Trajectory
from curling_env.typing import Image, Progress, no_progress, with_progress
from friction_estimation.camera.scene import save_scene
from friction_estimation.film.writer import film_writer
from friction_estimation.synthetic.cameras import scene_of
from friction_estimation.synthetic.film_spec import FilmSpec, on_film
from friction_estimation.synthetic.renderer import FilmRenderer
from friction_estimation.synthetic.stone_drawing import StoneOnIce

TRUTH_FORMAT = FileFormat(name="curling-truth/1", what="the truth of a film")
FILM_QUALITY = 18.0
"""Constant rate factor of rendered films: at 1080p 10 to 20 Mbit/s, as of phones."""
FILM_PRESET = "ultrafast"
"""Little work for each picture, as in a camera: half the time of the writer's own preset, at the
same error of a pixel, in a file larger by a third.
"""


def write_film(path: str | Path, pictures: Iterable[Image], fps: float) -> int:
    """Write frames to a film, completely or not at all.

    Returns
    -------
    number of frames

    Raises
    ------
    OutputError : the file cannot be written
    """
    pictures = iter(pictures)
    first = next(pictures, None)
    if first is None:
        raise InputError("a film needs at least one picture")
    count = 0
    size = (first.shape[1], first.shape[0])
    # With more threads the film would differ between machines.
    coder = film_writer(path, size, fps, quality=FILM_QUALITY, preset=FILM_PRESET, threads=1)
    with coder as writer:
        for picture in chain([first], pictures):
            writer.write(picture)
            count += 1
    return count


def render_film(
    path: str | Path,
    trajectory: Trajectory,
    spec: FilmSpec,
    *,
    sheet: Sheet = PAPER_SHEET,
    stone: Stone = RULE_BOOK_STONE,
    resting: Sequence[StoneOnIce] = (),
    progress: Progress = no_progress,
) -> Trajectory:
    """Film one throw, and return the true place of the stone in every frame."""
    renderer = FilmRenderer(spec, sheet=sheet, stone=stone, resting=resting)
    return _render(renderer, Path(path), trajectory, progress)


def _render(
    renderer: FilmRenderer, path: Path, trajectory: Trajectory, progress: Progress
) -> Trajectory:
    truth = on_film(trajectory, renderer.spec)
    pictures = renderer.frames(trajectory, seed=trajectory.throw)
    write_film(path, with_progress(pictures, path.name, progress, len(truth)), renderer.spec.fps)
    return truth


def film_throws(
    directory: Path,
    ice: Ice,
    releases: Sequence[Release],
    spec: FilmSpec,
    *,
    ice_name: str = "",
    progress: Progress = no_progress,
) -> list[Path]:
    """Film throws made one after the other on an ice, and write the ice next to the films.

    Parameters
    ----------
    directory : an existing folder for the films; see `render_films`
    ice, ice_name : the ice, and its name or file for the record
    releases : the throws, numbered from 0
    spec : camera, light and people
    progress : called with the number of frames done

    Raises
    ------
    InputError : a stone that starts off the ice or never stops
    OutputError : a film of the user would be replaced
    """
    numbered = [replace(release, throw=k) for k, release in enumerate(releases)]
    # Four samples a frame: the cubic between them is then exact to a micrometre.
    thrown = [run.trajectory for run in slides_in_turn(ice, numbered, fps=4 * spec.fps)]
    for throw in range(len(thrown)):
        check_writable(directory / f"{spec.name}-{throw}.mp4", kinds=("made film",))
    with together():
        films = render_films(
            directory,
            [trajectory for trajectory in thrown if trajectory is not None],
            spec,
            sheet=ice.sheet,
            stone=ice.stone,
            notes={"mu": float(ice.friction.mu.mean()), "ice": ice_name},
            progress=progress,
        )
        save_ice(ice, directory / f"{spec.name}.ice.json")
    return films


def render_films(
    directory: str | Path,
    trajectories: Sequence[Trajectory],
    spec: FilmSpec,
    *,
    sheet: Sheet = PAPER_SHEET,
    stone: Stone = RULE_BOOK_STONE,
    resting: Sequence[StoneOnIce] = (),
    name: str | None = None,
    notes: dict[str, Any] | None = None,
    progress: Progress = no_progress,
) -> list[Path]:
    """Film throws with one camera, and write the scene and the true paths next to the films.

    Writes `NAME-K.mp4` and `NAME-K.truth.csv` (t, x, y, theta of every frame) for every throw K,
    `NAME.scene.json` as marked by a user, and `NAME.truth.json` with the camera, the stone's
    outline and the times of release and rest.

    Parameters
    ----------
    directory : folder for the files; it is created if it does not exist
    trajectories : one for each film, sheet frame; the first sample is the release
    spec : specification of the films
    sheet, stone : the ice and the kind of stone
    resting : resting stones in every film
    name : name of the files; None takes that of the camera
    notes : further entries of `NAME.truth.json`, such as the friction
    progress : called after every frame

    Returns
    -------
    paths of the films

    Raises
    ------
    InputError : there are no throws
    OutputError : a file cannot be written
    """
    if not trajectories:
        raise InputError("no throws to film")
    folder = make_directory(directory)
    name = name or spec.name
    renderer = FilmRenderer(spec, sheet=sheet, stone=stone, resting=resting)
    clicks = np.random.default_rng([spec.seed, 1])
    scene = scene_of(renderer.camera, sheet=sheet, stone=stone, click_px=spec.click_px, rng=clicks)
    films: list[Path] = []
    throws: list[dict[str, Any]] = []
    for k, trajectory in enumerate(trajectories):
        film = folder / f"{name}-{k}.mp4"
        truth = _render(renderer, film, trajectory, progress)
        x, y = truth.xy.T
        columns = {"t": truth.t, "x": x, "y": y, "theta": truth.theta}
        rounded = {column: np.round(values, 6) for column, values in columns.items()}
        write_table(folder / f"{name}-{k}.truth.csv", rounded)
        films.append(film)
        throws.append(
            {
                "film": film.name,
                "throw": trajectory.throw,
                "released_at_s": spec.lead_in,
                "rested_at_s": spec.lead_in + trajectory.duration,
                "rest": [float(value) for value in trajectory.xy[-1]],
            }
        )
    with together():
        save_scene(scene, folder / f"{name}.scene.json")
        write_json(folder / f"{name}.truth.json", _truth(renderer, throws, notes or {}))
    return films


def _truth(
    renderer: FilmRenderer, throws: list[dict[str, Any]], notes: dict[str, Any]
) -> dict[str, Any]:
    spec, camera = renderer.spec, renderer.camera
    return {
        "format": TRUTH_FORMAT.name,
        **notes,
        "fps": spec.fps,
        "exposure_s": spec.exposure,
        "noise": spec.noise,
        "people": spec.people,
        "seed": spec.seed,
        "camera": {
            "size": list(camera.size),
            "position": camera.position.tolist(),
            "matrix": camera.lens.matrix.tolist(),
            "distortion": camera.lens.distortion.tolist(),
            "rotation": camera.rotation.tolist(),
            "translation": camera.translation.tolist(),
        },
        "stone": {
            "radius": renderer.shape.radius,
            "height": renderer.shape.height,
            "outline": renderer.shape.outline.tolist(),
        },
        "resting": [[stone.x, stone.y, stone.theta] for stone in renderer.resting],
        "throws": throws,
    }
