"""Figures of docs/validation.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from curling_env.ice import load_ice
from curling_env.render.figures import FAINT, INK, new_figure, plain_axes, save_figure
from curling_env.sheet import HOG_TO_FAR_TEE, HOG_TO_TEE
from curling_env.validation import ICE_ROWS, Row, Shots
from curling_env.validation.draws import KEEN, PLACES, hog_to_hog
from curling_env.validation.friction import friction_between

COLOURS = {"standard": "#123a63", "fitted": "#0d7a3f", "club": "#a38414", "fcv1": "#c8332b"}
BIN = 0.1
FARTHEST = 6.0
"""Maximum residual drawn, in half-widths of a row's bounds."""


def draw_all(folder: Path) -> None:
    """Draw every figure into a folder."""
    draw_friction(folder / "friction.png")
    draw_rows(folder / "rows.png")
    draw_weights(folder / "weights.png")


def draw_friction(path: Path) -> None:
    """Draw friction against speed: presets and measurements."""
    figure = new_figure(8, 4.6)
    ax = figure.subplots()
    low = np.arange(0.1, 2.2, BIN)
    ax.axhspan(0.006, 0.016, color="#eef2f6", label="Li et al. 2022: all")
    for name, colour in COLOURS.items():
        shots = Shots(load_ice(name))
        mu = [friction_between(shots, float(v) + BIN, float(v)) for v in low]
        ax.plot(low + BIN / 2, np.array(mu, dtype=float), color=colour, lw=1.8, label=name)
    v = np.linspace(0.15, 2.25, 100)
    ax.plot(v, 0.008 / np.sqrt(v), color=FAINT, ls="--", lw=1.2, label="Penner: 0.008·v^(-1/2)")
    ax.errorbar([0.25, 2.15], [0.012, 0.007], 0.0005, [0.05, 0.05], fmt="o", color="black", ms=5,
                capsize=3, label="Beijing 2022, first and last bin", zorder=5)  # fmt: skip
    plain_axes(ax)
    ax.set_xlim(0.1, 2.25)
    ax.set_ylim(0.004, 0.021)
    ax.set_xlabel("speed [m/s]", color=INK)
    ax.set_ylabel("deceleration over g", color=INK)
    ax.legend(frameon=False, fontsize=8)
    save_figure(figure, path)


def draw_rows(path: Path) -> None:
    """Draw the residual of each preset in every row with bounds, in half-widths."""
    rows: list[Row] = [row for row in ICE_ROWS if row.low is not None and row.low != row.high]
    figure = new_figure(9.5, 0.3 * len(rows) + 1.2)
    ax = figure.subplots()
    ax.axvspan(-1, 1, color="#e3f1e6")
    for k, (name, colour) in enumerate(COLOURS.items()):
        shots = Shots(load_ice(name))
        for line, row in enumerate(rows):
            value = row.value(shots)
            if value is None:
                continue
            off = row.residual(value)
            marker = "o" if abs(off) <= FARTHEST else (">" if off > 0 else "<")
            ax.plot(
                np.clip(off, -FARTHEST, FARTHEST), line + 0.16 * (k - 1.5), marker,
                color=colour, ms=5, clip_on=False, label=name if line == 0 else None,
            )  # fmt: skip
    plain_axes(ax)
    ax.set_yticks(range(len(rows)))
    ax.set_yticklabels([f"{row.name}  ({row.published})" for row in rows], fontsize=8)
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.set_xlim(-FARTHEST, FARTHEST)
    ax.set_xlabel(
        "difference from the published value, in units of its uncertainty", color=INK, fontsize=9
    )
    ax.legend(frameon=False, fontsize=8, ncols=4, loc="lower center", bbox_to_anchor=(0.3, 1.0))
    save_figure(figure, path)


def draw_weights(path: Path) -> None:
    """Draw the rest of stones by hog-to-hog time on 14.5 s ice, beside coaches' values."""
    figure = new_figure(8, 4.4)
    ax = figure.subplots()
    times = np.linspace(11.0, 17.0, 61)
    for name in ("standard", "fcv1"):
        scaled = Shots(load_ice(name)).scaled_until(hog_to_hog, KEEN)
        assert scaled is not None  # of a preset
        speeds = [scaled.weight_of_time(float(t)) for t in times]
        carried = [np.nan if s is None else scaled.carry(s) - HOG_TO_FAR_TEE for s in speeds]
        ax.plot(times, carried, color=COLOURS[name], lw=1.8, label=f"{name}, scaled to {KEEN} s")
    ax.plot(times, 1.8288 * (KEEN - times), color=FAINT, ls="--", lw=1.2, label="six feet a second")
    coaches = {"a guard": 15.2, "the hack": 12.5, "the backboard": 11.2}
    for place, time in coaches.items():
        at = PLACES[place] - HOG_TO_FAR_TEE
        ax.plot(time, at, "o", color="black", ms=5, zorder=5)
        ax.annotate(place, (time, at), (-6, -14), textcoords="offset points", fontsize=9, color=INK)
    ax.plot(KEEN, 0.0, "o", color="black", ms=5, zorder=5, label="coaches' table")
    ax.annotate("the draw", (KEEN, 0.0), (6, 5), textcoords="offset points", fontsize=9, color=INK)
    plain_axes(ax)
    ax.set_xlim(11.0, 17.0)
    ax.set_ylim(-HOG_TO_TEE, 12.0)
    ax.set_xlabel("hog line to hog line [s]", color=INK)
    ax.set_ylabel("stops beyond the tee [m]", color=INK)
    ax.legend(frameon=False, fontsize=8)
    save_figure(figure, path)
