"""Learning a value network: stopped runs resume, and other rules and ices are learned too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("torch", reason="the extra train")

import train_value_network
from train_value_network import Batch, learn, learn_backwards, play_batch

from agents.learning import read_model
from agents.playing import NETWORKS, ValueNetwork, ends_from, load_network
from curling_env.errors import InputError

(DIGITAL_CURLING,) = (known for known in NETWORKS if known.name == "digital_curling")


@pytest.fixture(autouse=True)
def few_ends(monkeypatch):
    monkeypatch.setattr(train_value_network, "PARALLEL_ENDS", 2)
    monkeypatch.setattr(train_value_network, "HELD_OUT", 2)


def learnt(folder, learnt_for=DIGITAL_CURLING) -> ValueNetwork:
    return learn(
        learnt_for,
        folder,
        begin=load_network(),
        rounds=[4, 2],
        epochs=1,
        workers=1,
        seed=3,
    )


def test_a_run_that_was_stopped_ends_as_one_that_was_not(tmp_path, capsys):
    whole = learnt(tmp_path / "whole")
    begun = tmp_path / "begun" / "round-1"
    begun.mkdir(parents=True)
    kept = (tmp_path / "whole" / "round-1" / "batch-000.npz").read_bytes()
    (begun / "batch-000.npz").write_bytes(kept)
    again = learnt(tmp_path / "begun")
    for a, b in zip(whole.layers, again.layers, strict=True):
        np.testing.assert_array_equal(a[0], b[0])
        np.testing.assert_array_equal(a[1], b[1])
    assert "−ln p of the score of 4 held-out ends" in capsys.readouterr().out
    with pytest.raises(InputError, match="choose another folder"):
        learnt(tmp_path / "begun", replace(DIGITAL_CURLING, ice="standard"))


def test_learning_backwards_resumes_too_and_excludes_held_out_ends(tmp_path, capsys):
    begin = learnt(tmp_path)
    capsys.readouterr()

    def backwards() -> ValueNetwork:
        return learn_backwards(
            DIGITAL_CURLING, tmp_path, begin, round_number=1, epochs=1, workers=1, seed=3
        )

    whole = backwards()
    parts = sorted((tmp_path / "backwards").iterdir())
    # Two batches of two ends, one of them held out; 15 positions of each end.
    assert [part.name for part in parts] == [f"{n:02d}-batch-001.npz" for n in range(1, 16)]
    assert "backwards: 114 positions" in capsys.readouterr().out
    for part in parts[6:]:
        part.unlink()
    again = backwards()
    for a, b, c in zip(whole.layers, again.layers, begin.layers, strict=True):
        np.testing.assert_array_equal(a[0], b[0])
        np.testing.assert_array_equal(a[1], b[1])
        assert (a[0] != c[0]).any()


def test_mixed_doubles_begin_with_their_placed_stones(tmp_path, monkeypatch):
    monkeypatch.setattr(train_value_network, "PARALLEL_ENDS", 24)
    doubles = replace(DIGITAL_CURLING, rules="mixed_doubles_2024", delivery="hog-line")
    path = tmp_path / "batch.npz"
    play_batch(load_network(), Batch(doubles, (1, 0, 0), path))
    played = ends_from(read_model(path)["ends"])
    assert played.stones.shape == (10, 24, 16, 2)
    # No stone may be put out before the fourth is delivered: the placed ones lie somewhere.
    assert np.isfinite(played.stones[2][:, [5, 13], 0]).all()
    # The guard of a power play lies to one side until it is struck, any other in the middle.
    beside = np.abs(played.stones[0][:, 13, 0])
    assert (beside < 1e-6).any()
    assert (np.abs(beside - 1.219) < 1e-6).any()
