"""Rows of the benchmark: stopped runs go on, and what a run saves plays as measured."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import baselines
import numpy as np
import pytest

from agents.benchmark import TASKS, contestant, played
from agents.benchmark.rows import read_row, shortcomings


@pytest.fixture
def small(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, value in (("EPISODES", 3), ("SEEDS", 2), ("CHUNKS", 1)):
        monkeypatch.setattr(baselines, name, value)
    monkeypatch.setattr(baselines, "DELIVERIES", {"learned": 64, "planner": 2})
    return tmp_path


@pytest.mark.parametrize(
    ("name", "task"),
    [("ppo", "draw"), ("sac", "draw"), ("bc-medium", "draw"), ("dqn", "end-rulebased")],
)
def test_runs_are_resumed_and_saved_weights_score_as_measured(small, monkeypatch, name, task):
    monkeypatch.setattr(baselines, "ENDS", ["end-rulebased"])
    baselines.run([name], [task], 0.02, "1")
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
    baselines.run([name], [task], 0.02, "1")
    assert (folder / "0" / "values.json").stat().st_mtime_ns == done
    assert read_row(baselines.FOLDER / f"{name}.json").scores == row.scores


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
    baselines.release()
    for name in ("curves.csv", "configurations.json", "ppo.json"):
        assert (folder / name).read_bytes() == (DOCS / name).read_bytes()


@pytest.mark.parametrize(("name", "task"), [("sac", "guard"), ("ppo", "draw-blind")])
def test_released_weights_score_as_their_row(name, task):
    values, _ = played(
        TASKS[task], contestant(str(DOCS / "weights" / f"{name}-{task}.zip")), episodes=20
    )
    runs = {score.task: score.runs for score in read_row(DOCS / f"{name}.json").scores}
    np.testing.assert_allclose(values, runs[task][0][:20], atol=1e-3)
