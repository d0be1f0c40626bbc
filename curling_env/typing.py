"""Type names of arrays and callbacks in the three packages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sized
from typing import Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
"""Array of real numbers."""
Singles: TypeAlias = NDArray[np.float32]
"""Array of real numbers in single precision."""
Integers: TypeAlias = NDArray[np.int64]
"""Array of whole numbers."""
Indices: TypeAlias = NDArray[np.intp]
"""Positions in another array."""
Flags: TypeAlias = NDArray[np.bool_]
"""Array of booleans."""
Image: TypeAlias = NDArray[np.uint8]
"""Picture: (height, width) grey or (height, width, 3) blue, green, red, 0 to 255."""

Item = TypeVar("Item")


class Progress(Protocol):
    """Function that long work calls repeatedly to report its progress.

    Parameters
    ----------
    what : current step, in a few words for people
    done : amount of it done, in any unit
    total : total amount, in the same unit; 0 if unknown
    """

    def __call__(self, what: str, done: float, total: float = 1.0, /) -> None: ...


def no_progress(_what: str, _done: float, _total: float = 1.0, /) -> None:
    """Do nothing: the default of every `progress` parameter."""


def with_progress(
    items: Iterable[Item], what: str, progress: Progress, total: float = 0.0
) -> Iterator[Item]:
    """Yield the same items, one by one; call `progress` after each.

    Parameters
    ----------
    items : the items
    what : current step
    progress : called with the number of items done
    total : number of items; 0 takes their length, if they have one
    """
    total = total or (len(items) if isinstance(items, Sized) else 0.0)
    progress(what, 0, total)
    for done, item in enumerate(items, start=1):
        yield item
        progress(what, done, total)


def part_of_progress(progress: Progress, begin: float, end: float) -> Progress:
    """Return the progress of one step of longer work, mapped to a range of shares.

    Parameters
    ----------
    progress : called with shares of the whole work, 0 to 1
    begin, end : shares of the whole work at the step's start and end
    """

    def pass_on(what: str, done: float, total: float = 1.0, /) -> None:
        progress(what, begin + (end - begin) * (done / total if total else 0.0))

    return pass_on
