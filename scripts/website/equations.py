"""Equations as drawings in the page: no script, no font, no network, the same in every browser."""

from __future__ import annotations

from html import escape
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from ziamath.zmath import Latex

TEXT, DISPLAYED = 17.5, 19.0
"""Size of letters in a line of text and in a separate equation [px]."""


def setup(app: Sphinx) -> dict[str, Any]:
    app.add_html_math_renderer("drawn", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def drawn(latex: str, *, block: bool) -> str:
    """Return an equation as SVG in the colour of the text, with a label for screen readers."""
    equation = Latex(
        latex, size=DISPLAYED if block else TEXT, color="currentColor", inline=not block
    )
    label = f'role="img" aria-label="{escape(latex, quote=True)}"'
    if not block:
        label += f' style="vertical-align: {equation.getyofst():.2f}px"'
    return equation.svg().replace("<svg ", f"<svg {label} ", 1)


def _inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(drawn(node.astext(), block=False))
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.math_block) -> None:
    shown = " ".join(drawn(part, block=True) for part in parts(node.astext()))
    writer.body.append(f'<div class="equation">{shown}</div>')
    raise nodes.SkipNode


def parts(latex: str) -> list[str]:
    """Split at wide spaces, to be drawn separately, so that the parts are stacked on a phone."""
    divided = [part.strip() for part in latex.split(r"\qquad")]
    whole = all(
        part.count(opening) == part.count(closing)
        for part in divided
        for opening, closing in (("{", "}"), (r"\left", r"\right"), (r"\begin", r"\end"))
    )
    return divided if whole and all(divided) else [latex]
