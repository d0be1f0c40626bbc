"""Players are found by name."""

from __future__ import annotations

import pytest

from curling_env.errors import InputError
from curling_env.game import (
    player_named,
)


def test_players_are_found_by_name():
    assert player_named("rulebased").name == "rulebased"
    with pytest.raises(InputError, match="draw, greedy, rulebased"):
        player_named("somebody")
