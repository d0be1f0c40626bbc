"""The parts of a stone, and the planes in which kernels paint them."""

from __future__ import annotations

PARTS = ("foot", "side", "bevel", "top", "handle")
"""Separately coloured parts of a stone, from the ice up."""
FOOT, SIDE, BEVEL, TOP, HANDLE, SHADE, LIT = range(7)
"""Planes of a painted stone: the share of each part, the light that the ice loses, and the light on
the stone from one side, in units of its side's brightness."""
PLANES = 7

SUMS_IN_ANY_ORDER = {"reassoc", "nsz", "contract", "arcp"}
"""Options of the kernels' floating-point arithmetic: the compiler may reorder it."""
FINE = 2
"""Number of parts into which a pixel's side is cut when a stone is painted; `blur` is written for
two."""
