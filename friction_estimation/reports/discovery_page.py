"""The report of a discovery as one page: paths, names, sizes, open questions, then evidence."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any, Literal

from matplotlib.figure import Figure

from curling_env.units import Units, short_length
from friction_estimation.discovery.discover import Discovery
from friction_estimation.discovery.verdict import gain_in_words, readable
from friction_estimation.reports.discovery_figures import (
    draw_picture,
    paths_picture,
    residual_pictures,
)
from friction_estimation.reports.draw_weight import draw_facts
from friction_estimation.reports.html import facts, fold, picture, table, write_page


def write_report_page(
    found: Discovery,
    report: dict[str, Any],
    path: Path,
    *,
    throws: str = "",
    units: Units = Units.METRES,
) -> None:
    """Write `report.html`: paths before and after, names, sizes, questions; everything else is
    folded.

    Parameters
    ----------
    found : the discovery
    report : what `discovery.report` says of it
    path : file to write
    throws : the table of throws (`throws_section.throws_section`), HTML
    units : units of lengths where a coach reads them
    """
    first = f"<h1>{escape(report['verdict'])}</h1>{_paths(found, units)}"
    ice = found.improved_ice()
    draw = draw_facts(ice, float(ice.friction.mu.mean()), units)
    folded = [
        f"<h2>A draw on this ice</h2>{facts(draw)}" if draw else "",
        _same_draw(found, units),
        *(_residuals(label, figure) for label, figure in residual_pictures(found)),
        throws,
        _candidates(report),
        _smallest(report),
        _numbers(report),
    ]
    questions = _sentences("What these throws cannot show", _open_questions(report))
    sections = [first, _effects(report), questions, _next(report), fold("Everything else", folded)]
    write_page(
        path,
        "Discovery",
        [section for section in sections if section],
        provenance=report.get("provenance"),
    )


def _paths(found: Discovery, units: Units) -> str:
    """Held-out throws with their forecasts by the model before and after."""
    if not found.gaps:
        return ""
    shown = "".join(
        picture(
            paths_picture(found, when),
            f"forecast and measured paths, {words}",
            caption=f"{words[0].upper()}{words[1:]}: "
            f"{short_length(found.gaps[when].rest_error, units)} off.",
        )
        for when, words in PICTURES.items()
    )
    return (
        "<p class=faint>Fresh throws are not used in the fit. Each is forecast from its first four "
        f"seconds, and drawn as its thrower sees it.</p><div class=side>{shown}</div>"
    )


STACKED = "throws"
"""Kind of a table whose rows become lists on a narrow screen."""
PICTURES: dict[Literal["before", "after"], str] = {
    "before": "the model before",
    "after": "the improved model",
}


def _same_draw(found: Discovery, units: Units) -> str:
    """Return the same draw on the ice before and after."""
    drawn = draw_picture(found, units)
    if drawn is None:
        return ""
    shown = picture(drawn[0], "the same draw before and after", caption=drawn[1])
    return f"<h2>The same draw</h2><div class=side>{shown}</div>"


def _residuals(label: str, figure: Figure) -> str:
    unknown = label == "unknown"
    title = "Unexplained by any known effect" if unknown else f"Evidence for {readable(label)}"
    return (
        f"<h2>{escape(title)}</h2><p class=faint>Red: residuals of the model before, averaged "
        "over all throws. Green: residuals with the effect in the model. Noise alone lies around "
        f"zero.</p>{picture(figure, title)}"
    )


def _sentences(title: str, sentences: Sequence[str]) -> str:
    """Sentences below a title, as HTML; nothing without any."""
    listed = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    return f"<h2>{escape(title)}</h2><ul>{listed}</ul>" if listed else ""


def _next(report: dict[str, Any]) -> str:
    """Most informative next throws."""
    rows = [
        [
            str(place),
            escape(throw["words"]),
            escape(
                ", ".join(f"{readable(k)} {100 * v:.0f} %" for k, v in throw["teaches"].items())
            ),
        ]
        for place, throw in enumerate(report.get("next_throws", []), start=1)
    ]
    if not rows:
        return ""
    head = ["", "throw", "share of the uncertainty removed"]
    return (
        f"<h2>The most informative next throws</h2>{table(head, rows, kind=STACKED)}"
        "<p class=faint>Each in addition to those above it. Handles are a right-hander's.</p>"
    )


def _words(effect: dict[str, Any]) -> str:
    """Return a reported effect in plain words."""
    return readable(effect["evidence"].get("label", effect["name"]))


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {escape(unit)}"


def _effects(report: dict[str, Any]) -> str:
    rows: list[list[str]] = []
    for effect in report["effects"]:
        values = ", ".join(
            f"{escape(name)} = {p['value']:.4g} ± {p['stderr']:.2g}{_unit(p['unit'])}"
            for name, p in effect["parameters"].items()
        )
        gain = effect["evidence"].get("metres_gained")
        values += f": {escape(gain_in_words(gain))}" if gain else ""
        follows = ", ".join(effect["depends_on"])
        rows.append(
            [
                f"<b>{escape(_words(effect))}</b><br>"
                f"<span class=tag>{escape(effect['name'])}</span>",
                values or (f"follows {escape(follows)}" if follows else "—"),
                escape(effect["where"]),
            ]
        )
    head = ["missing", "how much", "where it shows"]
    return f"<h2>What is missing</h2>{table(head, rows, kind=STACKED)}" if rows else ""


def _open_questions(report: dict[str, Any]) -> list[str]:
    """List uncertainties, remarks and proxies, and properties that no throws can show."""
    items = [*report["doubts"], *report["remarks"]]
    for effect in report["effects"]:
        proxies = ", ".join(readable(name) for name in effect["evidence"].get("proxies", []))
        if proxies:
            items.append(
                f"Proxies that explain part of the unknown, none of them proved: {proxies}."
            )
    why = report["undecidable"]["why"]
    return [*items, f"{why[0].upper()}{why[1:]}"]


def _candidates(report: dict[str, Any]) -> str:
    if not report["candidates"]:
        return ""
    evidence = {e["evidence"].get("label", e["name"]): e["evidence"] for e in report["effects"]}
    rows: list[list[str]] = []
    for row in report["candidates"]:
        p = evidence.get(row["name"], {}).get("p")
        rows.append(
            [
                escape(readable(row["name"])),
                f"{row['gain']:.1f}",
                "" if row["needed"] is None else f"{row['needed']:.0f}",
                "" if p is None else f"{p:.2g}",
            ]
        )
    head = ["alone beside the model", "gain in −2 ln L", "needed", "p"]
    return f"<h2>The candidates</h2>{table(head, rows, {1, 2, 3})}"


def _smallest(report: dict[str, Any]) -> str:
    rows = [
        [escape(readable(label)), escape(", ".join(f"{n} {v:.3g}" for n, v in values.items()))]
        for label, values in report["smallest_detectable"].items()
    ]
    if not rows:
        return ""
    return (
        "<h2>Smallest detectable effects</h2><p class=faint>The smallest effect that these "
        "throws would have shown clearly (five standard errors).</p>"
        f"{table(['effect', 'smallest'], rows)}"
    )


def _numbers(report: dict[str, Any]) -> str:
    base, noise, rest = report["baseline"], report["noise"], report["remaining"]
    rows = [
        ["friction of the baseline", f"{base['mu']:.6f} ± {base['mu_stderr']:.1g}"],
        ["throw-to-throw spread of friction", f"{100 * rest['mu_spread']:.2f} %"],
        ["noise of a position", f"{1e3 * noise['position_m']:.1f} mm"],
        ["noise of the heading", f"{1e3 * noise['heading_rad']:.0f} mrad"],
        ["memory of the noise", f"{noise['memory_s']:.2f} s"],
        ["slow residuals over noise, before", f"{base['slow_misfit']:.2f}"],
        ["slow residuals over noise, after", f"{rest['slow_misfit']:.2f}"],
    ]
    left = "".join(f"<li>{escape(reason)}</li>" for reason in report["left_out"])
    extra = f"<p class=faint>Excluded:</p><ul>{left}</ul>" if left else ""
    return f"<h2>Noise and baseline</h2>{table(['', ''], rows, {1})}{extra}"
