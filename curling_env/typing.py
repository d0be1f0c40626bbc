"""Names of the types that arrays and callbacks have throughout the three packages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sized
from typing import Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
"""An array of real numbers."""
Singles: TypeAlias = NDArray[np.float32]
"""An array of real numbers in single precision."""
Integers: TypeAlias = NDArray[np.int64]
"""An array of whole numbers."""
Indices: TypeAlias = NDArray[np.intp]
"""Positions in another array."""
Flags: TypeAlias = NDArray[np.bool_]
"""An array of yes and no."""
Image: TypeAlias = NDArray[np.uint8]
"""A picture: (height, width) grey or (height, width, 3) blue, green, red, 0 to 255."""

Item = TypeVar("Item")


class Progress(Protocol):
    """A function that long work calls repeatedly to report how far it is.

    Parameters
    ----------
    what : the step under way, in a few words for a person
    done : how much of it is done, in any unit
    total : how much there is to do, in the same unit; 0 if unknown
    """

    def __call__(self, what: str, done: float, total: float = 1.0, /) -> None: ...


def no_progress(_what: str, _done: float, _total: float = 1.0, /) -> None:
    """Does nothing: the default of every `progress` parameter."""


def with_progress(
    items: Iterable[Item], what: str, progress: Progress, total: float = 0.0
) -> Iterator[Item]:
    """The same items, one by one; `progress` is called after each.

    Parameters
    ----------
    items : the items to work through
    what : the step under way
    progress : called with the number of items done
    total : number of items; 0 takes their length, if they have one
    """
    total = total or (len(items) if isinstance(items, Sized) else 0.0)
    progress(what, 0, total)
    for done, item in enumerate(items, start=1):
        yield item
        progress(what, done, total)


def part_of_progress(progress: Progress, begin: float, end: float) -> Progress:
    """The progress of one step of longer work: its shares are passed on between two shares.

    Parameters
    ----------
    progress : called with shares of the whole work, 0 to 1
    begin, end : shares of the whole work at which the step begins and ends
    """

    def pass_on(what: str, done: float, total: float = 1.0, /) -> None:
        progress(what, begin + (end - begin) * (done / total if total else 0.0))

    return pass_on
