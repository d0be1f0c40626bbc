"""Safe standard streams of the process."""

from __future__ import annotations

import io
import logging
import os
import sys
import threading
import warnings
from collections.abc import Generator
from contextlib import contextmanager, suppress


def open_streams() -> None:
    """Redirect a closed stdin, stdout or stderr to the null device, and let stdout show any
    character.

    A shell can close them (``>&-``). The next file that is opened would get their descriptor, and
    printed text would go into it. A character that stdout cannot encode is shown as its number.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            nothing = os.open(os.devnull, os.O_RDWR)
            if nothing != number:
                os.dup2(nothing, number)
                os.close(nothing)
            os.set_inheritable(number, True)  # workers would find it closed again
        if getattr(sys, name) is None:
            mode = "w" if number else "r"
            setattr(sys, name, os.fdopen(number, mode, encoding="utf-8", closefd=False))
    with suppress(AttributeError, OSError, ValueError):  # not a text file, or not the process's own
        getattr(sys.stdout, "reconfigure")(errors="backslashreplace")  # noqa: B009


class _Terminal(io.TextIOWrapper):
    """Stream for remarks: a full disk behind it stops no work."""

    def write(self, text: str, /) -> int:
        """Write a text, or discard it and all later ones."""
        try:
            return super().write(text)
        except OSError:
            nothing = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nothing, self.fileno())
            os.close(nothing)
            return len(text)


@contextmanager
def silenced_libraries() -> Generator[None]:
    """Silence libraries on stderr; `sys.stderr` still reaches the terminal.

    libpng, FFmpeg, OpenCV and Ray write to the process's stderr themselves, and NumPy warns. With
    CURLING_TRACEBACK set, all of this is shown. Worker processes inherit the silence, and so hold
    no pipe to the reader of our stderr.
    """
    try:
        ours = sys.stderr.fileno() == 2 and not os.environ.get("CURLING_TRACEBACK")
        terminal = os.dup(2) if ours else -1
    except (AttributeError, OSError, ValueError):  # stderr is closed, or a test's own
        ours, terminal = False, -1
    if not ours:
        yield
        return
    before, was_disabled = sys.stderr, logging.root.manager.disable
    before.flush()
    # Line-buffered, and any characters of file names can be printed.
    sys.stderr = _Terminal(
        os.fdopen(terminal, "wb"), encoding=before.encoding, errors="replace", line_buffering=True
    )
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 2)
    os.close(nothing)
    logging.disable(logging.CRITICAL)
    # Not restored: TensorBoard's thread may meet a full disk even after our last line.
    threading.excepthook = lambda _: None
    try:
        with warnings.catch_warnings():
            if not sys.warnoptions:
                warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(was_disabled)
        sys.stderr.flush()
        os.dup2(terminal, 2)
        sys.stderr.close()
        sys.stderr = before
