"""Layout of arrays with the state of a stone, and the nodes of its path.

The order of a state is that of the columns in a file of releases. The places are tuples of whole
numbers, which every version of numba treats as constants.
"""

from __future__ import annotations

from typing import NamedTuple


class _StatePlaces(NamedTuple):
    """Place of each quantity in a state (6,): sheet frame, in m, m/s, rad and rad/s."""

    X: int = 0
    Y: int = 1
    VX: int = 2
    VY: int = 3
    THETA: int = 4
    OMEGA: int = 5


class _NodePlaces(NamedTuple):
    """Place of each quantity in a node of a path: a time [s], the state then, its acceleration."""

    T: int = 0
    X: int = 1
    Y: int = 2
    VX: int = 3
    VY: int = 4
    THETA: int = 5
    OMEGA: int = 6
    AX: int = 7
    AY: int = 8
    ALPHA: int = 9


State = _StatePlaces()
Node = _NodePlaces()
NODE_SIZE = len(Node)
