"""The queue of long work: two processes at most, one for a session at a time."""

from __future__ import annotations

import signal
import sys
from multiprocessing import get_context
from multiprocessing.context import SpawnProcess
from pathlib import Path
from threading import Event, Thread

from agents.app.club import Club, Job
from agents.app.club.records import State
from agents.app.work.jobs import CAUSES, COPY, OPEN, REPORT

MOST = 2
"""Processes at a time."""
PAUSE = 0.25
"""Between looks at the queue [s]."""
BESIDE = ("record", CAUSES, COPY, REPORT)
"""Work that runs beside other work on the same session."""
MAX_LOSSES = 2
"""Times that work is done again whose process was ended from outside."""
LOST = "its process was killed; the computer may be out of memory"
GOODBYE = 5.0
"""Time that a process has to end [s]."""


class WorkQueue:
    """Runs the work that waits in a club's database, and stops when the server stops.

    Parameters
    ----------
    club : whose work it is; work that was running when an earlier server ended waits again
    """

    def __init__(self, club: Club) -> None:
        self.club = club
        self.closed = Event()
        self._running: dict[int, SpawnProcess] = {}
        self._losses: dict[int, int] = {}
        with club.database.writing() as connection:
            for table in ("job", "film"):
                connection.execute(f"update {table} set state = 'waiting' where state = 'running'")
        self._thread = Thread(target=self._watch, daemon=True)

    def __enter__(self) -> WorkQueue:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.closed.set()
        self._thread.join()
        for process in self._running.values():
            process.terminate()
        for process in self._running.values():
            process.join(GOODBYE)

    def _watch(self) -> None:
        while not self.closed.wait(PAUSE):
            self._end()
            self._begin()

    def _end(self) -> None:
        """Stop processes whose work was cancelled, and repeat work whose process was killed."""
        for number, process in list(self._running.items()):
            is_alive = process.is_alive()  # first: it reports its end before it ends
            job = self.club.database.row(Job, "select * from job where id = ?", number)
            is_running = job is not None and job.state is State.RUNNING
            if is_alive and is_running:
                continue
            process.terminate()
            process.join(GOODBYE)
            process.kill()
            del self._running[number]
            if is_running:
                self._losses[number] = self._losses.get(number, 0) + 1
                change: dict[str, object] = {"state": State.WAITING, "left": None}
                if self._losses[number] > MAX_LOSSES:
                    change |= {"state": State.FAILED, "problem": LOST}
                self.club.change("job", number, **change)
            elif job is not None and job.kind == "track":
                query = (
                    "update film set state = 'waiting' where state = 'running' and session_id = ?"
                )
                self.club.database.write(query, job.session_id)

    def _begin(self) -> None:
        query = "select * from job where state in (?, ?) order by state, id"  # running ones first
        busy: set[int] = set()
        for job in self.club.database.rows(Job, query, *OPEN):
            is_free = job.kind in BESIDE or job.session_id not in busy
            if job.state is State.WAITING and is_free and len(self._running) < MOST:
                self._start(job)
            if job.kind not in BESIDE:
                busy.add(job.session_id)

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
