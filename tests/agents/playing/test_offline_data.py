"""A dataset of ends has the played ends, and Minari reads it back."""

from __future__ import annotations

import numpy as np
import pytest

from agents.playing import DATASET, RECORDED, record_ends
from curling_env.errors import InputError
from curling_env.game import player_named


def test_ends_are_written_and_read_back(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    options = {"opponent": "draw", "hammer": "opponent"}
    folder = record_ends(tmp_path, player_named("rulebased"), ends=3, options=options, seed=5)
    assert [one.name for one in tmp_path.iterdir()] == ["curling"]
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    data = minari.load_dataset("curling/ends-v0")
    assert (data.total_episodes, data.total_steps) == (3, 24)
    env = data.recover_environment()
    for episode in data.iterate_episodes():
        seen, _ = env.reset(seed=int(episode.id) + 5)
        np.testing.assert_array_equal(seen, episode.observations[0])
        for k, action in enumerate(episode.actions):
            seen, reward, over, _, _ = env.step(action)
            np.testing.assert_array_equal(seen, episode.observations[k + 1])
            assert reward == episode.rewards[k]
            assert over == episode.terminations[k]
    with pytest.raises(InputError, match="a dataset already"):
        record_ends(tmp_path, player_named("draw"), ends=1)
    assert folder.is_dir()


def test_a_relative_folder_serves(curling, tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    monkeypatch.chdir(tmp_path)
    curling("record-games", "--player", "draw", "--ends", "1", "-o", "runs/data")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "runs/data"))
    assert minari.load_dataset("curling/ends-v0").total_steps == 8


def test_without_minari_the_command_reports_the_missing_package(curling, tmp_path):
    try:
        import minari  # noqa: F401
    except ModuleNotFoundError:
        reported = curling("record-games", "--ends", "1", "-o", tmp_path / "data").complaint
        assert "pip install 'curling-sheet[offline]'" in reported
        assert not (tmp_path / "data").exists() or not list((tmp_path / "data").iterdir())


def test_the_dataset_that_is_shipped_is_small_and_whole():
    import json

    h5py = pytest.importorskip("h5py")
    folder = RECORDED / DATASET / "data"
    reported = json.loads((folder / "metadata.json").read_text())
    assert (reported["dataset_id"], reported["total_episodes"], reported["total_steps"]) == (
        DATASET,
        100,
        800,
    )
    assert (folder / "main_data.hdf5").stat().st_size < 1_000_000
    with h5py.File(folder / "main_data.hdf5") as file:
        assert len(file) == 100
        for k in range(100):
            end = file[f"episode_{k}"]
            assert end["observations"].shape == (9, 180)
            assert (np.abs(end["actions"][()]) <= 1).all()
            assert end["terminations"][()].tolist() == [False] * 7 + [True]
