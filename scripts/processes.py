"""Processes that a script starts end with it, however it ends."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from contextlib import suppress

_SET_PARENT_DEATH_SIGNAL = 1
"""PR_SET_PDEATHSIG of Linux's prctl(2)."""


def end_with(parent: int) -> None:
    """Have the system kill this process when the process that forked it ends.

    To be called in the new process. A script that is killed can tell nobody to end; systems other
    than Linux cannot do it either, and there only an orderly end reaches all processes.

    Parameters
    ----------
    parent : process number of the script, which may have ended already
    """
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(_SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def end_orderly_when_told() -> None:
    """Let SIGTERM end this script as Ctrl-C does, so that it clears away what it has made."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
