"""File of a donated session, `curling-session/1`: one JSON document.

It has the scene, the tracks column by column, the publishable notes on each throw, and a note of
consent. It contains no thrower, place or date.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from curling_env.errors import InputError, placed
from curling_env.infrastructure.files.reading import read_json
from curling_env.infrastructure.files.schema import Document, FileFormat, Short, checked
from curling_env.infrastructure.files.storage import write_json
from curling_env.trajectory import Trajectory, track_columns, tracks_of_columns
from friction_estimation.camera.scene import Scene, SceneDocument, document_of, scene_of
from friction_estimation.tracks.throw_list import MAX_THROWS

SESSION_FORMAT = FileFormat(name="curling-session/1", what="a donated session")
LICENCE = "CC0-1.0"
"""Licence of donated sessions: anyone may use them for anything."""
MAX_ROWS = 300_000
"""Maximum number of frames of one session: 350 throws at 30 frames a second."""
MIN_CONSENT, MAX_CONSENT = 20, 1000
"""Minimum and maximum number of letters of a note of consent."""


@dataclass(frozen=True, kw_only=True)
class ThrownBy:
    """Publishable notes on a throw.

    Parameters
    ----------
    throw : number of the throw in the tracks
    athlete : number in the order of the first throws; None if it was not noted
    hand : right, left, or empty if unknown
    called : called shot, in the words of calls; or empty
    """

    throw: int
    athlete: int | None = None
    hand: str = ""
    called: str = ""


@dataclass(frozen=True, kw_only=True)
class Session:
    """Measured session without film and without names.

    Parameters
    ----------
    consent : permission of use and its givers, in a sentence or two without names
    scene : scene of its camera
    tracks : its throws in order of play
    throws : notes on them, if any
    licence : its licence

    Raises
    ------
    InputError : a consent that is too short or too long, or no tracks, or too many
    """

    consent: str
    scene: Scene
    tracks: Sequence[Trajectory]
    throws: Sequence[ThrownBy] = ()
    licence: str = LICENCE

    def __post_init__(self) -> None:
        length = len(self.consent.strip())
        if not MIN_CONSENT <= length <= MAX_CONSENT or not self.consent.isprintable():
            raise InputError(
                f"expected a note of consent of {MIN_CONSENT} to {MAX_CONSENT} letters in one "
                f"line that states who agrees to what, got {length}"
            )
        if not self.tracks:
            raise InputError("a session needs at least one throw")
        rows = sum(map(len, self.tracks))
        if rows > MAX_ROWS:
            raise InputError(f"has {rows} frames; expected at most {MAX_ROWS}")


Whole = Annotated[int, Meta(ge=-(2**53), le=2**53)]
Numbers = Annotated[list[float | None], Meta(max_length=MAX_ROWS)]


class ThrowDocument(Document, omit_defaults=True):
    """Publishable notes on a throw."""

    throw: Whole
    athlete: Annotated[int, Meta(ge=0, le=MAX_THROWS)] | None = None
    hand: Literal["right", "left"] | None = None
    called: Short = ""


class TracksDocument(Document):
    """Columns of a tracks file, one entry per frame; null for an empty cell."""

    throw: Numbers
    t: Numbers
    x: Numbers
    y: Numbers
    theta: Numbers
    stone: Numbers | None = None
    clock: Numbers | None = None
    swept: Numbers | None = None
    sigma_xy: Numbers | None = None
    sigma_theta: Numbers | None = None
    sigma_t: Numbers | None = None


class SessionDocument(Document):
    """Donated session."""

    format: Short
    licence: Short
    consent: Annotated[str, Meta(min_length=MIN_CONSENT, max_length=MAX_CONSENT)]
    scene: SceneDocument
    tracks: TracksDocument
    throws: Annotated[list[ThrowDocument], Meta(max_length=MAX_THROWS)] = msgspec.field(
        default_factory=list[ThrowDocument]
    )


def write_session(session: Session, path: str | Path) -> None:
    """Write a donated session, completely or not at all; the same session gives the same bytes."""
    begins = min(track.clock for track in session.tracks)
    tracks = [replace(track, clock=track.clock - begins) for track in session.tracks]
    columns = {name: _plain(column) for name, column in track_columns(tracks).items()}
    write_json(
        path,
        {
            "format": SESSION_FORMAT.name,
            "licence": session.licence,
            "consent": session.consent.strip(),
            "scene": document_of(session.scene),
            "throws": [
                {name: value for name, value in asdict(thrown).items() if value not in (None, "")}
                for thrown in session.throws
            ],
            "tracks": columns,
        },
    )


def read_session(path: str | Path) -> Session:
    """Read a donated session from its file.

    Raises
    ------
    InputError : unreadable, of another format, columns of different lengths, or any error of a
        tracks file or a scene file
    """
    document = read_json(path)
    with placed(source=path):
        document = SESSION_FORMAT.accept(document)
        form = checked(document, SessionDocument)
        scene = _scene(document["scene"], str(path))
        return Session(
            consent=form.consent,
            licence=form.licence,
            scene=scene,
            tracks=tracks_of_columns(_given(form.tracks), str(path)),
            throws=[ThrownBy(**_given(thrown)) for thrown in form.throws],
        )


def _scene(document: Any, source: str) -> Scene:
    try:
        return scene_of(document, source)
    except InputError as error:
        where = f"scene.{error.where}" if error.where else "scene"
        raise InputError(error.problem, source=source, where=where) from error


def _given(form: Document) -> dict[str, Any]:
    """Return the entries of a part of a document that are given."""
    return {
        name: value for name, value in msgspec.structs.asdict(form).items() if value is not None
    }


def _plain(column: NDArray[Any]) -> list[float | None]:
    """Return a column for JSON: whole numbers as such, null for unknown ones."""
    whole = bool(np.isfinite(column).all() and (column == np.round(column)).all())
    return [
        None if not np.isfinite(value) else int(value) if whole else float(value)
        for value in column.tolist()
    ]
