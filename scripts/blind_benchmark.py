"""Blind sessions with a sealed truth: how often discovery finds what was hidden, and nothing else.

    python scripts/blind_benchmark.py --sessions 8 -o runs/blind

Draws sessions (`blind_sessions.py`: its own formulas, integrator and noise), writes their tracks,
seals the truth and some more throws in another folder, runs discovery on the tracks alone, and
only then opens the truth and scores. Derivative regressions see the same tracks.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from blind_sessions import FORMS, NAMES, OUTSIDE, SCATTER, make_session
from derivative_regression import names_found
from tqdm import tqdm

from curling_env.infrastructure.storage import make_directory, write_json, write_table
from curling_env.trajectory import Trajectory, read_tracks
from friction_estimation.discovery.data.session import open_session
from friction_estimation.discovery.discover import Discovery, discover
from friction_estimation.discovery.evidence.hold_out import forecast, noise_floor
from friction_estimation.discovery.report import document
from friction_estimation.discovery.tuning import CLEARLY_SEEN

COMPARED = {
    "speed_dependent_friction": ("exponent",),
    "curl": ("strength", "speed_exponent"),
    "slope": ("x", "y"),
    "pebble_wear": ("rate",),
    "pebble_wear:along paths": ("along_path",),
    "stone_bias": ("factor",),
    "sweeping": ("friction_factor",),
    "friction_patch": ("factor",),
    "time_drift": ("rate",),
    "spin_drag": ("rate",),
    "air_drag": ("coefficient",),
    "tracking_offset": ("forward", "left"),
    "lens_distortion": ("k1",),
}
KINDS = ("none", "one", "another form", "two", "outside", "one way")
NEUTRAL = {"stone_bias": 1.0, "sweeping": 1.0, "friction_patch": 1.0}
PAIRS = (
    ("curl", "speed_dependent_friction"),
    ("curl", "slope"),
    ("curl", "stone_bias"),
    ("curl", "sweeping"),
    ("speed_dependent_friction", "slope"),
    ("speed_dependent_friction", "time_drift"),
    ("air_drag", "speed_dependent_friction"),
    ("spin_drag", "curl"),
    ("slope", "pebble_wear"),
    ("curl", "pebble_wear:along paths"),
    ("tracking_offset", "curl"),
    ("friction_patch", "slope"),
    ("lens_distortion", "curl"),
)


ONE_WAY = ("", "curl", "speed_dependent_friction", "slope")
"""Hidden in sessions that were played in one direction only."""
FRESH = 6
"""Throws played after a session, that only the score sees."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """One session to make and to search."""

    kind: str
    hidden: tuple[str, ...]
    throws: int = 16
    ways: int = 2


def plan(kinds: list[str], sessions: int, others: list[int]) -> list[Task]:
    """What is hidden in every session, the full table with 16 throws first.

    Parameters
    ----------
    others : further numbers of throws, for sessions with one effect or none
    """
    out: list[Task] = []
    half = max(1, sessions // 2)
    if "none" in kinds:
        out += [Task(kind="none", hidden=())] * (4 * sessions)
        out += [Task(kind="undecidable", hidden=(n,)) for n in ("frame_rate_error", "scale_error")]
    for kind, names, times in (
        ("one", NAMES, sessions),
        ("another form", FORMS, half),
        ("outside", OUTSIDE, half),
    ):
        if kind in kinds:
            out += [Task(kind=kind, hidden=(name,)) for name in names] * times
    if "two" in kinds:
        out += [Task(kind="two", hidden=pair) for pair in PAIRS] * half
    if "one way" in kinds:
        out += [Task(kind="one way", hidden=(n,) if n else (), ways=1) for n in ONE_WAY]
    for throws in others:
        out += [Task(kind="one", hidden=(name,), throws=throws) for name in NAMES]
        out += [Task(kind="none", hidden=(), throws=throws)] * 2
    return out


def name_and_form(effect: dict[str, Any]) -> str:
    """An effect of a report; wear along paths is told from that of the whole sheet."""
    along = effect["name"] == "pebble_wear" and "along_path" in effect["parameters"]
    return "pebble_wear:along paths" if along else effect["name"]


def score(report: dict[str, Any], truth: dict[str, Any], seconds: float) -> dict[str, Any]:
    """A session's row: what was named, and how well."""
    hidden = sorted(n if n in COMPARED else n.partition(":")[0] for n in truth["effects"])
    hidden = [name for name in hidden if name in COMPARED]
    named = sorted({name_and_form(e) for e in report["effects"] if e["name"] != "unknown"})
    row: dict[str, Any] = {
        "hidden": hidden,
        "named": named,
        "unknown": [e["depends_on"] for e in report["effects"] if e["name"] == "unknown"],
        "exact": named == hidden and not any(e["name"] == "unknown" for e in report["effects"]),
        "seconds": round(seconds, 2),
        "errors": [],
        "inside": [],
    }
    for effect in report["effects"]:
        name = name_and_form(effect)
        for p in COMPARED.get(name, ()):
            true = truth["effects"].get(name, {}).get(p)
            if true is None or p not in effect["parameters"]:
                continue
            got = effect["parameters"][p]
            strength = abs(true - NEUTRAL.get(name, 0.0))
            if name == "slope":
                strength = float(np.hypot(*truth["effects"][name].values()))
            if name == "tracking_offset":
                strength = float(np.hypot(*truth["effects"][name].values()))
            if p != "speed_exponent":
                row["errors"].append(abs(got["value"] - true) / max(strength, 1e-12))
            row["inside"].append(bool(abs(got["value"] - true) < 1.96 * got["stderr"]))
    return row


def gap_on_fresh_throws(found: Discovery, fresh: Path) -> float | None:
    """Forecast gap left over the noise floor, over that before, on throws nobody has seen."""
    session = open_session(read_tracks(fresh))
    session = replace(session, orders=session.throws)
    noise = found.final.noise
    perfect = replace(found.final, model=replace(found.final.model, spread=SCATTER))
    floor = noise_floor(perfect, session).rest_error
    before = forecast(found.final_base.model, session, noise).rest_error
    after = forecast(found.final.model, session, noise).rest_error
    return max(after - floor, 0.0) / (before - floor) if before > 2 * floor else None


def visibility(report: dict[str, Any], hidden: dict[str, dict[str, float]]) -> float | None:
    """The hidden effect over the smallest that these throws would have shown clearly."""
    if len(hidden) != 1:
        return None
    ((name, true),) = hidden.items()
    smallest = dict(report["smallest_detectable"].get(name, {}))
    if "stone" in true:
        smallest = dict(report["smallest_detectable"].get(f"{name}[{true['stone']:.0f}]", {}))
    if "along_path" in true:
        smallest = dict(report["smallest_detectable"].get("pebble_wear[along_path]", {}))
    for effect in report["effects"]:
        if name_and_form(effect) == name:
            smallest = {p: CLEARLY_SEEN * v["stderr"] for p, v in effect["parameters"].items()}
    ratios = [
        abs(true[p] - NEUTRAL.get(name, 0.0)) / smallest[p]
        for p in COMPARED.get(name, ())
        if p != "speed_exponent" and p in true and smallest.get(p)
    ]
    return max(ratios, default=None)


def by_regression(tracks: list[Trajectory]) -> dict[str, list[str]]:
    """What derivative regressions name in the same tracks; pysindy's where it is installed."""
    methods = ["bic"] + ["sindy"] * (find_spec("pysindy") is not None)
    return {method: names_found(tracks, method=method) for method in methods}


def share(part: list[bool]) -> str:
    return f"{sum(part)} of {len(part)} ({100 * np.mean(part):.0f} %)" if part else "–"


def table(rows: list[dict[str, Any]]) -> str:
    """The scores as Markdown."""
    full = [row for row in rows if row["throws"] == 16]

    def of(kind: str) -> list[dict[str, Any]]:
        return [row for row in full if row["kind"] == kind]

    sized = [row for row in of("one") if row["exact"]]
    errors = [e for row in sized for e in row["errors"]]
    inside = [e for row in rows if row["kind"] == "one" and row["exact"] for e in row["inside"]]
    gaps = [row["gap_fresh"] for row in full if row["exact"] and row["gap_fresh"] is not None]
    quiet = of("none") + of("undecidable")
    seconds = [row["seconds"] for row in full]
    wrong = [bool(set(row["named"]) - set(row["hidden"])) for row in of("one way")]
    lines = [
        ("one effect: exactly named", share([r["exact"] for r in of("one")])),
        ("no effect: something named", share([bool(r["named"] or r["unknown"]) for r in quiet])),
        ("outside the catalogue: given a name", share([bool(r["named"]) for r in of("outside")])),
        (
            "outside the catalogue: called unknown",
            share([bool(r["unknown"]) for r in of("outside")]),
        ),
        ("two effects: both named, nothing else", share([r["exact"] for r in of("two")])),
        ("one effect, in another form: named", share([r["exact"] for r in of("another form")])),
        ("played in one direction: given a wrong name", share(wrong)),
        ("parameter error, median", f"{100 * np.median(errors):.2f} %" if errors else "–"),
        ("95 % intervals that hold the truth", share(inside)),
        ("forecast gap left on fresh throws, median", f"{np.median(gaps):.3f}" if gaps else "–"),
        ("the same, nine of ten below", f"{np.quantile(gaps, 0.9):.3f}" if gaps else "–"),
        ("CPU seconds a session, median", f"{np.median(seconds):.1f}" if seconds else "–"),
    ]
    parts = ["\n".join(["| 16 throws | |", "|---|---|", *(f"| {a} | {b} |" for a, b in lines)])]
    counts = sorted({row["throws"] for row in rows})
    lines = [
        (
            count,
            share([r["exact"] for r in rows if r["kind"] == "one" and r["throws"] == count]),
            share(
                [
                    bool(r["named"] or r["unknown"])
                    for r in rows
                    if r["kind"] in ("none", "undecidable") and r["throws"] == count
                ]
            ),
        )
        for count in counts
    ]
    head = ["| throws | one effect: exactly named | none: something named |", "|---|---|---|"]
    parts.append("\n".join(head + [f"| {a} | {b} | {c} |" for a, b, c in lines]))
    seen = [r for r in rows if r["kind"] == "one" and r["visibility"] is not None]
    head = ["| hidden effect over the smallest that would show clearly | named |", "|---|---|"]
    for low, high in ((0.0, 1.0), (1.0, 3.0), (3.0, np.inf)):
        part = [r["exact"] for r in seen if low <= r["visibility"] < high]
        words = f"{low:g} to {high:g}" if np.isfinite(high) else f"above {low:g}"
        head.append(f"| {words} | {share(part)} |")
    parts.append("\n".join(head))
    methods = {"discovery": None, "bic": "derivatives, BIC", "sindy": "pysindy"}
    head = [
        "| | " + " | ".join(m or "discovery" for m in methods.values()) + " |",
        "|---|---|---|---|",
    ]
    for words, kinds, right in (
        ("one effect: named, nothing else", ("one",), True),
        ("no effect: something named", ("none", "undecidable"), False),
        ("outside the catalogue: given a name", ("outside",), False),
        ("two effects: both named, nothing else", ("two",), True),
    ):
        cells: list[str] = []
        for method in methods:
            part: list[bool] = []
            for row in full:
                if row["kind"] not in kinds:
                    continue
                named = row["named"] if method == "discovery" else row["regression"].get(method)
                if named is not None:
                    part.append(named == row["hidden"] if right else bool(named))
            cells.append(share(part))
        head.append(f"| {words} | " + " | ".join(cells) + " |")
    parts.append("\n".join(head))
    return "\n\n".join(parts)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--sessions", type=int, default=4, help="per effect, with 16 throws")
    parser.add_argument("--other-throws", type=int, nargs="*", default=[8, 12, 24])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--film", action="store_true", help="tracks that err as those from films do"
    )
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/blind"))
    arguments = parser.parse_args()
    tracks_folder = make_directory(arguments.output / "tracks")
    sealed = make_directory(arguments.output / "sealed")
    rows: list[dict[str, Any]] = []
    tasks = plan(arguments.kinds, arguments.sessions, arguments.other_throws)
    for k, task in enumerate(tqdm(tasks)):
        rng = np.random.default_rng([arguments.seed, k])
        columns, truth = make_session(
            task.hidden,
            rng,
            throws=task.throws,
            fresh=FRESH,
            ways=task.ways,
            film=arguments.film,
        )
        name = f"{k:04d}"
        seen = np.array(columns["throw"]) < task.throws
        for folder, kept in ((tracks_folder, seen), (sealed, ~seen)):
            write_table(
                folder / f"{name}.csv",
                {key: np.array(values)[kept].tolist() for key, values in columns.items()},
            )
        write_json(sealed / f"{name}.json", json.loads(json.dumps(truth, default=float)))
        tracks = read_tracks(tracks_folder / f"{name}.csv")
        begun = time.process_time()
        found = discover(tracks)
        report = document(found)
        seconds = time.process_time() - begun
        opened = json.loads((sealed / f"{name}.json").read_text())
        row = {
            "session": name,
            "kind": task.kind,
            "throws": task.throws,
            **score(report, opened, seconds),
            "visibility": visibility(report, opened["effects"]),
            "gap_fresh": gap_on_fresh_throws(found, sealed / f"{name}.csv"),
            "regression": by_regression(tracks),
        }
        rows.append(row)
        if not row["exact"]:
            tqdm.write(
                f"{name} {task.kind}, {task.throws} throws: hidden {opened['effects']}, "
                f"named {row['named']}, unknown {row['unknown']}"
            )
        write_json(arguments.output / "scores.json", rows)
    print(table(rows))


if __name__ == "__main__":
    main()
