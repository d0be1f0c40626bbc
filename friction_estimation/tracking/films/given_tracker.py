"""A tracker on one piece of film: only those of this package take parts of films, and cameras."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

from curling_env.errors import NoThrowError
from curling_env.typing import Progress
from friction_estimation.camera.refinement import RefinedCamera
from friction_estimation.camera.scene import Scene
from friction_estimation.tracking.cutting.pieces import Piece
from friction_estimation.tracking.default import OwnTracker, own_tracker
from friction_estimation.tracking.films.film_track import FilmTrack, TrackingOptions
from friction_estimation.tracking.films.steady_film import SteadyFilm
from friction_estimation.tracking.films.tracked_film import TrackedFilm, summary_of
from friction_estimation.tracking.tracker import Tracker, tracks_in


@dataclass(frozen=True)
class GivenTracker:
    """A tracker, one of this package or another.

    Parameters
    ----------
    function : finds the stones in a film
    """

    function: Tracker

    @cached_property
    def own(self) -> OwnTracker | None:
        """Parts of a tracker of this package; None for another."""
        return own_tracker(self.function)

    @property
    def options(self) -> TrackingOptions | None:
        """Options chosen for a tracker of this package; None for the defaults, and for another."""
        given: Any = self.function
        return given.keywords.get("options") if self.own and isinstance(given, partial) else None

    @property
    def shares_cameras(self) -> bool:
        """Return whether it takes a camera that was solved before, and may correct it."""
        return self.own is not None and (self.options is None or self.options.refine)

    @property
    def identity(self) -> str:
        """A text that differs for different trackers and for different options of one."""
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
        """Track what shows one throw.

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
        if piece.begin is not None and self.own is not None and self.own.judged_of:
            given["judged"] = self.own.judged_of(piece.path)
        found = self.function(sampled or piece.film, scene, progress=progress, **given)  # pyright: ignore[reportArgumentType]
        tracks = tracks_in(found, piece.path)
        about = found if isinstance(found, FilmTrack) else None
        if piece.begin is not None and self.own is not None and (why := self.own.moved(tracks[0])):
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
