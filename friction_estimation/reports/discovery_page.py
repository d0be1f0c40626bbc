"""The report of a discovery as one page: figures first, then the evidence."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

from curling_env.units import Units
from friction_estimation.discovery.discover import Discovery
from friction_estimation.discovery.verdict import gain_in_words, readable
from friction_estimation.reports.assessment_sections import assessment_sections
from friction_estimation.reports.discovery_draw import draw_shift
from friction_estimation.reports.discovery_figures import (
    draw_picture,
    forecast_picture,
    gap_picture,
    residual_pictures,
)
from friction_estimation.reports.draw_weight import draw_facts
from friction_estimation.reports.html import facts, picture, table, write_page


def write_report_page(
    found: Discovery,
    report: dict[str, Any],
    path: Path,
    *,
    throws: str = "",
    units: Units = Units.METRES,
) -> None:
    """Write `report.html`.

    Parameters
    ----------
    found : the discovery
    report : what `discovery.report` says of it
    path : file to write
    throws : the table of throws (`throws_section.throws_section`), HTML
    units : what lengths are told in where a coach reads them
    """
    ice = found.improved_ice()
    draw = draw_facts(ice, float(ice.friction.mu.mean()), units)
    parts = [f"<h1>{escape(report['verdict'])}</h1>{_first_pictures(found, units)}"]
    if draw:
        parts.append(f"<h2>What this ice asks of a draw</h2>{facts(draw)}")
    parts.append(throws)
    if report["effects"]:
        parts.append(f"<h2>What is missing</h2>{_effects(report)}")
    for label, figure in residual_pictures(found):
        title = (
            "What nothing known explains"
            if label == "unknown"
            else f"Where {readable(label)} shows"
        )
        parts.append(
            f"<h2>{escape(title)}</h2><p class=faint>Red: what the model as it was leaves "
            "unexplained, averaged over all throws. Green: what is left once the effect is in it. "
            f"Noise alone lies around zero.</p>{picture(figure, title)}"
        )
    if found.gaps:
        parts.append(
            "<h2>Throws the model had never seen</h2>"
            "<p class=faint>Forecast from their first four seconds.</p>"
            + picture(forecast_picture(found), "forecast and measured paths")
        )
    parts += [_open_questions(report), _candidates(report), *assessment_sections(report)]
    parts += [_smallest(report), _numbers(report)]
    write_page(
        path,
        "Discovery",
        [part for part in parts if part],
        provenance=report.get("provenance"),
    )


def _first_pictures(found: Discovery, units: Units) -> str:
    """The forecast gap before and after, and the same draw before and after."""
    shown = ""
    if found.gaps:
        shown += picture(
            gap_picture(found),
            "distance between forecast and rest",
            caption="How far from the forecast throws came to rest that nothing was fitted to.",
        )
    shift = draw_shift(found)
    if shift is not None:
        shown += picture(
            draw_picture(shift, found.final.model.ice, units),
            "the same draw before and after",
            caption=shift.words_in(units),
        )
    return f"<div class=side>{shown}</div>" if shown else ""


def _words(effect: dict[str, Any]) -> str:
    """A reported effect in plain words."""
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
    return table(["missing", "how much", "where it shows"], rows) if rows else ""


def _open_questions(report: dict[str, Any]) -> str:
    items: list[str] = []
    for effect in report["effects"]:
        throws = effect["evidence"].get("separating_throws", {})
        for name, throw in throws.items():
            items.append(f"{_words(effect)} or {readable(name)}? Settled by a throw of {throw}.")
        proxies = effect["evidence"].get("proxies", [])
        if proxies:
            listed = ", ".join(readable(name) for name in proxies)
            items.append(f"Proxies that mend part of the unknown, none of them proved: {listed}.")
    items.append(report["undecidable"]["why"][0].upper() + report["undecidable"]["why"][1:])
    listed = "".join(f"<li>{escape(item)}</li>" for item in items)
    return f"<h2>What these throws cannot tell</h2><ul>{listed}</ul>"


def _candidates(report: dict[str, Any]) -> str:
    if not report["candidates"]:
        return ""
    evidence = {e["evidence"].get("label", e["name"]): e["evidence"] for e in report["effects"]}
    rows: list[list[str]] = []
    for row in report["candidates"]:
        p = evidence.get(row["name"], {}).get("p_holm")
        closes = row["closure"]
        rows.append(
            [
                escape(readable(row["name"])),
                f"{row['gain']:.1f}",
                "" if row["needed"] is None else f"{row['needed']:.0f}",
                "" if closes is None else f"{100 * closes:.0f} %",
                "" if p is None else f"{p:.2g}",
            ]
        )
    head = ["alone beside the model", "gain in −2 ln L", "needed", "closes", "p (corrected)"]
    return f"<h2>The candidates</h2>{table(head, rows, {1, 2, 3, 4})}"


def _smallest(report: dict[str, Any]) -> str:
    rows = [
        [escape(readable(label)), escape(", ".join(f"{n} {v:.3g}" for n, v in values.items()))]
        for label, values in report["smallest_detectable"].items()
    ]
    if not rows:
        return ""
    return (
        "<h2>What would have been seen</h2><p class=faint>The smallest effect that these "
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
    extra = f"<p class=faint>Left out:</p><ul>{left}</ul>" if left else ""
    return f"<h2>Noise and baseline</h2>{table(['', ''], rows, {1})}{extra}"
