"""Provenance of results."""

from __future__ import annotations

import importlib.metadata
import os
import subprocess

import pytest

from curling_env.infrastructure import typed
from curling_env.infrastructure.provenance import provenance


@pytest.fixture
def tracks(tmp_path):
    path = tmp_path / "tracks.csv"
    path.write_bytes(b"throw,t\r\n0,1\n")
    return path


def test_version_seed_and_digest(tracks):
    record = provenance([tracks], seed=4)
    assert record["version"] == importlib.metadata.version("curling-sheet")
    assert record["seed"] == 4
    digest = subprocess.run(["sha256sum", tracks], capture_output=True, text=True, check=True)
    assert record["inputs"] == [{"file": "tracks.csv", "sha256": digest.stdout.split()[0]}]
    assert "command" not in record  # nothing was typed


def test_presets_and_options_not_given_are_no_inputs(tracks):
    record = provenance([None, "standard", tracks])
    assert [entry["file"] for entry in record["inputs"]] == ["tracks.csv"]
    assert "seed" not in record


@pytest.mark.parametrize(
    ("arguments", "command"),
    [
        (["discover", "a b.csv", "-o", "runs/x"], "curling discover 'a b.csv'"),
        (
            ["discover", "t.csv", "--output=runs/x", "--seed", "3"],
            "curling discover t.csv --seed 3",
        ),
        (["estimate", "t.csv", "-oice.json", "--report", "r"], "curling estimate t.csv"),
        (["demo", "--workers", "4", "--throws", "9"], "curling demo --throws 9"),
        (["discover", "/home/t.csv", "--ice=/home/i.json"], "curling discover t.csv --ice=i.json"),
        (["plan", "--target", "-0.5,17.4"], "curling plan --target -0.5,17.4"),
    ],
)
def test_the_command_is_recorded_as_typed_without_folders(arguments, command):
    with typed(arguments):
        assert provenance()["command"] == command
    assert "command" not in provenance()


def test_a_pipe_is_not_read_again(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert provenance([pipe])["inputs"] == [{"file": "pipe", "sha256": None}]
