"""Sections of a discovery's page on what it is worth: models compared, and forecasts checked."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import kstwo

from curling_env.render.figures import INK, new_figure, plain_axes
from curling_env.typing import Floats
from friction_estimation.discovery.assessment import BASELINE, NAMED
from friction_estimation.discovery.verdict import readable
from friction_estimation.reports.html import picture, table

BAND, STEPS = "#8a97a6", "#2b7a4b"
SIDES = {"along": "how far it went", "across": "to which side it went"}
ENDS = {"along": "short to long", "across": "left to right"}
LEAST_CHECKED = 5
"""Throws below which a check of the forecasts says nothing."""


def assessment_sections(report: dict[str, Any]) -> list[str]:
    """The sections, as HTML; none for a report without an assessment."""
    sections: list[str] = []
    if len(report.get("models", [])) > 1:
        sections.append(models_section(report["models"]))
    checked = report.get("loo_pit", {"throws": []})
    if len(checked["throws"]) >= LEAST_CHECKED:
        sections.append(pit_section(checked))
    if report.get("next_throws"):
        sections.append(next_section(report["next_throws"]))
    return sections


def models_section(models: list[dict[str, Any]]) -> str:
    """The table of the models that were in question."""
    rows = [
        [
            escape(_model_in_words(model["name"])),
            f"{model['elpd']:,.0f}".replace(",", " "),
            f"{model['se']:,.0f}".replace(",", " "),
            f"{model['difference']:,.1f}".replace(",", " ") if model["difference"] else "best",
            f"{model['difference_se']:,.1f}".replace(",", " ") if model["difference"] else "",
        ]
        for model in models
    ]
    head = ["model", "elpd", "± se", "less than the best", "± se"]
    return (
        "<h2>How well each model foretells a throw</h2><p class=faint>Expected log predictive "
        "density: ln of the probability density of every throw under the fit to all the others, "
        "summed. A model is clearly worse where its difference is several times its standard "
        f"error.</p>{table(head, rows, {1, 2, 3, 4})}"
    )


def _model_in_words(name: str) -> str:
    """A model of a report in words, such as "the improved model without curl"."""
    for short, words in ((BASELINE, "the model as it was"), (NAMED, "the improved model")):
        if name == short:
            return words
        for sign, between in ((" + ", "with"), (" without ", "without")):
            if name.startswith(short + sign):
                return f"{words} {between} {readable(name.removeprefix(short + sign))}"
    return name


def pit_section(checked: dict[str, Any]) -> str:
    """The check of the forecasts: figure and verdict."""
    values = {side: np.array(checked[side]) for side in SIDES}
    worse = [SIDES[side] for side, each in values.items() if not _is_even(each)]
    verdict = (
        f"Not so here: {' and '.join(worse)} leaves the band."
        if worse
        else "Both stay within the band."
    )
    return (
        "<h2>Do the forecasts err as often as they say?</h2><p class=faint>Each throw was left "
        "out, forecast by the others from its first four seconds, and then found somewhere in its "
        "forecast. "
        "If the stated uncertainty is right, a tenth of the throws lie in the first tenth of "
        "their forecasts, and so on: the steps follow the diagonal, and leave the band in one "
        f"session of twenty. {escape(verdict)}</p>"
        + picture(pit_picture(values), "share of throws over the place in their forecast")
    )


def next_section(throws: list[dict[str, Any]]) -> str:
    """The throws that would teach most."""
    rows = [
        [
            str(place),
            escape(throw["words"]),
            escape(", ".join(_taught(name, part) for name, part in throw["teaches"].items())),
        ]
        for place, throw in enumerate(throws, start=1)
    ]
    return (
        "<h2>The next throws that would teach most</h2><p class=faint>Of throws in both "
        "directions, at five weights, with quick and slow turns and on five lines; each in "
        "addition to those above it.</p>" + table(["", "throw", "removes of the variance"], rows)
    )


def _taught(name: str, part: float) -> str:
    return f"{readable(name)} {100 * part:.0f} %"


def pit_picture(values: dict[str, Floats]) -> Figure:
    """Share of throws up to each place in their forecasts, with the band of even ones.

    Parameters
    ----------
    values : probability integral transforms by side, as of `SIDES`
    """
    figure = new_figure(8.4, 3.9)
    for ax, (side, title) in zip(figure.subplots(1, 2), SIDES.items(), strict=True):
        plain_axes(ax)
        each = np.sort(values[side])
        half = _half_band(len(each))
        line = np.linspace(0.0, 1.0, 101)
        low, high = np.clip(line - half, 0.0, 1.0), np.clip(line + half, 0.0, 1.0)
        ax.fill_between(line, low, high, color=BAND, alpha=0.25, lw=0, label="95 % of sessions")
        ax.plot([0, 1], [0, 1], color=BAND, lw=1)
        shares = np.arange(len(each) + 1) / len(each)
        ax.step(
            np.concatenate([[0.0], each, [1.0]]),
            np.append(shares, 1.0),
            where="post",
            color=STEPS,
            lw=2,
            label=f"{len(each)} throws",
        )
        ax.set_xlim(0, 1)
        ax.set_ylim(0, 1)
        ax.set_aspect("equal")
        ax.set_title(title, fontsize=10, color=INK)
        ax.set_xlabel(f"place in the forecast, {ENDS[side]}", fontsize=9)
        ax.set_ylabel("share of throws", fontsize=9)
        ax.legend(loc="upper left", fontsize=8, frameon=False)
    return figure


def _half_band(count: int) -> float:
    """Half-height of the band that even values stay within in 95 % of all cases.

    Source: Kolmogorov's distribution for a finite number of values.
    """
    return float(kstwo.ppf(0.95, count))


def _is_even(values: Floats) -> bool:
    """Whether the steps stay within the band."""
    each, n = np.sort(values), len(values)
    above = float((np.arange(1, n + 1) / n - each).max())
    below = float((each - np.arange(n) / n).max())
    return max(above, below) <= _half_band(n)
