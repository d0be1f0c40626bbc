"""Figures of the results: errors of athletes, causes of misses, and a set of stones."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agents.coaching.athletes import HANDLES, AthleteErrors, ErrorSummary
from agents.coaching.in_words import CAUSE_WORDS
from agents.coaching.misses.causes import (
    CAUSES,
    INTERVAL,
    Cause,
    Pattern,
    SessionCauses,
    ThrowCauses,
)
from agents.coaching.stones import StoneFactor, StoneMatch
from curling_env.render import figures
from curling_env.units import FOOT, INCH, Units, chosen_units, length, short_length

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes


HANDLE_COLOURS: dict[str | None, str] = {
    "in-turn": "#b5541c",
    "out-turn": "#137f8f",
    None: "#55606b",
}
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
            _draw_athlete(ax, shown[k], reach)
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


def _draw_athlete(ax: Axes, one: AthleteErrors, reach: tuple[float, float]) -> None:
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
                color=HANDLE_COLOURS[handle],
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
    colour = HANDLE_COLOURS[group.handle]
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


CAUSE_COLOURS: dict[Cause, str] = {
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
            ax.barh(row, value, left=ends[side], height=0.72, color=CAUSE_COLOURS[cause], lw=0)
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
                mfc=CAUSE_COLOURS[cause] if axis else "white",
                color=CAUSE_COLOURS[cause],
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
        ax.barh(0, 0, color=CAUSE_COLOURS[cause], label=CAUSE_WORDS[cause])
    ax.legend(loc="upper center", bbox_to_anchor=(0.45, -0.28), ncols=3, fontsize=9, frameon=False)
    ax.set_title("typical miss and its causes", fontsize=10, loc="left")


def _draw_share(ax: Axes, row: int, pattern: Pattern) -> None:
    ends = {1: 0.0, -1: 0.0}
    for cause, share in pattern.shares.items():
        value = 100 * share.value
        side = 1 if value >= 0 else -1
        ax.barh(row, value, left=ends[side], height=0.6, color=CAUSE_COLOURS[cause], lw=0)
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
