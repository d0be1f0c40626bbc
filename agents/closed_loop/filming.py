"""The demo's films: each throw filmed and tracked, two side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from curling_env.ice import Ice
from curling_env.physics.one_stone.slide import play_bounds, slide
from curling_env.sheet import Sheet, Stone
from curling_env.storage import make_directory
from curling_env.throw import Release
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats

if TYPE_CHECKING:
    from friction_estimation.synthetic import FilmSpec


CAMERA = "gantry"
"""Above the middle of the sheet: the place that measures best."""
FPS = 15.0
"""Frames a second: friction needs long paths, not many frames."""
PEOPLE = False
"""Whether players walk through the picture."""
TRUE_PATH_RATE = 120.0
"""Samples a second of the true path that is filmed."""
AT_REST = 0.01
"""A path that ends slower than this has come to rest [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """One throw to film and track, in a process of its own."""

    film: Path
    scene: Path
    path: Trajectory
    sheet: Sheet
    stone: Stone
    spec: FilmSpec
    overlay: Path | None


@dataclass(frozen=True, kw_only=True)
class Films:
    """What the films gave.

    Parameters
    ----------
    tracks : measured, in order of play; `clock` is the session time of a film's first frame
    errors : (n,) RMS distance of each from the truth [m]
    frames : filmed in all
    size : width and height [px]
    still : picture of a frame with the track; None if there is none
    """

    tracks: list[Trajectory]
    errors: Floats
    frames: int
    size: tuple[int, int]
    still: Path | None


def film_and_track(
    folder: Path,
    ice: Ice,
    releases: Sequence[Release],
    *,
    seed: int,
    fps: float,
    workers: int,
    tell: Callable[[str, float], None],
) -> Films:
    """Film the throws on an ice, and track every film.

    Parameters
    ----------
    folder : gets films/ and overlay.mp4
    ice : the true one; what is returned knows it only through the films
    workers : processes; 1 works in this one

    Raises
    ------
    OutputError : a file cannot be written
    """
    paths: list[Trajectory] = []
    for k, release in enumerate(releases):
        bounds = play_bounds(ice, release.direction)
        path = slide(ice, release, bounds=bounds, fps=TRUE_PATH_RATE, throw=k).trajectory
        assert path is not None  # a rate was given
        paths.append(path)
    return film_paths(
        folder, paths, ice.sheet, ice.stone, seed=seed, fps=fps, workers=workers, tell=tell
    )


def film_paths(
    folder: Path,
    paths: Sequence[Trajectory],
    sheet: Sheet,
    stone: Stone,
    *,
    seed: int,
    fps: float,
    workers: int,
    tell: Callable[[str, float], None],
    frame_size: tuple[int, int] | None = None,
) -> Films:
    """Film stones on their paths, and track every film; see `film_and_track`.

    Parameters
    ----------
    frame_size : width and height [px]; the camera's own by default
    """
    from friction_estimation.camera.scene import save_scene
    from friction_estimation.synthetic import FilmSpec, scene_of

    films = make_directory(folder / "films")
    spec = FilmSpec(camera=CAMERA, size=frame_size, fps=fps, seed=seed, people=PEOPLE)
    scene = films / f"{CAMERA}.scene.json"
    save_scene(scene_of(spec.resolved(), sheet=sheet, stone=stone), scene)
    jobs = [
        Job(
            film=films / f"{CAMERA}-{k}.mp4",
            scene=scene,
            path=path,
            sheet=sheet,
            stone=stone,
            # A stone that leaves the ice is not to be seen halting at its edge.
            spec=spec if _rests(path) else replace(spec, tail=0.0),
            overlay=folder / "overlay.mp4" if k == 0 else None,
        )
        for k, path in enumerate(paths)
    ]
    results: dict[int, tuple[Trajectory, float, int]] = {}

    def finished(k: int, result: tuple[Trajectory, float, int]) -> None:
        results[k] = result
        tell(f"filmed and tracked {len(results)} of {len(jobs)} throws", len(results) / len(jobs))

    tell("filming the first throws", 0.0)
    if workers > 1:
        # Fresh processes: forking one that holds OpenCV's and numba's threads may hang.
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            pending = {pool.submit(_film_and_track, job): k for k, job in enumerate(jobs)}
            for future in as_completed(pending):
                finished(pending[future], future.result())
    else:
        for k, job in enumerate(jobs):
            finished(k, _film_and_track(job))
    ordered = [results[k] for k in range(len(jobs))]
    return Films(
        tracks=[track for track, _, _ in ordered],
        errors=np.array([error for _, error, _ in ordered]),
        frames=sum(frames for _, _, frames in ordered),
        size=spec.resolved().size,
        still=_still(folder / "overlay.mp4", folder / "overlay.png"),
    )


def _film_and_track(job: Job) -> tuple[Trajectory, float, int]:
    """The measured track, its RMS distance from the truth [m], and how many frames there were."""
    import cv2

    from friction_estimation.camera.scene import load_scene
    from friction_estimation.synthetic import render_film
    from friction_estimation.tracking import track_film
    from friction_estimation.tracking.overlay import write_overlay

    cv2.setNumThreads(1)  # one process a core
    truth = render_film(job.film, job.path, job.spec, sheet=job.sheet, stone=job.stone)
    scene = load_scene(job.scene)
    result = track_film(job.film, scene, throw=job.path.throw)
    if job.overlay is not None:
        write_overlay(job.film, scene, result, job.overlay)
    # Times of a film count from its first frame, and that comes before the release.
    track = replace(result.trajectory, clock=truth.clock)
    true_x, true_y = (np.interp(track.t, truth.t, truth.xy[:, k]) for k in range(2))
    error = np.hypot(track.xy[:, 0] - true_x, track.xy[:, 1] - true_y)
    return track, float(np.sqrt(np.mean(error**2))), len(truth)


def _rests(path: Trajectory) -> bool:
    last = np.hypot(*(path.xy[-1] - path.xy[-2])) / (path.t[-1] - path.t[-2])
    return bool(last < AT_REST)


def estimate(tracks: list[Trajectory], law: Ice, *, uniform: bool = False) -> Ice:
    """The ice that the tracks ran on; the effects of `law` are taken as known.

    Parameters
    ----------
    uniform : one friction for all of it instead of a map
    """
    from friction_estimation.inversion import estimate_ice

    return estimate_ice(tracks, start=law, uniform=uniform).ice


def _still(film: Path, picture: Path) -> Path | None:
    """A frame from two thirds into a film, as a PNG."""
    import cv2

    from curling_env.storage import atomic_path

    if not film.exists():
        return None
    reader = cv2.VideoCapture(str(film))
    count = int(reader.get(cv2.CAP_PROP_FRAME_COUNT))
    reader.set(cv2.CAP_PROP_POS_FRAMES, 2 * count // 3)
    read, frame = reader.read()
    reader.release()
    if not read:
        return None
    with atomic_path(picture) as draft:
        cv2.imwrite(str(draft), frame)
    return picture
