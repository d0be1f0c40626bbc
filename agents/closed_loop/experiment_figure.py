"""The figure of the closed loop: the hidden ice, the estimate of it, and the throws."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from agents.closed_loop.experiment import KNOWLEDGE, ClosedLoopResult, interval
from curling_env.render import figures
from curling_env.sheet import PAPER_SHEET, Direction

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {
    "uniform": "#b5541c",
    "map": "#a38414",
    "map and effects": "#0d7a3f",
    "truth": "#34506e",
}
LABELS = {
    "uniform": "(a) planned on\none friction",
    "map": "(b) planned on\nthe map",
    "map and effects": "(c) planned on\nmap and effects",
    "truth": "(d) planned on\nthe true ice",
}
COLOUR_LIMIT = 20.0
"""End of the colour scale of friction [%]."""


def draw_experiment(result: ClosedLoopResult, path: Path) -> None:
    """Write the figure of one hidden ice; the suffix chooses the format.

    Raises
    ------
    OutputError : the picture cannot be written
    """
    figure = figures.new_figure(10.5, 7.2)
    grid = figure.add_gridspec(3, 2, height_ratios=[1, 1, 4.6], width_ratios=[1, 1.15])
    _draw_maps(figure, [figure.add_subplot(grid[k, :]) for k in range(2)], result)
    _draw_house(figure.add_subplot(grid[2, 0]), result)
    _draw_misses(figure.add_subplot(grid[2, 1]), result)
    figures.save_figure(figure, path)


def _draw_maps(figure: Figure, axes: list[Axes], result: ClosedLoopResult) -> None:
    """Hidden and estimated friction, each relative to its mean in the observed cells."""
    x, y = np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres)
    estimate = result.ices["map and effects"].friction
    observed = estimate.observed
    hidden = result.hidden.friction(x, y)
    estimated = np.where(observed, estimate.mu / estimate.mu[observed].mean(), np.nan)
    layer = None
    for ax, relative, title in (
        (axes[0], hidden / hidden[observed].mean(), "Hidden friction"),
        (axes[1], estimated, f"Estimated from {len(result.tracks)} tracked throws, where they ran"),
    ):
        layer = figures.draw_map(
            ax,
            PAPER_SHEET,
            100 * (relative - 1),
            cmap=figures.KEEN_TO_HEAVY,
            vmin=-COLOUR_LIMIT,
            vmax=COLOUR_LIMIT,
            smooth=ax is axes[0],
        )
        figures.draw_sheet(ax, PAPER_SHEET, rings=0.5)
        figures.show_lengthwise(ax, PAPER_SHEET)
        ax.set_title(title, fontsize=9, loc="left")
    axes[0].set_xticks([])
    assert layer is not None  # two maps were drawn
    bar = figure.colorbar(layer, ax=axes, pad=0.01, aspect=14)
    bar.set_label("friction [%]", fontsize=8)
    bar.ax.tick_params(labelsize=7)


def _draw_house(ax: Axes, result: ClosedLoopResult) -> None:
    """Where draws and guards ended without execution error, with a line from each target."""
    view = figures.from_the_thrower(Direction.AWAY)
    figures.draw_sheet(ax, PAPER_SHEET, view)
    for knowledge in ("uniform", "map and effects"):
        for plan, made in zip(result.plans[knowledge], result.exact[knowledge], strict=True):
            if not plan.objective.comes_to_rest:
                continue
            way = view(np.array([plan.target, made.ends[0]]))
            ax.plot(*way.T, color=COLOURS[knowledge], lw=0.9, alpha=0.8, zorder=4)
            ax.plot(*way[1], "o", ms=5, color=COLOURS[knowledge], zorder=5)
    targets = [p.target for p in result.plans["truth"] if p.objective.comes_to_rest]
    ax.plot(*view(np.array(targets)).T, "+", ms=9, mew=1.4, color=figures.INK, zorder=6)
    figures.show_house(ax, PAPER_SHEET, short=5.2, past=2.6)
    ax.set_title("Draws and guards without execution error, from + to ●", fontsize=9, loc="left")


def _draw_misses(ax: Axes, result: ClosedLoopResult) -> None:
    """Mean miss for each kind of knowledge with its interval, and the share of tasks done."""
    figures.plain_axes(ax)
    for row, knowledge in enumerate(KNOWLEDGE):
        colour = COLOURS[knowledge]
        for error, shift, face in ((False, -0.14, colour), (True, 0.14, "white")):
            miss = interval(result.misses(knowledge, error=error))
            done = result.successes(knowledge, error=error).mean()
            ends = [max(miss["low"], 1e-4), miss["high"]]
            ax.plot(ends, [row + shift] * 2, color=colour, lw=2)
            ax.plot(miss["mean"], row + shift, "o", ms=8, color=colour, mfc=face, mew=1.6)
            ax.text(
                max(miss["high"], miss["mean"]) * 1.2,
                row + shift,
                f"{_length(miss['mean'])}, {100 * done:.0f} % done",
                va="center",
                fontsize=8,
                color=figures.INK,
            )
    ax.set_xscale("log")
    low, high = ax.get_xlim()
    ax.set_xlim(low, max(high, 2.0) * 6)
    ax.set_ylim(len(KNOWLEDGE) - 0.5, -0.5)
    ax.set_yticks(range(len(KNOWLEDGE)), [LABELS[knowledge] for knowledge in KNOWLEDGE])
    ax.set_xlabel("mean miss on the hidden ice [m]", fontsize=8)
    ax.grid(axis="y", visible=False)
    ax.set_title(
        f"{len(result.requests)} throws: ● exact, ○ with the errors of “{result.skill.name}”",
        fontsize=9,
        loc="left",
    )


def _length(metres: float) -> str:
    if metres < 0.01:
        return f"{1000 * metres:.0f} mm"
    return f"{100 * metres:.0f} cm" if metres < 1.0 else f"{metres:.1f} m"
