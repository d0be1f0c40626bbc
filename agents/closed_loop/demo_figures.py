"""The demo's pictures: the hidden ice beside the one that was found, and the draw that tests it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from agents.closed_loop.demo_findings import Findings
from curling_env.ice import Ice
from curling_env.physics.one_stone.slide import play_bounds, slide
from curling_env.render import figures
from curling_env.sheet import TEE_Y
from curling_env.storage import atomic_path
from curling_env.throw import Throw

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK = "#1d2b3a"
ON_TRUE, ON_ESTIMATED, BY_AVERAGE = "#c8433f", "#2f6fb3", "#e0a100"
"""Handles of the stones: thrown on the hidden ice, on the estimated, and planned without a map."""


def draw_maps(found: Findings, path: str | Path) -> None:
    """Hidden ice, found ice with the filmed paths, and its uncertainty, one under the other."""
    figure = Figure(figsize=(13, 6.2), dpi=110, layout="constrained", facecolor="white")
    axes = [figure.add_subplot(3, 1, k) for k in (1, 2, 3)]
    _three_maps(figure, axes, found)
    _save(figure, path)


def draw_house(found: Findings, path: str | Path) -> None:
    """Where the tested draw came to rest."""
    figure = Figure(figsize=(6.2, 7.4), dpi=110, layout="constrained", facecolor="white")
    _house(figure.add_subplot(), found)
    _save(figure, path)


def draw_draws(found: Findings, path: str | Path) -> None:
    """How far each of the further draws missed, with the map and without."""
    figure = Figure(figsize=(6.2, 7.4), dpi=110, layout="constrained", facecolor="white")
    _draws(figure.add_subplot(), found)
    _save(figure, path)


def draw_page(found: Findings, path: str | Path) -> None:
    """All pictures on one page."""
    figure = Figure(figsize=(15, 15.5), dpi=100, layout="constrained", facecolor="white")
    rows: Any = figure.subfigures(2, 1, height_ratios=[1, 1.05])
    upper, lower = rows
    upper.suptitle(found.headline(), fontsize=15, fontweight="bold", color=figures.PATH_COLOUR)
    _three_maps(upper, [upper.add_subplot(3, 1, k) for k in (1, 2, 3)], found)
    left, right = lower.subfigures(1, 2)
    _house(left.add_subplot(), found)
    _draws(right.add_subplot(), found)
    _save(figure, path)


def _save(figure: Figure, path: str | Path) -> None:
    with atomic_path(path) as draft:
        figure.savefig(draft)


def _three_maps(figure: Figure, axes: list[Axes], found: Findings) -> None:
    view, sheet = figures.lengthwise, found.true_ice.sheet
    true, estimate = 100 * found.true_difference, 100 * found.found_difference
    limit = max(float(np.abs(true).max()), 2.0)
    scale = {"cmap": figures.KEEN_TO_HEAVY, "vmin": -limit, "vmax": limit}
    layer = figures.draw_map(axes[0], sheet, true, view, **scale)
    figures.draw_map(axes[1], sheet, estimate, view, **scale)
    bar = figure.colorbar(layer, ax=axes[:2], pad=0.01, aspect=24, shrink=0.85)
    bar.set_label("friction against the average [%]\nblue keen, red heavy", fontsize=9)
    sigma = 100 * found.estimated_ice.friction.sigma / found.estimated_ice.friction.mu
    known = figures.draw_map(
        axes[2], sheet, sigma, view, cmap="Greys", vmin=0, vmax=float(sigma.max())
    )
    bar = figure.colorbar(known, ax=axes[2], pad=0.01, aspect=11, shrink=0.85)
    bar.set_label("uncertainty σ [%]", fontsize=9)
    for track in found.tracks:
        for ax in axes[1:]:
            ax.plot(*view(track.xy).T, color=INK, lw=0.9, alpha=0.55)
    for ax in axes[:2]:
        way = _path(found.true_ice if ax is axes[0] else found.estimated_ice, found)
        ax.plot(*view(way).T, color="#0d7a3f", lw=2.2)
    for area in found.areas:
        cells = np.where(area.cells, 1.0, 0.0)
        corners = view(np.stack(np.meshgrid(sheet.x_centres, sheet.y_centres), axis=-1))
        axes[1].contour(
            corners[..., 0], corners[..., 1], cells, levels=[0.5], colors=INK, linewidths=1.1,
            linestyles="--",
        )  # fmt: skip
        middle = view((area.x, (area.y_low + area.y_high) / 2))
        axes[1].text(
            middle[0], middle[1], f"{area.kind}\n{100 * area.difference:+.0f} %", ha="center",
            va="center", fontsize=9, color=INK, fontweight="bold",
            bbox={"boxstyle": "round,pad=0.2", "fc": "white", "ec": "none", "alpha": 0.75},
        )  # fmt: skip
    titles = (
        "The hidden ice: where it is heavy and keen, unknown to everything below",
        f"The ice read from {len(found.tracks)} filmed throws (thin lines); "
        "dashed: what it calls heavy or keen",
        "How sure it is: dark where no stone has been",
    )
    for ax, title in zip(axes, titles, strict=True):
        figures.draw_sheet(ax, sheet, view, rings=0.55)
        figures.show_lengthwise(ax, sheet)
        ax.set_title(title, fontsize=11, loc="left", color=INK)
    axes[0].legend(
        handles=[Line2D([], [], color="#0d7a3f", lw=2.2, label="the draw that tests it")],
        loc="lower left", fontsize=9, framealpha=0.85,
    )  # fmt: skip


def _path(ice: Ice, found: Findings, throw: Throw | None = None) -> np.ndarray:
    plan = found.plan
    result = slide(
        ice,
        (throw or plan.best.throw).release(plan.direction),
        bounds=play_bounds(ice, plan.direction),
        fps=20.0,
    )
    assert result.trajectory is not None  # a rate was given
    return result.trajectory.xy


def _house(ax: Axes, found: Findings) -> None:
    plan, ice = found.plan, found.true_ice
    view = figures.from_the_thrower(plan.direction)
    figures.draw_sheet(ax, ice.sheet, view)
    ways = (
        (_path(ice, found, found.average_plan.best.throw), BY_AVERAGE, "-", 1.5),
        (_path(found.estimated_ice, found), ON_ESTIMATED, "--", 1.8),
        (_path(ice, found), ON_TRUE, "-", 1.8),
    )
    for way, colour, style, width in ways:
        ax.plot(*view(way).T, color=colour, ls=style, lw=width, zorder=4)
    miss = float(np.hypot(*(found.on_estimated - plan.target)))
    stones = (
        (found.average_on_true, BY_AVERAGE, found.average_miss,
         "thrown on the hidden ice, planned on its average friction"),
        (found.on_estimated, ON_ESTIMATED, miss, "thrown on the ice read from film"),
        (found.on_true, ON_TRUE, found.miss, "thrown on the hidden ice"),
    )  # fmt: skip
    for rest, colour, _, _ in stones:
        figures.draw_stone(ax, ice.stone.radius, rest, view, colour=colour, alpha=0.9)
    figures.draw_target(ax, plan.target, view)
    handles = [_wanted()]
    handles += [
        Line2D([], [], marker="o", mfc=colour, mec="#3c4248", ls="", ms=10,
               label=f"{text}: {100 * distance:.0f} cm off")
        for _, colour, distance, text in reversed(stones)
    ]  # fmt: skip
    places = [view(rest)[1] for rest, *_ in stones]
    figures.show_house(
        ax,
        ice.sheet,
        short=float(np.clip(1.0 - min(places), 2.4, 6.0)),
        past=float(np.clip(max(places) + 0.6, 2.2, 2.8)),
    )
    ax.set_title("The draw that tests it, seen by the thrower", fontsize=11, loc="left", color=INK)
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.08), fontsize=9,
              frameon=False)  # fmt: skip


def draw_missing(found: Findings, path: str | Path) -> None:
    """The draw on ice with a hidden curl, planned before and after it was found."""
    figure = figures.new_figure(6.0, 5.6)
    ax = figure.subplots()
    view, missing = figures.from_the_thrower(found.plan.direction), found.missing
    ice = found.true_ice
    figures.draw_sheet(ax, ice.sheet, view)
    handles = [_wanted()]
    for rest, colour, miss, text in (
        (missing.before, BY_AVERAGE, missing.miss_before, "planned without curl"),
        (missing.after, ON_TRUE, missing.miss_after, "planned with what was found"),
    ):
        figures.draw_stone(ax, ice.stone.radius, rest, view, colour=colour, alpha=0.9)
        label = f"{text}: {100 * miss:.0f} cm off"
        handles.append(
            Line2D([], [], marker="o", mfc=colour, mec="#3c4248", ls="", ms=10, label=label)
        )
    figures.draw_target(ax, missing.target, view)
    figures.show_house(ax, ice.sheet, short=2.6, past=2.6)
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.08), fontsize=9,
              frameon=False)  # fmt: skip
    _save(figure, path)


def _wanted() -> Line2D:
    return Line2D(
        [], [], marker="+", color=figures.TARGET_COLOUR, ls="", ms=11, mew=2, label="wanted"
    )


def _draws(ax: Axes, found: Findings) -> None:
    view = figures.from_the_thrower(found.plan.direction)
    ice = found.true_ice
    figures.draw_sheet(ax, ice.sheet, view)
    for draw in found.draws:
        for rest, colour in ((draw.by_average, BY_AVERAGE), (draw.by_map, ON_TRUE)):
            ends = view(np.stack([draw.target, rest]))
            ax.plot(*ends.T, color=colour, lw=2, zorder=5)
            ax.plot(*ends[1], "o", ms=6, color=colour, mec="#3c4248", mew=0.6, zorder=6)
        ax.plot(*view(draw.target), "+", ms=9, mew=1.8, color=figures.TARGET_COLOUR, zorder=7)
    lowest = min(float(view(draw.by_average)[1]) for draw in found.draws)
    figures.show_house(ax, ice.sheet, short=float(np.clip(0.6 - lowest, 2.4, 6.0)), past=2.8)
    ax.set_title(
        f"{len(found.draws)} more draws on the hidden ice", fontsize=11, loc="left", color=INK
    )
    handles = [_wanted()]
    for colour, text, miss in (
        (ON_TRUE, "planned on the ice read from film", found.mean_miss),
        (BY_AVERAGE, "planned on its average friction", found.mean_average_miss),
    ):
        label = f"{text}: {100 * miss:.0f} cm off on average"
        handles.append(Line2D([], [], marker="o", color=colour, ms=7, label=label))
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.08), fontsize=9,
              frameon=False)  # fmt: skip


HOUSE_TARGETS = tuple(
    np.array([x, TEE_Y + y])
    for x, y in ((0.0, 0.0), (0.9, 0.0), (-0.9, 0.0), (0.0, 1.1), (0.0, -1.1), (0.7, -0.8),
                 (-0.7, -0.8), (0.6, 0.8), (-0.6, 0.8), (0.35, -2.6))
)  # fmt: skip
"""Places a skip asks for: button, wings, back and front of the house, a guard [m]."""
