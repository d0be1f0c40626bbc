"""Blind sessions with a sealed truth: how often discovery finds what was hidden, and nothing else.

    python scripts/blind_benchmark.py --sessions 8 -o runs/blind

Draws sessions (`blind_sessions.py`: its own formulas, integrator and noise), writes their tracks,
seals the truth in another folder, runs discovery on the tracks alone, and only then opens the
truth and scores.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from blind_sessions import FORMS, NAMES, OUTSIDE, make_session
from tqdm import tqdm

from curling_env.storage import make_directory, write_json, write_table
from curling_env.trajectory import read_tracks
from friction_estimation.discrepancy.discovery import discover
from friction_estimation.discrepancy.verdict import document

COMPARED = {
    "speed_dependent_friction": ("exponent",),
    "curl": ("strength", "speed_exponent"),
    "slope": ("x", "y"),
    "pebble_wear": ("rate",),
    "stone_bias": ("factor",),
    "sweeping": ("friction_factor",),
    "friction_patch": ("factor",),
    "time_drift": ("rate",),
    "spin_drag": ("rate",),
    "air_drag": ("coefficient",),
    "tracking_offset": ("forward", "left"),
    "lens_distortion": ("k1",),
}
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
    ("tracking_offset", "curl"),
    ("friction_patch", "slope"),
    ("lens_distortion", "curl"),
)


def plan(kinds: list[str], sessions: int) -> list[tuple[str, tuple[str, ...]]]:
    """(kind, hidden effects) of every session."""
    out: list[tuple[str, tuple[str, ...]]] = []
    if "none" in kinds:
        out += [("none", ())] * (3 * sessions)
        out += [("undecidable", (n,)) for n in ("frame_rate_error", "scale_error")]
    if "one" in kinds:
        out += [("one", (name,)) for name in NAMES] * sessions
    if "two" in kinds:
        out += [("two", pair) for pair in PAIRS] * max(1, sessions // 2)
    if "form" in kinds:
        out += [("another form", (name,)) for name in FORMS] * max(1, sessions // 2)
    if "outside" in kinds:
        out += [("outside", (name,)) for name in OUTSIDE] * max(1, sessions // 2)
    return out


def score(report: dict[str, Any], truth: dict[str, Any], seconds: float) -> dict[str, Any]:
    """A session's row: what was named, and how well."""
    hidden = sorted(n.partition(":")[0] for n in truth["effects"])
    hidden = [name for name in hidden if name in COMPARED]
    named = sorted({e["name"] for e in report["effects"] if e["name"] != "unknown"})
    row: dict[str, Any] = {
        "hidden": sorted(truth["effects"]),
        "named": named,
        "unknown": [e["depends_on"] for e in report["effects"] if e["name"] == "unknown"],
        "exact": named == hidden and not any(e["name"] == "unknown" for e in report["effects"]),
        "seconds": round(seconds, 2),
        "errors": [],
        "inside": [],
    }
    for effect in report["effects"]:
        name = effect["name"]
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
    gap = report["gap"]
    if "before" in gap:
        before, after, floor = (gap[k]["rest_error_m"] for k in ("before", "after", "noise_floor"))
        if named and before > 2 * floor:
            row["gap_left"] = max(after - floor, 0.0) / (before - floor)
    return row


def table(rows: list[dict[str, Any]]) -> str:
    """The scores as Markdown."""

    def of(kind: str) -> list[dict[str, Any]]:
        return [row for row in rows if row["kind"] == kind]

    def share(part: list[bool]) -> str:
        return f"{sum(part)} of {len(part)} ({100 * np.mean(part):.0f} %)" if part else "–"

    errors = [e for row in rows if row["kind"] == "one" and row["exact"] for e in row["errors"]]
    inside = [e for row in rows if row["kind"] == "one" and row["exact"] for e in row["inside"]]
    gaps = [row["gap_left"] for row in rows if "gap_left" in row and row["exact"]]
    quiet = of("none") + of("undecidable")
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
        ("parameter error, median", f"{100 * np.median(errors):.2f} %" if errors else "–"),
        ("95 % intervals that hold the truth", share(inside)),
        ("forecast gap left over the noise floor", f"{np.median(gaps):.3f}" if gaps else "–"),
        ("seconds a session, median", f"{np.median([r['seconds'] for r in rows]):.1f}"),
    ]
    return "\n".join(["| | |", "|---|---|", *(f"| {a} | {b} |" for a, b in lines)])


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--sessions", type=int, default=4, help="per effect")
    parser.add_argument("--throws", type=int, default=16)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", nargs="+", default=["none", "one", "form", "two", "outside"])
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/blind"))
    arguments = parser.parse_args()
    tracks_folder = make_directory(arguments.output / "tracks")
    sealed = make_directory(arguments.output / "sealed")
    rows: list[dict[str, Any]] = []
    for k, (kind, hidden) in enumerate(tqdm(plan(arguments.kinds, arguments.sessions))):
        rng = np.random.default_rng([arguments.seed, k])
        columns, truth = make_session(hidden, rng, throws=arguments.throws)
        name = f"{k:04d}"
        write_table(tracks_folder / f"{name}.csv", columns)
        write_json(sealed / f"{name}.json", json.loads(json.dumps(truth, default=float)))
        begun = time.perf_counter()
        report = document(discover(read_tracks(tracks_folder / f"{name}.csv")))
        seconds = time.perf_counter() - begun
        opened = json.loads((sealed / f"{name}.json").read_text())
        row = {"session": name, "kind": kind, **score(report, opened, seconds)}
        rows.append(row)
        if not (row["exact"] or kind == "outside"):
            tqdm.write(
                f"{name} {kind}: hidden {row['hidden']}, named {row['named']}, "
                f"unknown {row['unknown']}"
            )
        elif kind == "outside":
            tqdm.write(
                f"{name} outside {row['hidden']}: named {row['named']}, unknown {row['unknown']}"
            )
        write_json(arguments.output / "scores.json", rows)
    print(table(rows))


if __name__ == "__main__":
    main()
