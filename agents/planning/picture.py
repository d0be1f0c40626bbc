"""The picture of a plan: the path, where the stone would end, and what to call."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from agents.planning.planner import Choice, Plan
from curling_env import drawing
from curling_env.ice import Ice
from curling_env.physics.slide import SlideEnd, play_bounds, slide
from curling_env.sheet import TEE_Y
from curling_env.storage import atomic_path

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PATH_RATE = 20.0
"""Points a second of the drawn path."""


def draw_plan(ice: Ice, plan: Plan, path: str | Path) -> None:
    """Write the picture of a plan, format by suffix.

    Parameters
    ----------
    ice : it was planned on
    plan : to show
    path : of the picture

    Raises
    ------
    OutputError : the picture cannot be written
    """
    figure = Figure(figsize=(11, 8.6), dpi=120, layout="constrained", facecolor="white")
    grid = figure.add_gridspec(2, 2, height_ratios=[1.2, 7], width_ratios=[1.0, 1])
    _draw_way(figure, figure.add_subplot(grid[0, :]), ice, plan)
    _draw_landing(figure.add_subplot(grid[1, 0]), ice, plan)
    _write_call(figure.add_subplot(grid[1, 1]), plan)
    figure.suptitle(_title(plan), fontsize=14, fontweight="bold", color=drawing.PATH_COLOUR)
    with atomic_path(path) as draft:
        figure.savefig(draft)


def _title(plan: Plan) -> str:
    x, y = plan.target
    side = plan.direction * x
    past = plan.direction * y - TEE_Y
    if np.hypot(side, past) < 0.02:
        place = "a draw to the button"
    else:
        parts = []
        if abs(past) >= 0.02:
            parts.append(
                f"{abs(past):.2f} m {'behind' if past > 0 else 'in front of'} the tee line"
            )
        if abs(side) >= 0.02:
            parts.append(f"{abs(side):.2f} m {'right' if side > 0 else 'left'} of the centre line")
        place = "a stone " + ", ".join(parts)
    return f"{place[0].upper()}{place[1:]}"


def _path_of(ice: Ice, plan: Plan, choice: Choice) -> np.ndarray:
    result = slide(
        ice,
        choice.throw.release(plan.direction),
        bounds=play_bounds(ice, plan.direction),
        fps=PATH_RATE,
    )
    assert result.trajectory is not None  # a rate was given
    return result.trajectory.xy


def _draw_way(figure: Figure, ax: Axes, ice: Ice, plan: Plan) -> None:
    view = drawing.lengthwise
    if not ice.friction.is_uniform:
        mean = float(ice.friction.mu.mean())
        percent = 100 * (ice.friction.mu / mean - 1)
        limit = max(float(np.abs(percent).max()), 1.0)
        layer = drawing.draw_map(
            ax, ice.sheet, percent, view, cmap=drawing.KEEN_TO_HEAVY, vmin=-limit, vmax=limit,
            smooth=ice.friction.interpolation == "bilinear",
        )  # fmt: skip
        bar = figure.colorbar(layer, ax=ax, pad=0.01, aspect=8)
        bar.set_label("friction [%]", fontsize=8)
        bar.ax.tick_params(labelsize=7)
    drawing.draw_sheet(ax, ice.sheet, view, rings=1.0 if ice.friction.is_uniform else 0.7)
    if plan.second is not None:
        ax.plot(*view(_path_of(ice, plan, plan.second)).T, color="#777", lw=1.2, ls="--")
    ax.plot(*view(_path_of(ice, plan, plan.best)).T, color=drawing.PATH_COLOUR, lw=2)
    for stone in plan.stones:
        drawing.draw_stone(ax, ice.stone.radius, stone, view, colour="#c9a400")
    drawing.draw_stone(ax, ice.stone.radius, plan.best.rest, view, colour="#c8433f")
    drawing.show_lengthwise(ax, ice.sheet)


def _draw_landing(ax: Axes, ice: Ice, plan: Plan) -> None:
    view = drawing.from_the_thrower(plan.direction)
    drawing.draw_sheet(ax, ice.sheet, view)
    spread = plan.best.spread
    rested = spread.ends[spread.why == SlideEnd.REST]
    if len(rested) > 2:
        colours = {SlideEnd.REST: "#34506e", SlideEnd.CONTACT: "#b8860b"}
        for end in (SlideEnd.REST, SlideEnd.CONTACT, SlideEnd.LEFT_BOUNDS):
            dots = view(spread.ends[spread.why == end])
            ax.plot(*dots.T, ".", ms=3, color=colours.get(end, "#c8433f"), alpha=0.35, zorder=3)
        for share, style in ((0.5, "-"), (0.9, "--")):
            drawing.draw_landing_ellipse(
                ax, rested, share, view, edgecolor=drawing.PATH_COLOUR, lw=1.6, ls=style, zorder=5
            )
    if plan.second is not None:
        ax.plot(*view(_path_of(ice, plan, plan.second)).T, color="#777", lw=1.3, ls="--", zorder=4)
    ax.plot(*view(_path_of(ice, plan, plan.best)).T, color=drawing.PATH_COLOUR, lw=2, zorder=4)
    for stone in plan.stones:
        drawing.draw_stone(ax, ice.stone.radius, stone, view, colour="#c9a400")
    drawing.draw_stone(ax, ice.stone.radius, plan.best.rest, view, colour="#c8433f", alpha=0.85)
    drawing.draw_target(ax, plan.target, view)
    lowest = min(
        float(view(plan.target)[1]),
        float(np.quantile(view(spread.ends)[:, 1], 0.02)),
        *(float(y) for y in view(plan.stones)[:, 1]),
    )
    drawing.show_house(ax, ice.sheet, short=float(np.clip(1.0 - lowest, 2.6, 9.0)))
    ax.set_title("Where it comes to rest, seen by the thrower", fontsize=10, loc="left")


def _write_call(ax: Axes, plan: Plan) -> None:
    ax.axis("off")
    place = 1.0

    def line(text: str, size: float = 10, **style: Any) -> None:
        nonlocal place
        for part in textwrap.wrap(text, int(620 / size)) or [""]:
            ax.text(0.02, place, part, fontsize=size, va="top", transform=ax.transAxes, **style)
            place -= 0.0052 * size

    for title, choice in (("Throw this", plan.best), ("Second choice (dashed)", plan.second)):
        if choice is None:
            continue
        first = choice is plan.best
        line(title, 14 if first else 11, fontweight="bold", color=drawing.PATH_COLOUR)
        place -= 0.012
        words, spread = choice.words, choice.spread
        size = 11 if first else 9.5
        time = "stops before the hog line"
        if words.hog_to_hog_s is not None:
            time = f"{words.hog_to_hog_s:.1f} s hog to hog"
        line(f"Weight: {time} ({choice.throw.speed:.3f} m/s)", size)
        side = "right" if words.broom_m > 0 else "left"
        line(
            f"Broom: {abs(words.broom_m):.2f} m {side} of the centre line, "
            f"{words.ice_m:.2f} m of ice",
            size,
        )
        if choice.throw.spin:
            line(
                f"Handle: {words.right_hander} (right-hander), {words.left_hander} (left-hander), "
                f"{words.turns:.1f} turns",
                size,
            )
        line(f"Takes {choice.time:.1f} s to come to rest", size)
        place -= 0.015
        if len(spread.miss) > 1:
            line(
                f"Expected miss: {100 * spread.expected_miss:.0f} cm; nine in ten within "
                f"{100 * float(np.quantile(spread.miss, 0.9)):.0f} cm",
                size,
                color=drawing.TARGET_COLOUR,
            )
            if plan.stones.size:
                line(f"Touches a stone: {100 * spread.chance(SlideEnd.CONTACT):.0f} %", size)
            line(f"In the house: {100 * choice.chance_in_house:.0f} %", size)
            out = spread.chance(SlideEnd.LEFT_BOUNDS)
            if out >= 0.005:
                line(f"Leaves play: {100 * out:.0f} %", size)
        else:
            line(
                f"Without error it rests {1000 * choice.miss_without_error:.1f} mm from the target",
                size,
                color=drawing.TARGET_COLOUR,
            )
        place -= 0.045
    skill = plan.skill
    hand = (
        "exact throws"
        if skill.is_exact
        else f"skill “{skill.name}”: weight ±{skill.sigma_speed:g} m/s, line "
        f"±{np.degrees(skill.sigma_angle):.2f}°, spin ±{skill.sigma_spin:g} rad/s"
    )
    ice = "and what the map does not know" if plan.map_is_uncertain else "on ice known exactly"
    line(f"Dots: {len(plan.best.spread.miss)} trials with {hand}, {ice}.", 8.5, color="#55606b")
    line("Solid ellipse: half of them; dashed: nine in ten.", 8.5, color="#55606b")
