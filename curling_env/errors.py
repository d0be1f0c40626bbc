"""Exception tree: everything a caller may want to catch derives from CurlingError."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path


class CurlingError(Exception):
    """Base of every error this project raises on purpose. Its text is one line for a person."""


class InputError(CurlingError, ValueError):
    """Invalid input from outside.

    Parameters
    ----------
    problem : expected and actual value
    source : file or argument with the problem
    where : place inside the source, such as ``row 12, column y`` or ``frame 40``
    """

    def __init__(
        self, problem: str, *, source: str | Path | None = None, where: str | None = None
    ) -> None:
        self.problem = problem
        self.source = None if source is None else str(source)
        self.where = where
        place = ", ".join(part for part in (self.source, where) if part)
        text = f"{place}: {problem}" if place else problem
        super().__init__("".join(c if c.isprintable() else _in_place_of(c) for c in text))


def _in_place_of(letter: str) -> str:
    """Return a substitute for a character of a key or a name that cannot be printed."""
    return " " if letter.isspace() else "\N{REPLACEMENT CHARACTER}"


class OutputError(CurlingError, OSError):
    """A result could not be written; nothing was left half-written."""


class UnknownOptionError(InputError, TypeError):
    """Keyword argument that a function or an environment does not have."""


class OutOfRangeError(InputError):
    """Number outside the model's range of validity."""


class TrackTooShortError(InputError):
    """Too few samples for the requested quantity."""


class FitError(InputError):
    """Measured throws to which no ice can be fitted."""


class NoThrowError(InputError):
    """Film, or part of one, without a thrown stone."""


@contextmanager
def placed(*, source: str | Path | None = None, where: str | None = None) -> Generator[None]:
    """Add the place to an `InputError` of this block that has no source.

    Parameters
    ----------
    source, where : as in `InputError`; a more exact `where` of the error stays
    """
    try:
        yield
    except InputError as error:
        if error.source is not None:
            raise
        raise InputError(error.problem, source=source, where=error.where or where) from error
