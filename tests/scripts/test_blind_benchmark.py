"""The blind benchmark: the truth stays sealed, and a session is judged alike every time."""

from __future__ import annotations

import blind_benchmark
import pytest
from blind.families import Task

from curling_env.errors import InputError
from curling_env.infrastructure import make_directory, read_json, read_table


@pytest.fixture
def job(tmp_path):
    for folder in ("tracks", "sealed", "reports", "rows"):
        make_directory(tmp_path / folder)
    task = Task(kind="weak", index=0, hidden=("curl",), throws=4, scale=0.1)
    return blind_benchmark.Job(task=task, seed=1, film=False, draws=False, folder=tmp_path)


def test_a_session_is_judged_alike_every_time(job):
    first = blind_benchmark.judge(job)
    assert read_json(job.row) == first
    assert {**blind_benchmark.judge(job), "seconds": 0.0} == {**first, "seconds": 0.0}
    assert first["hidden"] == ["curl"]
    tracks = read_table(job.folder / "tracks" / "weak-4-000.csv", required=["throw"])
    assert set(tracks.integers("throw")) == {0, 1, 2, 3}


def test_a_search_that_fails_is_a_session_not_understood(job, monkeypatch):
    def fails(*_):
        raise InputError("no such patch")

    monkeypatch.setattr(blind_benchmark, "discover", fails)
    row = blind_benchmark.judge(job)
    assert row["failed"] == "InputError: no such patch"
    assert row["right"] is False
    assert "no such patch" in blind_benchmark.said(row)
