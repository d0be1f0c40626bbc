"""Figure of a set of stones: friction and curl of each, and the suggested pairs."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from agents.coaching.stones import StoneFactor, StoneMatch
from curling_env.render import figures
from curling_env.units import FOOT, Units, chosen_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_stones(found: StoneMatch, path: str | Path) -> None:
    """Draw the stones of a set; the suffix chooses the format.

    Parameters
    ----------
    found : result of `match_stones`
    path : picture file to write

    Raises
    ------
    OutputError : the picture cannot be written
    """
    figure = figures.new_figure(9.5, 7.0)
    ax = figure.add_subplot()
    places = {one.stone: _place(one, row) for row, one in enumerate(found.stones)}
    for number, pair in enumerate(found.pairs):
        ends = np.array([places[pair.first], places[pair.second]])
        colour = figures.TRACK_COLOURS[number % len(figures.TRACK_COLOURS)]
        ax.plot(*ends.T, color=colour, lw=9, alpha=0.22, solid_capstyle="round", zorder=1)
    _draw_stones(ax, found, places)
    ax.axhline(0, color=figures.FAINT, lw=0.8, zorder=0)
    figures.plain_axes(ax)
    ax.set_ylabel("◀ keener    friction over the set's [%]    heavier ▶", color=figures.SOFT)
    if found.stones[0].curl is None:
        ax.set_xticks([])
        ax.set_xlabel(f"curl unknown{_open_pairs(found)}", color=figures.SOFT)
    else:
        ax.axvline(0, color=figures.FAINT, lw=0.8, zorder=0)
        words = f"◀ straighter    curl over the set's [%]    curls more ▶{_open_pairs(found)}"
        ax.set_xlabel(words, color=figures.SOFT)
    _second_axis(ax, found)
    title = "Stones against their set, with 95 % intervals; bands join the suggested pairs"
    ax.set_title(title, fontsize=12, fontweight="bold", color=figures.PATH_COLOUR, loc="left")
    figures.save_figure(figure, path, dpi=120)


def _open_pairs(found: StoneMatch) -> str:
    """Return the pairs that cannot be distinguished yet, on separate lines."""
    if not found.undecided:
        return ""
    names = ", ".join(f"{pair.first}-{pair.second}" for pair in found.undecided[:24])
    more = ", …" if len(found.undecided) > 24 else ""
    return "\n" + textwrap.fill(f"not distinguished yet: {names}{more}", 110).replace("$", r"\$")


def _place(one: StoneFactor, row: int) -> tuple[float, float]:
    across = float(row) if one.curl is None else 100 * (one.curl.value - 1)
    return across, 100 * (one.friction.value - 1)


def _draw_stones(ax: Axes, found: StoneMatch, places: dict[str, tuple[float, float]]) -> None:
    for one in found.stones:
        x, y = places[one.stone]
        bars = None
        if one.curl is not None:
            bars = np.array([[x - 100 * (one.curl.low - 1)], [100 * (one.curl.high - 1) - x]])
        ax.errorbar(
            x,
            y,
            xerr=bars,
            yerr=[[y - 100 * (one.friction.low - 1)], [100 * (one.friction.high - 1) - y]],
            color=figures.PATH_COLOUR,
            lw=1.1,
            capsize=2.5,
            zorder=2,
        )
        ax.scatter(x, y, s=330, color="#e8edf1", edgecolor=figures.PATH_COLOUR, lw=1.6, zorder=3)
        ax.text(
            x,
            y,
            one.stone[:5].replace("$", r"\$"),
            ha="center",
            va="center",
            fontsize=8 if len(one.stone) < 3 else 6,
            fontweight="bold",
            color=figures.INK,
            zorder=4,
        )


def _second_axis(ax: Axes, found: StoneMatch) -> None:
    """Add an axis of the extra distance on a draw, next to the friction."""
    known = max(found.stones, key=lambda one: abs(np.log(one.friction.value)))
    per_log = -known.carry.value / float(np.log(known.friction.value) or 1e-9)
    name, unit = ("m", 1.0) if chosen_units() is Units.METRES else ("ft", 1 / FOOT)
    low, high = ax.get_ylim()
    other = ax.twinx()
    other.set_ylim(-unit * per_log * low / 100, -unit * per_log * high / 100)
    other.set_ylabel(f"extra distance on a draw [{name}]", color=figures.SOFT)
    other.tick_params(labelsize=8, colors=figures.SOFT)
    for side in other.spines.values():
        side.set_visible(False)
