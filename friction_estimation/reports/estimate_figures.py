"""Figures of an estimate."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.patheffects import Normal, Stroke
from scipy.interpolate import CubicSpline

from curling_env.ice import Ice
from curling_env.physics.motion import GRAVITY
from curling_env.render.figures import (
    INK,
    KEEN_TO_HEAVY,
    SOFT,
    TRACK_COLOURS,
    UNCERTAINTY,
    draw_map,
    draw_sheet,
    lengthwise,
    new_figure,
    plain_axes,
    save_figure,
    show_lengthwise,
)
from curling_env.sheet import HOG_LINE_Y, TEE_Y
from curling_env.typing import Floats
from curling_env.units import Units, length, speed
from friction_estimation.estimation.camera_bias import CameraBias
from friction_estimation.estimation.estimate import Estimate
from friction_estimation.reports.draw_weight import DrawWeight
from friction_estimation.tracks.smoothing import smooth_motion


def write_pictures(
    found: Estimate, plain: Estimate | None, folder: Path, units: Units = Units.METRES
) -> list[str]:
    """All figures of an estimate.

    Parameters
    ----------
    found : the estimate
    plain : the same throws by the paper's method; None where that is the method of the estimate
    folder : existing folder to write to
    units : units of displayed lengths and of the speed of a draw

    Returns
    -------
    names of the files written
    """
    save_map(found, folder / "map.png", units)
    save_motion(found, folder / "motion.png")
    names = ["map.png", "motion.png"]
    if found.travel_residuals:
        save_residuals(found, folder / "residuals.png")
        names.append("residuals.png")
    if plain is not None and not found.uniform:
        save_profile(found, plain, folder / "profile.png")
        names.append("profile.png")
    if found.camera_bias is not None and found.camera_bias.found:
        save_camera_bias(found.camera_bias, found.ice, folder / "camera.png")
        names.append("camera.png")
    return names


def save_map(found: Estimate, path: Path, units: Units = Units.METRES) -> None:
    """Save the friction map in a curler's terms, its uncertainty, and the measured paths."""
    sheet, friction = found.ice.sheet, found.ice.friction
    figure = new_figure(13, 4.5)
    top, bottom = figure.subplots(2, 1)
    level = found.mu if found.mu > 0 else float(friction.mu.mean())
    relative = 100 * (friction.mu / level - 1)
    seen = friction.observed
    reach = max(float(np.percentile(np.abs(relative[seen]), 99)), 1.0)
    colours = {"cmap": KEEN_TO_HEAVY, "vmin": -reach, "vmax": reach}
    hidden = np.where(seen, 1.0, 0.35)
    layer = draw_map(top, sheet, relative, smooth=False, alpha=hidden, **colours)
    error = 100 * friction.sigma / level
    most = max(float(np.percentile(error, 98)), 1e-3)
    sigma = draw_map(bottom, sheet, error, smooth=False, cmap=UNCERTAINTY, vmin=0.0, vmax=most)
    for ax, drawn, label in (
        (top, layer, "keener ← % → heavier"),
        (bottom, sigma, "standard error, %"),
    ):
        bar = figure.colorbar(drawn, ax=ax, pad=0.01, aspect=11, shrink=0.82)
        bar.set_label(label, fontsize=8, color=INK)
        bar.ax.tick_params(labelsize=8, colors=SOFT)
        bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]
        draw_sheet(ax, sheet, rings=0.55)
        show_lengthwise(ax, sheet)
    for part in found.slides:
        bottom.plot(
            *lengthwise(part.xy[::3]).T,
            color=INK,
            lw=0.8,
            path_effects=[Stroke(linewidth=2.0, foreground="white", alpha=0.7), Normal()],
        )
    low, high = found.interval
    title = f"Friction of the ice: μ = {found.mu:.5f}  (95 %: {low:.5f} to {high:.5f})"
    top.set_title(_caption(found, units), fontsize=9.5, color=SOFT, loc="left")
    note = "standard error and the paths that were measured; pale above: no stone crossed"
    if found.resolution is not None:
        note += f"; details below {length(found.resolution, units)} are not resolved"
    bottom.set_title(note, fontsize=9.5, color=SOFT, loc="left")
    save_figure(figure, path, f"{title}, {found.throws} throws")


def _caption(found: Estimate, units: Units) -> str:
    """Describe the level of the ice in a curler's numbers, and its keenest and heaviest places."""
    draw = DrawWeight(found.ice, found.mu) if found.mu > 0 else None
    words = ""
    if draw is not None and draw.speed is not None:
        words = (
            f"a draw to the tee: {speed(draw.speed, units)} at the hog line, {draw.seconds:.1f} s "
            f"from hog line to rest, {draw.hog_to_hog:.1f} s from hog line to hog line"
        )
    friction = found.ice.friction
    if found.mu > 0 and not found.uniform and friction.observed.any():
        mu = friction.mu[friction.observed]
        words += (
            f";  keenest cell that a stone crossed {per_cent(mu.min() / found.mu - 1)}, "
            f"heaviest {per_cent(mu.max() / found.mu - 1)}"
        )
    return words.lstrip("; ")


def save_motion(found: Estimate, path: Path) -> None:
    """Speed over time and deceleration over distance of every throw."""
    figure = new_figure(13, 5)
    left, right = figure.subplots(1, 2)
    for k, part in enumerate(found.slides):
        colour = TRACK_COLOURS[k % len(TRACK_COLOURS)]
        motion = smooth_motion(part.t, part.xy, window=2.0, noise=part.noise)
        t = part.t - part.t[0]
        left.plot(t, motion.speed, color=colour, lw=1, alpha=0.8)
        inner = slice(len(t) // 40 + 1, -(len(t) // 40) - 1)
        brake = -motion.acceleration[inner] / GRAVITY
        error = motion.acceleration_sigma[inner] / GRAVITY
        right.plot(motion.distance[inner], brake, color=colour, lw=0.9, alpha=0.8)
        if len(found.slides) <= 3:
            _band(right, motion.distance[inner], brake, 2 * error, colour)
    right.axhline(found.mu, color=INK, lw=1.2, ls="--")
    place = right.get_yaxis_transform()
    right.text(0.005, 0.98 * found.mu, "level of the ice", transform=place, va="top", fontsize=8)
    right.set_ylim(0, 2.2 * found.mu)
    left.set_ylim(bottom=0)
    plain_axes(left, "seconds since release", "speed [m/s]")
    plain_axes(right, "distance since release [m]", "deceleration / g")
    save_figure(figure, path, "How the stones slowed")


def save_residuals(found: Estimate, path: Path) -> None:
    """Residuals of each throw, and the correlation between neighbouring frames."""
    assert found.noise is not None
    figure = new_figure(13, 4.2)
    left, right = figure.subplots(1, 2, width_ratios=(2, 1))
    lags = np.arange(0, 31)
    sums, counts = np.zeros(len(lags)), np.zeros(len(lags))
    for k, (t, residual) in enumerate(found.travel_residuals):
        colour = TRACK_COLOURS[k % len(TRACK_COLOURS)]
        rest = 1000 * residual
        left.plot(t, rest, ".", color=colour, ms=1.5, alpha=0.5)
        for lag in lags[: len(rest) - 1]:
            sums[lag] += float((rest[lag:] * rest[: len(rest) - lag]).sum())
            counts[lag] += len(rest) - lag
    known = counts > 0
    alike = sums[known] / counts[known]
    right.bar(lags[known], alike / max(alike[0], 1e-12), color=TRACK_COLOURS[0], width=0.7)
    limit = 4.5e3 * found.noise.total
    left.set_ylim(-limit, limit)
    plain_axes(left, "seconds since release", "measured − fitted distance [mm]")
    plain_axes(right, "frames apart", "correlation of the residuals")
    noise = f"noise: {1000 * found.noise.white:.1f} mm white"
    if found.noise.slow > 0:
        noise += f", {1000 * found.noise.slow:.1f} mm lasting {found.noise.time:.2f} s"
    save_figure(figure, path, f"Residuals of the fit;  {noise}")


def save_profile(found: Estimate, plain: Estimate, path: Path) -> None:
    """Friction along the sheet: the joint fit with its σ, and the paper's method beside it.

    Parameters
    ----------
    found : joint fit
    plain : estimate of the same throws by the paper's method
    path : file to write
    """
    sheet, friction = found.ice.sheet, found.ice.friction
    figure = new_figure(13, 4.6)
    ax = figure.subplots()
    weights = friction.observed / np.maximum(friction.observed.sum(axis=1, keepdims=True), 1)
    error = (friction.sigma * weights).sum(axis=1)
    y = sheet.y_centres
    shown = np.where(friction.observed.any(axis=1), (friction.mu * weights).sum(axis=1), np.nan)
    _band(ax, y, shown, 2 * error, label="± 2 σ of a cell")
    ax.plot(y, shown, color=TRACK_COLOURS[0], lw=2, label="joint fit of all throws")
    own = plain.ice.friction
    rough = np.where(own.observed, own.mu, np.nan)
    ax.plot(
        np.repeat(y, sheet.shape[1]),
        rough.ravel(),
        ".",
        color=TRACK_COLOURS[1],
        ms=3,
        alpha=0.5,
        label="differentiated and averaged, per cell",
    )
    span = max(float(np.nanmax(shown + 3 * error) - np.nanmin(shown - 3 * error)), 0.1 * found.mu)
    ax.set_ylim(max(0.0, np.nanmin(shown) - 1.2 * span), np.nanmax(shown) + 1.2 * span)
    _along_the_sheet(ax, found.ice, "μ, mean over the cells crossed")
    ax.legend(frameon=False, fontsize=8, ncols=3, loc="upper left")
    save_figure(figure, path, "Friction along the sheet")


def save_camera_bias(bias: CameraBias, ice: Ice, path: Path) -> None:
    """Draw the bias of the camera along the sheet, with its 95 % interval."""
    figure = new_figure(13, 3.4)
    ax = figure.subplots()
    y = np.linspace(bias.nodes[0], bias.nodes[-1], 400)
    shown = 1000 * CubicSpline(bias.nodes, bias.values, bc_type="natural")(y)
    error = 1000 * np.interp(y, bias.nodes, bias.sigma)
    _band(ax, y, shown, 1.96 * error)
    ax.plot(y, shown, color=TRACK_COLOURS[0], lw=2)
    ax.axhline(0, color=INK, lw=0.8)
    _along_the_sheet(ax, ice, "towards home ← mm → away")
    save_figure(figure, path, f"What the camera was off by: {1000 * bias.size:.1f} mm (rms)")


def _band(
    ax: Any, x: Floats, y: Floats, half: Floats, colour: str = TRACK_COLOURS[0], **style: Any
) -> None:
    ax.fill_between(x, y - half, y + half, color=colour, alpha=0.2, lw=0, **style)


def _along_the_sheet(ax: Any, ice: Ice, label: str) -> None:
    ax.set_xlim(-ice.sheet.length / 2, ice.sheet.length / 2)
    ax.set_xticks([-TEE_Y, -HOG_LINE_Y, 0, HOG_LINE_Y, TEE_Y])
    ax.set_xticklabels(["home tee", "hog line", "middle", "hog line", "away tee"])
    plain_axes(ax, y=label)


def per_cent(part: float) -> str:
    """Return a share in words for people, with its sign."""
    return f"{100 * part:+.1f} %".replace("-", "−")
