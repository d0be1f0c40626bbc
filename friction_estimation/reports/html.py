"""Pages that stand alone: style, tables and pictures in one HTML file, with nothing loaded from
elsewhere.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Collection, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from curling_env.infrastructure.files.storage import write_text
from curling_env.infrastructure.page_policy import policy_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLE = """
body{font:16px/1.5 system-ui,sans-serif;color:#22313f;background:#eef3f7;margin:0}
main{max-width:74rem;margin:0 auto;padding:1.5rem}
section{overflow-x:auto;background:#fff;border-radius:10px;padding:1.1rem 1.4rem;margin:1rem 0;
box-shadow:0 1px 3px #0002}
h1{font-size:1.55rem;line-height:1.3;margin:.4rem 0}
h2{font-size:1.1rem;margin:.2rem 0 .6rem}
img{max-width:100%;height:auto;display:block}
table{border-collapse:collapse;width:100%;font-size:.92rem}
td,th{padding:.3rem .6rem;border-bottom:1px solid #e3e8ed;text-align:left}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
figure{margin:.6rem 0;min-width:0}
.side{display:flex;flex-wrap:wrap;gap:1rem;align-items:flex-start}
.side figure{flex:1 1 22rem;margin:0}
figcaption,.faint{color:#66727f;font-size:.92rem}
.stills{display:grid;grid-template-columns:repeat(auto-fit,minmax(17rem,1fr));gap:.6rem}
.facts{display:grid;grid-template-columns:repeat(auto-fit,minmax(11rem,1fr));gap:.8rem;
margin:1rem 0 0}
.facts div{border-left:3px solid #7fa8cf;padding-left:.7rem}
.facts b{display:block;font-size:1.35rem;font-variant-numeric:tabular-nums}
footer{overflow-wrap:anywhere}
.throws{font-size:.86rem}
.throws td,.throws th{padding:.3rem .45rem;vertical-align:top}
.throws .k,.throws .n{white-space:nowrap}
.throws th{white-space:nowrap}
.throws small{color:#66727f}
@media screen and (max-width:700px){.throws tr:first-child{display:none}
.throws tr{display:block;border-bottom:2px solid #cfd8e0;padding:.4rem 0}
.throws td{display:block;border:0;padding:.1rem 0;text-align:right}
.throws td:empty{display:none}.throws .k,.throws .n{white-space:normal}
.throws td::before{content:attr(data-name);color:#66727f;float:left;margin-right:1rem}
.throws td:first-child{font-weight:600}}
@media print{body,section{background:#fff;box-shadow:none}section{break-inside:avoid;
padding:.4rem 0}.throws{font-size:8pt}main{max-width:none;padding:0}}
summary{cursor:pointer;font-size:1.1rem;font-weight:600;padding:.3rem 0}
details h2{margin-top:1.4rem}
.tag{background:#e3edf6;border-radius:5px;padding:.1rem .5rem;font-size:.9rem}
"""


def write_page(
    path: str | Path,
    title: str,
    sections: Sequence[str],
    *,
    reload: float | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Write a page, complete or not at all.

    Parameters
    ----------
    path : file to write
    title : plain text for the browser's tab
    sections : HTML of each section; every one is shown as a card
    reload : time after which the browser loads the page again [s]; None for never
    provenance : where the page comes from, for its last lines (`infrastructure.provenance`)
    """
    again = "" if reload is None else f"<meta http-equiv=refresh content={reload:g}>"
    cards = "".join(f"<section>{section}</section>" for section in sections)
    write_text(
        path,
        f"<!doctype html><html lang=en><meta charset=utf-8>{policy_of('')}"
        f"<title>{escape(title)}</title>"
        f"{again}"
        "<meta name=viewport content='width=device-width'><link rel=icon href='data:,'>"
        f"<style>{STYLE}</style><main>{cards}{_origin(provenance)}</main></html>\n",
    )


def _origin(provenance: Mapping[str, Any] | None) -> str:
    """Return the last lines of a page: version, command, seed and inputs, as HTML."""
    if not provenance:
        return ""
    made = f"curling-sheet {escape(provenance['version'])}"
    if "command" in provenance:
        made += f": <code>{escape(provenance['command'])}</code>"
    elif "seed" in provenance:
        made += f", seed {provenance['seed']}"
    files = "".join(
        f"<br>{escape(entry['file'])}: SHA-256 <code>{entry['sha256'] or 'unknown'}</code>"
        for entry in provenance["inputs"]
    )
    return f"<footer class=faint>{made}{files}</footer>"


def picture(content: bytes | Figure, alt: str, *, kind: str = "png", caption: str = "") -> str:
    """Return an embedded picture with a caption below it, as HTML.

    Parameters
    ----------
    content : bytes of a picture file, or a figure to draw
    alt : plain text that says what it shows, for those who cannot see it
    kind : png or jpeg
    caption : plain text
    """
    if not isinstance(content, bytes):
        drawn = io.BytesIO()
        content.savefig(drawn, format="png", dpi=130)
        content = drawn.getvalue()
    data = base64.b64encode(content).decode()
    image = f"<img alt='{escape(alt, quote=True)}' src='data:image/{kind};base64,{data}'>"
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f"<figure>{image}{below}</figure>"


def table(
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    numeric: Collection[int] = (),
    *,
    kept: Collection[int] = (),
    kind: str = "",
) -> str:
    """Return a table as HTML.

    Parameters
    ----------
    head, rows : HTML of the cells
    numeric : numbers of the columns that are aligned to the right
    kept : numbers of the columns whose cells stay on one line
    kind : class of the table in the style of the pages; on a narrow screen each of its rows becomes
        a list of names and values
    """
    marks = {**dict.fromkeys(kept, " class=k"), **dict.fromkeys(numeric, " class=n")}
    names = [f" data-name='{name}'" if kind else "" for name in head]

    def cells(row: Sequence[str], tag: str) -> str:
        return "".join(
            f"<{tag}{marks.get(k, '')}{names[k] if tag == 'td' else ''}>{cell}</{tag}>"
            for k, cell in enumerate(row)
        )

    body = "".join(f"<tr>{cells(row, 'td')}</tr>" for row in rows)
    named = f" class={kind}" if kind else ""
    return f"<table{named}><tr>{cells(head, 'th')}</tr>{body}</table>"


def fold(title: str, parts: Sequence[str]) -> str:
    """Return parts of a page that open on a click; empty without parts.

    Parameters
    ----------
    title : plain text that stays visible
    parts : HTML; empty ones are dropped
    """
    inside = "".join(parts)
    return f"<details><summary>{escape(title)}</summary>{inside}</details>" if inside else ""


def facts(pairs: Sequence[tuple[str, str]]) -> str:
    """Return numbers with their meaning, as HTML, from plain text."""
    items = "".join(f"<div><b>{escape(value)}</b>{escape(what)}</div>" for value, what in pairs)
    return f"<div class=facts>{items}</div>"
