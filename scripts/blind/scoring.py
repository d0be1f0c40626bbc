"""How well a session was understood: what was named, and how near its numbers are to the truth."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from derivative_regression import names_found

from blind.bound import Bound, crossed_cells, log_error
from blind.families import Task
from blind.hidden import SCATTER
from blind.law import PATCH_X0, PATCH_X1, PATCH_Y0, PATCH_Y1
from curling_env.ice import Ice
from curling_env.sheet import PAPER_SHEET
from curling_env.trajectory import Trajectory, read_tracks
from curling_env.typing import Floats
from friction_estimation.discovery.data.session import open_session
from friction_estimation.discovery.discover import Discovery
from friction_estimation.discovery.evidence.hold_out import forecast, noise_floor
from friction_estimation.discovery.tuning import CLEARLY_SEEN

MAP = "friction_map"
ALONG_PATHS = "pebble_wear:along paths"
ELSEWHERE = " elsewhere"
"""Added to the name of another stone, or of a patch at another place, than the true one."""
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
VECTORS = ("slope", "tracking_offset")
"""Effects whose parameters are the two parts of one size."""
STRENGTHS = {
    "speed_dependent_friction": "exponent",
    "air_drag": "coefficient",
    "curl": "strength",
    "spin_drag": "rate",
}
"""The strength of each effect of the preset `standard`."""
WITHIN = 1.96
"""Standard errors to either side of a 95 % interval."""


def name_and_form(effect: dict[str, Any]) -> str:
    """An effect of a report; wear along paths is told from that of the whole sheet."""
    along = effect["name"] == "pebble_wear" and "rate" not in effect["parameters"]
    return ALONG_PATHS if along else effect["name"]


def is_in_place(effect: dict[str, Any], truth: dict[str, Any]) -> bool:
    """Whether a named stone is the one that differs, and a named patch lies where friction does.

    Of the patch that was found and the true one, the centre of one has to lie in the other.
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
    """Names that the hidden effects should get; what is outside the catalogue has none."""
    names = [n if n in COMPARED else n.partition(":")[0] for n in truth["effects"]]
    if "pebble_wear:under each contact" in truth["effects"]:
        names = [ALONG_PATHS if n == "pebble_wear" else n for n in names]
    return sorted(n for n in names if n in COMPARED)


def score(report: dict[str, Any], truth: dict[str, Any], task: Task) -> dict[str, Any]:
    """What was named, whether that is right, and the sizes beside the true ones."""
    hidden = hidden_names(truth)
    named = sorted(
        {
            name_and_form(e) + ("" if is_in_place(e, truth) else ELSEWHERE)
            for e in report["effects"]
            if e["name"] != "unknown"
        }
    )
    row: dict[str, Any] = {
        "hidden": hidden,
        "named": named,
        "unknown": [e["depends_on"] for e in report["effects"] if e["name"] == "unknown"],
        "wrong_name": bool(set(named) - set(hidden)),
        "visibility": visibility(report, truth["effects"]),
        **sizes(report, truth),
    }
    row["exact"] = named == hidden and not row["unknown"]
    row["right"] = is_right(row, task)
    return row


def is_right(row: dict[str, Any], task: Task) -> bool:
    """Whether the answer is the one that its family asks for.

    Weak effects and those of bad measurements may stay unnamed if the report says that smaller ones
    would not have shown; beside a map only the effects count; something outside the catalogue has
    to be called unknown.
    """
    if task.kind == "outside":
        return not row["named"] and bool(row["unknown"])
    if task.kind == "known beside unknown":
        return row["named"] == row["hidden"] and bool(row["unknown"])
    if task.kind == "map":
        effects = [[n for n in row[key] if n != MAP] for key in ("named", "hidden")]
        return effects[0] == effects[1] and not row["unknown"]
    if task.kind in ("weak", "badly measured") and not row["named"]:
        out_of_sight = row["visibility"] is not None and row["visibility"] < 1.0
        return (row["exact"] or out_of_sight) and not row["unknown"]
    return row["exact"]


def sizes(report: dict[str, Any], truth: dict[str, Any]) -> dict[str, Any]:
    """Relative errors of parameters, and whether 95 % intervals hold the truth.

    Returns
    -------
    ``errors`` and ``inside`` of the named effects; ``changed``, whether the interval of each
    corrected strength of the given model holds the true one
    """
    errors: list[float] = []
    inside: list[bool] = []
    for effect in report["effects"]:
        name = name_and_form(effect)
        true = true_parameters(name, truth)
        for p in COMPARED.get(name, ()):
            if p not in true or p not in effect["parameters"]:
                continue
            got = effect["parameters"][p]
            off = abs(got["value"] - true[p])
            strength = abs(true[p] - NEUTRAL.get(name, 0.0))
            if name in VECTORS:
                strength = float(np.linalg.norm(list(true.values())))
            if p != "speed_exponent":
                errors.append(off / max(strength, 1e-12))
            inside.append(bool(off < WITHIN * got["stderr"]))
    changed = [
        bool(abs(c["found"] - truth["strengths"][c["name"]]) < WITHIN * c["stderr"])
        for c in report.get("changes", [])
        if c["name"] in truth.get("strengths", {}) and STRENGTHS[c["name"]] == c["parameter"]
    ]
    return {"errors": errors, "inside": inside, "changed": changed}


def true_parameters(name: str, truth: dict[str, Any]) -> dict[str, float]:
    """Of a hidden effect, also where it is hidden in another form; empty if it is not hidden."""
    if name == ALONG_PATHS and name not in truth["effects"]:
        return truth["effects"].get("pebble_wear:under each contact", {})
    of_name = (p for key, p in truth["effects"].items() if key.partition(":")[0] == name)
    return truth["effects"].get(name) or next(of_name, {})


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


def map_scores(ice: Ice, truth: dict[str, Any], throws: int, best: Bound | None) -> dict[str, Any]:
    """The found friction map beside the true one, its mean over the crossed cells taken out.

    Parameters
    ----------
    throws : of the session
    best : the joint Bayesian bound, if it is known

    Returns
    -------
    ``map_rmse`` of ln μ; ``map_bound``, the least to be expected of it, where the map is a
    Gaussian field; ``cells_inside``, the share of crossed cells whose 95 % interval holds the truth
    """
    centres = np.stack(np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres), axis=-1)
    mu: Floats = ice.mu_at(centres)
    sigma = ice.friction.sigma[ice.sheet.cell_of(centres)] / mu
    crossed = crossed_cells(truth, throws) if best is None else best.crossed
    error = log_error(np.log(mu), np.array(truth["map"]), crossed)
    return {
        "map_rmse": float(np.sqrt((error**2).mean())),
        "map_bound": best.rmse if best is not None and MAP in truth["effects"] else None,
        "cells_inside": float((np.abs(error) < WITHIN * sigma[crossed]).mean()),
    }


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


def by_regression(tracks: list[Trajectory]) -> dict[str, list[str]]:
    """What derivative regressions name in the same tracks; pysindy's where it is installed."""
    methods = ["bic"] + ["sindy"] * (find_spec("pysindy") is not None)
    return {method: names_found(tracks, method=method) for method in methods}
