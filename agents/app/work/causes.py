"""Causes of misses and differences of stones in a session: worked out beside the server.

An answer is kept in the database with a digest of all that it follows from: tracks, notes, hands,
both ices and the version of this program. Where the digest differs, the answer is worked out
again, and the earlier one is shown meanwhile.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from importlib.metadata import version
from threading import Lock
from typing import NamedTuple

import msgspec

from agents.app.club import Club, Job, Session
from agents.app.club.club import ICE, TRACKS, digest_of_file
from agents.app.work.jobs import CAUSES, OPEN, Reported, requested
from agents.coaching import (
    AthleteErrors,
    SessionCauses,
    StoneMatch,
    athlete_errors,
    hand_or_ice,
    match_stones,
)
from agents.coaching.throw_sheet import HANDS_LIST, hands_beside
from curling_env.errors import CurlingError, InputError
from curling_env.ice import load_ice
from friction_estimation.tracks.throw_list import THROW_LIST, load_tracks, throws_beside


class ComingError(CurlingError):
    """The requested result is being worked out.

    Parameters
    ----------
    jobs : the work; also one that has failed or was cancelled, which is begun again only on
        request
    """

    def __init__(self, jobs: list[Job]) -> None:
        super().__init__("this is being computed; it appears as soon as it is ready")
        self.jobs = jobs


class Kept(msgspec.Struct):
    """An answer that was worked out.

    Parameters
    ----------
    of : digest of what it follows from
    found : why throws missed
    stones : the stones against each other; None where these throws do not match stones
    no_stones : why they do not
    """

    of: str
    found: SessionCauses
    stones: StoneMatch | None = None
    no_stones: str = ""


class Answer(NamedTuple):
    """The latest answer for a session.

    Parameters
    ----------
    kept : the answer
    job : the work on a newer one; None while nothing has changed since
    """

    kept: Kept
    job: Job | None


def causes_of(club: Club, session: Session, believed: Session | None) -> Answer | None:
    """Return why the throws of a session missed; None while it has no tracks or no ice.

    Parameters
    ----------
    believed : the session whose ice the team planned with; None if that is not known

    Raises
    ------
    ComingError : it is being worked out for the first time
    """
    if not has_causes(club, session):
        return None
    digest = digest_of(club, session, believed)
    kept, of = club.answer(_name(session, believed), Kept) or (None, "")
    if kept is not None and of == digest:
        return Answer(kept, None)
    given = f"{0 if believed is None else believed.id} {digest}"
    job = requested(club, CAUSES, session, given)
    if kept is None:
        raise ComingError([job])
    return Answer(kept, job)


def prepare(club: Club, session: Session) -> None:
    """Work out what the pages show of a session, unless that is known."""
    with suppress(ComingError):
        causes_of(club, session, believed_ice(club, session))


def work_out(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Work out why throws missed and how the stones differ, and keep it.

    Parameters
    ----------
    given : the number of the session whose ice was believed in, or 0, and a digest of what was
        there when it was requested; if that has changed since, nothing is done
    """
    number, _, wanted = given.partition(" ")
    believed = club.session(int(number))
    digest = digest_of(club, session, believed)
    if wanted and wanted != digest:
        return
    path = club.tracks_of(session)
    tracks, ice, notes = load_tracks(path), load_ice(club.ice_of(session)), throws_beside(path)
    found = hand_or_ice(
        tracks,
        ice,
        notes,
        believed=None if believed is None else load_ice(club.ice_of(believed)),
        hands=hands_beside(path),
        progress=progress,
    )
    kept = Kept(of=digest, found=found)
    try:
        kept.stones = match_stones(tracks, ice, notes)
    except InputError as error:
        kept.no_stones = error.problem
    club.keep_answer(_name(session, believed), digest, kept)


def digest_of(club: Club, session: Session, believed: Session | None, *more: str) -> str:
    """A digest of all that an answer follows from: files, this version, and further texts."""
    folder = club.folder_of(session)
    paths = [folder / name for name in (TRACKS, ICE, THROW_LIST, HANDS_LIST)]
    if believed is not None:
        paths.append(club.ice_of(believed))
    digests = [version("curling-sheet"), *(digest_of_file(path) for path in paths), *more]
    return hashlib.sha256(" ".join(digests).encode()).hexdigest()[:16]


def _name(session: Session, believed: Session | None) -> str:
    return f"causes {session.id} {0 if believed is None else believed.id}"


MOST_SESSIONS = 12
"""Maximum number of sessions, the latest, from which an athlete's errors are computed."""


def earlier_sessions(club: Club, session: Session) -> list[Session]:
    """Earlier sessions with an ice on the same sheet, the latest first."""
    return [
        other
        for other in club.sessions()
        if (other.day, other.id) < (session.day, session.id)
        and other.sheet == session.sheet
        and club.ice_of(other).exists()
    ]


def believed_ice(club: Club, session: Session) -> Session | None:
    """The session whose ice a team knew before this one: the latest earlier one on its sheet."""
    return next(iter(earlier_sessions(club, session)), None)


def has_causes(club: Club, session: Session) -> bool:
    """Return whether a session has the data that explain misses: tracks and an ice."""
    return club.tracks_of(session).exists() and club.ice_of(session).exists()


def sessions_with_causes(club: Club) -> list[Session]:
    """The latest sessions with tracks and an ice, the latest first."""
    return [session for session in club.sessions() if has_causes(club, session)][:MOST_SESSIONS]


MOST = 100
"""Answers that are kept."""

_ONE_AT_A_TIME = Lock()
"""Several requests for one answer wait for the first, which works it out."""


def errors_of(
    club: Club, sessions: Sequence[Session], *, only_kept: bool = False
) -> tuple[list[AthleteErrors], list[Job]]:
    """Return how every athlete throws, from some sessions, and the work on newer answers.

    Parameters
    ----------
    only_kept : return nothing rather than work for a second

    Raises
    ------
    ComingError : none of these sessions is worked out yet
    """
    found: list[Kept] = []
    coming: list[Job] = []
    for session in sessions:
        try:
            answer = causes_of(club, session, believed_ice(club, session))
        except ComingError as error:
            coming += error.jobs
        else:
            if answer is not None:
                found.append(answer.kept)
                coming += [] if answer.job is None else [answer.job]
    coming = [job for job in coming if job.state in OPEN]  # a failure is shown on its own page
    if coming and not found:
        raise ComingError(coming)
    digest = hashlib.sha256(" ".join(one.of for one in found).encode()).hexdigest()[:24]
    with _ONE_AT_A_TIME:
        kept = club.answer(f"athletes {digest}", list[AthleteErrors])
        if kept is not None:
            return list(kept[0]), coming
        if only_kept:
            return [], coming
        errors = athlete_errors([one.found for one in found[::-1]])  # in the order of time
        club.keep_answer(f"athletes {digest}", digest, errors)
    return errors, coming


def prepare_errors(club: Club, session: Session) -> None:
    """Work out how athletes throw, in one session and in the latest ones, before someone asks."""
    errors_of(club, [session])
    errors_of(club, sessions_with_causes(club))
    club.database.write(
        "delete from answer where name like 'athletes %' and rowid not in "
        "(select rowid from answer where name like 'athletes %' order by rowid desc limit ?)",
        MOST,
    )
