"""Law as a table over speed and spin, for large numbers of throws on one ice.

Most effects depend on nothing but the stone's speed and spin. Their sum takes a dozen logarithms
and exponentials, or a few multiplications from a table. Its bins grow with the speed and the spin,
a quarter of an octave each; in a bin the table is a cubic in the speed and a parabola in the spin.
It follows the law to a few parts in a million, or to a few per cent if the rim is about as fast as
the centre, as in a stone's last centimetres. A rest is 0.02 mm off.
"""

# Work arrays come untyped through compiled code: values read from them are unknown, not wrong.
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from typing import Any

import numpy as np

from curling_env.physics.compiled import inlined
from curling_env.typing import Floats

COLUMNS = 5
"""Numbers of the table for each state: drag and torque from `running_band`, times the effects'
factors, acceleration along the travel and to its left, angular acceleration.
"""
SLOWEST, FASTEST = 2.0**-11, 8.0
"""Speeds of the table [m/s]; whole powers of two."""
SPIN_OFFSET = 2.0**-7
"""Offset added to the spin, so that bins are narrow where the sign of the rotation fades out
[rad/s].
"""
MAX_SPIN = 8.0
"""Maximum spin plus offset of the table [rad/s]; a whole power of two."""
NO_TABLE: Floats = np.zeros(0)
"""Empty table of a law that is evaluated."""

_BIN_BITS = 50
"""Number of bits of a double that give the position within a quarter of an octave."""
_REST = np.int64((1 << _BIN_BITS) - 1)
_PER_BIN = 1.0 / (1 << _BIN_BITS)
_FIRST_SPEED_BIN = int(np.float64(SLOWEST).view(np.int64)) >> _BIN_BITS
_FIRST_SPIN_BIN = int(np.float64(SPIN_OFFSET).view(np.int64)) >> _BIN_BITS
SPEED_NODES, SPIN_NODES = 3, 2
"""Number of nodes of the table in each bin."""
_ROWS = 4 * SPEED_NODES * round(math.log2(FASTEST / SLOWEST)) + 1
_ROW_SIZE = COLUMNS * (4 * SPIN_NODES * round(math.log2(MAX_SPIN / SPIN_OFFSET)) + 1)
"""Length of a row of the table; the rows of positive spins come first, then those of negative
ones.
"""
_STEP, _COLUMNS = np.uint64(_ROW_SIZE), np.uint64(COLUMNS)


def _nodes(low: float, high: float, per_bin: int) -> Floats:
    """Return the places of the nodes from `low` to `high`."""
    octaves = round(math.log2(high / low))
    quarters = low * 2.0 ** np.arange(octaves)[:, None] * (1 + np.arange(4) / 4)
    width = low * 2.0 ** np.arange(octaves)[:, None] / 4
    inside = np.arange(per_bin) / per_bin
    return np.append((quarters[..., None] + width[..., None] * inside).ravel(), high)


def table_states() -> tuple[Floats, Floats]:
    """Return speeds (rows,) and spins (2 · columns,) of the nodes, the positive spins first."""
    spins = _nodes(SPIN_OFFSET, MAX_SPIN, SPIN_NODES) - SPIN_OFFSET
    return _nodes(SLOWEST, FASTEST, SPEED_NODES), np.concatenate([spins, -spins])


def as_table(values: Floats) -> Floats:
    """Return the table of values (rows, 2 · columns, COLUMNS) at `table_states`, row after row."""
    return np.ascontiguousarray(values.reshape(_ROWS, 2, -1).swapaxes(0, 1)).ravel()


@inlined
def in_table(table: Any, speed: float, spin: float) -> bool:
    """Return whether a speed and a spin are within a table; never for `NO_TABLE`."""
    return (
        table.shape[0] > 0
        and SLOWEST <= speed < FASTEST
        and math.fabs(spin) + SPIN_OFFSET < MAX_SPIN
    )


@inlined
def _column(table: Any, rows: Any, k: Any, speed_weights: Any, spin_weights: Any) -> float:
    """Return one column at a state: the nodes' values weighted, the rows from their places in
    `table`.
    """
    r0, r1, r2, r3 = rows
    w0, w1, w2, w3 = speed_weights
    s0, s1, s2 = spin_weights
    a, b, c = k, k + _COLUMNS, k + _COLUMNS + _COLUMNS
    first = (w0 * table[r0 + a] + w1 * table[r1 + a]) + (w2 * table[r2 + a] + w3 * table[r3 + a])
    second = (w0 * table[r0 + b] + w1 * table[r1 + b]) + (w2 * table[r2 + b] + w3 * table[r3 + b])
    third = (w0 * table[r0 + c] + w1 * table[r1 + c]) + (w2 * table[r2 + c] + w3 * table[r3 + c])
    return s0 * first + s1 * second + s2 * third


@inlined
def look_up(table: Any, speed: float, spin: float) -> Any:
    """Return the five columns of the table at a state within it."""
    bits = np.float64(speed).view(np.int64)
    row = SPEED_NODES * ((bits >> _BIN_BITS) - _FIRST_SPEED_BIN)
    u = float(bits & _REST) * _PER_BIN
    bits = np.float64(math.fabs(spin) + SPIN_OFFSET).view(np.int64)
    at = COLUMNS * SPIN_NODES * ((bits >> _BIN_BITS) - _FIRST_SPIN_BIN)
    w = float(bits & _REST) * _PER_BIN
    if spin < 0.0:
        row += _ROWS
    # An unsigned index saves a check for counting from the end.
    r0 = np.uint64(row * _ROW_SIZE + at)
    r1 = r0 + _STEP
    r2 = r1 + _STEP
    rows = (r0, r1, r2, r2 + _STEP)
    # Lagrange's weights of the nodes at 0, 1/3, 2/3, 1 and at 0, 1/2, 1.
    a, b, c = u - 1 / 3, u - 2 / 3, u - 1.0
    by_speed = (-4.5 * a * b * c, 13.5 * u * b * c, -13.5 * u * a * c, 4.5 * u * a * b)
    by_spin = (2.0 * (w - 0.5) * (w - 1.0), -4.0 * w * (w - 1.0), 2.0 * w * (w - 0.5))
    return (
        _column(table, rows, np.uint64(0), by_speed, by_spin),
        _column(table, rows, np.uint64(1), by_speed, by_spin),
        _column(table, rows, np.uint64(2), by_speed, by_spin),
        _column(table, rows, np.uint64(3), by_speed, by_spin),
        _column(table, rows, np.uint64(4), by_speed, by_spin),
    )
