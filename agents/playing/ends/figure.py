"""The picture of ends beside published ones, and of what predictions were worth."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from agents.playing.ends.published import CLASSES, PUBLISHED_SHARES
from agents.playing.tournament import wilson
from curling_env.render.figures import new_figure, plain_axes, save_figure

COLOURS = {"published": "#20364b", "by-the-odds": "#c8793a", "championship": "#2f8f83"}
LABELS = {"by-the-odds": "by the odds alone", "championship": "as championships are played"}


def draw_ends(
    found: Mapping[str, Mapping[str, Any]], calibration: Mapping[str, Any], path: Path
) -> None:
    """Draw scores of ends and the calibration of predictions.

    Parameters
    ----------
    found : summaries of games by name, see `results.summary`
    calibration : how chances to win came true, see `results.calibration`
    path : picture to write
    """
    figure = new_figure(9.5, 3.9)
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    plain_axes(left)
    at, width = np.arange(len(CLASSES)), 0.27
    left.bar(
        at - width,
        100 * np.array(PUBLISHED_SHARES),
        width,
        color=COLOURS["published"],
        label="published, 37,624 ends",
    )
    for k, name in enumerate(label for label in LABELS if label in found):
        counts = np.array(found[name]["counts"])
        bounds = np.array([wilson(float(c), int(counts.sum())) for c in counts]).T
        shares = counts / counts.sum()
        left.bar(
            at + k * width,
            100 * shares,
            width,
            color=COLOURS[name],
            label=f"{LABELS[name]}, {counts.sum():,} ends",
            yerr=100 * np.abs(bounds - shares),
            error_kw={"lw": 0.8, "ecolor": "#555555"},
        )
    left.set_xticks(at, CLASSES)
    left.set_xlabel("points of the team with the hammer", fontsize=8)
    left.set_ylabel("ends [%]", fontsize=8)
    left.set_ylim(0, 1.35 * left.get_ylim()[1])
    left.legend(frameon=False, fontsize=8, loc="upper left")
    plain_axes(right)
    right.plot([0, 1], [0, 1], color="#9aa7b3", lw=0.8)
    for key, label, colour in (
        ("calls", "chance seen in a call", COLOURS["championship"]),
        ("table_of_search", "win table of search, before an end", COLOURS["by-the-odds"]),
    ):
        bins = calibration[key]["bins"]
        x, y, low, high = (
            np.array([one[part] for one in bins]) for part in ("predicted", "share", "low", "high")
        )
        right.errorbar(
            x, y, yerr=[y - low, high - y], fmt="o-", ms=3, lw=1, color=colour, label=label
        )
    right.set_xlabel("chance to win that was predicted", fontsize=8)
    right.set_ylabel("share of games won", fontsize=8)
    right.legend(frameon=False, fontsize=8)
    save_figure(figure, path)
