"""Throws filmed from above and tracked on the films, several in parallel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from curling_env.ice import Ice
from curling_env.infrastructure.executor import executor
from curling_env.infrastructure.files.writing import atomic_path, make_directory
from curling_env.physics.slides import play_bounds, slide
from curling_env.sheet import Sheet, Stone
from curling_env.throw import Release
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Progress, no_progress, with_progress
from friction_estimation.camera.scene import load_scene, save_scene
from friction_estimation.synthetic import FilmSpec, render_film, scene_of
from friction_estimation.tracking import track_film
from friction_estimation.tracking.overlay.film import write_overlay

CAMERA = "gantry"
"""Camera above the middle of the sheet, the most accurate one."""
FPS = 15.0
"""Frame rate of the films [1/s]; friction needs long paths, not many frames."""


@dataclass(frozen=True, kw_only=True)
class _Job:
    """One throw to film and track, in a separate process."""

    film: Path
    scene: Path
    path: Trajectory
    sheet: Sheet
    stone: Stone
    spec: FilmSpec
    overlay: Path | None


@dataclass(frozen=True, kw_only=True)
class Films:
    """Films of some throws and the tracks from them.

    Parameters
    ----------
    tracks : measured tracks in order of play; `clock` is the session time of a film's first frame
    errors : (n,) RMS distance of each track from the true path [m]
    frames : number of frames in all films
    size : width and height of a frame [px]
    still : picture of a frame with the track drawn into it; None if absent
    """

    tracks: list[Trajectory]
    errors: Floats
    frames: int
    size: tuple[int, int]
    still: Path | None


def film_throws(
    folder: Path,
    ice: Ice,
    releases: Sequence[Release],
    *,
    seed: int,
    fps: float = FPS,
    frame_size: tuple[int, int] | None = None,
    workers: int = 1,
    progress: Progress = no_progress,
) -> Films:
    """Film throws on a known ice and track every film.

    Parameters
    ----------
    folder : directory for films/ and overlay.mp4
    seed : seed of the rendered pictures
    fps : frame rate [1/s]
    frame_size : width and height [px]; the camera's own by default
    workers : number of processes; 1 uses this one
    progress : called after each film

    Raises
    ------
    OutputError : a file cannot be written
    """
    paths: list[Trajectory] = []
    for k, release in enumerate(releases):
        bounds = play_bounds(ice, release.direction)
        path = slide(ice, release, bounds=bounds, fps=120.0, throw=k).trajectory
        assert path is not None  # a rate was requested
        paths.append(path)
    films = make_directory(folder / "films")
    spec = FilmSpec(camera=CAMERA, size=frame_size, fps=fps, seed=seed, people=False)
    scene = films / f"{CAMERA}.scene.json"
    save_scene(scene_of(spec.resolved(), sheet=ice.sheet, stone=ice.stone), scene)
    jobs = [
        _Job(
            film=films / f"{CAMERA}-{k}.mp4",
            scene=scene,
            path=path,
            sheet=ice.sheet,
            stone=ice.stone,
            # A stone that leaves the ice must not be shown stopping at its edge.
            spec=spec if _comes_to_rest(path) else replace(spec, tail=0.0),
            overlay=folder / "overlay.mp4" if k == 0 else None,
        )
        for k, path in enumerate(paths)
    ]
    with executor(workers) as crew:
        done = crew.map(_film_and_track, jobs)
        results = list(with_progress(done, "filming and tracking throws", progress, len(jobs)))
    return Films(
        tracks=[track for track, _, _ in results],
        errors=np.array([error for _, error, _ in results]),
        frames=sum(frames for _, _, frames in results),
        size=spec.resolved().size,
        still=_still(folder / "overlay.mp4", folder / "overlay.png"),
    )


def _film_and_track(job: _Job) -> tuple[Trajectory, float, int]:
    """Return the measured track, its RMS distance from the truth [m], and the number of frames."""
    cv2.setNumThreads(1)  # each process has one core
    truth = render_film(job.film, job.path, job.spec, sheet=job.sheet, stone=job.stone)
    scene = load_scene(job.scene)
    result = track_film(job.film, scene, throw=job.path.throw)
    if job.overlay is not None:
        write_overlay(job.film, scene, result, job.overlay)
    # Times of a film count from its first frame, which is before the release.
    track = replace(result.trajectory, clock=truth.clock)
    true_x, true_y = (np.interp(track.t, truth.t, truth.xy[:, k]) for k in range(2))
    error = np.hypot(track.xy[:, 0] - true_x, track.xy[:, 1] - true_y)
    return track, float(np.sqrt(np.mean(error**2))), len(truth)


def _comes_to_rest(path: Trajectory) -> bool:
    """Return whether a path ends slower than 1 cm/s."""
    last = np.hypot(*(path.xy[-1] - path.xy[-2])) / (path.t[-1] - path.t[-2])
    return bool(last < 0.01)


def _still(film: Path, picture: Path) -> Path | None:
    """Write the frame at two thirds of a film as a PNG; return None if there is no film."""
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
