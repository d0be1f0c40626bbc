"""Rows of the benchmark: stopped runs go on, and what a run saves plays as measured."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import baselines
import numpy as np
import pytest

from agents.benchmark import TASKS, contestant, make, played
from agents.benchmark.rows import read_row, shortcomings


@pytest.fixture
def small(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, value in (("EPISODES", 3), ("SEEDS", 2), ("CHUNKS", 1), ("CLONING_STEPS", 50)):
        monkeypatch.setattr(baselines, name, value)
    monkeypatch.setattr(baselines, "DELIVERIES", {"learned": 64, "planner": 2})
    return tmp_path


@pytest.mark.parametrize(
    ("name", "task"),
    [("ppo", "draw"), ("sac", "draw"), ("bc-medium", "draw"), ("dqn", "end-rulebased")],
)
def test_runs_are_resumed_and_saved_weights_score_as_measured(small, monkeypatch, name, task):
    monkeypatch.setattr(baselines, "ENDS", ["end-rulebased"])
    baselines.run([name], [task], 0.005, "1")
    folder = baselines.FOLDER / name / task
    row = read_row(baselines.FOLDER / f"{name}.json")
    assert row.learnt
    assert [len(run) for run in row.scores[0].runs] == [3, 3]
    assert any("at least 100" in words for words in shortcomings(row))
    values, _ = played(TASKS[task], contestant(str(folder / "1" / "model.zip")), episodes=3)
    np.testing.assert_allclose(values, row.scores[0].runs[1], atol=1e-4)
    about = json.loads((folder / "0" / "config.json").read_text())
    assert about["seed"] == 0
    assert about["steps"] > 0

    done = (folder / "0" / "values.json").stat().st_mtime_ns
    (folder / "0" / "model.zip").write_bytes(b"not read: this training is measured")
    for name_of_file in ("values.json", "model.zip"):
        (folder / "1" / name_of_file).unlink()
    baselines.run([name], [task], 0.005, "1")
    assert (folder / "0" / "values.json").stat().st_mtime_ns == done
    assert read_row(baselines.FOLDER / f"{name}.json").scores == row.scores


@pytest.mark.parametrize("blind", [False, True])
def test_learners_of_ends_see_every_stone_unless_they_are_blind(blind):
    task = TASKS["end-rulebased"]
    model = baselines._model(replace(baselines.ALGORITHMS["ppo"], blind=blind), task, seed=0)
    scale = model.policy.features_extractor.scale.numpy()
    names = make("end-rulebased").unwrapped.observation.names
    varies = {name for name, one in zip(names, scale, strict=True) if one}
    stones = {f"{who} stone {k}" for who in ("own", "their") for k in range(1, 8)}
    seen = {one for one in stones if {f"{one} {what}" for what in ("present", "x", "y")} <= varies}
    assert seen == (set() if blind else stones)
    assert {"hammer", "stones delivered"} <= varies


def test_what_needs_no_training_is_measured_on_all_that_it_can_do(small):
    baselines.run(["random", "rulebased"], ["guard", "end-rulebased"], 1.0, "1")
    names = [
        [score.task for score in read_row(baselines.FOLDER / f"{name}.json").scores]
        for name in ("random", "rulebased")
    ]
    assert names == [["guard", "end-rulebased"], ["end-rulebased"]]


DOCS = Path(__file__).parents[2] / baselines.RELEASED


@pytest.mark.parametrize("path", sorted(DOCS.glob("[!c]*.json")), ids=lambda path: path.stem)
def test_released_rows_are_complete(path):
    assert shortcomings(read_row(path)) == []


def test_a_release_keeps_the_rows_that_were_not_run_again(small):
    folder = small / baselines.RELEASED
    shutil.copytree(DOCS, folder)
    baselines.run(["random"], ["guard"], 1.0, "1")
    before, partly = (
        {score.task: score.runs for score in read_row(path / "random.json").scores}
        for path in (folder, baselines.FOLDER)
    )
    assert len(partly["guard"][0]) == 3
    assert partly | {"guard": before["guard"]} == before
    baselines.release()
    for name in ("curves.csv", "configurations.json", "ppo.json", "random.json"):
        assert (folder / name).read_bytes() == (DOCS / name).read_bytes()


@pytest.mark.parametrize(("name", "task"), [("sac", "guard"), ("ppo", "draw-blind")])
def test_released_weights_score_as_their_row(name, task):
    values, _ = played(
        TASKS[task], contestant(str(DOCS / "weights" / f"{name}-{task}.zip")), episodes=20
    )
    runs = {score.task: score.runs for score in read_row(DOCS / f"{name}.json").scores}
    np.testing.assert_allclose(values, runs[task][0][:20], atol=1e-3)
