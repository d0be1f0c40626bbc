"""Executors of independent work: this process, local processes, or a Ray cluster."""

from __future__ import annotations

import re
from collections.abc import Generator
from contextlib import contextmanager

from curling_env.errors import InputError
from curling_env.infrastructure.workers import Executor, ProcessExecutor

MAX_WORKERS = 1024
"""Maximum number of processes."""


@contextmanager
def executor(workers: int | str = 1) -> Generator[Executor]:
    """Provide the executor for a number of workers.

    Parameters
    ----------
    workers : number of local processes, 1 for this process alone; ``"ray"`` for the running Ray
        cluster, or for one started on this machine; ``"ray://host:port"`` for the cluster
        at that address. Every machine of a cluster needs this distribution installed.

    Raises
    ------
    InputError : any other value, or a cluster that does not answer
    """
    text = str(workers)
    if text == "ray" or text.startswith("ray://"):
        from curling_env.infrastructure.ray_cluster import cluster

        with cluster(None if text == "ray" else text) as there:
            yield there
        return
    count = int(text) if re.fullmatch("[0-9]{1,9}", text) else 0
    if not 0 < count <= MAX_WORKERS:
        raise InputError(
            f"workers must be a number of processes up to {MAX_WORKERS}, 'ray' or "
            f"'ray://host:port', got {text[:40]!r}"
        )
    yield Executor() if count == 1 else ProcessExecutor(count)
