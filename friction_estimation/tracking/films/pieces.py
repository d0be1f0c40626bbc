"""A film cut into its throws, each of which is then tracked as a separate film."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from curling_env.errors import NoThrowError
from curling_env.typing import Progress, no_progress
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.camera.scene import Scene
from friction_estimation.film.stabilisation import stabiliser_for
from friction_estimation.film.video import Film
from friction_estimation.tracking import tuning
from friction_estimation.tracking.association.recording import find_throws

STILL_FRAMES = 25
"""Number of frames in which a film without a throw is checked for a moving camera."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """Film of one throw, or the part of a film that shows it.

    Parameters
    ----------
    path : the film's file
    film : the film to track; the path of a whole film that is not opened yet
    begin, end : beginning and end of the part in the film [s]; None for all of it
    """

    path: Path
    film: Film | Path
    begin: float | None = None
    end: float | None = None

    @classmethod
    def whole(cls, film: Film | Path) -> Piece:
        """All of a film."""
        return cls(path=film.path if isinstance(film, Film) else film, film=film)

    @property
    def name(self) -> str:
        """Beginning and end, in words."""
        if self.begin is None or self.end is None:
            return "all of it"
        return f"{minutes(self.begin)} to {minutes(self.end)}"

    @property
    def key(self) -> list[float] | None:
        """Key that distinguishes it from other parts of the film, for JSON."""
        if not isinstance(self.film, Film) or (self.film.whole and not self.film.first):
            return None
        return [self.film.first, self.film.frame_count]

    @property
    def summary(self) -> dict[str, Any]:
        """Position in the film, for JSON."""
        return {} if self.begin is None else {"clock": round(self.begin, 3)}


def cut(
    film: Film,
    scene: Scene,
    *,
    left_out: Callable[[str], object] = lambda why: None,
    progress: Progress = no_progress,
) -> list[Piece]:
    """Return the throws of a film in order; the whole film if it is short and shows at most one.

    Parameters
    ----------
    film : of one throw or of many
    scene : its camera's view of the sheet
    left_out : called with each skipped part of a film that is cut, and the reason
    progress : called with the number of frames passed and the expected number of all

    Raises
    ------
    InputError : points that do not fit the film, or a long film in which nothing is thrown
    """
    back: list[tuple[float, float]] = []
    throws = find_throws(
        film,
        scene,
        camera_from_scene(scene, film.size),
        slid_back=lambda *when: back.append(when),
        progress=progress,
    )
    if len(throws) <= 1 and film.duration <= tuning.WINDOW:
        return [Piece.whole(film)]
    if not throws:
        stabiliser_for(film.sample(STILL_FRAMES), film.path)  # refuses a camera that moves
        raise NoThrowError(
            f"no throw found in {minutes(film.duration)} of film: nothing slides along the ice as "
            "a stone does",
            source=film.path,
        )
    for begin, end in back:
        when = f"{minutes(begin)} to {minutes(end)}"
        left_out(f"{when}: slid back from where the stone before it came to rest")
    pieces: list[Piece] = []
    for throw in throws:
        part = film.part(throw.begin, throw.end)
        begin = film.begin_of(part)
        pieces.append(Piece(path=film.path, film=part, begin=begin, end=begin + part.duration))
    return pieces


def minutes(t: float) -> str:
    """Return a time as minutes and seconds."""
    minutes, seconds = divmod(t, 60)
    hours, minutes = divmod(int(minutes), 60)
    return f"{hours}:{minutes:02d}:{seconds:04.1f}" if hours else f"{minutes}:{seconds:04.1f}"
