"""Correct answers of each family, and sizes and maps compared with the truth."""

from __future__ import annotations

import json

import numpy as np
import pytest
from blind.families import Task
from blind.law import MU, PATCH_X0, PATCH_X1, PATCH_Y0, PATCH_Y1, SIZE
from blind.scoring import hidden_names, map_scores, score
from blind.sessions import make_session

from curling_env.ice import FrictionMap, Ice
from curling_env.trajectory import Trajectory


def effect(name, **parameters):
    values = {p: {"value": v, "stderr": s, "unit": ""} for p, (v, s) in parameters.items()}
    return {"name": name, "parameters": values, "depends_on": []}


UNKNOWN = effect("unknown")
CURL = effect("curl", strength=(0.0061, 0.0001), speed_exponent=(0.0, 0.1))
CURL_TRUTH = {"curl": {"strength": 0.006, "speed_exponent": 0.3, "spin_exponent": 0.0}}


def scored(kind, hidden, *effects, smallest=None, **more):
    report = {"effects": list(effects), "smallest_detectable": smallest or {}, **more}
    task = Task(kind=kind, index=0, hidden=tuple(hidden), throws=20)
    return score(report, {"effects": hidden, **more.pop("truth", {})}, task)


def test_an_extra_name_is_wrong():
    row = scored("one", CURL_TRUTH, CURL, effect("slope", x=(1e-4, 1e-5)))
    assert row["wrong_name"]
    assert not row["right"]


def test_intervals_of_a_named_effect():
    row = scored("one", CURL_TRUTH, CURL)
    assert row["right"]
    assert not row["wrong_name"]
    assert row["inside"] == [True, False]


def test_an_unnamed_weak_effect_is_right_only_if_it_could_not_show():
    for size, right in ((0.01, True), (0.001, False)):
        smallest = {"curl": {"strength": size}}
        assert scored("weak", CURL_TRUTH, smallest=smallest)["right"] is right
        assert not scored("weak", CURL_TRUTH, UNKNOWN, smallest=smallest)["right"]
        assert not scored("one", CURL_TRUTH, smallest=smallest)["right"]
    assert not scored("weak", CURL_TRUTH)["right"]


def test_with_an_unknown_effect_the_known_one_is_named_and_the_rest_reported():
    hidden = {**CURL_TRUTH, "trough": {}}
    assert scored("known beside unknown", hidden, CURL, UNKNOWN)["right"]
    assert not scored("known beside unknown", hidden, CURL)["right"]
    assert not scored("known beside unknown", hidden, UNKNOWN)["right"]


def test_with_a_map_only_the_effects_count():
    hidden = {"friction_map": {"sd": 0.04, "length": 2.0}, **CURL_TRUTH}
    row = scored("map", hidden, CURL)
    assert row["right"]
    assert not row["exact"]
    row = scored("map", hidden, CURL, effect("friction_map", sd=(0.04, 0.01)))
    assert row["right"]
    assert row["exact"]
    assert not scored("map", hidden, CURL, effect("friction_patch"))["right"]


def test_another_stone_is_a_wrong_name():
    hidden = {"stone_bias": {"stone": 2.0, "factor": 1.02}}
    for stone, right in ((2, True), (1, False)):
        named = effect("stone_bias", stone=(stone, 0.0), factor=(1.02, 0.001))
        row = scored("one", hidden, named)
        assert row["right"] is right
        assert row["wrong_name"] is not right


def test_a_patch_at_another_place_is_a_wrong_name():
    numbers = np.zeros(SIZE)
    numbers[[PATCH_X0, PATCH_X1, PATCH_Y0, PATCH_Y1]] = -0.9, -0.1, -4.7, -1.4
    for x, right in ((-0.8, True), (-0.05, False)):
        sides = {"x_min": x, "x_max": x + 0.6, "y_min": -3.0, "y_max": -2.0}
        named = effect("friction_patch", **{name: (value, 0.1) for name, value in sides.items()})
        truth = {"effects": {"friction_patch": {"factor": 0.9}}, "numbers": numbers}
        report = {"effects": [named], "smallest_detectable": {}}
        row = score(report, truth, Task(kind="one", index=0, throws=16))
        assert row["right"] is right
        assert row["wrong_name"] is not right


def test_friction_that_ripples_is_a_friction_map():
    assert hidden_names({"effects": {"friction_map:ripples": {}}}) == ["friction_map"]
    assert hidden_names({"effects": {"trough": {}}}) == []


def test_a_map_is_judged_in_the_cells_that_stones_crossed():
    columns, truth = make_session(("friction_map",), np.random.default_rng(1), throws=3)
    sealed = json.loads(json.dumps(truth, default=float))
    numbers, t = np.array(columns["throw"]), np.array(columns["t"])
    xy = np.column_stack([columns["x"], columns["y"]])
    tracks = [Trajectory(t=t[numbers == k], xy=xy[numbers == k]) for k in range(3)]
    mu = sealed["numbers"][MU] * np.exp(np.array(sealed["map"]))
    everywhere = np.ones_like(mu, dtype=bool)
    true = Ice(friction=FrictionMap(mu=1.3 * mu, sigma=0.01 * mu, observed=everywhere))
    row = map_scores(true, sealed, tracks)
    assert row["map_rmse"] == pytest.approx(0.0, abs=1e-9)
    assert row["cells_inside"] == 1.0
    plain = map_scores(Ice.uniform(0.009), sealed, tracks)
    assert plain["map_rmse"] > 2 * plain["map_bound"] > 0.0
    assert plain["cells_inside"] == 0.0
