"""Independent pieces of work, done in this process or in local processes.

Results come in the order of the items, and a piece whose worker was killed is repeated by another.
Work that depends only on its item gives the same numbers on any number of workers.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from threading import Thread
from typing import TypeVar

from curling_env.errors import CurlingError
from curling_env.infrastructure.threads import one_thread

Piece = TypeVar("Piece")
Output = TypeVar("Output")

MAX_RETRIES = 3
"""Maximum number of repeats of a piece after its worker was lost."""
PIECES_PER_WORKER = 4
"""Pieces handed out per worker at a time, so that no worker waits."""


class WorkersLostError(CurlingError):
    """Workers died repeatedly on the same piece of work."""


class Executor:
    """Executor that does one piece after the other in this process."""

    def map(self, work: Callable[[Piece], Output], items: Iterable[Piece]) -> Iterator[Output]:
        """Return the results of the work on each item, in the order of the items.

        Parameters
        ----------
        work : function at the top level of a module; its result depends on its item only
        items : one for each piece of work

        Raises
        ------
        WorkersLostError : workers died repeatedly on the same piece
        """
        return map(work, items)


class ProcessExecutor(Executor):
    """Executor in local processes.

    They are spawned, not forked: a fork of a process with numba's and OpenCV's threads may hang.

    Parameters
    ----------
    count : number of processes; at most twice the number of cores are started
    """

    def __init__(self, count: int) -> None:
        self._count = min(count, 2 * max(os.cpu_count() or 1, 2))

    def map(self, work: Callable[[Piece], Output], items: Iterable[Piece]) -> Iterator[Output]:
        """See `Executor`."""
        source, begun, losses = iter(items), deque[Piece](), 0
        while losses <= MAX_RETRIES:
            pool = ProcessPoolExecutor(
                self._count, mp_context=get_context("spawn"), initializer=begin_worker
            )
            try:
                # After a loss these are the pieces that the lost pool had started.
                results = deque[Future[Output]](pool.submit(work, item) for item in begun)
                while True:
                    for item in islice(source, PIECES_PER_WORKER * self._count - len(begun)):
                        begun.append(item)
                        results.append(pool.submit(work, item))
                    if not begun:
                        return
                    result = results.popleft().result()
                    begun.popleft()
                    losses = 0
                    yield result
            except BrokenProcessPool:
                losses += 1
            finally:
                pool.shutdown(cancel_futures=True)
        raise WorkersLostError(
            f"workers died {losses} times on the same piece of work; it may need more memory "
            "than available"
        )


def begin_worker() -> None:
    """Make this worker process end with its parent, use one core, and hold no other resources.

    A killed parent cannot end its workers. They notice that it is gone, also while they work. Their
    output has no reader: a process that reads the parent's output would otherwise wait for their
    end too.
    """
    parent = parent_process()
    if parent is None:
        return
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nothing, stream)
    os.close(nothing)
    one_thread()
    Thread(target=lambda: os._exit(len(wait([parent.sentinel]))), daemon=True).start()
