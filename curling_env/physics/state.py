"""The order in which arrays hold the state of a stone, and the nodes of its path.

The order of a state is that of the columns in a file of releases.
"""

from __future__ import annotations

from enum import IntEnum


class State(IntEnum):
    """Place of each quantity in a state (6,): sheet frame, in m, m/s, rad and rad/s."""

    X = 0
    Y = 1
    VX = 2
    VY = 3
    THETA = 4
    OMEGA = 5


class Node(IntEnum):
    """Place of each quantity in a node of a path: a time [s], the state then, its acceleration."""

    T = 0
    X = 1
    Y = 2
    VX = 3
    VY = 4
    THETA = 5
    OMEGA = 6
    AX = 7
    AY = 8
    ALPHA = 9


NODE_SIZE = len(Node)
