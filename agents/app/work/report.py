"""An athlete's evening as one HTML file to send: numbers, the picture of the hand, and clips."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import numpy as np

from agents.app.club import Athlete, Club, Session, Throw
from agents.app.rendering import rendered
from agents.app.views.hands import hands_of
from agents.app.views.throws import sheets_of, throw_numbers
from agents.app.work.causes import ComingError, digest_of, errors_of, sessions_with_causes
from agents.app.work.film_copy import smaller
from agents.app.work.jobs import Reported
from agents.coaching import ThrowSheet
from agents.coaching.calls import shown_call
from agents.coaching.scores import leaderboard, missed_by, points_of
from curling_env.errors import InputError
from curling_env.infrastructure.files.storage import write_text
from curling_env.infrastructure.files.writing import make_directory
from friction_estimation.film.video import Film

WIDEST, QUALITY, EVERY = 480, 30.0, 2
"""Clips: their width [px], compression, and which of the frames they have."""
CLIPS = 4
"""Number of clips: the best two throws and the two that missed by most."""
AFTER = 2.0
"""Length of a clip after the end of the throw [s]."""


def report_path(club: Club, session: Session, athlete: Athlete) -> Path:
    """The file of a report as throws, calls and ice are now; it may not be there yet."""
    of = digest_of(club, session, None, club.units)
    return club.folder_of(session) / "reports" / f"{athlete.id}-{of}.html"


def do_report(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Make the report of the athlete whose number is given.

    Raises
    ------
    InputError : that athlete has no throws in the session
    """
    athlete = next((one for one in club.athletes() if str(one.id) == given), None)
    sheets = [
        sheet
        for sheet in sheets_of(club, session)
        if athlete is not None and sheet.athlete == athlete.name
    ]
    if athlete is None or not sheets:
        raise InputError("has no throws of this athlete", source=session.name)
    path = report_path(club, session, athlete)
    throws = {throw.number: throw for throw in club.throws(session)}
    filmed = [one for one in sheets if throws[one.throw].film_id is not None]
    text = rendered(
        "report.html",
        athlete=athlete,
        session=session,
        hand=_hand(club, athlete),
        score=next(iter(leaderboard((one, throws[one.throw].made) for one in sheets)), None),
        throws=[
            {
                "number": one.throw + 1,
                "called": shown_call(one.note.called),
                "numbers": throw_numbers(one),
                "off": missed_by(one),
                "points": points_of(one, throws[one.throw].made),
            }
            for one in sheets
        ],
        clips=list(_clips(club, throws, _worth_seeing(filmed), progress)),
    )
    make_directory(path.parent)
    for old in path.parent.glob(f"{athlete.id}-*.html"):
        old.unlink()
    write_text(path, text)


def _hand(club: Club, athlete: Athlete) -> dict[str, Any] | None:
    """Describe the athlete's hand, over the latest sessions; None while that is not known."""
    sessions = sessions_with_causes(club)
    try:
        errors, _ = errors_of(club, sessions, only_kept=True)
    except ComingError:
        return None
    own = [one for one in errors if one.name == athlete.name]
    return hands_of(club, sessions, own)[0] if own else None


def _worth_seeing(sheets: list[ThrowSheet]) -> list[ThrowSheet]:
    """The best throws and those that missed by most; without calls the latest."""
    off = sorted((one for one in sheets if one.miss is not None), key=lambda k: missed_by(k) or 0)
    few = sheets[-CLIPS:] if len(off) < CLIPS else [*off[: CLIPS // 2], *off[-(CLIPS // 2) :]]
    return sorted(few, key=lambda sheet: sheet.throw)


def _clips(
    club: Club, throws: Mapping[int, Throw], sheets: list[ThrowSheet], progress: Reported
) -> Iterable[dict[str, Any]]:
    for k, sheet in enumerate(sheets):
        progress.piece(k, len(sheets))
        throw = throws[sheet.throw]
        film = club.film(throw.film_id)
        if film is None or not club.path(film.file).is_file():
            continue
        one, begin = sheet.measures, throw.clock
        lasts = 30.0 if one.hog_to_rest is None else one.hog_to_rest.value + 6.0
        whole = Film.open(club.path(film.file))
        part = whole.part(max(begin - 1.0, 0.0), min(begin + lasts + AFTER, whole.duration))
        with TemporaryDirectory() as folder:
            clip = Path(folder) / "clip.mp4"
            smaller(part, clip, WIDEST, QUALITY, progress, every=EVERY)
            frames = [frame for _, frame in Film.open(clip).sample(3)]
            _, still = cv2.imencode(".jpg", frames[-1], [cv2.IMWRITE_JPEG_QUALITY, 70])
            yield {
                "number": sheet.throw + 1,
                "called": shown_call(sheet.note.called),
                "film": _data("video/mp4", clip.read_bytes()),
                "still": _data("image/jpeg", np.asarray(still).tobytes()),
            }


def _data(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
