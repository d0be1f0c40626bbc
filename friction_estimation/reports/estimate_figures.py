"""Pictures of an estimate and of a comparison, for people."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patheffects import Normal, Stroke
from scipy.ndimage import median_filter

from curling_env.ice import FrictionMap, Ice
from curling_env.physics.effects.motion import GRAVITY
from curling_env.physics.one_stone.aim import Aim
from curling_env.physics.one_stone.slide import NO_BOUNDS, slide
from curling_env.physics.one_stone.tuning import FINE_TOLERANCE
from curling_env.render.figures import (
    FAINT,
    INK,
    KEEN_TO_HEAVY,
    TRACK_COLOURS,
    UNCERTAINTY,
    draw_map,
    draw_sheet,
    draw_stone,
    lengthwise,
    new_figure,
    plain_axes,
    save_figure,
    show_lengthwise,
)
from curling_env.sheet import HOG_LINE_Y, TEE_Y
from curling_env.throw import Throw
from friction_estimation.inversion import Estimate, estimate_ice
from friction_estimation.inversion.rethrow import Comparison
from friction_estimation.inversion.throw.camera_bias import CameraBias
from friction_estimation.tracks.smoothing import smooth_motion

SMOOTHING = 2.0
"""Width of the windows from which speed and deceleration are drawn [s]."""


def write_pictures(found: Estimate, folder: Path) -> list[str]:
    """All pictures of an estimate.

    Parameters
    ----------
    found : the estimate
    folder : exists

    Returns
    -------
    names of the files written
    """
    save_map(found, folder / "map.png")
    save_motion(found, folder / "motion.png")
    names = ["map.png", "motion.png"]
    if found.throws:
        save_residuals(found, folder / "residuals.png")
        names.append("residuals.png")
    if found.method == "trajectory" and not found.uniform:
        save_profile(found, papers_way(found), folder / "profile.png")
        names.append("profile.png")
    if found.bias_search is not None and len(found.bias_search.bias):
        save_camera_bias(found.bias_search.bias, found.ice, folder / "camera.png")
        names.append("camera.png")
    return names


def draw_weight(ice: Ice, mu: float) -> tuple[float, float, float] | None:
    """What a draw to the tee takes on even ice of this friction and these effects.

    Returns
    -------
    speed at the hog line [m/s], seconds from there to rest, and seconds from hog line to hog
    line; None where no throw up to 6 m/s comes to rest there
    """
    even = Ice(
        sheet=ice.sheet,
        stone=ice.stone,
        effects=ice.effects,
        friction=FrictionMap.uniform(mu, ice.sheet),
    )
    speed = Aim(even, tolerance=FINE_TOLERANCE).draw_weight()
    if speed is None:
        return None
    path = slide(even, Throw(speed=speed).release(), bounds=NO_BOUNDS, fps=60.0).trajectory
    assert path is not None
    hog_to_hog = float(np.interp(HOG_LINE_Y, path.xy[:, 1], path.t))
    return speed, path.duration, hog_to_hog


def worth_of_a_per_cent(ice: Ice, mu: float) -> tuple[float, float] | None:
    """What ice that is keener by one per cent does to a draw to the tee.

    Returns
    -------
    how much further the same throw runs [m], and by how much the split from hog line to hog line
    of the throw that then draws to the tee is longer [s]; None where no draw comes to rest there
    """
    usual, keener = draw_weight(ice, mu), draw_weight(ice, 0.99 * mu)
    if usual is None or keener is None:
        return None
    even = replace(ice, friction=FrictionMap.uniform(0.99 * mu, ice.sheet))
    return slide(even, Throw(speed=usual[0]).release(), bounds=NO_BOUNDS).y - TEE_Y, keener[
        2
    ] - usual[2]


def save_map(found: Estimate, path: Path) -> None:
    """The friction map as a curler reads it, its uncertainty, and the paths that showed it."""
    sheet, friction = found.ice.sheet, found.ice.friction
    figure = new_figure(13, 4.5)
    top, bottom = figure.subplots(2, 1)
    level = found.mu if found.mu > 0 else float(friction.mu.mean())
    relative = 100 * (friction.mu / level - 1)
    seen = friction.observed
    reach = max(float(np.percentile(np.abs(relative[seen]), 99)), 1.0)
    hidden = np.where(seen, 1.0, 0.35)
    layer = draw_map(
        top, sheet, relative, smooth=False,
        cmap=KEEN_TO_HEAVY, vmin=-reach, vmax=reach, alpha=hidden,
    )  # fmt: skip
    bar = figure.colorbar(layer, ax=top, pad=0.01, aspect=11, shrink=0.82)
    bar.set_label("keener ← % → heavier", fontsize=8, color=INK)
    error = 100 * friction.sigma / level
    limits = (0.0, max(float(np.percentile(error, 98)), 1e-3))
    sigma = draw_map(
        bottom, sheet, error, smooth=False, cmap=UNCERTAINTY, vmin=limits[0], vmax=limits[1]
    )
    bar_sigma = figure.colorbar(sigma, ax=bottom, pad=0.01, aspect=11, shrink=0.82)
    bar_sigma.set_label("standard error, %", fontsize=8, color=INK)
    for bar_ in (bar, bar_sigma):
        bar_.ax.tick_params(labelsize=8, colors="#55606b")
        bar_.outline.set_visible(False)  # pyright: ignore[reportCallIssue]
    for ax in (top, bottom):
        draw_sheet(ax, sheet, rings=0.55)
        show_lengthwise(ax, sheet)
    for part in found.slides:
        bottom.plot(
            *lengthwise(part.xy[::3]).T, color=INK, lw=0.8,
            path_effects=[Stroke(linewidth=2.0, foreground="white", alpha=0.7), Normal()],
        )  # fmt: skip
    low, high = found.interval
    figure.suptitle(
        f"Friction of the ice: μ = {found.mu:.5f}  (95 %: {low:.5f} to {high:.5f}), "
        f"{len(found.slides)} throws",
        fontsize=13,
        color=INK,
    )
    top.set_title(_words(found), fontsize=9.5, color="#55606b", loc="left")
    note = "standard error and the paths that were measured; pale above: no stone crossed"
    if found.hyperparameters is not None:
        note += f"; details below {found.resolution:.1f} m are not resolved"
    bottom.set_title(note, fontsize=9.5, color="#55606b", loc="left")
    save_figure(figure, path)


def _words(found: Estimate) -> str:
    """The level of the ice in a curler's numbers, and where it is keen and heavy."""
    draw = draw_weight(found.ice, found.mu) if found.mu > 0 else None
    words = ""
    if draw is not None:
        speed, seconds, hog_to_hog = draw
        words = (
            f"a draw to the tee: {speed:.2f} m/s at the hog line, {seconds:.1f} s from hog line to "
            f"rest, {hog_to_hog:.1f} s from hog line to hog line"
        )
    friction = found.ice.friction
    if not found.uniform and friction.observed.any():
        mu = friction.mu[friction.observed]
        words += (
            f";  keenest {per_cent(mu.min() / found.mu - 1)}, "
            f"heaviest {per_cent(mu.max() / found.mu - 1)} where stones ran"
        )
    return words.lstrip("; ")


def save_motion(found: Estimate, path: Path) -> None:
    """Speed over time and deceleration over distance of every throw."""
    figure = new_figure(13, 5)
    left, right = figure.subplots(1, 2)
    for k, part in enumerate(found.slides):
        colour = TRACK_COLOURS[k % len(TRACK_COLOURS)]
        motion = smooth_motion(part.t, part.xy, window=SMOOTHING, noise=part.noise)
        t = part.t - part.t[0]
        left.plot(t, motion.speed, color=colour, lw=1, alpha=0.8)
        inner = slice(len(t) // 40 + 1, -(len(t) // 40) - 1)
        brake = -motion.acceleration[inner] / GRAVITY
        error = motion.acceleration_sigma[inner] / GRAVITY
        right.plot(motion.distance[inner], brake, color=colour, lw=0.9, alpha=0.8)
        if len(found.slides) <= 3:
            right.fill_between(
                motion.distance[inner], brake - 2 * error, brake + 2 * error, color=colour,
                alpha=0.15, lw=0,
            )  # fmt: skip
    right.axhline(found.mu, color=INK, lw=1.2, ls="--")
    right.annotate(
        "level of the ice", (0.005, found.mu), xycoords=("axes fraction", "data"),
        xytext=(0, -4), textcoords="offset points", va="top", fontsize=8, color=INK,
    )  # fmt: skip
    right.set_ylim(0, 2.2 * found.mu)
    left.set_ylim(bottom=0)
    for ax, x, y in (
        (left, "seconds since release", "speed [m/s]"),
        (right, "distance since release [m]", "deceleration / g"),
    ):
        plain_axes(ax)
        ax.set_xlabel(x, fontsize=9, color=INK)
        ax.set_ylabel(y, fontsize=9, color=INK)
    figure.suptitle("How the stones slowed", fontsize=13, color=INK)
    save_figure(figure, path)


def save_residuals(found: Estimate, path: Path) -> None:
    """What the fit leaves of each throw, and how alike neighbouring frames err."""
    assert found.noise is not None
    figure = new_figure(13, 4.2)
    left, right = figure.subplots(1, 2, width_ratios=(2, 1))
    lags = np.arange(0, 31)
    sums, counts = np.zeros(len(lags)), np.zeros(len(lags))
    for k, throw in enumerate(found.throws):
        colour = TRACK_COLOURS[k % len(TRACK_COLOURS)]
        rest = 1000 * throw.residual[throw.keep]
        left.plot(throw.t[throw.keep], rest, ".", color=colour, ms=1.5, alpha=0.5)
        for lag in lags[: len(rest) - 1]:
            sums[lag] += float((rest[lag:] * rest[: len(rest) - lag]).sum())
            counts[lag] += len(rest) - lag
    known = counts > 0
    alike = sums[known] / counts[known]
    right.bar(lags[known], alike / max(alike[0], 1e-12), color=TRACK_COLOURS[0], width=0.7)
    limit = 4.5e3 * found.noise.total
    left.set_ylim(-limit, limit)
    for ax, x, y in (
        (left, "seconds since release", "measured − fitted distance [mm]"),
        (right, "frames apart", "correlation of the rest"),
    ):
        plain_axes(ax)
        ax.set_xlabel(x, fontsize=9, color=INK)
        ax.set_ylabel(y, fontsize=9, color=INK)
    noise = f"noise: {1000 * found.noise.white:.1f} mm white"
    if found.noise.slow > 0:
        noise += f", {1000 * found.noise.slow:.1f} mm lasting {found.noise.time:.2f} s"
    figure.suptitle(f"What the fit leaves;  {noise}", fontsize=13, color=INK)
    save_figure(figure, path)


def papers_way(found: Estimate) -> Estimate:
    """What differentiating and averaging, the paper's own way, makes of the same throws."""
    tracks = [part.track for part in found.slides]
    return estimate_ice(tracks, start=found.ice, method="paper", uniform=found.uniform)


def save_profile(found: Estimate, plain: Estimate, path: Path) -> None:
    """Friction along the sheet: the joint fit, its σ, and the paper's own way beside it."""
    sheet, friction = found.ice.sheet, found.ice.friction
    figure = new_figure(13, 4.6)
    ax = figure.subplots()
    weights = friction.observed.astype(float)
    seen = weights.sum(axis=1) > 0
    total = np.maximum(weights.sum(axis=1), 1)
    mean = (friction.mu * weights).sum(axis=1) / total
    error = (friction.sigma * weights).sum(axis=1) / total
    y = sheet.y_centres
    shown = np.where(seen, mean, np.nan)
    ax.fill_between(y, shown - 2 * error, shown + 2 * error, color=TRACK_COLOURS[0], alpha=0.2,
                    lw=0, label="± 2 σ of a cell")  # fmt: skip
    ax.plot(y, shown, color=TRACK_COLOURS[0], lw=2, label="joint fit of all throws")
    own = plain.ice.friction
    rough = np.where(own.observed, own.mu, np.nan)
    ax.plot(np.repeat(y, sheet.shape[1]), rough.ravel(), ".", color=TRACK_COLOURS[1], ms=3,
            alpha=0.5, label="differentiated and averaged, per cell")  # fmt: skip
    span = max(float(np.nanmax(shown + 3 * error) - np.nanmin(shown - 3 * error)), 0.1 * found.mu)
    ax.set_ylim(max(0.0, np.nanmin(shown) - 1.2 * span), np.nanmax(shown) + 1.2 * span)
    _along_the_sheet(ax, found.ice)
    ax.set_ylabel("μ, mean over the cells crossed", fontsize=9, color=INK)
    ax.legend(frameon=False, fontsize=8, ncols=3, loc="upper left")
    figure.suptitle("Friction along the sheet", fontsize=13, color=INK)
    save_figure(figure, path)


def save_camera_bias(bias: CameraBias, ice: Ice, path: Path) -> None:
    """The ripple of a camera along the sheet, and how well it is known."""
    figure = new_figure(13, 3.4)
    ax = figure.subplots()
    y = np.linspace(bias.nodes[0], bias.nodes[-1], 400)
    shown, error = 1000 * bias.at(y), 1000 * np.interp(y, bias.nodes, bias.sigma)
    ax.fill_between(y, shown - 1.96 * error, shown + 1.96 * error, color=TRACK_COLOURS[0],
                    alpha=0.2, lw=0)  # fmt: skip
    ax.plot(y, shown, color=TRACK_COLOURS[0], lw=2)
    ax.axhline(0, color=INK, lw=0.8)
    _along_the_sheet(ax, ice)
    ax.set_ylabel("towards home ← mm → away", fontsize=9, color=INK)
    figure.suptitle(
        f"What the camera was off by: {1000 * bias.size:.1f} mm (rms)", fontsize=13, color=INK
    )
    save_figure(figure, path)


def _along_the_sheet(ax: Any, ice: Ice) -> None:
    ax.set_xlim(-ice.sheet.length / 2, ice.sheet.length / 2)
    ax.set_xticks([-TEE_Y, -HOG_LINE_Y, 0, HOG_LINE_Y, TEE_Y])
    ax.set_xticklabels(["home tee", "hog line", "middle", "hog line", "away tee"])
    plain_axes(ax)


def save_comparison(comparison: Comparison, ice: Ice, path: Path) -> None:
    """Measured and predicted paths on the sheet, the misses at rest, and how the paths part."""
    figure = new_figure(13, 7.2)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.0, 1.9), width_ratios=(1, 1.25))
    top = figure.add_subplot(grid[0, :])
    draw_sheet(top, ice.sheet)
    show_lengthwise(top, ice.sheet)
    colours = {
        k.throw: TRACK_COLOURS[i % len(TRACK_COLOURS)] for i, k in enumerate(comparison.rethrows)
    }
    for k in comparison.rethrows:
        colour = colours[k.throw]
        top.plot(*lengthwise(k.measured).T, color=colour, lw=1.4, alpha=0.75)
        top.plot(*lengthwise(k.predicted).T, color=colour, lw=1.0, ls=(0, (4, 3)))
        if k.rest is not None:
            draw_stone(top, ice.stone.radius, k.rest, colour=colour)
            draw_stone(top, ice.stone.radius, k.predicted_rest, colour=colour, filled=False)
    top.set_xlim(-ice.sheet.length / 2 - 0.3, ice.sheet.length / 2 + 0.3)
    top.legend(
        handles=[
            Line2D([], [], color=INK, lw=1.4, label="measured, rest as a stone"),
            Line2D([], [], color=INK, lw=1.0, ls=(0, (4, 3)), label="predicted, rest as a ring"),
        ],
        frameon=False, fontsize=8, ncols=2, loc="upper left", bbox_to_anchor=(0.0, 1.22),
    )  # fmt: skip
    _draw_misses(figure.add_subplot(grid[1, 0]), comparison, ice.stone.radius, colours)
    _draw_parting(figure.add_subplot(grid[1, 1]), comparison, colours)
    totals = comparison.summary()
    words = f"paths {_centimetres(totals['path_rms_m'])} apart (rms)"
    if totals["rested"]:
        words += f", rest {_centimetres(totals['rest_error_m'])} apart (rms)"
    figure.suptitle(
        f"{len(comparison.rethrows)} throws thrown again: {words}", fontsize=13, color=INK
    )
    save_figure(figure, path)


def _draw_misses(ax: Any, comparison: Comparison, radius: float, colours: dict[int, str]) -> None:
    """Predicted rest about the measured one, seen by the thrower."""
    from matplotlib.patches import Circle

    misses = [
        (k.throw, -k.too_far_left, k.too_long)
        for k in comparison.rethrows
        if k.too_far_left is not None and k.too_long is not None
    ]
    plain_axes(ax)
    ax.set_title("where the prediction rests; grey: the measured stone", fontsize=10,
                 color=INK)  # fmt: skip
    if not misses:
        ax.text(0.5, 0.5, "no throw was seen to rest", transform=ax.transAxes, ha="center",
                color=FAINT)  # fmt: skip
        return
    reach = max(1.25 * max(abs(v) for _, *both in misses for v in both), 1.3 * radius)
    ax.add_patch(Circle((0, 0), radius, facecolor="#e8ebee", edgecolor=FAINT, lw=1))
    ax.axhline(0, color=FAINT, lw=0.6)
    ax.axvline(0, color=FAINT, lw=0.6)
    for throw, right, long in misses:
        ax.plot(right, long, "o", color=colours[throw], ms=7)
        ax.annotate(str(throw), (right, long), xytext=(6, 4), textcoords="offset points",
                    fontsize=7, color=INK)  # fmt: skip
    ax.set_xlim(-reach, reach)
    ax.set_ylim(-reach, reach)
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlabel("left ← metres → right", fontsize=9, color=INK)
    ax.set_ylabel("short ← metres → long", fontsize=9, color=INK)


def _draw_parting(ax: Any, comparison: Comparison, colours: dict[int, str]) -> None:
    """How far predicted and measured path lie apart along the play, over the distance run."""
    for k in comparison.rethrows:
        ahead = k.release.direction * (k.predicted - k.measured)[:, 1]
        # The eye wants the trend: a median over two thirds of a second quiets single frames.
        ahead = median_filter(ahead, size=min(21, len(ahead)), mode="nearest")
        run = np.hypot(*(k.predicted - k.predicted[0]).T)
        whole = slice(10, -10) if len(run) > 60 else slice(None)  # medians cut short at the ends
        ax.plot(run[whole], 100 * ahead[whole], color=colours[k.throw], lw=1, alpha=0.8)
        outside = np.flatnonzero(k.tested)
        if outside.size:
            ax.plot(run[outside[0]], 100 * ahead[outside[0]], "|", color=INK, ms=9)
    ax.axhline(0, color=INK, lw=0.8)
    plain_axes(ax)
    ax.set_title("prediction ahead of the stone; the bar ends the part it was fitted to",
                 fontsize=10, color=INK)  # fmt: skip
    ax.set_xlabel("distance since release [m]", fontsize=9, color=INK)
    ax.set_ylabel("behind ← cm → ahead", fontsize=9, color=INK)


def per_cent(part: float) -> str:
    """A share in words for people, with its sign."""
    return f"{100 * part:+.1f} %".replace("-", "−")


def _centimetres(metres: float | None) -> str:
    return "–" if metres is None else f"{100 * metres:.1f} cm"
