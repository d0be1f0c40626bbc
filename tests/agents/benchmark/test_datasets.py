"""Datasets of the tasks in three tiers, which Minari reads back with their reference scores."""

from __future__ import annotations

import numpy as np
import pytest

from agents.benchmark import TASKS
from agents.benchmark.datasets import TIERS, record_tier
from curling_env.errors import InputError


@pytest.mark.parametrize("shots", [False, True])
def test_tiers_of_ends_are_written_and_read_back(tmp_path, monkeypatch, shots):
    minari = pytest.importorskip("minari")
    for tier in TIERS:
        record_tier(tmp_path, "end-rulebased", tier, deliveries=17, shots=shots)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    kind = "end-rulebased-shots" if shots else "end-rulebased"
    data = [minari.load_dataset(f"curling/{kind}-{tier}-v0") for tier in TIERS]
    for one in data:
        assert one.total_steps == 24  # three ends are the fewest with 17 deliveries
        low, high = TASKS["end-rulebased"].reference_returns
        assert minari.get_normalized_score(one, np.array([low, high])).tolist() == [0.0, 1.0]
        episode = next(iter(one.iterate_episodes()))
        env = one.recover_environment().unwrapped
        np.testing.assert_array_equal(env.reset(seed=10_000_000)[0], episode.observations[0])
        if shots:
            masks = episode.infos["action_mask"]
            assert masks.shape == (9, 201)
            assert all(mask[k] for mask, k in zip(masks, episode.actions, strict=False))
    first = [next(iter(one.iterate_episodes())).actions for one in data]
    assert not np.array_equal(first[0], first[2])


def test_single_throws_are_on_other_ices_than_the_benchmarks(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    record_tier(tmp_path, "draw", "expert", deliveries=3)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    data = minari.load_dataset("curling/draw-expert-v0")
    assert data.total_steps == 3
    assert data.env_spec.kwargs["ices"]["knows"] == "map"


def test_what_makes_no_sense_is_refused(tmp_path):
    with pytest.raises(InputError, match="single throws have no shots"):
        record_tier(tmp_path, "draw", "random", deliveries=1, shots=True)
    with pytest.raises(InputError, match="tier must be one of random, medium, expert"):
        record_tier(tmp_path, "draw", "best", deliveries=1)
