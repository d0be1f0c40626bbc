"""Figures of the demo: the hidden ice beside its estimate, and the draws that test it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from agents.closed_loop.demo_findings import ComparedDraw, Findings
from curling_env.ice import Ice
from curling_env.physics.slides import play_bounds, slide
from curling_env.render import figures
from curling_env.throw import Throw
from curling_env.typing import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ON_TRUE, ON_ESTIMATED, BY_AVERAGE = "#c8433f", "#2f6fb3", "#e0a100"
"""Handle colours: thrown on the hidden ice, on the estimate, and planned on the average ice."""


def draw_all(found: Findings, folder: Path) -> None:
    """Write maps.png, house.png, draws.png, missing.png, and page.png with all but the last.

    Raises
    ------
    OutputError : a picture cannot be written
    """
    figure = figures.new_figure(11, 5.8)
    _maps(figure, found)
    figures.save_figure(figure, folder / "maps.png")
    for name, draw in (("house", _house), ("draws", _more_draws), ("missing", _missing_effect)):
        figure = figures.new_figure(6.2, 7.4 if name != "missing" else 5.8)
        draw(figure.subplots(), found)
        figures.save_figure(figure, folder / f"{name}.png")
    figure = figures.new_figure(15, 15.5)
    rows: Any = figure.subfigures(2, 1, height_ratios=[1, 1.05])
    rows[0].suptitle(found.headline(), fontsize=15, fontweight="bold", color=figures.PATH_COLOUR)
    _maps(rows[0], found)
    left, right = rows[1].subfigures(1, 2)
    _house(left.add_subplot(), found)
    _more_draws(right.add_subplot(), found)
    figures.save_figure(figure, folder / "page.png")


def _maps(figure: Figure, found: Findings) -> None:
    """Draw hidden ice, estimated ice with the filmed paths, and its uncertainty, one above the
    other.
    """
    axes = [figure.add_subplot(3, 1, k) for k in (1, 2, 3)]
    sheet = found.true_ice.sheet
    true, estimate = (100 * found.difference(ice) for ice in (found.true_ice, found.estimated_ice))
    limit = max(float(np.abs(true).max()), 2.0)
    scale: dict[str, Any] = {"cmap": figures.KEEN_TO_HEAVY, "vmin": -limit, "vmax": limit}
    layer = figures.draw_map(axes[0], sheet, true, **scale)
    figures.draw_map(axes[1], sheet, estimate, **scale)
    bar = figure.colorbar(layer, ax=axes[:2], pad=0.01, aspect=24, shrink=0.85)
    bar.set_label("friction against the average [%]\nblue keen, red heavy", fontsize=9)
    friction = found.estimated_ice.friction
    sigma = 100 * friction.sigma / friction.mu
    layer = figures.draw_map(axes[2], sheet, sigma, cmap="Greys", vmin=0, vmax=float(sigma.max()))
    bar = figure.colorbar(layer, ax=axes[2], pad=0.01, aspect=11, shrink=0.85)
    bar.set_label("uncertainty σ [%]", fontsize=9)
    for track in found.tracks:
        for ax in axes[1:]:
            ax.plot(*figures.lengthwise(track.xy).T, color=figures.INK, lw=0.9, alpha=0.55)
    for ax, ice in zip(axes, (found.true_ice, found.estimated_ice), strict=False):
        path = figures.lengthwise(_path(ice, found, found.plan.best.throw))
        ax.plot(*path.T, color=figures.TARGET_COLOUR, lw=2.2, label="a test draw")
    _outline_areas(axes[1], found)
    titles = (
        "The hidden ice with its heavy and keen areas",
        f"The ice estimated from {len(found.tracks)} filmed throws (thin lines); dashed: parts "
        "found heavy or keen",
        "Uncertainty of the estimate: dark where no stone ran",
    )
    for ax, title in zip(axes, titles, strict=True):
        figures.draw_sheet(ax, sheet, rings=0.55)
        figures.show_lengthwise(ax, sheet)
        ax.set_title(title, fontsize=11, loc="left", color=figures.INK)
    axes[0].legend(loc="lower left", fontsize=9, framealpha=0.85)


def _outline_areas(ax: Axes, found: Findings) -> None:
    for area in found.areas:
        (left, right), (low, high) = area.x, area.y
        corners = [(left, low), (right, low), (right, high), (left, high), (left, low)]
        outline = figures.lengthwise(corners)
        ax.plot(*outline.T, color=figures.INK, lw=1.1, ls="--")
        x, y = figures.lengthwise((np.mean(area.x), np.mean(area.y)))
        ax.text(
            x,
            y,
            f"{area.kind}\n{100 * (area.relative or 0.0):+.0f} %",
            ha="center",
            va="center",
            fontsize=9,
            color=figures.INK,
            fontweight="bold",
            bbox={"boxstyle": "round,pad=0.2", "fc": "white", "ec": "none", "alpha": 0.75},
        )


def _path(ice: Ice, found: Findings, throw: Throw) -> Floats:
    """Return the path of a throw on an ice, sheet frame (n, 2) [m]."""
    direction = found.plan.direction
    bounds = play_bounds(ice, direction)
    trajectory = slide(ice, throw.release(direction), bounds=bounds, fps=20.0).trajectory
    assert trajectory is not None  # a rate was requested
    return trajectory.xy


def _house(ax: Axes, found: Findings) -> None:
    """Draw the places of rest of the tested draw."""
    plan, ice, view = found.plan, found.true_ice, _view_of(found)
    figures.draw_sheet(ax, ice.sheet, view)
    for path, colour, style, width in (
        (_path(ice, found, found.average_plan.best.throw), BY_AVERAGE, "-", 1.5),
        (_path(found.estimated_ice, found, plan.best.throw), ON_ESTIMATED, "--", 1.8),
        (_path(ice, found, plan.best.throw), ON_TRUE, "-", 1.8),
    ):
        ax.plot(*view(path).T, color=colour, ls=style, lw=width, zorder=4)
    rests = (
        (found.tested.rest, ON_TRUE, found.tested.miss, "thrown on the hidden ice"),
        (found.on_estimated, ON_ESTIMATED, found.miss_on_estimated,
         "thrown on the estimated ice"),
        (found.tested.other, BY_AVERAGE, found.tested.other_miss,
         "thrown on the hidden ice, planned on its average friction"),
    )  # fmt: skip
    for rest, colour, _, _ in reversed(rests):
        figures.draw_stone(ax, ice.stone.radius, rest, view, colour=colour, alpha=0.9)
    figures.draw_target(ax, plan.target, view)
    heights = [float(view(rest)[1]) for rest, *_ in rests]
    short = float(np.clip(1.0 - min(heights), 2.4, 6.0))
    past = float(np.clip(max(heights) + 0.6, 2.2, 2.8))
    figures.show_house(ax, ice.sheet, short=short, past=past)
    ax.set_title(
        "The test draw, from the thrower's view",
        fontsize=11,
        loc="left",
        color=figures.INK,
    )
    _legend_below(
        ax, [(colour, f"{text}: {found.in_units(miss)} off") for _, colour, miss, text in rests]
    )


def _more_draws(ax: Axes, found: Findings) -> None:
    """Draw the misses of the further draws, planned on the map and on the average ice."""
    view, sheet = _view_of(found), found.true_ice.sheet
    figures.draw_sheet(ax, sheet, view)
    for draw in found.draws:
        for rest, colour in ((draw.other, BY_AVERAGE), (draw.rest, ON_TRUE)):
            ends = view(np.stack([draw.target, rest]))
            ax.plot(*ends.T, color=colour, lw=2, zorder=5)
            ax.plot(*ends[1], "o", ms=6, color=colour, mec="#3c4248", mew=0.6, zorder=6)
        ax.plot(*view(draw.target), "+", ms=9, mew=1.8, color=figures.TARGET_COLOUR, zorder=7)
    lowest = min(float(view(draw.other)[1]) for draw in found.draws)
    figures.show_house(ax, sheet, short=float(np.clip(0.6 - lowest, 2.4, 6.0)), past=2.8)
    title = f"{len(found.draws)} more draws on the hidden ice"
    ax.set_title(title, fontsize=11, loc="left", color=figures.INK)
    _legend_below(
        ax,
        [
            (colour, f"{text}: {found.in_units(miss)} off on average")
            for colour, text, miss in (
                (ON_TRUE, "planned on the estimated ice", found.mean_miss),
                (BY_AVERAGE, "planned on its average friction", found.mean_other_miss),
            )
        ],
    )


def _missing_effect(ax: Axes, found: Findings) -> None:
    """Draw the draw on ice with a hidden curl, planned before and after its discovery."""
    view, ice = _view_of(found), found.true_ice
    draw: ComparedDraw = found.missing
    figures.draw_sheet(ax, ice.sheet, view)
    rests = (
        (draw.other, BY_AVERAGE, draw.other_miss, "planned without curl"),
        (draw.rest, ON_TRUE, draw.miss, "planned with the discovered effects"),
    )
    for rest, colour, _, _ in rests:
        figures.draw_stone(ax, ice.stone.radius, rest, view, colour=colour, alpha=0.9)
    figures.draw_target(ax, draw.target, view)
    figures.show_house(ax, ice.sheet, short=2.6, past=2.6)
    _legend_below(
        ax, [(colour, f"{text}: {found.in_units(miss)} off") for _, colour, miss, text in rests]
    )


def _view_of(found: Findings) -> figures.Projection:
    return figures.from_the_thrower(found.plan.direction)


def _legend_below(ax: Axes, entries: list[tuple[str, str]]) -> None:
    """Add a legend under the house: the target's cross, then a dot in each colour with its text."""
    cross: dict[str, Any] = {"marker": "+", "color": figures.TARGET_COLOUR, "ms": 11, "mew": 2}
    handles = [Line2D([], [], ls="", label="wanted", **cross)]
    handles += [
        Line2D([], [], marker="o", mfc=colour, mec="#3c4248", ls="", ms=10, label=text)
        for colour, text in entries
    ]
    ax.legend(
        handles=handles,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.08),
        fontsize=9,
        frameon=False,
    )
