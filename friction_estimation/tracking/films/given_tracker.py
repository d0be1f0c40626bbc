"""A tracker on one piece of film: only the built-in one takes parts of films, and cameras."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.errors import NoThrowError
from curling_env.trajectory import Trajectory
from curling_env.typing import Progress
from friction_estimation.camera.refinement import RefinedCamera
from friction_estimation.camera.scene import Scene
from friction_estimation.tracking.cutting.pace import slides_freely, stops_before_its_hog_line
from friction_estimation.tracking.cutting.pieces import Piece
from friction_estimation.tracking.detection.thrown_stone import RoughPath
from friction_estimation.tracking.films.film_track import FilmTrack, TrackingOptions
from friction_estimation.tracking.films.steady_film import SteadyFilm
from friction_estimation.tracking.films.tracked_film import TrackedFilm, summary_of
from friction_estimation.tracking.pipeline import track_film
from friction_estimation.tracking.tracker import Tracker, tracks_in


@dataclass(frozen=True)
class GivenTracker:
    """A tracker, the built-in one or another.

    Parameters
    ----------
    function : finds the stones in a film
    """

    function: Tracker

    @property
    def is_built_in(self) -> bool:
        """Whether it is `track_film`, with options or without."""
        return self._plain[0] is track_film

    @property
    def options(self) -> TrackingOptions | None:
        """What was chosen for the built-in one; None for the defaults, and for another."""
        return self._plain[1].get("options") if self.is_built_in else None

    @property
    def shares_cameras(self) -> bool:
        """Whether it takes a camera that was solved before, and may correct it."""
        return self.is_built_in and (self.options is None or self.options.refine)

    @property
    def identity(self) -> str:
        """A text that differs for different trackers and for different options of one."""
        return _identity(self.function)

    @property
    def _plain(self) -> tuple[Any, dict[str, Any]]:
        """The function without the arguments that it was given before, and these."""
        given: Any = self.function
        return (given.func, given.keywords) if isinstance(given, partial) else (given, {})

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
        if piece.begin is not None and self.is_built_in:
            given["judged"] = lambda path: _refuse_what_is_moved(path, piece.path)
        found = self.function(sampled or piece.film, scene, progress=progress, **given)  # pyright: ignore[reportArgumentType]
        tracks = tracks_in(found, piece.path)
        about = found if isinstance(found, FilmTrack) else None
        if piece.begin is not None:
            _refuse_what_is_moved(tracks[0], piece.path)
        return TrackedFilm(
            film=piece.path,
            tracks=tracks,
            summary=summary_of(about or tracks[0]),
            found=about,
            shown=piece.film,
        )


def _refuse_what_is_moved(seen: Trajectory | RoughPath, film: Path) -> None:
    """Refuse what was not thrown: by its track, or already by where it was followed by its look.

    Raises
    ------
    NoThrowError : a stone that is carried, pushed or moved aside
    """
    if isinstance(seen, RoughPath):
        if not seen.measured:
            return
        t, xy = (np.array([getattr(s, name) for s in seen.sightings]) for name in ("t", "xy"))
        seen = Trajectory(t=t, xy=xy)
    if not slides_freely(seen):
        raise NoThrowError(
            "what moves there keeps its pace, as a stone does that is carried or pushed",
            source=film,
        )
    if stops_before_its_hog_line(seen):
        raise NoThrowError(
            "what moves there stops before the hog line of its own end, as no thrown stone does",
            source=film,
        )


def _identity(function: Any) -> str:
    if isinstance(function, partial):
        return f"{_identity(function.func)} {function.args!r} {function.keywords!r}"
    return f"{getattr(function, '__module__', '')}:{getattr(function, '__qualname__', function)}"
