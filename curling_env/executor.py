"""Independent pieces of work, done here, in local processes or on a Ray cluster.

One function, `executor`, and one method, `map`. Results come in the order of the items whoever did
them, and a piece whose worker was killed is done again by another: work that depends on nothing
but its item gives the same numbers on any number of workers.
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
from multiprocessing import get_context
from typing import Any, Protocol, TypeVar, cast

from curling_env.errors import CurlingError, InputError

Item = TypeVar("Item")
Result = TypeVar("Result")

MOST_LOSSES = 3
"""Times a piece is done again after its worker was lost; a piece that kills workers must end."""
AHEAD = 4
"""Pieces handed out for each worker before the first is back, so that none waits."""


class WorkersLostError(CurlingError):
    """Workers died again and again over the same work."""


class Executor(Protocol):
    """Whoever does pieces of work."""

    def map(self, work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """Results of work on each item, in the order of the items.

        Parameters
        ----------
        work : a function of a module, which depends on nothing but its item

        Raises
        ------
        WorkersLostError : workers died over the same piece again and again
        """
        ...


@contextmanager
def executor(workers: int | str = 1) -> Generator[Executor]:
    """Whoever is to do the work.

    Parameters
    ----------
    workers : how many local processes, 1 for this one alone; ``"ray"`` for the Ray cluster at hand,
        or one that is started on this machine; ``"ray://host:port"`` for that one. Every machine of
        a cluster needs this distribution installed.

    Raises
    ------
    InputError : workers that are none of these, or a cluster that does not answer
    """
    text = str(workers)
    if text == "ray" or text.startswith("ray://"):
        with _cluster(None if text == "ray" else text) as cluster:
            yield cluster
        return
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise InputError(
            f"workers must be a number of processes, 'ray' or 'ray://host:port', got {text!r}"
        )
    yield Here() if int(text) == 1 else Processes(int(text))


class Here:
    """The process itself, one piece after the other."""

    def map(self, work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """See `Executor`."""
        return map(work, items)


class Processes:
    """Local processes.

    Fresh ones: forking a process that holds numba's and OpenCV's threads may hang.

    Parameters
    ----------
    count : how many
    """

    def __init__(self, count: int) -> None:
        self._count = count

    def map(self, work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """See `Executor`."""
        source = iter(items)
        queue: deque[tuple[Item, Future[Result]]] = deque()
        pool, losses = self._pool(), 0
        try:
            while True:
                try:
                    for item in islice(source, AHEAD * self._count - len(queue)):
                        # In the queue before anything can fail: no item is lost with a pool.
                        queue.append((item, Future()))
                        queue[-1] = (item, pool.submit(work, item))
                    if not queue:
                        return
                    result = queue[0][1].result()
                except BrokenProcessPool:
                    losses += 1
                    if losses > MOST_LOSSES:
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
        return ProcessPoolExecutor(self._count, mp_context=get_context("spawn"))


def _succeeded(future: Future[Any]) -> bool:
    return future.done() and not future.cancelled() and future.exception() is None


class RayCluster:
    """The Ray cluster that this process is connected to."""

    def map(self, work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """See `Executor`."""
        import ray
        from ray.exceptions import NodeDiedError, RayTaskError, WorkerCrashedError

        task = ray.remote(max_retries=MOST_LOSSES)(work)
        ahead = AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))
        source = iter(items)
        queue: deque[Any] = deque()
        # What has begun when a sweep is abandoned runs out by itself, a few pieces for each worker:
        # in Ray a cancel races with the task's own end, and the loser is this process.
        while True:
            queue.extend(task.remote(item) for item in islice(source, ahead - len(queue)))
            if not queue:
                return
            try:
                result = cast("Result", ray.get(queue[0]))
            except RayTaskError as error:
                raise error.cause from None
            except (WorkerCrashedError, NodeDiedError) as error:
                raise WorkersLostError(
                    f"workers died {MOST_LOSSES + 1} times over the same piece of work"
                ) from error
            queue.popleft()
            yield result


@contextmanager
def _cluster(address: str | None) -> Generator[RayCluster]:
    """Connect to a cluster, unless this process is connected already."""
    # Nothing is told to anyone outside.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    import ray

    if ray.is_initialized():
        yield RayCluster()
        return
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of Ray's: a failure is one line, below
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
        yield RayCluster()
    finally:
        ray.shutdown()
