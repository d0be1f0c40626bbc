"""Players are found by name, even if other packages have the names of this project's."""

from __future__ import annotations

import pytest

from curling_env.errors import InputError
from curling_env.game import player_named
from curling_env.infrastructure import shadowed_by


def test_players_are_found_by_name():
    assert player_named("rulebased").name == "rulebased"
    with pytest.raises(InputError, match="draw, greedy, learned, rulebased"):
        player_named("absent")


def test_a_distribution_that_wrote_over_a_package_is_named(monkeypatch):
    import importlib.metadata

    (entry,) = importlib.metadata.entry_points(group="curling.players", name="greedy")
    assert shadowed_by(entry) is None
    both = {"agents": ["curling-sheet", "openai-agents"]}
    monkeypatch.setattr(importlib.metadata, "packages_distributions", lambda: both)
    message = shadowed_by(entry)
    assert message is not None
    assert "'openai-agents' also has a package 'agents'" in message


def test_a_model_file_is_a_player_and_other_files_are_not(tmp_path):
    with pytest.raises(InputError, match=r"ends in \.npz"):
        player_named(tmp_path / "model.txt")
    with pytest.raises(InputError, match="no such file"):
        player_named(str(tmp_path / "model.npz"))
