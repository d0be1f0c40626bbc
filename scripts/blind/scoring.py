"""Scores of a discovery: named effects, and the accuracy of its numbers."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from blind.bound import bound_of
from blind.families import Task
from blind.law import PATCH_X0, PATCH_X1, PATCH_Y0, PATCH_Y1
from blind.planned_draws import draws_on_truth
from curling_env import load_ice
from curling_env.ice import Ice
from curling_env.sheet import PAPER_SHEET
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.discovery.discover import discover
from friction_estimation.discovery.report import document
from friction_estimation.discovery.tuning import CLEARLY_SEEN

MAP = "friction_map"
ALONG_PATHS = "pebble_wear:along paths"
ELSEWHERE = " elsewhere"
"""Suffix of the name of another stone, or of a patch at another place, than the true one."""
COMPARED = {
    "speed_dependent_friction": ("exponent",),
    "curl": ("strength", "speed_exponent"),
    "slope": ("x", "y"),
    "pebble_wear": ("rate",),
    ALONG_PATHS: ("along_path", "under_contacts"),
    "stone_bias": ("factor", "curl_factor"),
    "sweeping": ("friction_factor",),
    "friction_patch": ("factor",),
    "time_drift": ("rate",),
    "spin_drag": ("rate",),
    "air_drag": ("coefficient",),
    "tracking_offset": ("forward", "left"),
    "lens_distortion": ("k1",),
    MAP: (),
}
"""Effects that can be named, and the parameters that are compared with the truth."""
NEUTRAL = {"stone_bias": 1.0, "sweeping": 1.0, "friction_patch": 1.0}
WITHIN = 1.96
"""Half-width of a 95 % interval [standard errors]."""
RINK_ICE = ("model given", "model given, nothing hidden", "map", "one way")
"""Families on whose ice draws are planned."""
Row = dict[str, Any]


def judge(task: Task, seed: int, *, draws: bool = False) -> Row:
    """Make a session, search it, and only then open the truth; return its scores.

    Parameters
    ----------
    draws : plan draws on the discovered ice
    """
    tracks, truth = task.make(seed)
    model = load_ice("standard") if task.given else None
    begun = time.process_time()
    found = discover(tracks, model)
    report = document(found)
    row: Row = {"kind": task.kind, "seconds": round(time.process_time() - begun, 2)}
    row |= score(report, truth, task)
    if task.kind == "map":
        row |= map_scores(found.improved_ice(), truth, tracks)
    if draws and task.kind in RINK_ICE:
        # If all throws went one way, the home half of the sheet was never seen.
        direction = -1.0 if task.ways == 2 else 1.0
        row["draws"] = draws_on_truth(found.improved_ice(), truth, direction=direction)
    return row


def score(report: dict[str, Any], truth: dict[str, Any], task: Task) -> Row:
    """Return the named effects, their correctness, and the 95 % intervals that contain the
    truth.
    """
    hidden = hidden_names(truth)
    named = sorted(
        {
            name_and_form(e) + ("" if is_in_place(e, truth) else ELSEWHERE)
            for e in report["effects"]
            if e["name"] != "unknown"
        }
    )
    unknown = any(e["name"] == "unknown" for e in report["effects"])
    row: Row = {
        "wrong_name": bool(set(named) - set(hidden)),
        "exact": named == hidden and not unknown,
        "inside": inside(report, truth),
    }
    if task.kind == "known beside unknown":
        return row | {"right": named == hidden and unknown}
    if task.kind == "map":  # only the effects count
        effects = [[name for name in names if name != MAP] for names in (named, hidden)]
        return row | {"right": effects[0] == effects[1] and not unknown}
    if task.kind == "weak" and not named:
        # It may stay unnamed if the report states that smaller ones would not have shown.
        seen = visibility(report, truth["effects"])
        return row | {"right": seen is not None and seen < 1.0 and not unknown}
    return row | {"right": row["exact"]}


def name_and_form(effect: dict[str, Any]) -> str:
    """Return the name of a report's effect, which differs for wear along paths."""
    along = effect["name"] == "pebble_wear" and "rate" not in effect["parameters"]
    return ALONG_PATHS if along else effect["name"]


def is_in_place(effect: dict[str, Any], truth: dict[str, Any]) -> bool:
    """Return whether a named stone is the one that differs, or a named patch is at the right place.

    The centre of the discovered patch must be in the true one, or the reverse.
    """
    true = true_parameters(effect["name"], truth)
    got = {name: p["value"] for name, p in effect["parameters"].items()}
    if "stone" in got and "stone" in true:
        return got["stone"] == true["stone"]
    hidden = {name.partition(":")[0] for name in truth["effects"]}
    if effect["name"] != "friction_patch" or effect["name"] not in hidden:
        return True
    q = truth["numbers"]
    true_box = np.array([[q[PATCH_X0], q[PATCH_Y0]], [q[PATCH_X1], q[PATCH_Y1]]])
    box = np.array([[got["x_min"], got["y_min"]], [got["x_max"], got["y_max"]]])
    return any(
        bool(((one[0] < other.mean(axis=0)) & (other.mean(axis=0) < one[1])).all())
        for one, other in ((box, true_box), (true_box, box))
    )


def hidden_names(truth: dict[str, Any]) -> list[str]:
    """Return names that the hidden effects should get; effects outside the catalogue have none."""
    names = [n if n in COMPARED else n.partition(":")[0] for n in truth["effects"]]
    if "pebble_wear:under each contact" in truth["effects"]:
        names = [ALONG_PATHS if n == "pebble_wear" else n for n in names]
    return sorted(n for n in names if n in COMPARED)


def true_parameters(name: str, truth: dict[str, Any]) -> dict[str, float]:
    """Return the parameters of a hidden effect, also if it has another form; empty if it is not
    hidden.
    """
    if name == ALONG_PATHS and name not in truth["effects"]:
        return truth["effects"].get("pebble_wear:under each contact", {})
    of_name = (p for key, p in truth["effects"].items() if key.partition(":")[0] == name)
    return truth["effects"].get(name) or next(of_name, {})


def inside(report: dict[str, Any], truth: dict[str, Any]) -> list[bool]:
    """Return whether the 95 % interval of each compared parameter contains the truth."""
    found: list[bool] = []
    for effect in report["effects"]:
        name = name_and_form(effect)
        true = true_parameters(name, truth)
        for p in COMPARED.get(name, ()):
            if p in true and p in effect["parameters"]:
                got = effect["parameters"][p]
                found.append(bool(abs(got["value"] - true[p]) < WITHIN * got["stderr"]))
    return found


def visibility(report: dict[str, Any], hidden: dict[str, dict[str, float]]) -> float | None:
    """Return the hidden effect over the smallest that these throws would have shown clearly."""
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


def map_scores(ice: Ice, truth: dict[str, Any], tracks: list[Trajectory]) -> Row:
    """Compare a discovered friction map with the true one, without its mean over the crossed cells.

    Returns
    -------
    ``map_rmse`` of ln μ; ``map_bound``, its lower bound; ``cells_inside``, the share of crossed
    cells whose 95 % interval contains the truth
    """
    centres = np.stack(np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres), axis=-1)
    mu: Floats = ice.mu_at(centres)
    sigma = ice.friction.sigma[ice.sheet.cell_of(centres)] / mu
    best = bound_of(truth, tracks)
    error = (np.log(mu) - np.array(truth["map"]))[best.crossed]
    error = error - error.mean()
    return {
        "map_rmse": float(np.sqrt((error**2).mean())),
        "map_bound": best.rmse,
        "cells_inside": float((np.abs(error) < WITHIN * sigma[best.crossed]).mean()),
    }
