"""Throws that draw to a place or run over it."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.ice import load_ice
from curling_env.physics.one_stone.aim import Aim
from curling_env.sheet import Direction


@pytest.mark.parametrize("direction", Direction)
@pytest.mark.parametrize("spin", [1.5, -1.5, 0.4])
@pytest.mark.parametrize("ice", ["standard", "fcv1", "paper"])
def test_aim_draws_to_a_millimetre_and_runs_over_what_it_aims_at(ice, spin, direction):
    aim = Aim(load_ice(ice), direction)
    for x, y in ((0.0, 0.0), (1.2, -3.0), (-0.9, 1.0)):
        throw = aim.draw(x, y, spin)
        assert throw is not None
        assert aim.rest(throw) == pytest.approx((x, y), abs=1.1e-3)
    hit = aim.through(0.7, -0.5, 1.3 * throw.speed, spin)
    assert hit is not None
    in_the_way = np.array([[0.7, -0.5]])
    assert not aim.path_clears(hit, in_the_way, until=2.0)
    assert aim.path_clears(hit, in_the_way + np.array([0.5, 0.0]), until=2.0)
