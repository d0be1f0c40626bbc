"""Learning a value network: stopped runs resume, and other rules and ices are learned too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("torch", reason="the extra train")

from train_value_network import learn_backwards, settings_for

from agents.playing import NETWORKS, ValueNetwork, load_network, run_league
from agents.playing.league import run
from agents.playing.league.run import played_batch

(DIGITAL_CURLING,) = (known for known in NETWORKS if known.name == "digital_curling")
TINY = settings_for(DIGITAL_CURLING, generations=(4, 4), epochs=1, tried=8, seed=3)


@pytest.fixture(autouse=True)
def few_ends(monkeypatch):
    monkeypatch.setattr(run, "PARALLEL_ENDS", 2)
    monkeypatch.setattr(run, "HELD_OUT", 2)


def test_learning_backwards_resumes_and_excludes_held_out_ends(tmp_path, capsys):
    reports: list[str] = []
    begin = run_league(tmp_path, TINY, report=reports.append)
    assert all(words.startswith("−ln p of the score of 2 held-out ends") for words in reports)
    assert "worse by" in reports[0]

    def backwards() -> ValueNetwork:
        return learn_backwards(TINY, tmp_path, begin, workers=1)

    whole = backwards()
    parts = sorted((tmp_path / "backwards").iterdir())
    # Two batches of two ends, one of them held out; 15 positions of each end.
    assert [part.name for part in parts] == [f"{n:02d}-batch-000.npz" for n in range(1, 16)]
    assert "backwards: 114 positions" in capsys.readouterr().out
    for part in parts[6:]:
        part.unlink()
    again = backwards()
    for a, b, c in zip(whole.layers, again.layers, begin.layers, strict=True):
        np.testing.assert_array_equal(a[0], b[0])
        np.testing.assert_array_equal(a[1], b[1])
        assert (a[0] != c[0]).any()


def test_mixed_doubles_begin_with_their_placed_stones(monkeypatch):
    monkeypatch.setattr(run, "PARALLEL_ENDS", 24)
    doubles = replace(TINY, rules="mixed_doubles_2024", delivery="hog-line")
    network = load_network()
    played = played_batch(doubles, (network, network), (1, 0, 0))
    assert played.stones.shape == (10, 24, 16, 2)
    # No stone may be put out before the fourth is delivered: the placed ones lie somewhere.
    assert np.isfinite(played.stones[2][:, [5, 13], 0]).all()
    # The guard of a power play lies to one side until it is struck, any other in the middle.
    beside = np.abs(played.stones[0][:, 13, 0])
    assert (beside < 1e-6).any()
    assert (np.abs(beside - 1.219) < 1e-6).any()
