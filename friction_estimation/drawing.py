"""The sheet lying down and what lies on it, for the pictures of reports; needs no display."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, RING_RADII, TEE_Y, Sheet
from curling_env.storage import atomic_path

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

INK = "#22313f"
FAINT = "#8a97a6"
HOG_COLOUR = "#c8433f"
KEEN_TO_HEAVY = "RdBu_r"
"""Keen ice blue, heavy ice red."""
UNCERTAINTY = "YlGnBu"
TRACK_COLOURS = ("#123a63", "#b5541c", "#2b7a4b", "#7a3b8f", "#a38414", "#137f8f")


def lengthwise(xy: Floats) -> tuple[Floats, Floats]:
    """Sheet coordinates (n, 2) as seen from above with the home end on the left."""
    return xy[..., 1], -xy[..., 0]


def draw_sheet(ax: Axes, sheet: Sheet, *, over_map: bool = False) -> None:
    """Ice, lines and both houses, lengthwise."""
    half = sheet.length / 2, sheet.width / 2
    ice = ((-half[0], -half[1]), 2 * half[0], 2 * half[1])
    ax.add_patch(
        Rectangle(*ice, facecolor="none" if over_map else "#f4f8fb", edgecolor=FAINT, lw=1)
    )
    fills = ("none",) * 4 if over_map else ("#cfe0f1", "#f4f8fb", "#f3cfcc", "#f4f8fb")
    for end in (-1, 1):
        for radius, fill in zip(RING_RADII, fills, strict=True):
            ax.add_patch(
                Circle((end * TEE_Y, 0), radius, facecolor=fill, edgecolor=INK, lw=0.5, alpha=0.6)
            )
        for place, colour, width in (
            (TEE_Y, FAINT, 0.7),
            (BACK_LINE_Y, FAINT, 0.7),
            (HOG_LINE_Y, HOG_COLOUR, 1.8),
        ):
            ax.plot([end * place] * 2, [-half[1], half[1]], color=colour, lw=width)
    ax.plot([-half[0], half[0]], [0, 0], color=FAINT, lw=0.5)
    ax.set_xlim(-half[0] - 0.2, half[0] + 0.2)
    ax.set_ylim(-half[1] - 0.1, half[1] + 0.1)
    ax.set_xticks([-TEE_Y, -HOG_LINE_Y, 0, HOG_LINE_Y, TEE_Y])
    ax.set_xticklabels(["home tee", "hog line", "middle", "hog line", "away tee"])
    ax.set_yticks([])
    ax.tick_params(length=0, labelsize=8, colors="#55606b")
    ax.set_aspect("equal")
    for spine in ax.spines.values():
        spine.set_visible(False)


def draw_cells(ax: Axes, sheet: Sheet, values: Floats, **style: Any) -> Any:
    """A value per cell (rows, columns), lengthwise; masked cells stay empty."""
    rows, columns = sheet.shape
    along = -sheet.length / 2 + np.arange(rows + 1) * sheet.cell_size
    across = sheet.width / 2 - np.arange(columns + 1) * sheet.cell_size
    return ax.pcolormesh(along, across, values.T, shading="flat", rasterized=True, **style)


def stone_at(ax: Axes, xy: Floats, radius: float, colour: str, *, filled: bool = True) -> None:
    """A stone from above, lengthwise."""
    u, v = lengthwise(xy)
    face = "#b9bec4" if filled else "none"
    ax.add_patch(
        Circle((float(u), float(v)), radius, facecolor=face, edgecolor=colour, lw=1.2, zorder=4)
    )
    if filled:
        ax.add_patch(Circle((float(u), float(v)), 0.55 * radius, facecolor=colour, zorder=5))


def new_figure(width: float, height: float) -> Figure:
    """An empty figure [inches] in the reports' style."""
    layout = ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.08)
    return Figure(figsize=(width, height), layout=layout, facecolor="white")


def plain_axes(ax: Axes) -> None:
    """Light axes: no box, a faint grid."""
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        ax.spines[side].set_color(FAINT)
    ax.tick_params(labelsize=8, colors="#55606b")
    ax.grid(color="#e3e8ed", lw=0.6)
    ax.set_axisbelow(True)


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure, complete or not at all."""
    with atomic_path(path) as draft:
        figure.savefig(draft, dpi=150)
