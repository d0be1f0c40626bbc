"""Figure of a plan: the path, the place of rest, and the call."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from scipy.ndimage import gaussian_filter

from agents.planning.description import seconds_per_speed
from agents.planning.planned_throw import Plan, PlannedThrow
from curling_env.ice import Ice
from curling_env.physics.slides import SlideEnd, play_bounds, slide
from curling_env.render import figures
from curling_env.sheet import TEE_Y
from curling_env.throw import FROM_HOG_LINE
from curling_env.typing import Floats
from curling_env.units import FOOT, INCH, Units, length, short_length, speed

if TYPE_CHECKING:
    from matplotlib.axes import Axes


OWN_COLOUR, OTHER_COLOUR, NO_TEAM_COLOUR = "#c8433f", "#f2c230", "#7d8894"
"""Handle colours of the thrower's stones, of the opponents', and of stones without a team."""
MAX_CONTACT_SHARE = 0.05
"""Share of trials with a contact above which the ends are not drawn as an ellipse."""


def draw_plan(ice: Ice, plan: Plan, path: str | Path, units: Units = Units.METRES) -> None:
    """Draw a plan; the suffix chooses the format.

    Parameters
    ----------
    ice : ice that the plan was made on
    plan : the plan to show
    path : picture file to write
    units : units of displayed lengths

    Raises
    ------
    OutputError : the picture cannot be written
    """
    figure = Figure(figsize=(11, 8.6), dpi=120, layout="constrained", facecolor="white")
    exact = len(plan.best.trials.miss) < 2 or plan.skill.is_exact
    grid = figure.add_gridspec(3, 2, height_ratios=[1.2, 4.6, 2.4], width_ratios=[1.0, 1])
    _draw_path(figure, figure.add_subplot(grid[0, :]), ice, plan)
    _draw_landing(figure.add_subplot(grid[1:, 0]), ice, plan, units)
    _write_call(figure.add_subplot(grid[1:, 1] if exact else grid[1, 1]), ice, plan, units)
    if not exact:
        _draw_forgiveness(figure.add_subplot(grid[2, 1]), ice, plan, units)
    figure.suptitle(_title(plan, units), fontsize=14, fontweight="bold", color=figures.PATH_COLOUR)
    figures.save_figure(figure, path, dpi=120)


def _title(plan: Plan, units: Units) -> str:
    x, y = plan.target
    side = plan.direction * x
    past = plan.direction * y - TEE_Y
    if np.hypot(side, past) < 0.02:
        place = "the button"
    else:
        parts = []
        if abs(past) >= 0.02:
            parts.append(
                f"{length(past, units)} {'behind' if past > 0 else 'in front of'} the tee line"
            )
        if abs(side) >= 0.02:
            which = "right" if side > 0 else "left"
            parts.append(f"{length(side, units)} {which} of the centre line")
        place = ", ".join(parts)
    if plan.objective.name == "score":
        return "The most points"
    name = {"rest": "draw"}.get(plan.objective.name, plan.objective.name)
    return f"{name.capitalize()}: {place}"


def _path_of(ice: Ice, plan: Plan, planned: PlannedThrow) -> Floats:
    """Return the path of the thrown stone until it rests, leaves play or meets another, (n, 2)
    [m].
    """
    result = slide(
        ice,
        planned.throw.release(
            plan.direction, sweep=planned.sweep or (0.0, 0.0), delivery=plan.delivery
        ),
        bounds=play_bounds(ice, plan.direction),
        fps=20.0,
    )
    assert result.trajectory is not None  # a rate was requested
    path = result.trajectory.xy
    if len(plan.stones):
        apart = np.hypot(*(path[:, None] - plan.stones).transpose(2, 0, 1)).min(axis=1)
        touching = np.flatnonzero(apart < 2 * ice.stone.radius)
        path = path[: touching[0] + 1] if touching.size else path
    return path


def _draw_path(figure: Figure, ax: Axes, ice: Ice, plan: Plan) -> None:
    view = figures.lengthwise
    if not ice.friction.is_uniform:
        mean = float(ice.friction.mu.mean())
        percent = 100 * (ice.friction.mu / mean - 1)
        limit = max(float(np.abs(percent).max()), 1.0)
        layer = figures.draw_map(
            ax,
            ice.sheet,
            percent,
            view,
            cmap=figures.KEEN_TO_HEAVY,
            vmin=-limit,
            vmax=limit,
            smooth=ice.friction.interpolation == "bilinear",
        )
        bar = figure.colorbar(layer, ax=ax, pad=0.01, aspect=8)
        bar.set_label("friction [%]", fontsize=8)
        bar.ax.tick_params(labelsize=7)
    figures.draw_sheet(ax, ice.sheet, view, rings=1.0 if ice.friction.is_uniform else 0.7)
    if plan.second is not None:
        ax.plot(*view(_path_of(ice, plan, plan.second)).T, color="#777", lw=1.2, ls="--")
    ax.plot(*view(_path_of(ice, plan, plan.best)).T, color=figures.PATH_COLOUR, lw=2)
    for stone, colour in zip(plan.stones, _colours(plan), strict=True):
        figures.draw_stone(ax, ice.stone.radius, stone, view, colour=colour)
    figures.draw_stone(ax, ice.stone.radius, plan.best.rest, view, colour=OWN_COLOUR)
    figures.show_lengthwise(ax, ice.sheet)


def _draw_landing(ax: Axes, ice: Ice, plan: Plan, units: Units) -> None:
    view = figures.from_the_thrower(plan.direction)
    figures.draw_sheet(ax, ice.sheet, view)
    trials, best = plan.best.trials, plan.best
    rested = trials.ends[trials.in_play]
    if len(rested) > 2:
        _draw_density(ax, view(rested))
        colours = {SlideEnd.REST: "#34506e", SlideEnd.CONTACT: "#b8860b"}
        for end in (SlideEnd.REST, SlideEnd.CONTACT, SlideEnd.LEFT_BOUNDS):
            dots = view(trials.ends[trials.why == end])
            ax.plot(*dots.T, ".", ms=2.5, color=colours.get(end, "#c8433f"), alpha=0.3, zorder=3)
        _draw_moved_stones(ax, plan, view)
        for share, style in ((0.5, "-"), (0.9, "--")):
            if _is_cloud(plan):
                figures.draw_landing_cloud(
                    ax, rested, share, view, colors=figures.PATH_COLOUR, linewidths=1.4,
                    linestyles=style, zorder=5,
                )  # fmt: skip
            else:
                figures.draw_landing_ellipse(
                    ax, rested, share, view, edgecolor=figures.PATH_COLOUR, lw=1.6, ls=style,
                    zorder=5,
                )  # fmt: skip
    if plan.second is not None:
        ax.plot(*view(_path_of(ice, plan, plan.second)).T, color="#777", lw=1.3, ls="--", zorder=4)
    ax.plot(*view(_path_of(ice, plan, best)).T, color=figures.PATH_COLOUR, lw=2, zorder=4)
    for before, after, colour in zip(plan.stones, best.stones, _colours(plan), strict=True):
        moved = not np.hypot(*(after - before)) < 1e-3
        alpha = 0.45 if moved else 1.0
        figures.draw_stone(ax, ice.stone.radius, before, view, colour=colour, alpha=alpha)
        if moved and not np.isnan(after[0]):
            figures.draw_stone(ax, ice.stone.radius, after, view, colour=colour)
    figures.draw_stone(ax, ice.stone.radius, best.rest, view, colour=OWN_COLOUR, alpha=0.85)
    figures.draw_target(ax, plan.target, view)
    lowest = min(
        float(view(plan.target)[1]),
        float(np.quantile(view(trials.ends)[:, 1], 0.02)),
        *(float(y) for y in view(plan.stones)[:, 1]),
    )
    figures.show_house(ax, ice.sheet, short=float(np.clip(1.0 - lowest, 2.6, 9.0)), units=units)
    _draw_legend(ax, plan)
    ax.set_title("Place of rest, from the thrower's view", fontsize=10, loc="left")


def _colours(plan: Plan) -> list[str]:
    """Return the handle colour of each resting stone."""
    if plan.own is None:
        return [NO_TEAM_COLOUR] * len(plan.stones)
    return [OWN_COLOUR if own else OTHER_COLOUR for own in plan.own]


def _is_cloud(plan: Plan) -> bool:
    """Return whether the ends have any shape, because stones touched another."""
    return plan.best.trials.chance(SlideEnd.CONTACT) > MAX_CONTACT_SHARE


def _draw_moved_stones(ax: Axes, plan: Plan, view: figures.Projection) -> None:
    """Draw the final positions of the other stones in the trials that moved them."""
    after = plan.best.trials.stones
    for k, (before, colour) in enumerate(zip(plan.stones, _colours(plan), strict=True)):
        apart = np.hypot(*(after[:, k] - before).T)
        moved = after[apart > 0.02, k]
        if len(moved):
            ax.plot(*view(moved).T, ".", ms=3, color=colour, alpha=0.35, zorder=3.5, mec="#3c4248",
                    mew=0.15)  # fmt: skip


def _draw_legend(ax: Axes, plan: Plan) -> None:
    """Draw the legend of the teams' colours."""
    if not len(plan.stones):
        return
    kinds = [(OWN_COLOUR, "own")]
    if plan.own is None:
        kinds.append((NO_TEAM_COLOUR, "team unknown"))
    elif not all(plan.own):
        kinds.append((OTHER_COLOUR, "theirs"))
    for colour, name in kinds:
        ax.plot([], [], "o", ms=8, mfc=colour, mec="#3c4248", ls="", label=name)
    legend = ax.legend(fontsize=8, loc="upper left", framealpha=0.9)
    legend.set_zorder(10)


def _draw_density(ax: Axes, places: Floats) -> None:
    """Draw a heat layer of the final places (n, 2) of the thrown stone."""
    cell = 0.03
    low, high = places.min(axis=0) - 0.3, places.max(axis=0) + 0.3
    cells = np.maximum(np.ceil((high - low) / cell).astype(int), 4)
    heat, x, y = np.histogram2d(*places.T, bins=cells, range=list(zip(low, high, strict=True)))
    heat = gaussian_filter(heat, 0.06 / cell)
    share = heat.T / heat.max()
    picture = colormaps["YlOrRd"](share)
    picture[..., 3] = 0.6 * np.clip(4 * share, 0, 1)  # fades out instead of ending at an edge
    extent = (x[0], x[-1], y[0], y[-1])
    ax.imshow(picture, extent=extent, origin="lower", interpolation="bilinear", zorder=2.5)


def _draw_forgiveness(ax: Axes, ice: Ice, plan: Plan, units: Units) -> None:
    """Draw the costs of small errors of weight and line: the trials, sorted by their errors."""
    trials = plan.best.trials
    weight, weight_name = _weight_unit(ice, plan, units)
    unit, unit_name = (0.01, "cm") if units is Units.METRES else (INCH, "in")
    errors = trials.errors[:, :2] * [weight, -plan.delivery.start_y / unit]
    rests, scores = plan.objective.name == "rest", plan.objective.name == "score"
    values = 100.0 * trials.success
    if rests or scores:
        values = trials.miss / unit if rests else trials.value
    limit = np.quantile(np.abs(errors), 0.985, axis=0)
    edges = [np.linspace(-end, end, 16) for end in limit]
    total, _, _ = np.histogram2d(*errors.T, bins=edges, weights=values)
    count, _, _ = np.histogram2d(*errors.T, bins=edges)
    blur = 0.8
    total, count = gaussian_filter(total, blur), gaussian_filter(count, blur)
    mean = np.ma.masked_where(count < 0.15, total / np.maximum(count, 1e-9))
    limits = (None, None) if rests or scores else (0.0, 100.0)
    shades = "viridis_r" if rests else "viridis"
    layer = ax.pcolormesh(-edges[1], edges[0], mean, cmap=shades, vmin=limits[0], vmax=limits[1])
    ax.axhline(0, color="white", lw=0.6)
    ax.axvline(0, color="white", lw=0.6)
    ax.set_xlabel(f"line: right of the broom at the far tee [{unit_name}]", fontsize=8)
    ax.set_ylabel(weight_name, fontsize=8)
    ax.tick_params(labelsize=7)
    bar = ax.figure.colorbar(layer, ax=ax, pad=0.01, aspect=12)
    label = f"miss [{unit_name}]" if rests else "points" if scores else "succeeds [%]"
    bar.set_label(label, fontsize=8)
    bar.ax.tick_params(labelsize=7)
    ax.set_title("Cost of small errors", fontsize=10, loc="left")


def _weight_unit(ice: Ice, plan: Plan, units: Units) -> tuple[float, str]:
    """Return the unit of an error of weight: its factor per m/s, and a label for an axis.

    A draw's is in seconds from hog line to hog line, where less is heavier.
    """
    slope = seconds_per_speed(ice, plan.best.throw, plan.direction, plan.delivery)
    if slope is not None:
        return -slope, "heavier by [s hog to hog]"
    if units is Units.FEET:
        return 1 / FOOT, "weight [ft/s]"
    return 1.0, "weight [m/s]"


def _write_call(ax: Axes, ice: Ice, plan: Plan, units: Units) -> None:
    ax.axis("off")
    place = 1.0

    def line(text: str, size: float = 10, **style: Any) -> None:
        nonlocal place
        for part in textwrap.wrap(text, int(620 / size)) or [""]:
            ax.text(0.02, place, part, fontsize=size, va="top", transform=ax.transAxes, **style)
            place -= 0.0052 * size

    for title, planned in (("Throw this", plan.best), ("Second choice (dashed)", plan.second)):
        if planned is None:
            continue
        first = planned is plan.best
        line(title, 14 if first else 11, fontweight="bold", color=figures.PATH_COLOUR)
        place -= 0.012
        words, trials = planned.description, planned.trials
        size = 11 if first else 9.5
        time = "stops before the hog line"
        if words.hog_to_hog_s is not None:
            time = f"{words.hog_to_hog_s:.1f} s hog to hog"
        where = "hog line" if plan.delivery == FROM_HOG_LINE else "release"
        line(f"Weight: {time} ({speed(planned.throw.speed, units)} at the {where})", size)
        line(f"Broom: {words.broom_in(units)}; {length(words.ice_m, units)} of ice", size)
        if planned.throw.spin:
            line(
                f"Handle: {words.right_hander} (right-hander), {words.left_hander} (left-hander), "
                f"{words.turns:.1f} turns",
                size,
            )
        line(f"Time until rest: {planned.time:.1f} s", size)
        place -= 0.015
        if planned.sweep is not None:
            start, end = planned.sweep[0], min(planned.sweep[1], planned.time)
            line(f"Sweep from {start:.0f} to {end:.0f} s after the release", size)
        expectation = plan.expectation(planned, units)
        for part in expectation.split("; ") if expectation else []:
            line(part[0].upper() + part[1:], size, color=figures.TARGET_COLOUR)
        if len(trials.miss) > 1 and plan.objective.miss_means is not None:
            within = short_length(float(np.quantile(trials.miss, 0.9)), units)
            line(f"90 % miss by less than {within}", size)
        if len(trials.miss) > 1:
            if plan.stones.size:
                line(f"Touches a stone: {100 * trials.chance(SlideEnd.CONTACT):.0f} %", size)
            line(f"In the house: {100 * planned.chance_in_house:.0f} %", size)
            out = trials.chance(SlideEnd.LEFT_BOUNDS)
            if out >= 0.005:
                line(f"Leaves play: {100 * out:.0f} %", size)
        elif plan.objective.comes_to_rest and len(trials.miss) < 2:
            line(
                f"Rests {1000 * planned.miss_without_error:.1f} mm from the target without error",
                size,
                color=figures.TARGET_COLOUR,
            )
        place -= 0.045
    skill = plan.skill
    player = (
        "exact throws" if skill.is_exact else f"skill “{skill.name}”: {_skill(ice, plan, units)}"
    )
    known = "and the uncertainty of the ice" if plan.ice_is_uncertain else "on exactly known ice"
    line(f"Dots: {len(plan.best.trials.miss)} trials with {player}, {known}.", 8.5, color="#55606b")
    shape = "line contains" if _is_cloud(plan) else "ellipse contains"
    line(f"The solid {shape} 50 % of them, the dashed one 90 %.", 8.5, color="#55606b")


def _skill(ice: Ice, plan: Plan, units: Units) -> str:
    """Return one standard deviation of a player's errors, in a coach's units."""
    skill = plan.skill
    slope = seconds_per_speed(ice, plan.best.throw, plan.direction, plan.delivery)
    weight = (
        f"weight ± {speed(skill.sigma_speed, units)}"
        if slope is None
        else f"weight ± {abs(slope) * skill.sigma_speed:.2f} s hog to hog"
    )
    line = short_length(-skill.sigma_angle * plan.delivery.start_y, units)
    return f"{weight}, line ± {line} at the broom, spin ± {skill.sigma_spin:g} rad/s"
