"""Execution of independent work on a Ray cluster; see `curling_env.infrastructure.workers`."""

# Ray is optional and comes without complete types.
# pyright: reportMissingImports=false, reportUnknownMemberType=false, reportMissingTypeStubs=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import logging
import os
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from typing import Any

from curling_env.errors import InputError
from curling_env.infrastructure.workers import (
    MAX_RETRIES,
    PIECES_PER_WORKER,
    Executor,
    Output,
    Piece,
    WorkersLostError,
)

os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # disables Ray's usage reports
import ray
from ray.exceptions import NodeDiedError, RayTaskError, WorkerCrashedError


class RayExecutor(Executor):
    """Executor on the Ray cluster that this process is connected to."""

    def map(self, work: Callable[[Piece], Output], items: Iterable[Piece]) -> Iterator[Output]:
        """See `Executor`."""
        task = ray.remote(max_retries=MAX_RETRIES)(work)
        ahead = PIECES_PER_WORKER * max(1, int(ray.cluster_resources().get("CPU", 1)))
        source, begun = iter(items), deque[Any]()
        try:
            # If the work is abandoned, running pieces are left to finish: cancelling a Ray task
            # that ends at that moment can crash this process.
            while begun.extend(map(task.remote, islice(source, ahead - len(begun)))) or begun:
                yield ray.get(begun.popleft())
        except RayTaskError as error:
            raise error.cause from None
        except (WorkerCrashedError, NodeDiedError) as error:
            raise WorkersLostError(
                f"workers died {MAX_RETRIES + 1} times on the same piece of work"
            ) from error


@contextmanager
def cluster(address: str | None) -> Generator[Executor]:
    """Connect to a cluster, unless this process is connected already.

    Parameters
    ----------
    address : of its head; None for the running cluster, or one started on this machine

    Raises
    ------
    InputError : no cluster answers there
    """
    options: dict[str, Any] = {
        "include_dashboard": False,
        "log_to_driver": False,
        "logging_level": logging.ERROR,
    }
    connected = ray.is_initialized()
    try:
        with warnings.catch_warnings(action="ignore"):
            _ = connected or ray.init(address, **options)
    except (ConnectionError, RuntimeError, ValueError) as error:
        at = f" at {address}" if address else ""
        raise InputError(
            f"no Ray cluster answers{at} ({str(error).splitlines()[0]}); one that asks for a token "
            "also needs RAY_AUTH_MODE=token here"
        ) from error
    try:
        yield RayExecutor()
    finally:
        if not connected:
            ray.shutdown()
