"""Result of tracking one throw of a film, under its numbers in a tracks file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from curling_env.trajectory import Trajectory
from friction_estimation.camera.scene import Scene
from friction_estimation.film.video import Film
from friction_estimation.tracking.films.film_track import FilmTrack
from friction_estimation.tracking.films.pieces import Piece, minutes
from friction_estimation.tracking.stone_numbers import StoneNumbers, handle_code


@dataclass(frozen=True, kw_only=True, eq=False)
class TrackedFilm:
    """Result of tracking one throw.

    Parameters
    ----------
    film : its path
    tracks : the thrown stone's track, then those of the other stones
    summary : frames, rows, times and contacts, for JSON
    found : everything that the built-in tracker found; None for a tracker that returns tracks
        alone, and for a resumed film
    resumed : whether an earlier, interrupted call had tracked the film
    shown : the film, or the part of it that shows this throw; None for a resumed film
    scene : its camera's view of the sheet
    """

    film: Path
    tracks: tuple[Trajectory, ...]
    summary: dict[str, Any]
    found: FilmTrack | None = None
    resumed: bool = False
    shown: Film | Path | None = None
    scene: Scene | None = None

    @property
    def thrown(self) -> Trajectory:
        """The thrown stone's track."""
        return self.tracks[0]

    @property
    def name(self) -> str:
        """Name of the film, with the time of the throw in a longer one."""
        at = self.summary.get("clock")
        return self.film.name if at is None else f"{self.film.name} at {minutes(at)}"

    @property
    def handles(self) -> list[str | None]:
        """Colour of the handle of each stone, see `handle_code`; None where it is not known."""
        seen: list[dict[str, Any]] = [self.summary, *self.summary.get("others", [])]
        codes = [about.get("handle") for about in seen]
        return [*codes, *[None] * len(self.tracks)][: len(self.tracks)]

    def numbered(self, throw: int, piece: Piece) -> TrackedFilm:
        """Return the same with the number of the throw and the start of its piece."""
        tracks = tuple(
            replace(track, throw=throw, stone=k, clock=piece.begin or track.clock)
            for k, track in enumerate(self.tracks)
        )
        return replace(self, tracks=tracks, summary={**piece.summary, **self.summary})


def with_stones(films: Iterable[TrackedFilm]) -> Iterator[TrackedFilm]:
    """Number the stones in order of play, and distinguish them by the colours of their handles."""
    numbers = StoneNumbers()
    for one in films:
        given = numbers.of(one.tracks, one.handles)
        tracks = tuple(replace(k, stone=n) for k, n in zip(one.tracks, given, strict=True))
        summary = {"stone": given[0], **one.summary}
        others: list[dict[str, Any]] = one.summary.get("others", [])
        if others:
            summary["others"] = [
                {**about, "stone": n} for about, n in zip(others, given[1:], strict=True)
            ]
        yield replace(one, tracks=tracks, summary=summary)


def summary_of(found: FilmTrack | Trajectory) -> dict[str, Any]:
    """Frames, rows, times and contacts of what a tracker found, for JSON."""
    thrown = found.trajectory if isinstance(found, FilmTrack) else found
    about: dict[str, Any] = {
        "tracked": len(thrown),
        "from_s": float(thrown.t[0]),
        "to_s": float(thrown.t[-1]),
    }
    if isinstance(found, FilmTrack):
        about = {"frames": found.frame_count, **about, **_handle(found)}
        if found.not_seen:
            about["not_seen"] = found.not_seen
        if found.unexplained:
            about["unexplained"] = list(found.unexplained)
        if found.contacts:
            about["contacts_s"] = [float(t) for t in found.contacts]
        if found.others:
            about["others"] = [_summary_of_other(other) for other in found.others]
    return about


def _summary_of_other(other: FilmTrack) -> dict[str, Any]:
    begin, end = other.trajectory.xy[0], other.trajectory.xy[-1]
    about: dict[str, Any] = {
        "stone": int(other.trajectory.stone),
        **_handle(other),
        "struck": bool(other.contacts),
        "lay": [round(float(value), 4) for value in begin],
    }
    if other.contacts:
        about["rests"] = [round(float(value), 4) for value in end]
    return about


def _handle(found: FilmTrack) -> dict[str, str]:
    """Return the colour of a stone's handle, if it is seen."""
    code = handle_code(found.handle_colour)
    return {} if code is None else {"handle": code}
