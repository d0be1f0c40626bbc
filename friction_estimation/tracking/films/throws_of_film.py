"""Throws of one film: cut, and tracked one after the other; kept results are read."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from curling_env.errors import InputError
from curling_env.typing import Progress
from friction_estimation.camera.refinement import RefinedCamera
from friction_estimation.camera.scene import Scene
from friction_estimation.film.stabilisation import CameraMovesError
from friction_estimation.film.video import Film
from friction_estimation.tracking.films.given_tracker import GivenTracker
from friction_estimation.tracking.films.pieces import Piece, cut
from friction_estimation.tracking.films.resume import Checkpoints, digest
from friction_estimation.tracking.films.shared_cameras import SharedCameras, camera_document
from friction_estimation.tracking.films.tracked_film import TrackedFilm


@dataclass(kw_only=True, eq=False)
class ThrowTracker:
    """Tracker of the throws of films, numbered in order.

    Parameters
    ----------
    tracker : finds the stones in a throw
    cameras : what is known of the cameras of scenes
    checkpoints : the tracks of an interrupted call, and where those of this one are kept
    always_track : number of first throws that are tracked even if checkpoints hold their tracks
    several_films : whether there are several; the throw of a single film is not kept
    left_out : called with each dropped part of a film, and the reason
    progress : called with the number of frames done and the expected number of all
    """

    tracker: GivenTracker
    cameras: SharedCameras
    checkpoints: Checkpoints | None
    always_track: int
    several_films: bool
    left_out: Callable[[str], object]
    progress: Progress
    _done: int = 0

    def throws_of(
        self, film: Path, scene: Scene, *, like: Sequence[Path] = (), throw: int | None = None
    ) -> Generator[TrackedFilm, None, InputError | None]:
        """Track the throws of a film, in order.

        Parameters
        ----------
        like : films of the same scene that follow
        throw : number of its only throw; None to cut the film into its throws

        Returns
        -------
        None; or, if no part of the film is a throw, the error of the first; all were reported

        Raises
        ------
        InputError : a film without a throw, or an error of the tracker
        """
        pieces = [Piece.whole(film)] if throw is not None else self._pieces(film, scene)
        camera = self._camera_of(scene, pieces, like)
        refused: list[InputError] = []
        for piece in pieces:
            key = self._key(piece, scene, camera)
            one = self._kept(key, piece)
            if one is None:
                try:
                    one = self._track(piece, scene, camera)
                except InputError as error:
                    if piece.begin is None:
                        raise
                    moves = isinstance(error, CameraMovesError)
                    known = moves and any(isinstance(k, CameraMovesError) for k in refused)
                    refused.append(without_context(error))
                    if not known:  # reported once
                        self.left_out(f"{piece.path.name}, {piece.name}: {error.problem}")
                    continue
                self._keep(one, key, scene, even_alone=piece.begin is not None)
            yield self._next(one, piece, scene, throw)
        return refused[0] if len(refused) == len(pieces) else None

    def _track(self, piece: Piece, scene: Scene, camera: RefinedCamera | None) -> TrackedFilm:
        sampled = self.cameras.sampled(piece)
        return self.tracker.track(piece, scene, camera, self.progress, sampled=sampled)

    def _pieces(self, film: Path, scene: Scene) -> list[Piece]:
        """Return the throws of a film, or the whole film if it shows one throw only."""
        if not self.tracker.is_built_in:
            return [Piece.whole(film)]
        options = self.tracker.options
        opened = Film.open(film, scene.fps, None if options is None else options.slow)
        return cut(
            opened,
            scene,
            left_out=lambda why: self.left_out(f"{film.name}, {why}"),
            progress=self.progress,
        )

    def _camera_of(
        self, scene: Scene, pieces: Sequence[Piece], like: Sequence[Path]
    ) -> RefinedCamera | None:
        """Return the camera shared by all films of the scene; None if each is solved separately."""
        if not self.tracker.shares_cameras:
            return None
        return self.cameras.of(scene, pieces, like, self.progress)

    def _key(self, piece: Piece, scene: Scene, camera: RefinedCamera | None) -> str:
        """Return a digest of everything that determines the tracks of a piece."""
        if self.checkpoints is None:
            return ""
        return digest(
            piece.path,
            tracker=self.tracker.identity,
            scene=asdict(replace(scene, source=None)),
            piece=piece.key,
            camera=None if camera is None else camera_document(camera),
        )

    def _kept(self, key: str, piece: Piece) -> TrackedFilm | None:
        """Return the kept tracks of a piece; None without any."""
        if self.checkpoints is None or self._done < self.always_track:
            return None
        kept = self.checkpoints.load(key)
        if kept is None:
            return None
        tracks, summary = kept
        return TrackedFilm(film=piece.path, tracks=tuple(tracks), summary=summary, resumed=True)

    def _keep(self, one: TrackedFilm, key: str, scene: Scene, *, even_alone: bool) -> None:
        """Keep the tracks, and the camera that was used."""
        if one.found is not None:
            self.cameras.note(scene, one.found)
        if self.checkpoints is not None and (even_alone or self.several_films):
            self.checkpoints.save(key, one.tracks, one.summary)

    def _next(
        self, one: TrackedFilm, piece: Piece, scene: Scene, throw: int | None = None
    ) -> TrackedFilm:
        """Number the next throw."""
        number = self._done if throw is None else throw
        self._done += 1
        return replace(one.numbered(number, piece), scene=scene)


def without_context(error: InputError) -> InputError:
    """Return an error without its context, which has the pictures of a dropped throw."""
    error.__cause__ = error.__context__ = None
    return error.with_traceback(None)
