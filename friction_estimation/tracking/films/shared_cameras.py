"""Shared camera of the films of a scene: solved once, kept, and checked.

Lens, pose and height are solved from the first films of a scene together and written beside the
scene when a throw is tracked with them. Later films use them at once. In every film the paint must
agree with the camera; otherwise the tripod has moved, and the camera is solved again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.errors import CurlingError, InputError
from curling_env.infrastructure.files.reading import read_json
from curling_env.infrastructure.files.schema import FileFormat
from curling_env.infrastructure.files.storage import write_json
from curling_env.infrastructure.files.writing import fitted, note_rewritten
from curling_env.typing import Progress, no_progress
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import FreeLens, Lens
from friction_estimation.camera.refined import RefinedCamera
from friction_estimation.camera.refinement import displacement, refine_again
from friction_estimation.camera.scene import Scene
from friction_estimation.camera.tuning import STONE_HEIGHT_SIGMA
from friction_estimation.film.stabilisation import STILL_PX
from friction_estimation.film.video import Film
from friction_estimation.tracking import tuning
from friction_estimation.tracking.built_in import find_thrown
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.films.film_track import FilmTrack
from friction_estimation.tracking.films.pieces import Piece
from friction_estimation.tracking.films.steady_film import SteadyFilm, empty_ice, refined_by_paint
from friction_estimation.tracking.measuring.looks import SeenStone, with_focal

FORMAT = FileFormat(name="curling-camera/1", what="a solved camera")
SOLVER = 4
"""Version of the solver: cameras solved by earlier ones are solved again."""


@dataclass(eq=False)
class SharedCameras:
    """Cameras of scenes.

    Parameters
    ----------
    keep : whether they are read from and written to files beside the scenes
    """

    keep: bool = False
    _known: dict[str, RefinedCamera | None] = field(default_factory=dict)
    _unkept: set[str] = field(default_factory=set)
    _sampled: SteadyFilm | None = None

    def of(
        self,
        scene: Scene,
        pieces: Sequence[Piece],
        others: Sequence[Path],
        progress: Progress,
    ) -> RefinedCamera | None:
        """Return the camera of a scene, solved from its first films if it is unknown.

        Parameters
        ----------
        pieces : what is tracked next
        others : films of the same scene that follow
        progress : called while the camera is solved

        Returns
        -------
        None where its films do not show the paint: each film is then left to itself
        """
        films = [piece.film for piece in pieces if isinstance(piece.film, Film)]
        if not films:
            return None
        key = self._key(scene, films[0].size)
        if key not in self._known:
            kept = self._read(scene, key)
            self._known[key] = kept or self._solved(scene, films, others, progress)
            if kept is None:
                self._unkept.add(key)
        return self._known[key]

    def sampled(self, piece: Piece) -> SteadyFilm | None:
        """Return a piece's film, once, if it was sampled just now to solve its camera."""
        sampled, self._sampled = self._sampled, None
        return sampled if sampled is not None and sampled.film is piece.film else None

    def note(self, scene: Scene, found: FilmTrack) -> None:
        """Continue with the camera of a film in which it has moved, and keep it."""
        if found.moved_px and found.refined.measured:
            key = self._key(scene, found.camera.size)
            self._known[key] = found.refined
            self._unkept.add(key)
        self.keep_of(scene, found.camera.size)

    def keep_of(self, scene: Scene, size: tuple[int, int]) -> None:
        """Write the camera of a scene beside it, once a throw was tracked with it.

        Parameters
        ----------
        size : width and height of its films [px]
        """
        key = self._key(scene, size)
        if key in self._unkept:
            self._unkept.discard(key)
            self._write(scene, key)

    def _solved(
        self,
        scene: Scene,
        films: list[Film],
        others: Sequence[Path],
        progress: Progress,
    ) -> RefinedCamera | None:
        for path in others:
            if len(films) >= tuning.SOLVING_FILMS:
                break
            try:
                film = Film.open(path, scene.fps)
            except InputError:
                continue  # it is reported when this film's turn comes
            if film.size == films[0].size and film.duration <= tuning.WINDOW:
                films.append(film)

        def sampled(film: SteadyFilm) -> None:
            if film.film is films[0]:
                self._sampled = film

        films = films[: tuning.SOLVING_FILMS]
        return solve_camera(films, scene, sampled=sampled, progress=progress)

    def _key(self, scene: Scene, size: tuple[int, int]) -> str:
        """Text that identifies the scene, the size of pictures, and the version of the solver."""
        seen = asdict(replace(scene, source=None, fps=None))
        made_from = {**seen, "size": size, "solver": SOLVER}
        text = json.dumps(
            made_from, sort_keys=True, default=lambda value: np.asarray(value).tolist()
        )
        return hashlib.sha256(text.encode()).hexdigest()

    def _read(self, scene: Scene, key: str) -> RefinedCamera | None:
        path = camera_beside(scene)
        if not self.keep or path is None or not path.exists():
            return None
        note_rewritten(path)  # it may be of another scene, or of a tripod that has moved
        try:
            document = FORMAT.accept(read_json(path))
            return camera_from(document) if document["scene"] == key else None
        except (CurlingError, KeyError, TypeError, ValueError):
            return None  # it is solved and written again

    def _write(self, scene: Scene, key: str) -> None:
        path, camera = camera_beside(scene), self._known[key]
        if not self.keep or path is None or camera is None or not _may_replace(path):
            return
        try:
            write_json(path, {"format": FORMAT.name, "scene": key, **camera_document(camera)})
        except CurlingError:
            return  # a read-only folder is not an error


def solve_camera(
    films: Sequence[Film],
    scene: Scene,
    *,
    sampled: Callable[[SteadyFilm], object] = lambda film: None,
    progress: Progress = no_progress,
) -> RefinedCamera | None:
    """Solve the camera of several films from all of them together.

    Parameters
    ----------
    films : of one camera that does not move, a throw each; those that it does not fit are dropped
    scene : its view of the sheet
    sampled : called with each film once its frames are sampled, which takes a while
    progress : called with the number of films done and that of all

    Returns
    -------
    None where the first film does not show the paint, or no film is fit to be used

    Raises
    ------
    InputError : points that do not fit the films
    """
    label, count = f"solve the camera of {films[0].path.name}", len(films) + 1
    seen: list[tuple[SteadyFilm, Background]] = []
    refined: RefinedCamera | None = None
    for k, film in enumerate(films):
        progress(label, k, count)
        try:
            steady = SteadyFilm(film)
            sampled(steady)
            background = empty_ice(steady, scene)
        except InputError:
            continue  # it is reported when this film's turn comes
        if refined is None:
            refined = refined_by_paint(steady, scene, background, True)
            if not refined.measured:
                return None
        elif (
            background.image.shape != seen[0][1].image.shape
            or displacement(refined, scene, background.image, background.origin_px) > STILL_PX
        ):
            continue
        seen.append((steady, background))
    if refined is None:
        return None
    progress(label, len(films), count)
    if len(seen) > 1:
        image = np.asarray(
            np.mean([background.image for _, background in seen], axis=0), dtype=np.float32
        )
        refined = refine_again(refined, scene, image, seen[0][1].origin_px)
    if refined.log_focal_sigma > STONE_HEIGHT_SIGMA:
        stones: list[SeenStone] = []
        for steady, background in seen:
            with suppress(InputError):
                stones.append(find_thrown(steady, scene, refined.camera, background))
        refined = with_focal(refined, scene, stones)
    progress(label, count, count)
    return refined


def camera_beside(scene: Scene) -> Path | None:
    """Return the path of a scene's solved camera: `end.solved.json` beside `end.scene.json`."""
    if scene.source is None:
        return None
    path = Path(scene.source)
    name = path.name.removesuffix(".json").removesuffix(".scene")
    return path.with_name(fitted(name, ".solved.json"))


def _may_replace(path: Path) -> bool:
    """Return whether a path has no file yet, or a solved camera."""
    if not path.exists():
        return True
    try:
        FORMAT.accept(read_json(path))
    except CurlingError:
        return False
    return True


def camera_document(refined: RefinedCamera) -> dict[str, Any]:
    """Return a solved camera for JSON, to the last bit."""
    document: dict[str, Any] = {
        **_camera_values(refined.camera),
        "measured": refined.measured,
        "rms_px": refined.rms_px,
        "misfit": refined.misfit,
        "covariance": refined.covariance.tolist(),
        "depth_sigma": refined.depth_sigma,
        "lens": asdict(refined.lens),
    }
    if refined.farther is not None:
        document["farther"] = _camera_values(refined.farther)
    return document


def camera_from(document: dict[str, Any]) -> RefinedCamera:
    """Return the camera of a document of `camera_document`.

    Raises
    ------
    KeyError, TypeError, ValueError : something else
    """
    flags = {flag.name: bool(document["lens"][flag.name]) for flag in fields(FreeLens)}
    farther = document.get("farther")
    covariance = np.array(document["covariance"], dtype=np.float64)
    lens = FreeLens(**flags)
    if covariance.shape != (6 + lens.count,) * 2:
        raise ValueError("covariance of another lens")
    return RefinedCamera(
        camera=_camera(document),
        measured=int(document["measured"]),
        rms_px=float(document["rms_px"]),
        misfit=float(document["misfit"]),
        covariance=covariance,
        depth_sigma=float(document.get("depth_sigma", 0.0)),  # earlier versions had none
        lens=lens,
        farther=None if farther is None else _camera(farther),
    )


def _camera_values(camera: Camera) -> dict[str, Any]:
    return {
        "image_size": list(camera.size),
        "camera_matrix": camera.lens.matrix.tolist(),
        "distortion": camera.lens.distortion.tolist(),
        "rotation": camera.rotation.tolist(),
        "translation": camera.translation.tolist(),
    }


def _camera(document: dict[str, Any]) -> Camera:
    """Return the camera itself; a file may contain anything.

    Raises
    ------
    KeyError, TypeError, ValueError : no camera
    """
    rotation = np.array(document["rotation"], dtype=np.float64).reshape(3, 3)
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6):
        raise ValueError("no rotation")
    width, height = document["image_size"]
    lens = Lens(
        matrix=np.array(document["camera_matrix"], dtype=np.float64).reshape(3, 3),
        distortion=np.array(document["distortion"], dtype=np.float64).reshape(5),
        size=(int(width), int(height)),
    )
    return Camera(
        lens=lens,
        rotation=rotation,
        translation=np.array(document["translation"], dtype=np.float64).reshape(3),
    )
