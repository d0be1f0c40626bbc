"""The intended throw reaches its call on the ice that was believed in."""

from __future__ import annotations

import numpy as np
import pytest

from agents.coaching import Place, intend, read_call
from curling_env.analysis import shoot
from curling_env.errors import InputError
from curling_env.ice import load_ice
from curling_env.sheet import TEE_Y, Direction
from curling_env.throw import Throw

ICE = load_ice("standard")


def meant(called, *, spin=-1.3, x=0.1, speed=2.6, direction=Direction.AWAY):
    found = intend(read_call(called), ICE, Place(direction=direction), spin=spin, x=x, speed=speed)
    speed, angle, spin, x = found.throw
    throw = Throw(speed=speed, angle=angle, spin=spin, x=x)
    return found, throw, shoot(ICE, throw, direction)


@pytest.mark.parametrize("direction", Direction)
@pytest.mark.parametrize("called", ["draw 0.6,-0.9 in", "guard", "draw back eight"])
def test_a_draw_rests_at_its_target(called, direction):
    _, throw, shot = meant(called, direction=direction)
    right, past = read_call(called).target
    assert (direction * shot.x, direction * shot.y - TEE_Y) == pytest.approx(
        (right, past), abs=0.01
    )
    assert (throw.x, throw.spin) == (0.1, -1.3)


def test_a_called_broom_is_the_line_and_the_weight_still_carries():
    _, throw, shot = meant("draw 0,-1 in broom 0.4 right")
    assert throw.x - 28.346 * np.tan(throw.angle) == pytest.approx(0.4, abs=1e-3)
    assert shot.y - TEE_Y == pytest.approx(-1.0, abs=0.01)


def test_a_called_time_is_the_weight_and_the_line_still_leads_there():
    _, _, shot = meant("draw button in 13.9 s")
    assert shot.hog_to_hog == pytest.approx(13.9, abs=0.02)
    assert shot.x == pytest.approx(0.0, abs=0.01)


def test_called_turns_are_the_rotation():
    _, throw, shot = meant("draw button 2.5 turns", spin=0.9)
    assert shot.turns == pytest.approx(2.5, abs=0.02)
    assert throw.spin > 0
    assert shot.from_tee_m < 0.02


def test_a_hit_runs_over_its_target_with_the_speed_that_is_usual():
    found, throw, _ = meant("hit 0.4,0.3 normal", speed=3.1)
    assert throw.speed == pytest.approx(3.1)
    assert found.outcome == pytest.approx([0.4, 0.3], abs=0.005)


def test_its_derivatives_by_uncalled_quantities_are_returned():
    found, _, _ = meant("draw button")
    other, _, _ = meant("draw button", spin=-1.4, x=0.15)
    foretold = found.throw + found.slopes @ [-0.1, 0.05]
    assert other.throw == pytest.approx(foretold, abs=2e-3)


def test_calls_that_no_throw_reaches():
    with pytest.raises(InputError, match="no throw"):
        meant("draw button 29.9 s")
    with pytest.raises(InputError, match="names no target"):
        meant("peel")
