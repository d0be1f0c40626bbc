"""The figure of the closed loop: the ice that was hidden, what was found, and the throws."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from agents.closed_loop.experiment import CHAINS, Proof, interval
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
LETTERS = dict(zip(CHAINS, "abcd", strict=True))
LIMIT = 20.0
"""End of the colour scale of friction [%]."""


def draw_proof(proof: Proof, path: Path) -> None:
    """Write the figure of one hidden ice, format by suffix.

    Raises
    ------
    OutputError : the picture cannot be written
    """
    figure = figures.new_figure(10.5, 7.2)
    grid = figure.add_gridspec(3, 2, height_ratios=[1, 1, 4.6], width_ratios=[1, 1.15])
    _draw_maps(figure, [figure.add_subplot(grid[k, :]) for k in range(2)], proof)
    _draw_house(figure.add_subplot(grid[2, 0]), proof)
    _draw_misses(figure.add_subplot(grid[2, 1]), proof)
    figures.save_figure(figure, path)


def _draw_maps(figure: Figure, axes: list[Axes], proof: Proof) -> None:
    """Hidden and found friction in the cells that the practice crossed, each over its mean."""
    x, y = np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres)
    found = proof.ices["map and effects"].friction
    layer = None
    for ax, mu, title in (
        (axes[0], proof.hidden.friction(x, y), "Hidden friction"),
        (axes[1], found.mu, f"Found from {len(proof.tracks)} tracked throws, where stones ran"),
    ):
        percent = 100 * (mu / mu[found.observed].mean() - 1)
        percent = np.where(found.observed, percent, np.nan) if ax is axes[1] else percent
        layer = figures.draw_map(
            ax, PAPER_SHEET, percent, cmap=figures.KEEN_TO_HEAVY, vmin=-LIMIT, vmax=LIMIT,
            smooth=ax is axes[0],
        )  # fmt: skip
        figures.draw_sheet(ax, PAPER_SHEET, rings=0.5)
        figures.show_lengthwise(ax, PAPER_SHEET)
        ax.set_title(title, fontsize=9, loc="left")
        if ax is axes[0]:
            ax.set_xticks([])
    assert layer is not None  # two maps were drawn
    bar = figure.colorbar(layer, ax=axes, pad=0.01, aspect=14)
    bar.set_label("friction [%]", fontsize=8)
    bar.ax.tick_params(labelsize=7)


def _draw_house(ax: Axes, proof: Proof) -> None:
    """Where draws and guards ended without execution error, an arrow from each target."""
    view = figures.from_the_thrower(Direction.AWAY)
    figures.draw_sheet(ax, PAPER_SHEET, view)
    for chain in ("uniform", "map and effects"):
        for plan, made in zip(proof.plans[chain], proof.exact[chain], strict=True):
            if not plan.wanted.rests:
                continue
            way = view(np.array([plan.target, made.ends[0]]))
            ax.plot(*way.T, color=COLOURS[chain], lw=0.9, alpha=0.8, zorder=4)
            ax.plot(*way[1], "o", ms=5, color=COLOURS[chain], zorder=5)
    targets = [p.target for p in proof.plans["truth"] if p.wanted.rests]
    ax.plot(*view(np.array(targets)).T, "+", ms=9, mew=1.4, color=figures.INK, zorder=6)
    figures.show_house(ax, PAPER_SHEET, short=5.2, past=2.6)
    ax.set_title("Draws and guards without execution error, from + to ●", fontsize=9, loc="left")


def _draw_misses(ax: Axes, proof: Proof) -> None:
    """Mean miss of each chain with its interval, and the share of tasks done."""
    figures.plain_axes(ax)
    for row, chain in enumerate(CHAINS):
        for error, shift, fill in ((False, -0.14, "full"), (True, 0.14, "none")):
            found = interval(proof.misses(chain, error=error))
            done = proof.successes(chain, error=error).mean()
            place = row + shift
            ax.plot(
                [max(found["low"], 1e-4), found["high"]], [place, place], color=COLOURS[chain], lw=2
            )
            ax.plot(
                found["mean"], place, "o", ms=8, color=COLOURS[chain], fillstyle=fill, mew=1.6,
                markerfacecolor=COLOURS[chain] if fill == "full" else "white",
            )  # fmt: skip
            ax.text(
                max(found["high"], found["mean"]) * 1.2, place,
                f"{_length(found['mean'])}, {100 * done:.0f} % done", va="center", fontsize=8,
                color=figures.INK,
            )  # fmt: skip
    ax.set_xscale("log")
    low, high = ax.get_xlim()
    ax.set_xlim(low, max(high, 2.0) * 6)
    ax.set_ylim(len(CHAINS) - 0.5, -0.5)
    ax.set_yticks(range(len(CHAINS)), [f"({LETTERS[c]}) planned on\n{_known(c)}" for c in CHAINS])
    ax.set_xlabel("mean miss on the hidden ice [m]", fontsize=8)
    ax.grid(axis="y", visible=False)
    ax.set_title(
        f"{len(proof.asked)} throws: ● exact, ○ with the hand of “{proof.skill.name}”",
        fontsize=9, loc="left",
    )  # fmt: skip


def _known(chain: str) -> str:
    return {
        "uniform": "one friction",
        "map": "the map",
        "map and effects": "map and effects",
        "truth": "the true ice",
    }[chain]


def _length(metres: float) -> str:
    if metres < 0.01:
        return f"{1000 * metres:.0f} mm"
    return f"{100 * metres:.0f} cm" if metres < 1.0 else f"{metres:.1f} m"
