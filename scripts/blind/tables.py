"""The scores of a benchmark as Markdown, with what is asked of them beside."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

Row = dict[str, Any]
Rows = list[Row]

QUIET = ("none", "undecidable")
"""Families with nothing in them that could be found."""


def wilson(count: int, total: int) -> tuple[float, float]:
    """95 % interval of a share by Wilson's method."""
    z, p = 1.96, count / total
    middle = (p + z * z / (2 * total)) / (1 + z * z / total)
    half = z * np.sqrt(p * (1 - p) / total + z * z / (4 * total**2)) / (1 + z * z / total)
    return float(max(middle - half, 0.0)), float(min(middle + half, 1.0))


def share(part: Iterable[bool]) -> str:
    """A count, its share and the 95 % interval of that."""
    values = list(part)
    if not values:
        return "–"
    low, high = wilson(sum(values), len(values))
    percent = 100 * np.mean(values)
    return (
        f"{sum(values)} of {len(values)} ({percent:.0f} %; {100 * low:.0f} to {100 * high:.0f} %)"
    )


def tables(rows: Rows) -> str:
    """All tables for which there are sessions."""
    parts = [goals(rows), families(rows)]
    if any(row["kind"] in ("one", *QUIET) for row in rows):
        parts += [first_suite(rows), numbers_of_throws(rows), methods(rows)]
    parts.append(by_visibility(rows))
    return "\n\n".join(parts)


def table(head: tuple[str, ...], lines: Iterable[tuple[object, ...]]) -> str:
    text = ["| " + " | ".join(map(str, line)) + " |" for line in lines]
    return "\n".join(["| " + " | ".join(head) + " |", "|---" * len(head) + "|", *text])


def pooled(rows: Rows, key: str) -> list[Any]:
    """All entries of a list that rows have, one after the other."""
    return [entry for row in rows for entry in row.get(key, [])]


def goals(rows: Rows) -> str:
    """What is asked of the benchmark, and what it measured."""

    def right(*kinds: str) -> str:
        return share(row["right"] for row in rows if row["kind"] in kinds)

    measured = [row for row in rows if row["kind"] == "map" and row.get("map_bound")]
    seconds = [row["seconds"] for row in rows if row["throws"] == 24 and "seconds" in row]
    lines = [
        ("model given, one more hidden: exactly named", right("model given"), "90 %", "97 %"),
        (
            "model given, nothing hidden: nothing named",
            right("model given, nothing hidden"),
            "95 %",
            "99 %",
        ),
        ("map with 0 to 3 effects: effects exactly named", right("map"), "90 %", "97 %"),
        ("error of the map over the joint Bayesian bound", over_bound(measured), "1.5", "1.2"),
        (
            "95 % intervals of effects that hold the truth",
            share(pooled(rows, "inside")),
            "90 to 98 %",
            "93 to 97 %",
        ),
        (
            "the same, of corrected strengths of the model given",
            share(pooled(rows, "changed")),
            "90 to 98 %",
            "93 to 97 %",
        ),
        ("the same, of cells of the map", cells(rows), "90 to 98 %", "93 to 97 %"),
        ("one effect: exactly named", right("one"), "95 %", "99 %"),
        ("two effects: both named, nothing else", right("two"), "90 %", "97 %"),
        ("nothing hidden: nothing named", right(*QUIET), "98 %", "99 %"),
        (
            "weak effects: named, or not named and too small to show",
            right("weak"),
            "95 %",
            "95 %",
        ),
        ("a wrong name anywhere", share(r.get("wrong_name", False) for r in rows), "3 %", "1 %"),
        (
            "mean miss of draws planned on the ice found, over planned on the true one",
            draws(rows),
            "1.10",
            "1.03",
        ),
        (
            "CPU seconds of one core for 24 throws, median (longest)",
            f"{np.median(seconds):.0f} ({max(seconds):.0f})" if seconds else "–",
            "60",
            "20",
        ),
    ]
    return table(("", "measured (95 % interval)", "floor", "goal"), lines)


def over_bound(rows: Rows) -> str:
    """RMS error of maps over the RMS of their bounds, and the median of the single ratios."""
    if not rows:
        return "–"
    error, bound = (np.array([row[key] for row in rows]) for key in ("map_rmse", "map_bound"))
    ratio = float(np.sqrt((error**2).mean() / (bound**2).mean()))
    return f"{ratio:.2f} (median {np.median(error / bound):.2f})"


def cells(rows: Rows) -> str:
    """Mean share of cells inside their intervals, with the standard error over sessions."""
    inside = [row["cells_inside"] for row in rows if "cells_inside" in row]
    if not inside:
        return "–"
    mean = f"{100 * np.mean(inside):.1f}"
    if len(inside) == 1:
        return f"{mean} %"
    return f"{mean} ± {100 * np.std(inside, ddof=1) / np.sqrt(len(inside)):.1f} %"


def draws(rows: Rows) -> str:
    """Mean miss over all planned draws, over that of draws planned on the truth.

    At best: with the knowledge of the ice that the joint Bayesian bound allows.
    """
    made = [row["draws"] for row in rows if row.get("draws")]
    planned = [d for d in made if d["miss"] is not None]
    if not planned:
        return "–"
    ratio = sum(d["miss"] for d in planned) / sum(d["miss_on_truth"] for d in planned)
    worst = max(d["miss"] / d["miss_on_truth"] for d in planned)
    lost = sum(d["unplanned"] for d in made)
    text = f"{ratio:.3f} (worst session {worst:.2f}"
    held = [d for d in planned if "miss_at_best" in d]
    if held:
        best = sum(d["miss_at_best"] for d in held) / sum(d["miss_on_truth"] for d in held)
        text += f"; at best {best:.3f}"
    return f"{text}; {lost} draws without a plan)" if lost else text + ")"


def families(rows: Rows) -> str:
    """A line for each family and what is varied in it."""

    def words(row: Row) -> str:
        if row["kind"] == "map":
            return f"map and {row['effects'] - 1} more" if row["effects"] > 1 else "map alone"
        if row["kind"] == "weak":
            return f"weak, {row['scale']:.2g} of the usual size"
        if row["kind"] == "badly measured":
            return "badly measured, " + ("one effect" if row["effects"] else "nothing hidden")
        return row["kind"]

    lines: list[tuple[object, ...]] = []
    for name in dict.fromkeys((words(row), row["throws"]) for row in rows):
        part = [row for row in rows if (words(row), row["throws"]) == name]
        seconds = [row["seconds"] for row in part if "seconds" in row]
        is_map = [row for row in part if row.get("map_bound")]
        lines.append(
            (
                *name,
                share(row["right"] for row in part),
                share(row["exact"] for row in part),
                share(row.get("wrong_name", False) for row in part),
                share(bool(row.get("unknown")) for row in part),
                share(pooled(part, "inside")),
                over_bound(is_map),
                cells(part),
                draws(part),
                f"{np.median(seconds):.1f}" if seconds else "–",
                sum("failed" in row for row in part),
            )
        )
    head = (
        "family",
        "throws",
        "right",
        "exactly named",
        "a wrong name",
        "unknown said",
        "95 % intervals of effects",
        "map error over bound",
        "95 % intervals of cells",
        "draws over those on the truth",
        "CPU s",
        "failed",
    )
    return table(head, lines)


def first_suite(rows: Rows) -> str:
    """One effect, two, none, or something outside the catalogue, on perfect ice otherwise."""
    full = [row for row in rows if row["throws"] == 16]

    def of(*kinds: str) -> Rows:
        return [row for row in full if row["kind"] in kinds]

    found = [row for row in of("one") if row["exact"]]
    errors = pooled(found, "errors")
    gaps = [r["gap_fresh"] for r in full if r["exact"] and r.get("gap_fresh") is not None]
    seconds = [row["seconds"] for row in full if "seconds" in row]
    lines = [
        ("one effect: exactly named", share(r["exact"] for r in of("one"))),
        ("no effect: something named", share(not r["exact"] for r in of(*QUIET))),
        (
            "outside the catalogue: given a name",
            share(bool(r.get("named")) for r in of("outside")),
        ),
        (
            "outside the catalogue: called unknown",
            share(bool(r.get("unknown")) for r in of("outside")),
        ),
        ("two effects: both named, nothing else", share(r["exact"] for r in of("two"))),
        ("one effect, in another form: named", share(r["exact"] for r in of("another form"))),
        ("parameter error, median", f"{100 * np.median(errors):.2f} %" if errors else "–"),
        ("95 % intervals that hold the truth", share(pooled(found, "inside"))),
        ("forecast gap left on fresh throws, median", f"{np.median(gaps):.3f}" if gaps else "–"),
        ("the same, nine of ten below", f"{np.quantile(gaps, 0.9):.3f}" if gaps else "–"),
        ("CPU seconds a session, median", f"{np.median(seconds):.1f}" if seconds else "–"),
    ]
    return table(("16 throws", ""), lines)


def numbers_of_throws(rows: Rows) -> str:
    """How many throws it takes to name one effect, and nothing where there is none."""

    def part(count: int, *kinds: str) -> Rows:
        return [r for r in rows if r["kind"] in kinds and r["throws"] == count]

    counts = sorted({row["throws"] for row in rows if row["kind"] in ("one", *QUIET)})
    lines = [
        (
            count,
            share(row["exact"] for row in part(count, "one")),
            share(not row["exact"] for row in part(count, *QUIET)),
        )
        for count in counts
    ]
    return table(("throws", "one effect: exactly named", "none: something named"), lines)


def by_visibility(rows: Rows) -> str:
    """How often single effects are named, by how large they are."""
    seen = [row for row in rows if row.get("visibility") is not None]
    lines: list[tuple[object, ...]] = []
    for low, high in ((0.0, 1.0), (1.0, 3.0), (3.0, np.inf)):
        part = [row["exact"] for row in seen if low <= row["visibility"] < high]
        words = f"{low:g} to {high:g}" if np.isfinite(high) else f"above {low:g}"
        lines.append((words, share(part)))
    return table(("hidden effect over the smallest that would show clearly", "named"), lines)


def methods(rows: Rows) -> str:
    """Discovery beside derivative regressions on the same tracks."""
    others = {"discovery": None, "bic": "derivatives, BIC", "sindy": "pysindy"}

    def exact(row: Row, named: list[str]) -> bool:
        return named == row["hidden"]

    def something(row: Row, named: list[str]) -> bool:
        return bool(named)

    lines: list[tuple[object, ...]] = []
    asked: tuple[tuple[str, tuple[str, ...], Callable[[Row, list[str]], bool]], ...] = (
        ("one effect: named, nothing else", ("one",), exact),
        ("no effect: something named", QUIET, something),
        ("outside the catalogue: given a name", ("outside",), something),
        ("two effects: both named, nothing else", ("two",), exact),
    )
    for words, kinds, judge in asked:
        line: list[str] = [words]
        for method in others:
            part: list[bool] = []
            for row in rows:
                if row["throws"] != 16 or row["kind"] not in kinds or "regression" not in row:
                    continue
                named = row["named"] if method == "discovery" else row["regression"].get(method)
                if named is not None:
                    part.append(judge(row, named))
            line.append(share(part))
        lines.append(tuple(line))
    return table(("", *(words or name for name, words in others.items())), lines)
