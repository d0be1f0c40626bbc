"""Ice of a game, and its changes."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.game import (
    NO_EVOLUTION,
    TYPICAL_EVOLUTION,
    IceEvolution,
    ice_for_game,
)
from curling_env.ice import load_ice


def test_every_game_has_its_own_set_of_stones():
    ice = load_ice("standard")
    factors = [
        [
            e.parameters["factor"]
            for e in ice_for_game(ice, TYPICAL_EVOLUTION, seed, sweeping=False).effects
            if e.name == "stone_bias"
        ]
        for seed in (0, 0, 1)
    ]
    assert factors[0] == factors[1] != factors[2]
    assert len(factors[0]) == 16
    assert 0.003 < np.std(np.log(factors[0])) < 0.015
    assert ice_for_game(ice, NO_EVOLUTION, 0, sweeping=False) == ice


@pytest.mark.parametrize(
    "changes", [{"wear": 0.5}, {"frost": -2}, {"stone_spread": -0.1}, {"pace": 0}]
)
def test_changes_that_no_ice_shows_are_refused(changes):
    with pytest.raises(InputError):
        IceEvolution(**changes)
