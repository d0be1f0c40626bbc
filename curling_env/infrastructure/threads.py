"""Threads of linear-algebra libraries, which start many by default."""

# pyright: reportMissingTypeStubs=false

from __future__ import annotations

import os

from threadpoolctl import threadpool_limits

LIMITS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Environment variables that such libraries read when they are loaded."""


def one_thread() -> None:
    """Limit linear algebra in this process to one thread, also in libraries that are loaded later.

    Our matrices are small: more threads mostly wait for each other, and take the cores from other
    processes.
    """
    for name in LIMITS:
        os.environ[name] = "1"
    threadpool_limits(1)
