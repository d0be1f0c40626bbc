"""Long work: done in a process of its own, told in words, taken up again."""

from __future__ import annotations

import time

from agents.app.work.queue import WorkQueue


def wait_for(work, number, *states, seconds=60.0):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        job = next(job for job in work.jobs() if job.id == number)
        if job.state in states:
            return job
        time.sleep(0.1)
    raise AssertionError(f"still {job}")


def test_work_that_cannot_be_done_says_why(club):
    session = club.add_session("Tuesday", "2026-11-17", "sheet 1", None)
    with WorkQueue(club) as work:
        job = work.submit("estimate", session)
        assert work.submit("estimate", session).id == job.id or job.state != "waiting"
        failed = wait_for(work, job.id, "failed")
    assert "tracks.csv" in failed.problem


def test_work_that_an_ended_server_had_begun_waits_again(club):
    session = club.add_session("Tuesday", "2026-11-17", "sheet 1", None)
    number = WorkQueue(club).submit("estimate", session).id
    with club.database.writing() as connection:
        connection.execute("update job set state = 'running'")
    assert [(job.id, job.state) for job in WorkQueue(club).jobs(session)] == [(number, "waiting")]


def test_cancelled_work_never_begins(club):
    session = club.add_session("Tuesday", "2026-11-17", "sheet 1", None)
    work = WorkQueue(club)
    number = work.submit("estimate", session).id
    work.cancel(number)
    with work:
        time.sleep(0.6)
        assert [job.state for job in work.jobs()] == ["cancelled"]
