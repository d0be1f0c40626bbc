"""A tracker for one piece of film: only the built-in one takes parts of films, and cameras."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

from curling_env.errors import NoThrowError
from curling_env.typing import Progress
from friction_estimation.camera.refinement import RefinedCamera
from friction_estimation.camera.scene import Scene
from friction_estimation.tracking.association.recording import moved
from friction_estimation.tracking.built_in import track_film
from friction_estimation.tracking.films.film_track import FilmTrack, TrackingOptions
from friction_estimation.tracking.films.pieces import Piece
from friction_estimation.tracking.films.steady_film import SteadyFilm
from friction_estimation.tracking.films.tracked_film import TrackedFilm, summary_of
from friction_estimation.tracking.tracker import Tracker, tracks_in


@dataclass(frozen=True)
class GivenTracker:
    """Built-in or other tracker.

    Parameters
    ----------
    function : finds the stones in a film
    """

    function: Tracker

    @property
    def is_built_in(self) -> bool:
        """True for the tracker of this package, with options or without."""
        given: Any = self.function
        return (given.func if isinstance(given, partial) else given) is track_film

    @property
    def options(self) -> TrackingOptions | None:
        """Options chosen for the built-in tracker; None for the defaults, and for another one."""
        given: Any = self.function
        return (
            given.keywords.get("options")
            if self.is_built_in and isinstance(given, partial)
            else None
        )

    @property
    def shares_cameras(self) -> bool:
        """Return whether it accepts a solved camera, and may correct it."""
        return self.is_built_in and (self.options is None or self.options.refine)

    @property
    def identity(self) -> str:
        """Text that identifies a tracker and its options."""
        return _identity(self.function)

    def track(
        self,
        piece: Piece,
        scene: Scene,
        camera: RefinedCamera | None,
        progress: Progress,
        *,
        sampled: SteadyFilm | None = None,
    ) -> TrackedFilm:
        """Track a piece with one throw.

        Parameters
        ----------
        camera : the scene's, if it was solved before
        sampled : the piece's film, if its frames were sampled for that

        Raises
        ------
        NoThrowError : a part of a film in which a stone is carried, pushed or moved, not thrown
        InputError : what the tracker raises, or no tracks
        """
        given: dict[str, Any] = {} if camera is None else {"camera": camera}
        found = self.function(sampled or piece.film, scene, progress=progress, **given)  # pyright: ignore[reportArgumentType]
        tracks = tracks_in(found, piece.path)
        about = found if isinstance(found, FilmTrack) else None
        if piece.begin is not None and self.is_built_in and (why := moved(tracks[0])):
            raise NoThrowError(why, source=piece.path)
        return TrackedFilm(
            film=piece.path,
            tracks=tracks,
            summary=summary_of(about or tracks[0]),
            found=about,
            shown=piece.film,
        )


def _identity(function: Any) -> str:
    if isinstance(function, partial):
        return f"{_identity(function.func)} {function.args!r} {function.keywords!r}"
    return f"{getattr(function, '__module__', '')}:{getattr(function, '__qualname__', function)}"
