"""Figure of measured throws and their predictions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from scipy.ndimage import median_filter

from curling_env.ice import Ice
from curling_env.render.figures import (
    FAINT,
    INK,
    TRACK_COLOURS,
    draw_sheet,
    draw_stone,
    lengthwise,
    new_figure,
    plain_axes,
    save_figure,
    show_lengthwise,
)
from curling_env.units import FOOT, INCH, Units, short_length
from friction_estimation.comparison.rethrow import Comparison


def save_comparison(
    comparison: Comparison, ice: Ice, path: Path, units: Units = Units.METRES
) -> None:
    """Measured and predicted paths on the sheet, the misses at rest, and the distance between the
    paths.

    Parameters
    ----------
    comparison : of measured and predicted throws
    ice : that they were predicted with
    path : of the picture
    units : units of displayed lengths
    """
    figure = new_figure(13, 7.2)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.0, 1.9), width_ratios=(1, 1.25))
    top = figure.add_subplot(grid[0, :])
    draw_sheet(top, ice.sheet)
    show_lengthwise(top, ice.sheet)
    colours = {
        k.throw: TRACK_COLOURS[i % len(TRACK_COLOURS)] for i, k in enumerate(comparison.rethrows)
    }
    for k in comparison.rethrows:
        colour = colours[k.throw]
        top.plot(*lengthwise(k.measured).T, color=colour, lw=1.4, alpha=0.75)
        top.plot(*lengthwise(k.predicted).T, color=colour, lw=1.0, ls=(0, (4, 3)))
        if k.rest is not None:
            draw_stone(top, ice.stone.radius, k.rest, colour=colour)
            draw_stone(top, ice.stone.radius, k.predicted_rest, colour=colour, filled=False)
    top.set_xlim(-ice.sheet.length / 2 - 0.3, ice.sheet.length / 2 + 0.3)
    top.legend(
        handles=[
            Line2D([], [], color=INK, lw=1.4, label="measured, rest as a stone"),
            Line2D([], [], color=INK, lw=1.0, ls=(0, (4, 3)), label="predicted, rest as a ring"),
        ],
        frameon=False,
        fontsize=8,
        ncols=2,
        loc="upper left",
        bbox_to_anchor=(0.0, 1.22),
    )
    _draw_misses(figure.add_subplot(grid[1, 0]), comparison, ice.stone.radius, colours, units)
    _draw_parting(figure.add_subplot(grid[1, 1]), comparison, colours, units)
    totals = comparison.summary()
    words = f"paths {_distance(totals['path_rms_m'], units)} apart (rms)"
    if totals["rested"]:
        words += f", rest {_distance(totals['rest_error_m'], units)} apart (rms)"
    save_figure(figure, path, f"{len(comparison.rethrows)} throws thrown again: {words}")


def _draw_misses(
    ax: Any, comparison: Comparison, radius: float, colours: dict[int, str], units: Units
) -> None:
    """Draw predicted places of rest relative to the measured ones, as the thrower sees them."""
    unit, name = (FOOT, "feet") if units is Units.FEET else (1.0, "metres")
    radius = radius / unit
    misses = [
        (k.throw, -k.miss[0] / unit, k.miss[1] / unit)
        for k in comparison.rethrows
        if k.miss is not None
    ]
    plain_axes(
        ax,
        f"left ← {name} → right",
        f"short ← {name} → long",
        "where the prediction rests; grey: the measured stone",
    )
    if not misses:
        ax.text(
            0.5, 0.5, "no throw was seen to rest", transform=ax.transAxes, ha="center", color=FAINT
        )
        return
    reach = max(1.25 * max(abs(v) for _, *both in misses for v in both), 1.3 * radius)
    ax.add_patch(Circle((0, 0), radius, facecolor="#e8ebee", edgecolor=FAINT, lw=1))
    ax.axhline(0, color=FAINT, lw=0.6)
    ax.axvline(0, color=FAINT, lw=0.6)
    for throw, right, long in misses:
        ax.plot(right, long, "o", color=colours[throw], ms=7)
        ax.annotate(str(throw), (right, long), (6, 4), textcoords="offset points", fontsize=7)
    ax.set_xlim(-reach, reach)
    ax.set_ylim(-reach, reach)
    ax.set_aspect("equal", adjustable="box")


def _draw_parting(ax: Any, comparison: Comparison, colours: dict[int, str], units: Units) -> None:
    """Draw the distance along the play between predicted and measured path, over the distance
    travelled.
    """
    feet = units is Units.FEET
    small, large = (INCH, FOOT) if feet else (0.01, 1.0)
    for k in comparison.rethrows:
        ahead = k.release.direction * (k.predicted - k.measured)[:, 1]
        # A median over 21 frames keeps the trend and removes the noise of single frames.
        ahead = median_filter(ahead, size=min(21, len(ahead)), mode="nearest")
        run = np.hypot(*(k.predicted - k.predicted[0]).T) / large
        whole = slice(10, -10) if len(run) > 60 else slice(None)  # medians cut short at the ends
        ax.plot(run[whole], ahead[whole] / small, color=colours[k.throw], lw=1, alpha=0.8)
        outside = np.flatnonzero(k.tested)
        if outside.size:
            ax.plot(run[outside[0]], ahead[outside[0]] / small, "|", color=INK, ms=9)
    ax.axhline(0, color=INK, lw=0.8)
    plain_axes(
        ax,
        f"distance since release [{'ft' if feet else 'm'}]",
        f"behind ← {'inches' if feet else 'cm'} → ahead",
        "prediction ahead of the stone; the bar ends the part it was fitted to",
    )


def _distance(metres: float | None, units: Units) -> str:
    if metres is None:
        return "–"
    return f"{100 * metres:.1f} cm" if units is Units.METRES else short_length(metres, units)
