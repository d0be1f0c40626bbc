"""Long work: in a separate process, reported in words, resumed after a restart."""

from __future__ import annotations

import asyncio
import json
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from threading import Event

import numpy as np
import pytest

from agents.app import Part, State, WorkQueue, begin_film, keep_part
from agents.app.views.progress import events, time_left
from agents.app.work.jobs import Reported, cancel, jobs, jobs_by_number, submit
from agents.app.work.queue import MAX_LOSSES, MOST
from curling_env.trajectory import Trajectory


def in_a_thread(work):
    """Done in a thread: a browser that is driven in this one has its loop running there."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(work).result()


def wait_for(club, number, *states, seconds=60.0):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        job = next(job for job in jobs(club) if job.id == number)
        if job.state in states:
            return job
        time.sleep(0.1)
    raise AssertionError(f"still {job}")


def test_work_that_cannot_be_done_says_why(club):
    session = club.add_session("Tuesday", "2026-11-17", "sheet 1", None)
    with WorkQueue(club):
        job = submit(club, "estimate", session)
        assert submit(club, "estimate", session).id == job.id or job.state != "waiting"
        failed = wait_for(club, job.id, "failed")
    assert "tracks.csv" in failed.problem


def test_work_that_an_ended_server_had_begun_waits_again(club):
    session = club.add_session("Tuesday", "2026-11-17", "sheet 1", None)
    number = submit(club, "estimate", session).id
    with club.database.writing() as connection:
        connection.execute("update job set state = 'running'")
    WorkQueue(club)
    assert [(job.id, job.state) for job in jobs(club, session)] == [(number, "waiting")]


def test_cancelled_work_never_begins(club):
    session = club.add_session("Tuesday", "2026-11-17", "sheet 1", None)
    work = WorkQueue(club)
    number = submit(club, "estimate", session).id
    cancel(club, number)
    with work:
        time.sleep(0.6)
        assert [job.state for job in jobs(club)] == ["cancelled"]


def test_running_work_is_cancelled_and_leaves_nothing_half_written(club):
    session = club.add_session("Tuesday", "2026-11-17", "sheet 1", None)
    t = np.linspace(0.0, 24.0, 300)
    y = -10.97 + 2.1 * t - 0.0437 * t**2
    throws = [[Trajectory(t=t, xy=np.column_stack([0 * t + k / 30, y]))] for k in range(30)]
    keep_part(club, session, None, Part(throws=throws, handles=[[None]] * 30))
    before = sorted(path.name for path in club.folder_of(session).iterdir())
    with WorkQueue(club):
        number = submit(club, "estimate", session).id
        wait_for(club, number, "running")
        time.sleep(0.5)
        cancel(club, number)
        assert next(job for job in jobs(club)).state is State.CANCELLED
        time.sleep(0.6)
        assert next(job for job in jobs(club)).state is State.CANCELLED
    assert sorted(path.name for path in club.folder_of(session).iterdir()) == before


class Process:
    """Stands for a process."""

    def __init__(self) -> None:
        self.alive = True

    def is_alive(self) -> bool:
        return self.alive

    def terminate(self) -> None:
        self.alive = False

    def join(self, _seconds: float) -> None: ...

    def kill(self) -> None: ...


def begun(work, monkeypatch):
    """The jobs that are begun, by their processes' stand-ins."""
    made = {}

    def start(job):
        with work.club.database.writing() as connection:
            connection.execute("update job set state = 'running' where id = ?", (job.id,))
        made[job.id] = work._running[job.id] = Process()

    monkeypatch.setattr(work, "_start", start)
    return made


def test_two_at_a_time_and_one_for_a_session_but_a_camera_goes_on_beside(club, monkeypatch):
    sessions = [club.add_session(f"{k}", "2026-11-17", "1", None) for k in range(3)]
    work = WorkQueue(club)
    made = begun(work, monkeypatch)
    first = submit(club, "track", sessions[0])
    submit(club, "estimate", sessions[0])
    camera = submit(club, "record", sessions[0], "0")
    for session in sessions[1:]:
        submit(club, "track", session)
    work._begin()
    assert set(made) == {first.id, camera.id}
    assert len(made) == MOST
    work._begin()
    assert len(made) == MOST


def test_work_whose_process_was_ended_is_done_again_but_not_for_ever(club, monkeypatch):
    session = club.add_session("Tuesday", "2026-11-17", "1", None)
    work = WorkQueue(club)
    made = begun(work, monkeypatch)
    number = submit(club, "track", session).id
    for _ in range(MAX_LOSSES + 1):
        work._begin()
        made[number].alive = False
        work._end()
    (job,) = jobs(club)
    assert job.state is State.FAILED
    assert "was killed" in job.problem


def test_a_page_that_watches_receives_what_has_changed(club):
    session = club.add_session("Tuesday", "2026-11-17", "1", None)

    async def watch():
        result = events(club, Event(), session)
        first = await anext(result)
        submit(club, "track", session)
        second = await anext(result)
        await result.aclose()
        return first, second

    first, second = (
        json.loads(text.removeprefix("data: "))
        for text in in_a_thread(lambda: asyncio.run(watch()))
    )
    assert first["jobs"] == []
    assert [(job["what"], job["state"]) for job in second["jobs"]] == [("Tracking", "waiting")]


def test_a_time_is_shown_no_more_exactly_than_it_is_known():
    assert [time_left(s) for s in (3, 34, 100, 3000, 7200)] == [
        "about 10 s left",
        "about 30 s left",
        "about 2 min left",
        "about 50 min left",
        "2 h left",
    ]


def test_a_remaining_time_is_reported_only_while_estimates_agree(club, monkeypatch):
    session = club.add_session("Tuesday", "2026-11-17", "1", None)
    number = submit(club, "track", session).id
    now = 100.0
    monkeypatch.setattr("agents.app.work.jobs.monotonic", lambda: now)
    reported = Reported(club, number)

    def left(rate, seconds, begin=0.0):
        """Reports of work that progresses at a rate [share/s]."""
        nonlocal now
        found = []
        for k in range(seconds):
            now += 1.0
            reported("at it", begin + rate * (k + 1))
            found.append(jobs_by_number(club, [number])[0].left)
        return found

    first = left(0.04, 12)
    assert first[:5] == [None] * 5
    assert first[-1] == pytest.approx(13, abs=2)
    # Another stage begins: nothing is reported until its rate is known.
    second = left(0.004, 30)
    assert second[:12] == [None] * 12
    assert second[-1] == pytest.approx(220, rel=0.15)
    # One that stands still and then hurries: never seconds in place of minutes at once.
    third = [one for one in left(0.0, 20, 0.2) + left(0.05, 15, 0.2) if one is not None]
    assert all(b / a < 2 and a / b < 2 for a, b in pairwise(third))


def test_a_film_whose_tracking_is_cancelled_waits_again(club, monkeypatch):
    session = club.add_session("Tuesday", "2026-11-17", "1", None)
    film = begin_film(club, session, "end.mp4", 4)
    with club.database.writing() as connection:
        connection.execute("update film set state = 'running'")
    work = WorkQueue(club)
    begun(work, monkeypatch)
    number = submit(club, "track", session).id
    work._begin()
    cancel(club, number)
    work._end()
    assert club.film(film.id).state is State.WAITING
