"""The report as a page of its own: pictures first, everything in one file."""

from __future__ import annotations

import base64
import io
from html import escape
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from curling_env.storage import write_text
from friction_estimation.discrepancy.discovery import Discovery
from friction_estimation.discrepancy.on_a_draw import draw_shift
from friction_estimation.discrepancy.pictures import (
    draw_picture,
    forecast_picture,
    gap_picture,
    residual_pictures,
)
from friction_estimation.discrepancy.verdict import readable

STYLE = """
body{font:16px/1.5 system-ui,sans-serif;color:#22313f;background:#eef3f7;margin:0}
main{max-width:60rem;margin:0 auto;padding:1.5rem}
section{background:#fff;border-radius:10px;padding:1.1rem 1.4rem;margin:1rem 0;
box-shadow:0 1px 3px #0002}
h1{font-size:1.55rem;line-height:1.3;margin:.4rem 0}
h2{font-size:1.1rem;margin:.2rem 0 .6rem}
img{max-width:100%;height:auto;display:block}
table{border-collapse:collapse;width:100%;font-size:.92rem}
td,th{padding:.3rem .6rem;border-bottom:1px solid #e3e8ed;text-align:left}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
.faint{color:#66727f;font-size:.92rem}
.side{display:flex;flex-wrap:wrap;gap:1rem;align-items:flex-start}
figure{flex:1 1 22rem;margin:0;min-width:0}
figcaption{color:#445;font-size:.95rem;margin-top:.3rem}
.scroll{overflow-x:auto}
.tag{background:#e3edf6;border-radius:5px;padding:.1rem .5rem;font-size:.9rem}
"""


def write_page(found: Discovery, report: dict[str, Any], path: Path) -> None:
    """Write `report.html`."""
    parts = [f"<section><h1>{escape(report['verdict'])}</h1>{_first_pictures(found)}</section>"]
    if report["effects"]:
        parts.append(f"<section><h2>What is missing</h2>{_effects(report)}</section>")
    for label, figure in residual_pictures(found):
        name = readable(label.partition("[")[0])
        title = "What nothing known explains" if label == "unknown" else f"Where {name} shows"
        parts.append(
            f"<section><h2>{escape(title)}</h2><p class=faint>Red: what the model as it was leaves "
            "unexplained, averaged over all throws. Green: what is left once the effect is in it. "
            f"Noise alone lies around zero.</p>{_picture(figure, title)}</section>"
        )
    if found.gaps:
        parts.append(
            "<section><h2>Throws the model had never seen</h2>"
            "<p class=faint>Forecast from their first four seconds.</p>"
            f"{_picture(forecast_picture(found), 'forecast and measured paths')}</section>"
        )
    parts += [_open_questions(report), _league(report), _smallest(report), _numbers(report)]
    write_text(
        path,
        "<!doctype html><html lang=en><meta charset=utf-8><title>Discovery</title>"
        f"<meta name=viewport content='width=device-width'><style>{STYLE}</style>"
        f"<main>{''.join(parts)}</main></html>\n",
    )


def _first_pictures(found: Discovery) -> str:
    """How far off before and after, and what that does to a draw."""
    shown: list[tuple[str, str]] = []
    if found.gaps:
        shown.append(
            (
                _picture(gap_picture(found), "distance between forecast and rest"),
                "How far from the forecast throws came to rest that nothing was fitted to.",
            )
        )
    shift = draw_shift(found)
    if shift is not None:
        picture = draw_picture(shift, found.final.model.ice)
        shown.append((_picture(picture, "the same draw before and after"), shift.words))
    figures = "".join(
        f"<figure>{picture}<figcaption>{escape(words)}</figcaption></figure>"
        for picture, words in shown
    )
    return f"<div class=side>{figures}</div>" if shown else ""


def _picture(figure: Figure, shows: str) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=130)
    data = base64.b64encode(buffer.getvalue()).decode()
    return f"<img alt='{escape(shows)}' src='data:image/png;base64,{data}'>"


def _table(head: list[str], rows: list[list[str]], numeric: set[int]) -> str:
    def cells(row: list[str], tag: str) -> str:
        return "".join(
            f"<{tag} class=n>{c}</{tag}>" if k in numeric else f"<{tag}>{c}</{tag}>"
            for k, c in enumerate(row)
        )

    body = "".join(f"<tr>{cells(row, 'td')}</tr>" for row in rows)
    return f"<div class=scroll><table><tr>{cells(head, 'th')}</tr>{body}</table></div>"


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {escape(unit)}"


def _effects(report: dict[str, Any]) -> str:
    rows: list[list[str]] = []
    for effect in report["effects"]:
        values = ", ".join(
            f"{escape(name)} = {p['value']:.4g} ± {p['stderr']:.2g}{_unit(p['unit'])}"
            for name, p in effect["parameters"].items()
        )
        follows = ", ".join(effect["depends_on"])
        rows.append(
            [
                f"<b>{escape(readable(effect['name']))}</b><br>"
                f"<span class=tag>{escape(effect['name'])}</span>",
                values or (f"follows {escape(follows)}" if follows else "—"),
                escape(effect["where"]),
            ]
        )
    return _table(["missing", "how much", "where it shows"], rows, set()) if rows else ""


def _open_questions(report: dict[str, Any]) -> str:
    items: list[str] = []
    for effect in report["effects"]:
        throws = effect["evidence"].get("separating_throws", {})
        for name, throw in throws.items():
            items.append(
                f"{readable(effect['name'])} or {readable(name)}? Settled by a throw of {throw}."
            )
        proxies = effect["evidence"].get("proxies", [])
        if proxies:
            listed = ", ".join(readable(name) for name in proxies)
            items.append(f"Proxies that mend part of the unknown, none of them proved: {listed}.")
    items.append(report["undecidable"]["why"][0].upper() + report["undecidable"]["why"][1:])
    listed = "".join(f"<li>{escape(item)}</li>" for item in items)
    return f"<section><h2>What these throws cannot tell</h2><ul>{listed}</ul></section>"


def _league(report: dict[str, Any]) -> str:
    if not report["candidates"]:
        return ""
    proofs = {e["name"]: e["evidence"] for e in report["effects"]}
    rows: list[list[str]] = []
    for row in report["candidates"]:
        p = proofs.get(row["name"].partition("[")[0], {}).get("p_holm")
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
    return f"<section><h2>The candidates</h2>{_table(head, rows, {1, 2, 3, 4})}</section>"


def _smallest(report: dict[str, Any]) -> str:
    rows = [
        [escape(readable(label)), escape(", ".join(f"{n} {v:.3g}" for n, v in values.items()))]
        for label, values in report["smallest_detectable"].items()
    ]
    if not rows:
        return ""
    return (
        "<section><h2>What would have been seen</h2><p class=faint>The smallest effect that these "
        "throws would have shown clearly (five standard errors).</p>"
        f"{_table(['effect', 'smallest'], rows, set())}</section>"
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
    return f"<section><h2>Noise and baseline</h2>{_table(['', ''], rows, {1})}{extra}</section>"
