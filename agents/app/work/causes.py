"""Why the throws of a session missed: worked out beside the server, and kept with the session.

What was worked out is kept beside a digest of all that it follows from: tracks, notes, hands, both
ices and the version of this program. As long as the digest is the same, the answer is read from its
file; else it is worked out anew.
"""

from __future__ import annotations

import hashlib
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from agents.app.club import Club, Job, Session
from agents.app.club.club import ICE, TRACKS
from agents.app.club.planned_ice import believed_ice, has_causes
from agents.app.club.records import State
from agents.app.work.jobs import CAUSES, latest, submit
from agents.coaching import SessionCauses, hand_or_ice
from agents.coaching.throw_sheet import HANDS_LIST, hands_beside
from curling_env.errors import CurlingError
from curling_env.ice import load_ice
from curling_env.infrastructure.files.reading import read_text
from curling_env.infrastructure.files.storage import write_text
from curling_env.infrastructure.files.writing import make_directory
from curling_env.infrastructure.provenance import sha256_of
from friction_estimation.tracks.throw_list import THROW_LIST, load_tracks, throws_beside

if TYPE_CHECKING:
    from agents.app.work.reported import Reported

FOLDER = "coaching"
"""Of the answers, in the folder of a session."""


class ComingError(CurlingError):
    """What was asked for is being worked out.

    Parameters
    ----------
    jobs : the work; one that has failed or was cancelled too, which is begun again only if somebody
        asks for it
    """

    def __init__(self, jobs: list[Job]) -> None:
        super().__init__("this is being worked out, and is there in a moment")
        self.jobs = jobs


class _Kept(msgspec.Struct):
    """An answer, and the digest of what it follows from."""

    of: str
    found: SessionCauses


def causes_of(club: Club, session: Session, believed: Session | None) -> SessionCauses | None:
    """Why the throws of a session missed; None while it has no tracks or no ice.

    Parameters
    ----------
    believed : the session whose ice the team planned with; None if that is not known

    Raises
    ------
    ComingError : it is being worked out
    """
    if not has_causes(club, session):
        return None
    path, digest = _path(club, session, believed), digest_of(club, session, believed)
    if path.exists():
        kept = _read(path, path.stat().st_mtime_ns)
        if kept is not None and kept.of == digest:
            return kept.found
    raise ComingError([_asked_for(club, session, believed, digest)])


def prepare(club: Club, session: Session) -> None:
    """Begin to work out what somebody will ask for next."""
    believed = believed_ice(club, session)
    if has_causes(club, session):
        _asked_for(club, session, believed, digest_of(club, session, believed))


def work_out(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Work out why throws missed, and keep it.

    Parameters
    ----------
    given : the number of the session whose ice was believed in, or 0, and a digest of what was
        there when it was asked for; if that has changed since, nothing is done
    """
    number, _, asked = given.partition(" ")
    believed = club.session(int(number))
    digest = digest_of(club, session, believed)
    if asked and asked != digest:
        return
    tracks = club.tracks_of(session)
    found = hand_or_ice(
        load_tracks(tracks),
        load_ice(club.ice_of(session)),
        throws_beside(tracks),
        believed=None if believed is None else load_ice(club.ice_of(believed)),
        hands=hands_beside(tracks),
        progress=progress,
    )
    path = _path(club, session, believed)
    make_directory(path.parent)
    text = msgspec.json.encode(_Kept(of=digest, found=found), enc_hook=_as_list).decode()
    _parsed(text)
    path.unlink(missing_ok=True)  # whatever it holds, it no longer holds true
    write_text(path, text)


def digest_of(club: Club, session: Session, believed: Session | None) -> str:
    """A digest of all that the answer follows from."""
    folder = club.folder_of(session)
    paths = [folder / name for name in (TRACKS, ICE, THROW_LIST, HANDS_LIST)]
    if believed is not None:
        paths.append(club.ice_of(believed))
    digests = [version("curling-sheet"), *(_digest(path, _changed(path)) for path in paths)]
    return hashlib.sha256(" ".join(digests).encode()).hexdigest()[:16]


def _asked_for(club: Club, session: Session, believed: Session | None, digest: str) -> Job:
    given = f"{0 if believed is None else believed.id} {digest}"
    job = latest(club, CAUSES, session, given)
    if job is not None and job.state is not State.DONE:
        return job
    return submit(club, CAUSES, session, given)


def _path(club: Club, session: Session, believed: Session | None) -> Path:
    number = 0 if believed is None else believed.id
    return club.folder_of(session) / FOLDER / f"hand-or-ice-{number}.json"


@lru_cache(maxsize=24)
def _read(path: Path, changed: int) -> _Kept | None:
    """What is kept in a file; None where it cannot be read."""
    try:
        return _parsed(read_text(path))
    except (CurlingError, msgspec.DecodeError):
        return None


def _parsed(text: str) -> _Kept:
    return msgspec.json.decode(text, type=_Kept, dec_hook=_as_array)


def _as_list(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise NotImplementedError


def _as_array(_kind: Any, value: Any) -> Any:
    return np.array(value, dtype=np.float64)


@lru_cache(maxsize=256)
def _digest(path: Path, changed: int) -> str:
    return str(sha256_of(path)) if changed else ""


def _changed(path: Path) -> int:
    """When a file was changed last; 0 where there is none."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0
