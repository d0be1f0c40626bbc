"""The throw for a target, as the page tells it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from agents.app import PlanForm, asked, planned
from curling_env.errors import InputError
from curling_env.ice import load_ice
from curling_env.sheet import TEE_Y
from curling_env.throw import SKILLS

ICE, CLUB = load_ice("standard"), SKILLS["club"]
TARGET = {"x": 0.4, "y": TEE_Y - 0.3}


def plan(skill=CLUB, **wish):
    return planned(ICE, skill, asked({"ice": "x", "target": TARGET, **wish}, PlanForm))


def test_the_throw_rests_at_the_target():
    result = plan()
    rest = result["rest"]
    assert np.hypot(rest["x"] - TARGET["x"], rest["y"] - TARGET["y"]) < 0.01
    assert len(result["costs"]) == 4
    assert result["costs"][0]["words"].startswith("0.1 s heavier hog to hog:")
    json.dumps(result, allow_nan=False)


def test_the_miss_is_that_of_the_hand():
    club, elite = plan(), plan(SKILLS["elite"])
    assert club["miss"]["expected_m"] > 2 * elite["miss"]["expected_m"]
    assert club["miss"]["by_the_ice_m"] is None  # this ice is known exactly
    cloud = np.array(club["cloud"], dtype=float)
    missed = np.hypot(*(cloud - [TARGET["x"], TARGET["y"]]).T)
    assert np.nanmean(missed) == pytest.approx(club["miss"]["expected_m"], rel=0.25)
    # Half of the cloud lies within the ellipse.
    ellipse = club["ellipse"]
    turn = np.radians(ellipse["turn"])
    off = cloud - [ellipse["x"], ellipse["y"]]
    u = off @ [np.cos(turn), np.sin(turn)] / ellipse["rx"]
    v = off @ [-np.sin(turn), np.cos(turn)] / ellipse["ry"]
    assert 0.35 < np.mean(u**2 + v**2 < 1) < 0.65


@pytest.mark.parametrize(("handle", "sign"), [("clockwise", -1), ("counter-clockwise", 1)])
def test_a_handle_can_be_asked_for(handle, sign):
    assert plan(handle=handle)["throw"]["spin"] * sign > 0


def test_a_stone_is_hit():
    stones = [{**TARGET, "team": "away"}, {"x": -1.2, "y": TEE_Y, "team": "home"}]
    result = plan(hit=True, stones=stones)
    assert result["stones"][0] is None  # out of play
    assert result["stones"][1] is not None
    assert result["chance"] > 0.5
    assert result["miss"] is None


def test_a_target_under_a_stone_is_refused():
    lying = {"x": -0.0536576, "y": TEE_Y + 0.0361928}
    words = r"no stone can rest at the target: the stone at \(-0\.05, 17\.41\) m is in its place"
    with pytest.raises(InputError, match=words):
        plan(stones=[lying], target={"x": 0.0, "y": TEE_Y})
