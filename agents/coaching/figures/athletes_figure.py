"""Figure of athletes: line and weight of their throws, by handle, with ellipses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agents.coaching.athletes import HANDLES, AthleteErrors, ErrorSummary
from curling_env.render import figures
from curling_env.units import FOOT, INCH, Units, chosen_units, short_length

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

COLOURS: dict[str | None, str] = {"in-turn": "#b5541c", "out-turn": "#137f8f", None: "#55606b"}
MARKS: dict[str, Any] = {"guard": "^", "draw": "o", "hit": "s"}
MAX_ATHLETES = 9
"""Maximum number of athletes drawn; those with most throws are chosen."""


def draw_athletes(found: Sequence[AthleteErrors], path: str | Path) -> None:
    """Draw the errors of athletes; the suffix chooses the format.

    Parameters
    ----------
    found : result of `athlete_errors`
    path : picture file to write

    Raises
    ------
    OutputError : the picture cannot be written
    """
    shown = sorted(found, key=lambda one: -one.overall.throws)[:MAX_ATHLETES]
    columns = min(len(shown), 3)
    rows = -(-len(shown) // columns)
    figure = figures.new_figure(max(4.4 * columns, 7.4), 4.4 * rows + 0.7)
    axes = figure.subplots(rows, columns, squeeze=False)
    reach = _reach(shown)
    for k, ax in enumerate(axes.flat):
        if k < len(shown):
            _draw(ax, shown[k], reach)
        else:
            ax.axis("off")
    figure.suptitle(
        "Line and weight against the intended throw: bias (crosses, 95 %), 50 % and 90 % of throws",
        fontsize=11,
        fontweight="bold",
        color=figures.PATH_COLOUR,
    )
    figures.save_figure(figure, path, dpi=120)


def _reach(shown: Sequence[AthleteErrors]) -> tuple[float, float]:
    """Return the limits of the axes for all athletes: line [m] and speed [m/s]."""
    points = [one.errors[:, [1, 0]] for one in shown]
    ellipses = [group.ellipse(0.9) for one in shown for group in _by_handle(one)]
    largest = np.nanmax(np.abs(np.concatenate(points + ellipses)), axis=0, initial=0.02)
    return 1.06 * float(largest[0]), 1.06 * float(largest[1])


def _draw(ax: Axes, one: AthleteErrors, reach: tuple[float, float]) -> None:
    unit, across, of_weight, up = "cm", 100.0, "m/s", 1.0
    if chosen_units() is Units.FEET:
        unit, across, of_weight, up = "in", 1 / INCH, "ft/s", 1 / FOOT
    if one.seconds_per_speed is not None:
        of_weight, up = "s hog to hog", -one.seconds_per_speed
    ax.axhline(0, color=figures.FAINT, lw=0.8)
    ax.axvline(0, color=figures.FAINT, lw=0.8)
    for handle in (*HANDLES, None):
        for weight, mark in MARKS.items():
            mine = [
                k
                for k, (h, w) in enumerate(zip(one.handles, one.weights, strict=True))
                if h == handle and w == weight
            ]
            ax.scatter(
                across * one.errors[mine, 1],
                up * one.errors[mine, 0],
                s=20,
                marker=mark,
                color=COLOURS[handle],
                alpha=0.75,
                lw=0,
            )
    for group in _by_handle(one):
        _draw_ellipses(ax, group, across, up)
    ax.set_xlim(-across * reach[0], across * reach[0])
    ax.set_ylim(-up * reach[1], up * reach[1])
    figures.plain_axes(ax)
    ax.set_xlabel(f"◀ left   line [{unit}]   right ▶", fontsize=8, color=figures.SOFT)
    ax.set_ylabel(f"◀ light   weight [{of_weight}]   heavy ▶", fontsize=8, color=figures.SOFT)
    spread = short_length(one.overall.spread[1].value)
    weight = abs(up) * one.overall.spread[0].value
    name = (one.name or "no name").replace("$", r"\$")
    ax.set_title(
        f"{name}: {one.overall.throws} throws, ±{weight:.2f} {of_weight.split()[0]}, ±{spread}",
        fontsize=10,
        loc="left",
    )
    ax.legend(loc="lower right", fontsize=7, frameon=False)


def _by_handle(one: AthleteErrors) -> list[ErrorSummary]:
    """Return one group for each handle, or all throws without handles."""
    found: list[ErrorSummary] = []
    for handle in HANDLES:
        of = [group for group in one.groups if group.handle == handle]
        if of:
            found.append(max(of, key=lambda group: group.throws))
    return found or [one.overall]


def _draw_ellipses(ax: Axes, group: ErrorSummary, across: float, up: float) -> None:
    colour = COLOURS[group.handle]
    for share, width in ((0.5, 1.8), (0.9, 0.9)):
        ellipse = group.ellipse(share) * [across, up]
        ax.plot(*ellipse.T, color=colour, lw=width, label=group.handle if share == 0.5 else None)
    line, speed = group.bias[1], group.bias[0]
    ax.errorbar(
        across * line.value,
        up * speed.value,
        xerr=[[across * (line.value - line.low)], [across * (line.high - line.value)]],
        yerr=[[up * (speed.value - speed.low)], [up * (speed.high - speed.value)]],
        color=colour,
        lw=2.2,
        zorder=5,
    )
