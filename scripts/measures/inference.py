"""Measures of estimation and discovery: errors beside their bounds, names, intervals, and time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from blind.families import Task, plan
from blind.filmed import judged
from blind.scoring import Row, judge, map_scores
from figures import ROOT

from agents.closed_loop.demo import run_demo
from curling_env.ice import Ice
from curling_env.infrastructure.files.reading import read_json
from curling_env.infrastructure.files.writing import make_directory
from curling_env.sheet import HOG_LINE_Y, PAPER_STONE
from curling_env.trajectory import read_tracks
from friction_estimation import discover, estimate_ice
from friction_estimation.design.cramer_rao import uniform_bound
from friction_estimation.discovery.report import document
from measures.coverage import rest_errors
from measures.mutants import noticed
from measures.pitches import FPS, NOISE, SPEED, errors_of_table, pitch

MEASURES = (
    *("paper", "uniform", "maps", "sessions", "all_sessions"),
    *("independent", "rests", "filmed", "demo", "faults_noticed"),
)
TRACKS = ROOT / "runs" / "independent" / "tracks"
FILMED = ROOT / "runs" / "figures" / "film_sessions"
SEED, UNSEEN_SEED = 20261162, 771103
"""Seeds of the blind sessions: of those that are measured often, and of all 114."""
FAMILIES = (
    *("none", "one", "two", "another form", "model given", "model given, nothing hidden"),
    *("map", "weak", "known beside unknown", "one way"),
)
"""Families of all blind sessions."""
FEW = (
    *("none-16-000", "one-16-001", "one-16-007", "two-16-003", "two-16-004", "two-16-012"),
    *("model-given-20-005", "map-20-001", "map-20-009", "known-beside-unknown-20-001"),
)
"""Names of the blind sessions of the quick set."""
RESTS = (
    *(("model given", 20261130, 6), ("map", 20261131, 4)),
    *(("model given", 31, 8), ("map", 31, 8)),
)
"""Family, seed and number of the sessions whose draws are checked."""
UNIFORM_SESSIONS = {1: 100, 5: 50}
"""Number of sessions by number of throws."""
LOWEST_MU, HIGHEST_MU = 0.0018, 0.0102


# --- one friction, and a map -------------------------------------------------------------------


def paper() -> dict[str, float]:
    """Mean errors of μ in the paper's tables 3 and 4, repeated with one seed [%].

    Also the errors of the paper's own method on the same tracks, over those of the joint fit.
    """
    values: dict[str, float] = {}
    rng = np.random.default_rng(2019)
    for pitches in (1, 5):
        joint, averaged = errors_of_table(pitches, rng)
        values[f"error_{pitches}"] = float(joint.mean())
        values[f"averaging_{pitches}"] = float(averaged.mean() / joint.mean())
    return values


def uniform() -> dict[str, float]:
    """Error of one friction over the least possible, root mean square, by number of throws.

    Frictions from 0.0018 to 0.0102, throws at 1.6 m/s, 5 mm of noise, 30 frames/s.
    """
    values: dict[str, float] = {}
    for throws, sessions in UNIFORM_SESSIONS.items():
        ratios: list[float] = []
        for seed in range(sessions):
            rng = np.random.default_rng([throws, seed])
            mu = float(rng.uniform(LOWEST_MU, HIGHEST_MU))
            tracks = [pitch(mu, rng, number) for number in range(throws)]
            start = Ice.uniform(0.0082, stone=PAPER_STONE)
            found = estimate_ice(tracks, start=start, uniform=True)
            bound = uniform_bound(
                [SPEED] * throws, mu=mu, noise=NOISE, fps=FPS, distance=2 * HOG_LINE_Y
            )
            ratios.append((found.mu - mu) / bound)
        values[f"over_bound_{throws}"] = float(np.sqrt(np.mean(np.square(ratios))))
    return values


def maps() -> dict[str, float]:
    """Error of maps of 24 throws over the joint Bayesian bound, effects known; four ices."""
    scores: list[Row] = []
    for index in range(4):
        task = Task(kind="map", index=index, hidden=("friction_map",), throws=24)
        tracks, truth = task.make(SEED)
        scores.append(map_scores(estimate_ice(tracks, effects="none").ice, truth, tracks))
    return _maps(scores)


# --- blind sessions ------------------------------------------------------------------------------


def sessions() -> dict[str, float]:
    """Blind sessions, one or two of each kind: names, intervals, maps, planned draws, time."""
    tasks = {task.name: task for family in FAMILIES for task in plan(family)}
    rows = [judge(tasks[name], SEED, draws=True) for name in FEW]
    drawn = [row["draws"] for row in rows if row.get("draws")]
    miss, least = (sum(draw[key] for draw in drawn) for key in ("miss", "miss_on_truth"))
    with_map = [row for row in rows if row["kind"] == "map"]
    others = [row["seconds"] for row in rows if row["kind"] != "map"]
    return {
        **_names(rows),
        **_maps(with_map),
        "draws": miss / least,
        "seconds": float(np.median(others)),
        "map_seconds": float(np.median([row["seconds"] for row in with_map])),
    }


def all_sessions() -> dict[str, float]:
    """Blind sessions of all families, 114 in all: right verdicts, maps, and some by family."""
    rows = [judge(task, UNSEEN_SEED) for family in FAMILIES for task in plan(family)]
    values = {**_names(rows), **_maps([row for row in rows if row["kind"] == "map"])}
    kinds = {"two": "two", "weak": "weak", "beside_unknown": "known beside unknown"}
    for key, kind in kinds.items():
        values[key] = _percent(row["right"] for row in rows if row["kind"] == kind)
    return values


def independent() -> dict[str, float]:
    """Sessions of an independent simulator: share whose effects are named exactly [%]."""
    exact: list[bool] = []
    for file in sorted(TRACKS.glob("*.csv")):
        hidden = set(read_json(file.with_suffix(".truth.json"))["effects"])
        named = {effect["name"] for effect in document(discover(read_tracks(file)))["effects"]}
        exact.append(named == hidden)
    return {"exact": _percent(exact)}


def faults_noticed() -> dict[str, float]:
    """Share of small faults in the code of inference that its tests notice [%], by area."""
    parts = ("discovery", "estimation", "comparison", "design", "reports", "commands")
    tests = " ".join(f"tests/friction_estimation/{part}" for part in parts)
    return noticed(f"-n 54 --seed 11 --areas estimation discovery reports --tests {tests}")


# --- from the ice to draws, and from films -------------------------------------------------------


def rests() -> dict[str, float]:
    """Rests of draws on discovered ice beside their 95 % intervals; 26 sessions."""
    found = [rest_errors(task, seed) for kind, seed, count in RESTS for task in plan(kind)[:count]]
    off, sigma = (np.concatenate(part) for part in zip(*found, strict=True))
    return {
        "within_95": _percent(np.abs(off) < 1.96 * sigma),
        "error_over_sigma": float(np.sqrt(np.mean((off / sigma) ** 2))),
    }


def filmed() -> dict[str, float]:
    """Nine filmed sessions of twelve throws: sessions named exactly, and with a wrong name."""
    verdicts = list(judged(make_directory(FILMED)))
    return {
        "exact": sum(verdict.named == verdict.hidden for verdict in verdicts),
        "wrong_names": sum(bool({*verdict.named} - {*verdict.hidden}) for verdict in verdicts),
    }


def demo() -> dict[str, float]:
    """`curling demo`: the map of eight filmed throws one way, and draws planned on it."""
    with TemporaryDirectory() as folder:
        found = run_demo(Path(folder) / "demo", workers=1)
    return {
        "map": 100 * found.map_error(found.estimated_ice),
        "miss": 100 * found.mean_miss,
        "average_miss": 100 * found.mean_other_miss,
    }


# --- scores --------------------------------------------------------------------------------------


def _names(rows: Sequence[Row]) -> dict[str, float]:
    """Return correct verdicts [%], sessions with a wrong name, coverage of 95 % intervals [%]."""
    return {
        "right": _percent(row["right"] for row in rows),
        "wrong_names": sum(row["wrong_name"] for row in rows),
        "within_95": _percent(held for row in rows for held in row["inside"]),
    }


def _maps(rows: Sequence[Row]) -> dict[str, float]:
    """Return the median error of maps over the bound, and cells within their 95 % intervals [%]."""
    ratios = [row["map_rmse"] / row["map_bound"] for row in rows]
    return {
        "over_bound": float(np.median(ratios)),
        "cells": 100 * float(np.mean([row["cells_inside"] for row in rows])),
    }


def _percent(held: Iterable[bool]) -> float:
    return 100 * float(np.mean(list(held)))
