"""Figures of the sheet with Matplotlib for reports; no display is needed.

Films and windows need many pictures a second: they are drawn by `renderer`.
"""

# Matplotlib's types are incomplete.
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false
# pyright: reportUnknownVariableType=false, reportMissingTypeStubs=false

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Circle, Ellipse
from numpy.typing import ArrayLike
from scipy.ndimage import gaussian_filter, map_coordinates

from curling_env.infrastructure.files.writing import atomic_path
from curling_env.sheet import (
    BACK_LINE_Y,
    HOG_LINE_Y,
    RING_RADII,
    TEE_Y,
    Direction,
    Sheet,
    to_delivery,
)
from curling_env.typing import Floats
from curling_env.units import FOOT, Units

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Projection = Callable[[ArrayLike], Floats]
"""Function that maps points (..., 2) of the sheet frame to points of the drawing."""

RING_COLOURS = ("#7fa8d6", "#ffffff", "#e58a86", "#ffffff")
"""12-, 8- and 4-foot ring and button, pale so that paths and stones stand out."""
HOG_COLOUR = "#c8433f"
ICE_COLOUR = "#f4f8fb"
PATH_COLOUR = "#123a63"
TARGET_COLOUR = "#0d7a3f"
INK = "#22313f"
FAINT = "#8a97a6"
SOFT = "#55606b"
KEEN_TO_HEAVY = "RdBu_r"
"""Keen ice blue, heavy ice red."""
UNCERTAINTY = "YlGnBu"
TRACK_COLOURS = ("#123a63", "#b5541c", "#2b7a4b", "#7a3b8f", "#a38414", "#137f8f")


def lengthwise(xy: ArrayLike) -> Floats:
    """Project the whole sheet on its side, seen from above: the home end is on the left."""
    points = np.asarray(xy, dtype=np.float64)
    return np.stack([points[..., 1], -points[..., 0]], axis=-1)


def from_the_thrower(direction: Direction) -> Projection:
    """Project the end played to from the thrower's view: the tee is the origin and play goes up."""
    return partial(to_delivery, direction=direction)


def draw_sheet(
    ax: Axes, sheet: Sheet, view: Projection = lengthwise, *, rings: float = 1.0
) -> None:
    """Draw ice, lines and both houses; `rings` is the opacity of the rings, low over a map."""
    x, y = sheet.width / 2, sheet.length / 2
    edge = view([(-x, -y), (x, -y), (x, y), (-x, y)])
    ax.fill(*edge.T, facecolor=ICE_COLOUR if rings == 1.0 else "none", edgecolor=FAINT, lw=1)
    for end in (-1, 1):
        tee = view((0.0, end * TEE_Y))
        for radius, colour in zip(RING_RADII, RING_COLOURS, strict=True):
            face = colour if rings == 1.0 else "none"
            centre = (tee[0], tee[1])
            ax.add_patch(
                Circle(centre, radius, facecolor=face, edgecolor=FAINT, lw=0.6, alpha=rings)
            )
        for place, colour, width in (
            (TEE_Y, FAINT, 0.7),
            (BACK_LINE_Y, FAINT, 0.7),
            (HOG_LINE_Y, HOG_COLOUR, 2.0),
        ):
            ax.plot(*view([(-x, end * place), (x, end * place)]).T, color=colour, lw=width)
    ax.plot(*view([(0.0, -y), (0.0, y)]).T, color=FAINT, lw=0.5)
    ax.set_aspect("equal")
    for spine in ax.spines.values():
        spine.set_visible(False)


def show_lengthwise(ax: Axes, sheet: Sheet) -> None:
    """Set limits and ticks of a lengthwise drawing."""
    ax.set_xlim(-sheet.length / 2 - 0.2, sheet.length / 2 + 0.2)
    ax.set_ylim(-sheet.width / 2 - 0.1, sheet.width / 2 + 0.1)
    ax.set_xticks([-TEE_Y, -HOG_LINE_Y, 0, HOG_LINE_Y, TEE_Y])
    ax.set_xticklabels(["home tee", "hog line", "middle", "hog line", "away tee"])
    ax.set_yticks([])
    ax.tick_params(length=0, labelsize=8, colors=SOFT)


def show_house(
    ax: Axes,
    sheet: Sheet,
    *,
    short: float = 4.0,
    past: float = 2.6,
    units: Units = Units.METRES,
) -> None:
    """Set limits to the house seen by the thrower, from `short` of the tee to `past` it [m]."""
    ax.set_xlim(-sheet.width / 2 - 0.05, sheet.width / 2 + 0.05)
    ax.set_ylim(-short, past)
    unit, name, step = (1.0, "m", 1) if units is Units.METRES else (FOOT, "ft", 2)
    across = np.arange(-2, 3) if units is Units.METRES else np.arange(-6, 7, 2)
    along = np.arange(-step * np.floor(short / unit / step), past / unit, step)
    ax.set_xticks(across * unit, [f"{value:g}" for value in across])
    ax.set_yticks(along * unit, [f"{value:g}" for value in along])
    ax.tick_params(length=2, labelsize=8, colors=SOFT)
    ax.set_xlabel(f"right of the centre line [{name}]", fontsize=8, color=SOFT)
    ax.set_ylabel(f"past the tee [{name}]", fontsize=8, color=SOFT)


def draw_map(
    ax: Axes,
    sheet: Sheet,
    values: Floats,
    view: Projection = lengthwise,
    *,
    smooth: bool = True,
    **style: Any,
) -> Any:
    """Draw values (rows, columns) of the cells as a heat map; return it for a colour bar."""
    rows, columns = sheet.shape
    x = -sheet.width / 2 + np.arange(columns + 1) * sheet.cell_size
    y = -sheet.length / 2 + np.arange(rows + 1) * sheet.cell_size
    if smooth:  # bilinear between the centres of cells, as in the force law
        ice_x, ice_y = np.linspace(x[0], x[-1], 46), np.linspace(y[0], y[-1], 446)
        fine_x, fine_y = np.meshgrid((ice_x[1:] + ice_x[:-1]) / 2, (ice_y[1:] + ice_y[:-1]) / 2)
        row = (fine_y - sheet.y_centres[0]) / sheet.cell_size
        column = (fine_x - sheet.x_centres[0]) / sheet.cell_size
        values = map_coordinates(values, [row, column], order=1, mode="nearest")
        x, y = ice_x, ice_y
    corners = view(np.stack(np.meshgrid(x, y), axis=-1))
    return ax.pcolormesh(
        corners[..., 0], corners[..., 1], values, shading="flat", rasterized=True, **style
    )


def draw_stone(
    ax: Axes,
    radius: float,
    xy: ArrayLike,
    view: Projection = lengthwise,
    *,
    colour: str,
    filled: bool = True,
    zorder: float = 6,
    **style: Any,
) -> None:
    """Draw a stone from above in its true size, with a coloured handle, or only its outline."""
    x, y = view(xy)
    granite = "#9aa0a6" if filled else "none"
    edge = "#3c4248" if filled else colour
    ax.add_patch(
        Circle((x, y), radius, facecolor=granite, edgecolor=edge, lw=0.9, zorder=zorder, **style)
    )
    if filled:
        handle = Circle(
            (x, y), 0.68 * radius, facecolor=colour, edgecolor="none", zorder=zorder + 0.1, **style
        )
        ax.add_patch(handle)


def draw_target(ax: Axes, xy: ArrayLike, view: Projection, **style: Any) -> None:
    """Draw a cross at the target."""
    x, y = view(xy)
    ax.plot([x], [y], marker="+", ms=13, mew=2.2, color=TARGET_COLOUR, ls="", zorder=9, **style)


def draw_landing_ellipse(
    ax: Axes, points: Floats, share: float, view: Projection, **style: Any
) -> None:
    """Draw the ellipse that contains a share of normally distributed points (n, 2)."""
    seen = view(points)
    if len(seen) < 3:
        return
    values, vectors = np.linalg.eigh(np.cov(seen.T))
    scale = np.sqrt(-2 * np.log(1 - share) * np.maximum(values, 0.0))
    centre = seen.mean(axis=0)
    ax.add_patch(
        Ellipse(
            (centre[0], centre[1]),
            width=2 * scale[0],
            height=2 * scale[1],
            angle=float(np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0]))),
            facecolor="none",
            **style,
        )
    )


def draw_landing_cloud(
    ax: Axes, points: Floats, share: float, view: Projection, **style: Any
) -> None:
    """Draw the line around the densest region that contains a share of points (n, 2) of any
    shape.
    """
    seen = view(points)
    if len(seen) < 3:
        return
    cell, blur = 0.04, 0.1
    low, high = seen.min(axis=0) - 4 * blur, seen.max(axis=0) + 4 * blur
    cells = np.maximum(np.ceil((high - low) / cell).astype(int), 4)
    count, x, y = np.histogram2d(*seen.T, bins=cells, range=list(zip(low, high, strict=True)))
    density = gaussian_filter(count, blur / cell, mode="constant")
    ranked = np.sort(density, axis=None)[::-1]
    level = float(ranked[np.searchsorted(np.cumsum(ranked), share * ranked.sum())])
    middle_x, middle_y = (x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2
    ax.contour(middle_x, middle_y, density.T, levels=[level], **style)


def new_figure(width: float, height: float) -> Figure:
    """Make an empty figure in the style of the reports; width and height in inches."""
    layout = ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.08)
    return Figure(figsize=(width, height), layout=layout, facecolor="white")


def plain_axes(ax: Axes, x: str = "", y: str = "", title: str = "") -> None:
    """Give axes no box and a faint grid, and labels if there are any."""
    for label, text, size in (
        (ax.set_xlabel, x, 9),
        (ax.set_ylabel, y, 9),
        (ax.set_title, title, 10),
    ):
        if text:
            label(text, fontsize=size, color=INK)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        ax.spines[side].set_color(FAINT)
    ax.tick_params(labelsize=8, colors=SOFT)
    ax.grid(color="#e3e8ed", lw=0.6)
    ax.set_axisbelow(True)


def save_figure(figure: Figure, path: str | Path, title: str = "", *, dpi: int = 150) -> None:
    """Write a figure to a file, completely or not at all; as PNG unless its name has another
    suffix.

    Parameters
    ----------
    title : title above the whole figure

    Raises
    ------
    OutputError : see `atomic_path`
    """
    if title:
        figure.suptitle(title, fontsize=13, color=INK)
    named = Path(path).suffix.lower().removeprefix(".")
    kind = named if named in figure.canvas.get_supported_filetypes() else "png"
    with atomic_path(path) as draft:
        figure.savefig(draft, dpi=dpi, format=kind)
