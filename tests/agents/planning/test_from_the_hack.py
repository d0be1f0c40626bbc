"""Plans from the hack, as Digital Curling throws."""

from __future__ import annotations

import numpy as np
import pytest

from agents import plan_throw
from agents.digital_curling import move_of, transition
from agents.planning import draw_plan
from curling_env.errors import InputError
from curling_env.ice import load_ice
from curling_env.physics import play_bounds, slide
from curling_env.sheet import HACK_Y, TEE_Y
from curling_env.throw import FROM_HACK, Release

FCV1 = load_ice("fcv1")


@pytest.mark.parametrize("target", [(0.9, 15.0), (-0.6, -18.0)])
def test_a_draw_from_the_hack_rests_at_its_target(target, tmp_path):
    found = plan_throw(FCV1, target, skill="digital-curling", delivery=FROM_HACK)
    throw, d = found.best.throw, int(found.direction)
    assert abs(throw.spin) == pytest.approx(FROM_HACK.spin)
    release = Release(
        x=0.0,
        y=-d * HACK_Y,
        vx=-d * throw.speed * np.sin(throw.angle),
        vy=d * throw.speed * np.cos(throw.angle),
        omega=throw.spin,
    )
    rest = slide(FCV1, release, bounds=play_bounds(FCV1, found.direction))
    assert np.hypot(rest.x - target[0], rest.y - target[1]) < 5e-3
    assert found.as_dict()["release_line_m"] == HACK_Y
    draw_plan(FCV1, found, tmp_path / "plan.png")
    assert (tmp_path / "plan.png").stat().st_size > 10_000


def test_a_plan_agrees_with_the_competitions_server():
    """The shot of a plan, played in the server's own steps, rests at the target."""
    found = plan_throw("fcv1", (0.3, TEE_Y + 0.2), skill="none", delivery="hack")
    move = move_of(found.best.throw)
    nothing = {"team0": [None] * 8, "team1": [None] * 8}
    state = {
        "end": 0,
        "shot": 0,
        "hammer": "team1",
        "stones": nothing,
        "scores": {"team0": [None], "team1": [None]},
    }
    shot = {
        "type": "shot",
        "velocity": {"x": move.velocity.x, "y": move.velocity.y},
        "rotation": move.rotation,
    }
    lying = transition(state, shot, {"max_end": 1})["stones"]["team0"][0]["position"]
    assert (lying["x"], lying["y"] - 38.405) == pytest.approx((0.3, 0.2), abs=0.012)


def test_a_takeout_from_the_hack_keeps_to_its_greatest_speed():
    found = plan_throw(
        FCV1,
        "takeout",
        (0.4, TEE_Y),
        skill="none",
        delivery=FROM_HACK,
        candidates=600,
    )
    assert found.best.throw.speed <= FROM_HACK.max_speed
    assert found.best.trials.success.all()
    # Six seconds and more before the hog line count for nothing in the call.
    seconds = found.best.description.hog_to_hog_s
    assert seconds is not None
    assert 5.0 < seconds < 14.0


def test_a_plan_can_be_thrown_by_the_command(curling):
    planned = curling(
        *("plan", "--ice", "fcv1", "--target", f"0.2,{TEE_Y}", "--skill", "none"),
        *("--delivery", "hack"),
    ).json()
    numbers = ("--speed", planned["speed"], "--angle", planned["angle"], "--spin", planned["spin"])
    thrown = curling("throw", "--ice", "fcv1", *numbers, "--delivery", "hack").json()
    assert (thrown["x"], thrown["y"]) == pytest.approx((0.2, TEE_Y), abs=5e-3)
    reported = planned["in_words"]["hog_to_hog_s"]
    assert thrown["hog_to_hog"] == pytest.approx(reported, abs=0.02)
    assert thrown["time"] > thrown["hog_to_hog"] + 10.0  # it began ten metres before the hog line
    short = curling("throw", "--ice", "fcv1", *numbers)
    assert short.json()["status"] != "rest"  # from the hog line it runs through


def test_a_draw_from_the_tee_line_comes_to_rest_where_it_is_meant(curling):
    planned = curling(
        *("plan", "--ice", "standard", "--target", f"0.2,{TEE_Y}", "--skill", "none"),
        *("--delivery", "tee-line"),
    ).json()
    numbers = ("--speed", planned["speed"], "--angle", planned["angle"], "--spin", planned["spin"])
    thrown = curling("throw", "--ice", "standard", *numbers, "--delivery", "tee-line").json()
    assert (thrown["x"], thrown["y"]) == pytest.approx((0.2, TEE_Y), abs=5e-3)


def test_an_unknown_line_of_release_is_refused(curling):
    target = ("--target", f"0,{TEE_Y}")
    assert (
        "hog-line, hack" in curling("plan", "--ice", "fcv1", *target, "--delivery", "x").complaint
    )
    with pytest.raises(InputError, match="hog-line, hack"):
        plan_throw("fcv1", (0, TEE_Y), delivery="tee")
