"""The queue of long work: two processes at most, one for a session at a time."""

from __future__ import annotations

import signal
import sys
from collections.abc import Collection
from multiprocessing import get_context
from multiprocessing.context import SpawnProcess
from pathlib import Path
from threading import Event, Lock, Thread

from agents.app.club import Club, Job, Session
from agents.app.club.database import row_of, rows_of
from agents.app.club.records import State
from agents.app.work.jobs import CAUSES, COPY, MEASURE, REPORT, submit

MOST = 2
"""Processes at a time."""
PAUSE = 0.25
"""Between looks at the queue [s]."""
BESIDE = ("record", CAUSES, COPY, MEASURE, REPORT)
"""Work that goes on beside other work on the same session."""
MAX_LOSSES = 2
"""Times that work is done again whose process was ended from outside."""
GOODBYE = 5.0
"""Time that a process has to end [s]."""


class WorkQueue:
    """Begins the work of a club that waits, and ends it when the server ends.

    Parameters
    ----------
    club : whose work it is; work that was running when an earlier server ended waits again
    """

    def __init__(self, club: Club) -> None:
        self.club = club
        self.closed = Event()
        self._running: dict[int, SpawnProcess] = {}
        self._losses: dict[int, int] = {}
        self._lock = Lock()
        club.database.write("update job set state = 'waiting' where state = 'running'")
        self._thread = Thread(target=self._watch, daemon=True)

    def __enter__(self) -> WorkQueue:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.closed.set()
        self._thread.join()
        with self._lock:
            for process in self._running.values():
                process.terminate()
            for process in self._running.values():
                process.join(GOODBYE)

    def submit(self, kind: str, session: Session, given: str = "") -> Job:
        """Ask for work; the same work that waits already is enough."""
        return submit(self.club, kind, session, given)

    def cancel(self, number: int) -> None:
        """End work, or let it never begin; files that it has already written stay."""
        with self._lock:
            process = self._running.pop(number, None)
            if process is not None:
                process.terminate()
                process.join(GOODBYE)
                process.kill()
            with self.club.database.writing() as connection:
                connection.execute(
                    "update job set state = 'cancelled', left = null "
                    "where id = ? and state in ('waiting', 'running')",
                    (number,),
                )
                connection.execute(
                    "update film set state = 'waiting' where state = 'running' and session_id = "
                    "(select session_id from job where id = ? and kind = 'track')",
                    (number,),
                )

    def again(self, number: int) -> None:
        """Begin work once more that failed or was cancelled."""
        query = (
            "update job set state = 'waiting', share = 0, problem = null "
            "where id = ? and state in ('failed', 'cancelled')"
        )
        self.club.database.write(query, number)

    def those(self, numbers: Collection[int]) -> list[Job]:
        """Work by its numbers."""
        marks = ", ".join("?" * len(numbers))
        query = f"select * from job where id in ({marks}) order by id desc"
        return self.club.database.rows(Job, query, *numbers)

    def jobs(self, session: Session | None = None) -> list[Job]:
        """Work of a session, or of all, the latest first."""
        if session is None:
            return self.club.database.rows(Job, "select * from job order by id desc")
        query = "select * from job where session_id = ? order by id desc"
        return self.club.database.rows(Job, query, session.id)

    # --- the processes ---------------------------------------------------------------------------

    def _watch(self) -> None:
        while not self.closed.wait(PAUSE):
            with self._lock:
                self._reap()
                self._begin()

    def _reap(self) -> None:
        for number, process in list(self._running.items()):
            if process.is_alive():
                continue
            del self._running[number]
            with self.club.database.writing() as connection:
                job = row_of(connection, Job, "select * from job where id = ?", (number,))
                if job is None or job.state is not State.RUNNING:
                    continue  # it has reported its end
                self._losses[number] = self._losses.get(number, 0) + 1
                again = self._losses[number] <= MAX_LOSSES
                connection.execute(
                    "update job set state = ?, problem = ?, left = null where id = ?",
                    ("waiting", None, number)
                    if again
                    else ("failed", "its process was ended; the machine may lack memory", number),
                )

    def _begin(self) -> None:
        if len(self._running) >= MOST:
            return
        with self.club.database.reading() as connection:
            waiting = rows_of(
                connection,
                Job,
                "select * from job where state = 'waiting' order by id",
            )
            running = connection.execute(
                "select session_id, kind from job where state = 'running'"
            ).fetchall()
            busy = {row["session_id"] for row in running if row["kind"] not in BESIDE}
        for job in waiting:
            if len(self._running) >= MOST:
                return
            if job.kind in BESIDE:
                self._start(job)
            elif job.session_id not in busy:
                busy.add(job.session_id)
                self._start(job)

    def _start(self, job: Job) -> None:
        self.club.change("job", job.id, state=State.RUNNING, problem=None)
        process = get_context("spawn").Process(
            target=_work, args=(self.club.folder, job.id), daemon=True
        )
        process.start()
        self._running[job.id] = process


def _work(folder: Path, number: int) -> None:
    """Run a job in its process."""
    from curling_env.infrastructure.workers import begin_worker

    begin_worker()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the server's
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    from agents.app.work.jobs import do_job

    do_job(folder, number)
