"""Progress of a session's films and its work, for the page that watches."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import AsyncIterator, Callable, Collection
from threading import Event
from typing import Any

from starlette.concurrency import run_in_threadpool

from agents.app.club import Club, Job, Session
from agents.app.club.films import has_other_marks
from agents.app.club.records import State
from agents.app.club.removal import removed_in
from agents.app.views.throws import (
    sheet_seen_live,
    sheets_of,
    throw_numbers,
    untracked,
)
from agents.app.work.jobs import (
    CAUSES,
    COPY,
    KINDS,
    OPEN,
    REPORT,
    jobs,
    jobs_by_number,
)
from agents.coaching import ThrowSheet
from agents.coaching.calls import shown_call
from agents.coaching.scores import missed_by, points_of
from curling_env.units import short_length
from friction_estimation.reports.throws_section import throw_in_words

PAUSE = 0.5
"""Between looks [s]."""
SILENCE = 20
"""Looks without news after which something is sent all the same, to keep the line open."""
SHOWN = 5
"""Jobs that have ended, and the latest throws, that are shown."""
UNLISTED = (CAUSES, COPY, REPORT)
"""Work that a page begins, and whose end that page shows."""


def events(club: Club, closed: Event, session: Session) -> AsyncIterator[str]:
    """Server-sent events: the state of a session whenever it has changed."""
    return _watch(closed, lambda: (state_of(club, session), False))


def job_events(club: Club, closed: Event, numbers: Collection[int]) -> AsyncIterator[str]:
    """Server-sent events: how far some work is, until all of it has ended."""

    def look() -> tuple[Any, bool]:
        found = jobs_by_number(club, numbers)
        return [job_in_words(job) for job in found], all(job.state not in OPEN for job in found)

    return _watch(closed, look)


async def _watch(closed: Event, look: Callable[[], tuple[Any, bool]]) -> AsyncIterator[str]:
    """Yield the state whenever it has changed, until nothing more is to come."""
    sent, silent, ended = "", 0, False
    while not (ended or closed.is_set()):
        seen, ended = await run_in_threadpool(look)
        state, silent = json.dumps(seen), silent + 1
        if state != sent:
            yield f"data: {state}\n\n"
            sent, silent = state, 0
        elif silent >= SILENCE:
            yield ": nothing new\n\n"
            silent = 0
        if not ended:
            await asyncio.sleep(PAUSE)


def state_of(club: Club, session: Session) -> dict[str, Any]:
    """Films, work and the latest throws of a session, for JSON."""
    session = club.session(session.id) or session
    throws, camera = club.throws(session), club.camera(session.camera_id)
    films = club.films(session)
    again = {film.id for film in films if has_other_marks(club, session, film)}
    seen = [one.film_id for one in throws]
    work, live = jobs(club, session), sheet_seen_live(club, session)
    open_jobs = [job for job in work if job.state in OPEN]
    ended = [job for job in work if job.state not in OPEN and job.kind not in UNLISTED][:SHOWN]
    return {
        "camera": None if camera is None else {"name": camera.name, "marked": bool(camera.scene)},
        "films": [
            {
                "id": film.id,
                "name": film.name,
                "size": film.size,
                "received": film.received,
                "state": ("again" if film.id in again else film.state)
                if film.is_whole
                else "coming",
                "remark": film.said,
                "mark": film.state is State.FAILED and film.is_whole and camera is not None,
                "throws": seen.count(film.id),
            }
            for film in films
        ],
        "jobs": [job_in_words(job) for job in (*open_jobs, *ended)],
        "count": len(throws),
        "latest": [
            {"number": sheet.throw + 1, "words": in_words(sheet), **large(sheet)}
            for sheet in reversed(sheets_of(club, session)[-SHOWN:])
        ],
        "live": None if live is None else large(live) | {"rests": session.live_rests},
        "next": {
            "athlete": session.turn(untracked(club, session) + (live is not None)),
            "called": shown_call(session.drill),
        },
        "removed": len(removed_in(club, session)),
    }


def job_in_words(job: Job) -> dict[str, Any]:
    """A job as the page shows it."""
    return {
        "id": job.id,
        "kind": job.kind,
        "what": KINDS[job.kind][1] if job.kind in KINDS else job.kind,
        "state": job.state,
        "share": job.share,
        "says": job.says,
        "left": None if job.left is None else time_left(job.left),
        "problem": job.problem,
    }


def time_left(seconds: float) -> str:
    """Format a remaining time, no more exactly than it is known."""
    if seconds < 50:
        return f"about {max(10, 10 * round(seconds / 10))} s left"
    minutes = round(seconds / 60)
    return f"about {max(1, minutes)} min left" if minutes < 90 else f"{minutes / 60:.0f} h left"


def in_words(sheet: ThrowSheet) -> str:
    """Describe a throw in a sentence, with the handle by the athlete's hand."""
    words = throw_in_words(sheet.measures)
    if sheet.handle is not None:
        words = re.sub("in-turn|out-turn", sheet.handle, words)
    return ", ".join(part for part in (sheet.athlete, words) if part)


def large(sheet: ThrowSheet) -> dict[str, Any]:
    """The few numbers of a throw that are read from afar, and its points if a draw was called."""
    split, weight, _, line, *_, past, beside = throw_numbers(sheet)
    rest = {"name": "Rest", "value": "\n".join(filter(None, (past.value, beside.value)))}
    where, _, broom = line.value.partition(" of ")
    off, points = missed_by(sheet), points_of(sheet, None)
    missed = {"name": "From the target", "value": "" if off is None else short_length(off)}
    numbers = [
        {"name": "Split", "value": split.value, "sigma": split.sigma},
        {"name": weight.name, "value": weight.value, "sigma": weight.sigma},
        {"name": "Off the broom" if broom else "Line", "value": where, "sigma": line.sigma},
        rest | {"sigma": past.sigma},
        missed | {"sigma": "" if points is None else f"{points} points"},
    ]
    return {
        "athlete": sheet.athlete,
        "called": shown_call(sheet.note.called),
        "numbers": [one for one in numbers if one["value"]],
    }
