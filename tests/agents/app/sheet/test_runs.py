"""Throws as the page draws them, checked against the engine for single slides."""

from __future__ import annotations

import json

import pytest

from agents.app import RunForm, asked, run
from curling_env.errors import InputError
from curling_env.ice import load_ice
from curling_env.physics import slide
from curling_env.sheet import TEE_Y, Direction
from curling_env.throw import Throw

ICE = load_ice("standard")
DRAW = {"speed": 2.1, "angle": 0.035, "spin": -1.5}


def form(**changes):
    return asked({"ice": "standard", "throw": DRAW, **changes}, RunForm)


@pytest.mark.parametrize("to", ["away", "home"])
def test_a_lone_stone_runs_as_it_slides(to):
    result = run(ICE, form(to=to))
    direction = Direction.HOME if to == "home" else Direction.AWAY
    rest = slide(ICE, Throw(**DRAW).release(direction))
    assert result["rest"]["x"] == pytest.approx(rest.x, abs=1e-3)
    assert result["rest"]["y"] == pytest.approx(rest.y, abs=1e-3)
    assert result["time_s"] == pytest.approx(rest.time, abs=0.01)
    (path,) = result["paths"]
    assert path["stone"] is None
    assert [path["x"][-1], path["y"][-1]] == pytest.approx([rest.x, rest.y], abs=2e-3)
    assert "comes to rest" in result["ends"]
    # A stone that turns clockwise curls to the right: the broom is to the left.
    assert result["call"]["broom_m"] < 0
    assert result["call"]["right_hander"] == "in-turn"
    json.dumps(result, allow_nan=False)


def test_a_stone_in_the_way_is_moved():
    alone = run(ICE, form())["rest"]
    result = run(ICE, form(stones=[{**alone, "team": "away"}, {"x": 1.9, "y": 18.5}]))
    assert result["contacts"] >= 1
    assert {path["stone"] for path in result["paths"]} == {None, 0}
    assert result["stones"][0] != alone
    assert result["stones"][1] == {"x": 1.9, "y": 18.5}


@pytest.mark.parametrize(
    ("speed", "ends"), [(1.2, "stops before the hog line"), (3.0, "runs over the back line")]
)
def test_what_leaves_play_is_reported(speed, ends):
    result = run(ICE, form(throw={"speed": speed, "angle": 0.0, "spin": 0.0}))
    assert result["ends"] == ends
    assert not result["in_play"]


def test_a_stone_that_comes_to_rest_in_the_house_is_in_play():
    found = run(ICE, form(throw={"speed": 2.09, "angle": 0.0, "spin": 0.0}))
    assert found["in_play"]
    assert abs(found["rest"]["y"] - TEE_Y) < 2.0


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        ({"throw": {"speed": 9.0}}, "throw.speed"),
        ({"throw": {"speed": "fast"}}, "throw.speed"),
        ({"throw": {"speed": 2.0, "spun": 1}}, "spun"),
        ({"to": "there"}, "to"),
        ({"stones": [{"x": 0, "y": 17}] * 17}, "stones"),
        ({"stones": [{"x": float("nan"), "y": 17}]}, "stones"),
        ({"stones": [{"x": 0, "y": 17}, {"x": 0.1, "y": 17}]}, "overlaps stone 1"),
        ({"throw": {"speed": 0.0}}, "above 0"),
    ],
)
def test_what_cannot_be_is_one_line(wrong, complaint):
    with pytest.raises(InputError) as result:
        run(ICE, form(**wrong))
    assert complaint in str(result.value)
    assert "\n" not in str(result.value)
