"""Scripted sweepers."""

from __future__ import annotations

from dataclasses import replace

import pytest

from curling_env.game import sweep_for
from curling_env.ice import ActiveEffect, load_ice
from curling_env.sheet import Direction
from curling_env.throw import Throw

DRAW = Throw(speed=2.09, angle=-0.045, spin=1.5)


def test_sweepers_bring_a_light_stone_to_where_it_was_meant():
    ice = load_ice("standard").with_effect(ActiveEffect(name="sweeping"))
    light = replace(DRAW, speed=DRAW.speed - 0.05)
    sweep = sweep_for(ice, DRAW, light, Direction.AWAY)
    assert sweep[1] > sweep[0] > 0
    from curling_env.physics import slide

    def rest(throw, interval=(0.0, 0.0)):
        return slide(ice, throw.release(sweep=interval)).y

    assert rest(light) < rest(DRAW) - 1.0
    assert rest(light, sweep) == pytest.approx(rest(DRAW), abs=0.2)
    assert sweep_for(ice, DRAW, replace(DRAW, speed=DRAW.speed + 0.05), Direction.AWAY) == (0, 0)
