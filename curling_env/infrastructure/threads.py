"""Threads of the libraries for linear algebra, which are many by themselves."""

# pyright: reportMissingTypeStubs=false

from __future__ import annotations

import os

from threadpoolctl import threadpool_limits

LIMITS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Environment variables that such libraries read when they are loaded."""


def one_thread() -> None:
    """Let linear algebra in this process use one thread, also in libraries that are loaded later.

    Our matrices are small: more threads wait for each other longer than they work, and take the
    cores from the processes beside this one.
    """
    for name in LIMITS:
        os.environ[name] = "1"
    threadpool_limits(1)
