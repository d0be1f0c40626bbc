"""Independent pieces of work, done in this process, in local processes or on a Ray cluster.

`executor` chooses; `map` does the work. Results come in the order of the items, and a piece whose
worker was killed is done again by another. Work that depends on nothing but its item therefore
gives the same numbers on any number of workers.
"""

# Ray is optional and comes without complete types.
# pyright: reportMissingImports=false, reportUnknownMemberType=false, reportMissingTypeStubs=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import logging
import os
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import islice
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from threading import Thread
from typing import Any, Protocol, TypeVar, cast

from curling_env.errors import CurlingError, InputError
from curling_env.infrastructure.threads import one_thread

Piece = TypeVar("Piece")
Output = TypeVar("Output")

MAX_RETRIES = 3
"""Times that a piece is done again after its worker was lost."""
MAX_WORKERS = 1024
"""Processes that can be asked for."""
PIECES_PER_WORKER = 4
"""Pieces handed out per worker at a time, so that no worker waits."""


class WorkersLostError(CurlingError):
    """Workers died repeatedly over the same piece of work."""


class Executor(Protocol):
    """What does pieces of work."""

    def map(self, work: Callable[[Piece], Output], items: Iterable[Piece]) -> Iterator[Output]:
        """Results of the work on each item, in the order of the items.

        Parameters
        ----------
        work : function at the top level of a module; its result depends on its item only
        items : one for each piece of work

        Raises
        ------
        WorkersLostError : workers died repeatedly over the same piece
        """
        ...


@contextmanager
def executor(workers: int | str = 1) -> Generator[Executor]:
    """The executor for a number of workers.

    Parameters
    ----------
    workers : number of local processes, 1 for this process alone; ``"ray"`` for the running Ray
        cluster, or for one that is started on this machine; ``"ray://host:port"`` for the cluster
        at that address. Every machine of a cluster needs this distribution installed.

    Raises
    ------
    InputError : another value, or a cluster that does not answer
    """
    text = str(workers)
    if text == "ray" or text.startswith("ray://"):
        with _cluster(None if text == "ray" else text) as cluster:
            yield cluster
        return
    count = int(text) if text.isascii() and text.isdigit() and len(text) < 10 else 0
    if not 0 < count <= MAX_WORKERS:
        raise InputError(
            f"workers must be a number of processes up to {MAX_WORKERS}, 'ray' or "
            f"'ray://host:port', got {text[:40]!r}"
        )
    yield SerialExecutor() if count == 1 else ProcessExecutor(count)


class SerialExecutor:
    """Does one piece after the other in this process."""

    def map(self, work: Callable[[Piece], Output], items: Iterable[Piece]) -> Iterator[Output]:
        """See `Executor`."""
        return map(work, items)


class ProcessExecutor:
    """Does pieces in local processes.

    They are spawned, not forked: a fork of a process that holds numba's and OpenCV's threads may
    hang.

    Parameters
    ----------
    count : number of processes; more than twice as many as there are cores are not begun
    """

    def __init__(self, count: int) -> None:
        self._count = min(count, 2 * max(os.cpu_count() or 1, 2))

    def map(self, work: Callable[[Piece], Output], items: Iterable[Piece]) -> Iterator[Output]:
        """See `Executor`."""
        source = iter(items)
        queue: deque[tuple[Piece, Future[Output]]] = deque()
        pool, losses = self._pool(), 0
        try:
            while True:
                try:
                    for item in islice(source, PIECES_PER_WORKER * self._count - len(queue)):
                        # Queued before anything can fail, so that no item is lost with a pool.
                        queue.append((item, Future()))
                        queue[-1] = (item, pool.submit(work, item))
                    if not queue:
                        return
                    result = queue[0][1].result()
                except BrokenProcessPool:
                    losses += 1
                    if losses > MAX_RETRIES:
                        raise WorkersLostError(
                            f"workers died {losses} times over the same piece of work; it may "
                            "need more memory than there is"
                        ) from None
                    pool.shutdown(wait=False)
                    pool = self._pool()
                    queue = deque(
                        (item, done if _succeeded(done) else pool.submit(work, item))
                        for item, done in queue
                    )
                    continue
                queue.popleft()
                losses = 0
                yield result
        finally:
            pool.shutdown(cancel_futures=True)

    def _pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(
            self._count, mp_context=get_context("spawn"), initializer=begin_worker
        )


def begin_worker() -> None:
    """Make this worker process end with its parent, take one core, and hold nothing else.

    A parent that was killed cannot tell its workers to end. They notice that it is gone, also while
    they work. What they print has no reader: whoever reads the parent's output would else wait for
    their end too.
    """
    parent = parent_process()
    if parent is None:
        return
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nothing, stream)
    os.close(nothing)
    one_thread()
    Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)


def _succeeded(future: Future[Any]) -> bool:
    return future.done() and not future.cancelled() and future.exception() is None


class RayExecutor:
    """Does pieces on the Ray cluster that this process is connected to."""

    def map(self, work: Callable[[Piece], Output], items: Iterable[Piece]) -> Iterator[Output]:
        """See `Executor`."""
        import ray
        from ray.exceptions import NodeDiedError, RayTaskError, WorkerCrashedError

        task = ray.remote(max_retries=MAX_RETRIES)(work)
        ahead = PIECES_PER_WORKER * max(1, int(ray.cluster_resources().get("CPU", 1)))
        source = iter(items)
        queue: deque[Any] = deque()
        # When the work is abandoned, the few pieces that have begun are left to end by themselves:
        # cancelling a Ray task that ends at that moment can take this process down.
        while True:
            queue.extend(task.remote(item) for item in islice(source, ahead - len(queue)))
            if not queue:
                return
            try:
                result = cast("Output", ray.get(queue[0]))
            except RayTaskError as error:
                raise error.cause from None
            except (WorkerCrashedError, NodeDiedError) as error:
                raise WorkersLostError(
                    f"workers died {MAX_RETRIES + 1} times over the same piece of work"
                ) from error
            queue.popleft()
            yield result


@contextmanager
def _cluster(address: str | None) -> Generator[RayExecutor]:
    """Connect to a cluster, unless this process is connected already."""
    # Ray would otherwise report its use to its makers.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    import ray

    if ray.is_initialized():
        yield RayExecutor()
        return
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Ray warns much; a failure becomes one line below
            ray.init(
                address, include_dashboard=False, log_to_driver=False, logging_level=logging.ERROR
            )
    except (ConnectionError, RuntimeError, ValueError) as error:
        at = f" at {address}" if address else ""
        raise InputError(
            f"no Ray cluster answers{at} ({str(error).splitlines()[0]}); one that asks for a token "
            "also needs RAY_AUTH_MODE=token here"
        ) from error
    try:
        yield RayExecutor()
    finally:
        ray.shutdown()
