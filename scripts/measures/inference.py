"""Measures of estimation and discovery: errors beside their bounds, names, intervals, and time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import film_sessions
import numpy as np
import rest_coverage
from blind.bound import bound_of
from blind.families import Task, plan
from blind.scoring import map_scores
from blind.tables import pooled
from blind_benchmark import Job, judge, make_files, make_folders
from figures import ROOT
from paper.tables import FPS, NOISE, SPEED, pitch, repeat_table

from agents.closed_loop.demo import run_demo
from curling_env.ice import Ice
from curling_env.infrastructure.files.storage import make_directory, read_json
from curling_env.sheet import HOG_LINE_Y, PAPER_STONE
from curling_env.trajectory import read_tracks
from friction_estimation import discover, estimate_ice
from friction_estimation.design.cramer_rao import uniform_bound
from friction_estimation.discovery.report import document

MEASURES = (
    "paper",
    "uniform",
    "maps",
    "sessions",
    "all_sessions",
    "independent",
    "rests",
    "filmed",
    "demo",
)
TRACKS = ROOT / "runs" / "independent" / "tracks"
FILMED = ROOT / "runs" / "figures" / "film_sessions"
SEED = 20261162
"""Of the blind sessions."""
FEW = (
    "none-16-000",
    "one-16-001",
    "one-16-007",
    "two-16-003",
    "two-16-004",
    "two-16-012",
    "model-given-20-005",
    "map-20-001",
    "map-20-009",
    "known-beside-unknown-20-001",
)
"""Names of the blind sessions of the quick set."""
FAMILIES = (
    "none",
    "one",
    "two",
    "another form",
    "model given",
    "model given, nothing hidden",
    "map",
    "weak",
    "known beside unknown",
    "one way",
)
"""Families of all blind sessions."""
UNIFORM_SESSIONS = {1: 100, 5: 50}
"""Number of sessions by number of throws."""
LOWEST_MU, HIGHEST_MU = 0.0018, 0.0102
Row = dict[str, Any]


# --- one friction, and a map -------------------------------------------------------------------


def paper() -> dict[str, float]:
    """Mean errors of μ in the paper's tables 3 and 4, repeated with one seed [%].

    Also the errors of the paper's own method on the same tracks, over those of the joint fit.
    """
    values: dict[str, float] = {}
    rng = np.random.default_rng(2019)
    for pitches in (1, 5):
        table = repeat_table(pitches, rng)
        joint = table.error_percent(table.joint).mean()
        values[f"error_{pitches}"] = joint
        values[f"averaging_{pitches}"] = table.error_percent(table.averaged).mean() / joint
    return values


def uniform() -> dict[str, float]:
    """Error of one friction over the least possible, root mean square, by number of throws.

    Frictions from 0.0018 to 0.0102, throws at 1.6 m/s, 5 mm of noise, 30 frames/s.
    """
    values: dict[str, float] = {}
    inside: list[bool] = []
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
            low, high = found.interval
            inside.append(bool(low < mu < high))
        values[f"over_bound_{throws}"] = float(np.sqrt(np.mean(np.square(ratios))))
    return values | {"within_95": 100 * float(np.mean(inside))}


def maps() -> dict[str, float]:
    """Error of maps of 24 throws over the joint Bayesian bound, effects known; four ices."""
    scores: list[Row] = []
    for index in range(4):
        task = Task(kind="map", index=index, hidden=("friction_map",), throws=24)
        with TemporaryDirectory() as folder:
            job = _job(task, Path(folder))
            make_files(job)
            tracks = read_tracks(job.folder / "tracks" / f"{task.name}.csv")
            truth = read_json(job.folder / "sealed" / f"{task.name}.json")
        ice = estimate_ice(tracks, effects="none").ice
        scores.append(map_scores(ice, truth, task.throws, bound_of(truth, tracks)))
    return _maps(scores)


# --- blind sessions ------------------------------------------------------------------------------


def sessions() -> dict[str, float]:
    """Blind sessions, one or two of each kind: names, intervals, maps, planned draws, time."""
    tasks = {task.name: task for task in plan(list(FAMILIES), 1)}
    rows = _judged([tasks[name] for name in FEW], draws=True)
    drawn = [row["draws"] for row in rows if row.get("draws")]
    miss, least = (sum(draw[key] for draw in drawn) for key in ("miss", "miss_on_truth"))
    maps_only = [row for row in rows if row["kind"] == "map"]
    others = [row for row in rows if row["kind"] != "map"]
    return {
        **_names(rows),
        **_maps(maps_only),
        "draws": miss / least,
        "seconds": float(np.median([row["seconds"] for row in others])),
        "map_seconds": float(np.median([row["seconds"] for row in maps_only])),
    }


def all_sessions() -> dict[str, float]:
    """Blind sessions of all families, 114 in all: right verdicts by family, maps, time."""
    rows = _judged(plan(list(FAMILIES), 1), draws=False)
    values = {**_names(rows), **_maps([row for row in rows if row["kind"] == "map"])}
    for key, kinds in {
        "one_or_none": ("none", "one"),
        "two": ("two",),
        "given": ("model given", "model given, nothing hidden"),
        "with_map": ("map",),
        "weak": ("weak",),
        "beside_unknown": ("known beside unknown",),
    }.items():
        values[key] = _percent(row["right"] for row in rows if row["kind"] in kinds)
    return values


def independent() -> dict[str, float]:
    """Sessions of an independent simulator: share whose effects are named exactly [%]."""
    exact: list[bool] = []
    wrong = 0
    for file in sorted(TRACKS.glob("*.csv")):
        hidden = set(read_json(file.with_suffix(".truth.json"))["effects"])
        named = {effect["name"] for effect in document(discover(read_tracks(file)))["effects"]}
        exact.append(named == hidden)
        wrong += bool(named - hidden - {"unknown"})
    return {"exact": _percent(exact), "wrong_names": wrong}


# --- from the ice to draws, and from films -------------------------------------------------------


def rests() -> dict[str, float]:
    """Rests of draws on discovered ice beside their 95 % intervals; 26 sessions."""
    judged = [
        rest_coverage.judge(*rest_coverage.discovered(task, seed))
        for kind, seed, count in (
            ("model given", 20261130, 6),
            ("map", 20261131, 4),
            ("model given", 31, 8),
            ("map", 31, 8),
        )
        for task in plan([kind], 1)[:count]
    ]
    off, sigma = rest_coverage.pooled(judged, "common")
    return {
        "within_95": _percent(np.abs(off) < rest_coverage.WITHIN * sigma),
        "error_over_sigma": float(np.sqrt(np.mean((off / sigma) ** 2))),
    }


def filmed() -> dict[str, float]:
    """Nine filmed sessions of twelve throws: effects named, and intervals; right lens."""
    film_sessions.make_films(make_directory(FILMED), workers=1)
    verdicts = [k for k in film_sessions.judged(FILMED) if k.lens == "right" and not k.with_scene]
    off = np.array([size[-1] for verdict in verdicts for size in verdict.sizes])
    return {
        "exact": sum(sorted(k.named) == sorted(k.hidden) for k in verdicts),
        "wrong_names": sum(bool(set(k.named) - set(k.hidden)) for k in verdicts),
        "within_95": _percent(np.abs(off) < 1.96),
    }


def demo() -> dict[str, float]:
    """`curling demo`: the map of eight filmed throws one way, and draws planned on it."""
    with TemporaryDirectory() as folder:
        found = run_demo(Path(folder) / "demo", workers=1)
    return {
        "map": 100 * found.map_error(found.estimated_ice),
        "average": 100 * found.map_error(found.average_ice),
        "miss": 100 * found.mean_miss,
        "average_miss": 100 * found.mean_other_miss,
    }


# --- scores --------------------------------------------------------------------------------------


def _job(task: Task, folder: Path, *, draws: bool = False) -> Job:
    make_folders(folder)
    return Job(task=task, seed=SEED, film=False, draws=draws, folder=folder)


def _judged(tasks: Sequence[Task], *, draws: bool) -> list[Row]:
    with TemporaryDirectory() as folder:
        return [judge(_job(task, Path(folder), draws=draws)) for task in tasks]


def _names(rows: Sequence[Row]) -> dict[str, float]:
    """Right verdicts [%], sessions with a wrong name, and 95 % intervals of effects [%]."""
    return {
        "right": _percent(row["right"] for row in rows),
        "wrong_names": sum(bool(row.get("wrong_name")) for row in rows),
        "within_95": _percent(pooled(list(rows), "inside")),
    }


def _maps(rows: Sequence[Row]) -> dict[str, float]:
    """Median error of maps over the bound, and cells within their 95 % intervals [%]."""
    ratios = [row["map_rmse"] / row["map_bound"] for row in rows]
    return {
        "over_bound": float(np.median(ratios)),
        "cells": 100 * float(np.mean([row["cells_inside"] for row in rows])),
    }


def _percent(held: Iterable[bool]) -> float:
    return 100 * float(np.mean(list(held)))
