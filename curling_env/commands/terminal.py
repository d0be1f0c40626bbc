"""What reaches the terminal: our own words, each remark in one line."""

from __future__ import annotations

import io
import logging
import os
import sys
import threading
import warnings
from collections.abc import Generator
from contextlib import contextmanager, suppress
from contextvars import ContextVar

MAX_LINE = 300
"""Characters of a line that explains a refusal."""


_HELD: ContextVar[list[str] | None] = ContextVar("_HELD", default=None)


def say(text: str, *, now: bool = False) -> None:
    """Print a remark for the person at the terminal on stderr; stdout is for results.

    Where stderr is no terminal, remarks come when the command has succeeded: one that is refused
    says only why.

    Parameters
    ----------
    now : print it at once everywhere, because somebody waits for it
    """
    held = _HELD.get()
    if held is not None and not now and not sys.stderr.isatty():
        held.append(text)
        return
    tqdm = sys.modules.get("tqdm")
    # A bar that is being drawn must not be written into.
    (print if tqdm is None else tqdm.tqdm.write)(text, file=sys.stderr)


@contextmanager
def remarks_at_the_end() -> Generator[None]:
    """Hold remarks back until what is done within it has succeeded; else they are dropped."""
    held: list[str] = []
    token = _HELD.set(held)
    try:
        yield
    finally:
        _HELD.reset(token)
    for text in held:
        say(text)


def open_streams() -> None:
    """Give a closed stdin, stdout or stderr a place that leads nowhere, and let them show anything.

    A shell can close them (``>&-``). The next file that is opened would get their place, and what
    is printed would go into it. A letter that the terminal does not know is shown as its number.
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


def shortened(text: str) -> str:
    """A text as one line of at most 300 characters that any terminal can show."""
    line = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in _words(text))
    return line if len(line) <= MAX_LINE else f"{line[: MAX_LINE - 70]} ... {line[-60:]}"


def _words(text: str) -> str:
    # Cut first: a text of megabytes needs no care beyond what is shown.
    if len(text) > 4 * MAX_LINE:
        text = f"{text[: 2 * MAX_LINE]} ... {text[-MAX_LINE:]}"
    return " ".join(text.split())


class _Terminal(io.TextIOWrapper):
    """Where remarks are written: that nobody hears them, on a full disk, stops no work."""

    def write(self, text: str, /) -> int:
        """Write a text, or lead it and all later ones nowhere."""
        try:
            return super().write(text)
        except OSError:
            nothing = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nothing, self.fileno())
            os.close(nothing)
            return len(text)


@contextmanager
def only_our_words() -> Generator[None]:
    """Keep what libraries write to stderr from it; `sys.stderr` goes on to reach the terminal.

    libpng, FFmpeg, OpenCV and Ray write to the process's stderr themselves, and NumPy warns. With
    CURLING_TRACEBACK set all of that is shown. Worker processes inherit the silence, and so hold no
    pipe to whoever reads our stderr.
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
    # Line by line, and whatever a file's name may hold can be printed.
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
