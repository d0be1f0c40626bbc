"""Table of published measurements, and the comparison of an ice."""

from __future__ import annotations

import json
import textwrap
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import partial
from importlib import import_module
from importlib.resources import files
from typing import Any

from curling_env.ice import Ice, preset_names
from curling_env.validation.row import Comparison, Row, Verdict
from curling_env.validation.shots import Shots


def _rows() -> tuple[Row, ...]:
    """Load the rows of ``rows.json``, in which ``{NAME}`` stands for a shared text.

    ``compute`` names a module of this package and a function of `Shots`, ``with`` its arguments.
    """
    text = (files("curling_env.validation") / "rows.json").read_text(encoding="utf-8")
    document: dict[str, Any] = json.loads(text)
    texts: dict[str, str] = document["texts"]
    rows: list[Row] = []
    for row in document["rows"]:
        module, name = row.pop("compute").split(".")
        reasons = {ice: why.format(**texts) for ice, why in row.pop("why", {}).items()}
        source, about = row.pop("source").format(**texts), row.pop("about", "").format(**texts)
        value = partial(_computed, module, name, **row.pop("with", {}))
        rows.append(Row(**row, source=source, about=about, why=reasons, value=value))
    return tuple(rows)


def _computed(module: str, function: str, shots: Shots, /, **given: Any) -> float | None:
    return getattr(import_module(f"curling_env.validation.{module}"), function)(shots, **given)


ROWS = _rows()
"""Rows that are computed by the physics alone; those that depend on the ice, and the others."""
ICE_ROWS = tuple(row for row in ROWS if row.depends_on_ice)
OTHER_ROWS = tuple(row for row in ROWS if not row.depends_on_ice)

WIDTH = 100
"""Width of the table as text [characters]."""

IN_WORDS = {
    Verdict.AGREES: "agree with published values",
    Verdict.EXPLAINED: "differ, for a known reason",
    Verdict.DIFFERS: "do not",
    Verdict.NOT_MEASURED: "were never measured",
    Verdict.NOT_COMPUTED: "cannot be computed on this ice",
}


def compare(ice: Ice, preset: str = "", rows: Iterable[Row] = ICE_ROWS) -> list[Comparison]:
    """Compare an ice with published measurements.

    Parameters
    ----------
    ice : ice to compare
    preset : its name, if it is a preset, for which reasons are known
    rows : rows of the table
    """
    shots = Shots(ice)
    return [row.compared(shots, preset) for row in rows]


def counts(found: Sequence[Comparison]) -> dict[str, int]:
    """Return the number of rows with each verdict, by its name, including zeros."""
    number = Counter(comparison.verdict for comparison in found)
    return {verdict.value: number[verdict] for verdict in Verdict}


def as_text(found: Sequence[Comparison]) -> str:
    """Return the table as text: a line for each row, under its part, and reasons for
    differences.
    """
    lines: list[str] = []
    wide = max((len(c.row.name) for c in found), default=0)
    published = max((len(c.row.published) for c in found), default=0)
    part = ""
    for c in found:
        if c.row.part != part:
            part = c.row.part
            lines += ["", part]
        unit = "" if c.row.unit == "1" else f" {c.row.unit}"
        value = "–" if c.value is None else f"{c.value:.4g}{unit}"
        lines.append(
            f"  {c.row.name:{wide}}  {c.row.published:{published}}  {value:>11}  {c.verdict.value}"
        )
    reasons: dict[str, list[str]] = {}
    for c in found:
        if c.why:
            reasons.setdefault(c.why, []).append(c.row.name)
    if reasons:
        lines += ["", "why"]
    for why, names in reasons.items():
        lines += textwrap.wrap(
            f"{'; '.join(names)}: {why}.", WIDTH, initial_indent="  ", subsequent_indent="    "
        )
    return "\n".join(lines).strip("\n")


def in_words(found: Sequence[Comparison]) -> str:
    """Return the number of rows that agree, in a sentence."""
    number = Counter(comparison.verdict for comparison in found)
    counts = [
        f"{number[verdict]} {words}" for verdict, words in IN_WORDS.items() if number[verdict]
    ]
    return f"Of {len(found)} rows, " + "; ".join(counts) + "."


def preset_of(source: str) -> str:
    """Return the name of a preset; empty for the path of an ice file."""
    return source if source in preset_names() else ""
