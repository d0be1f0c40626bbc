"""Figure of the causes of misses: the contribution of each cause to each throw, and in total."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from agents.coaching.in_words import CAUSE_WORDS
from agents.coaching.misses.causes import (
    CAUSES,
    INTERVAL,
    Cause,
    Pattern,
    SessionCauses,
    ThrowCauses,
)
from curling_env.render import figures
from curling_env.units import FOOT, Units, chosen_units, length

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS: dict[Cause, str] = {
    "weight": "#123a63",
    "line": "#c4622d",
    "rotation": "#2b7a4b",
    "ice": "#6fb1dc",
    "sweeping": "#7a3b8f",
    "neither": "#b4bcc4",
}
"""Colour of each cause."""
MAX_ROWS = 40
"""Maximum number of throws drawn one by one; those with the largest misses are chosen."""


def draw_causes(found: SessionCauses, path: str | Path) -> None:
    """Draw the causes of a session's misses; the suffix chooses the format.

    Parameters
    ----------
    found : result of `hand_or_ice`
    path : picture file to write

    Raises
    ------
    OutputError : the picture cannot be written
    """
    throws = sorted(found.throws, key=lambda one: -one.distance)[:MAX_ROWS]
    throws = sorted(throws, key=lambda one: one.throw)
    rows = max(len(throws), 1)
    figure = figures.new_figure(12.0, 3.4 + 0.27 * rows)
    grid = figure.add_gridspec(2, 2, height_ratios=[0.27 * rows + 0.6, 2.6])
    along, across = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
    _draw_bars(along, throws, 1, labels=True)
    _draw_bars(across, throws, 0, labels=False)
    _draw_means(figure.add_subplot(grid[1, 0]), found)
    _draw_shares(figure.add_subplot(grid[1, 1]), found)
    title = "Hand or ice: contributions to each stone's miss"
    figure.suptitle(title, fontsize=14, fontweight="bold", color=figures.PATH_COLOUR)
    figures.save_figure(figure, path, dpi=120)


def _scale() -> tuple[float, str]:
    return (1.0, "m") if chosen_units() is Units.METRES else (1 / FOOT, "ft")


def _draw_bars(ax: Axes, throws: list[ThrowCauses], axis: int, *, labels: bool) -> None:
    """Draw a row for each throw: its parts end to end, to either side, and its miss as a mark."""
    factor, unit = _scale()
    for row, one in enumerate(throws):
        ends = {1: 0.0, -1: 0.0}
        for cause, part in one.parts.items():
            value = factor * (part.past if axis else part.right).value
            side = 1 if value >= 0 else -1
            ax.barh(row, value, left=ends[side], height=0.72, color=COLOURS[cause], lw=0)
            ends[side] += value
        ax.plot(factor * one.miss[axis], row, "D", ms=4.5, mfc="white", mec=figures.INK, mew=1.2)
    ax.axvline(0.0, color=figures.INK, lw=0.9)
    figures.plain_axes(ax)
    ax.set_ylim(len(throws) - 0.4, -0.6)
    ax.set_yticks(range(len(throws)), [_label(one) for one in throws] if labels else [])
    less, more = ("short", "past") if axis else ("left", "right")
    ax.set_xlabel(f"◀ {less}      [{unit}]      {more} ▶", fontsize=9, color=figures.SOFT)
    ax.set_title("along the sheet" if axis else "across the sheet", fontsize=10, loc="left")


def _label(one: ThrowCauses) -> str:
    call = one.call.text if len(one.call.text) <= 24 else f"{one.call.text[:23]}…"
    return "  ".join(filter(None, (str(one.throw), one.athlete[:14], call))).replace("$", r"\$")


def _draw_means(ax: Axes, found: SessionCauses) -> None:
    """Draw the mean contribution of each cause, along and across the sheet, with 95 % intervals."""
    factor, unit = _scale()
    mean = {} if found.pattern is None else found.pattern.mean
    for row, (cause, ways) in enumerate(mean.items()):
        for axis, lift in ((1, -0.16), (0, 0.16)):
            one = ways[axis]
            ax.errorbar(
                factor * one.value,
                row + lift,
                xerr=factor * INTERVAL * (one.sigma or 0.0),
                fmt="o" if axis else "s",
                ms=6,
                mfc=COLOURS[cause] if axis else "white",
                color=COLOURS[cause],
                lw=1.6,
                capsize=2.5,
            )
    ax.axvline(0.0, color=figures.INK, lw=0.9)
    figures.plain_axes(ax)
    ax.set_yticks(range(len(mean)), [CAUSE_WORDS[cause] for cause in mean])
    ax.set_ylim(len(mean) - 0.4, -0.6)
    words = f"●  ◀ short, past ▶      [{unit}]      □  ◀ left, right ▶"
    ax.set_xlabel(words, fontsize=9, color=figures.SOFT)
    ax.set_title("systematic part: means, 95 % intervals", fontsize=10, loc="left")


def _draw_shares(ax: Axes, found: SessionCauses) -> None:
    """Draw the share of each cause in the squared misses, for all throws and each athlete."""
    patterns = ([found.pattern] if found.pattern is not None else []) + list(found.athletes[:8])
    for row, pattern in enumerate(patterns):
        _draw_share(ax, row, pattern)
    figures.plain_axes(ax)
    names = [
        f"{'all' if p.athlete is None else p.athlete[:16]}: {length(p.typical_miss)}"
        for p in patterns
    ]
    ax.set_yticks(range(len(patterns)), [name.replace("$", r"\$") for name in names])
    ax.set_ylim(len(patterns) - 0.4, -0.6)
    ax.set_xlabel("share of the squared misses [%]", fontsize=9, color=figures.SOFT)
    used: list[Cause] = [c for c in CAUSES if any(c in one.parts for one in found.throws)]
    for cause in used:
        ax.barh(0, 0, color=COLOURS[cause], label=CAUSE_WORDS[cause])
    ax.legend(loc="upper center", bbox_to_anchor=(0.45, -0.28), ncols=3, fontsize=9, frameon=False)
    ax.set_title("typical miss and its causes", fontsize=10, loc="left")


def _draw_share(ax: Axes, row: int, pattern: Pattern) -> None:
    ends = {1: 0.0, -1: 0.0}
    for cause, share in pattern.shares.items():
        value = 100 * share.value
        side = 1 if value >= 0 else -1
        ax.barh(row, value, left=ends[side], height=0.6, color=COLOURS[cause], lw=0)
        if value > 7:
            light = cause in ("ice", "neither")
            ax.text(
                ends[side] + value / 2,
                row,
                f"{value:.0f} %",
                ha="center",
                va="center",
                fontsize=8,
                color=figures.INK if light else "white",
            )
        ends[side] += value
