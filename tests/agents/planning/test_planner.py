from __future__ import annotations

from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from matplotlib.image import imread

from agents import plan_throw
from agents.planning import (
    describe,
    draw_plan,
    find_throws,
    handles,
    roll_out,
    run_trials,
)
from curling_env.envs import ThrowRange
from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, FrictionMap, Ice, load_ice
from curling_env.physics import play_bounds, slide
from curling_env.physics.batch import releases_of
from curling_env.sheet import PAPER_SHEET, TEE_Y, Direction, to_delivery
from curling_env.throw import SKILLS, Skill, Throw
from curling_env.units import Units


def uneven(spread: float = 0.1, interpolation: str = "bilinear") -> Ice:
    """Championship ice with smooth heavy and keen areas."""
    ice = load_ice("standard")
    x, y = np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres)
    wave = np.sin(y / 3.0 + 1.0) * np.cos(1.3 * x - 0.4)
    friction = FrictionMap(
        mu=ice.friction.mu * (1 + spread * wave),
        sigma=np.zeros(wave.shape),
        observed=np.ones(wave.shape, dtype=bool),
        interpolation=interpolation,
    )
    return replace(ice, friction=friction)


@pytest.mark.parametrize("ice", ["standard", "fcv1", "paper", "bilinear", "cell", "slope"])
@pytest.mark.parametrize("target", [(0.0, TEE_Y), (1.1, 15.2), (-0.8, -18.4)])
def test_lands_within_5_mm_on_known_ice(ice: str, target: tuple[float, float]) -> None:
    if ice in ("bilinear", "cell"):
        known = uneven(interpolation=ice)
    elif ice == "slope":
        tilted = ActiveEffect(name="slope", parameters={"x": 4e-4, "y": -3e-4})
        known = load_ice("standard").with_effect(tilted)
    else:
        known = load_ice(ice)
    found = plan_throw(known, target, skill="none")
    # Judged by the ice itself, not by what the planner says.
    rest = slide(
        known, found.best.throw.release(found.direction), bounds=play_bounds(known, found.direction)
    )
    assert np.hypot(rest.x - target[0], rest.y - target[1]) < 5e-3
    assert found.best.expected_miss < 5e-3


def test_rollouts_are_slides() -> None:
    ice = uneven()
    throws = np.array([[2.1, -0.05, 1.0, 0.0], [1.4, -0.02, -1.3, 0.2]])
    for direction in Direction:
        many = roll_out(ice, throws, direction)
        for k, row in enumerate(throws):
            throw = Throw(speed=row[0], angle=row[1], spin=row[2], x=row[3])
            release = throw.release(direction)
            row = releases_of(throws, direction)[k]
            for name in ("x", "y", "vx", "vy", "omega"):
                assert row[name] == pytest.approx(getattr(release, name), abs=1e-12)
            alone = slide(ice, release)
            np.testing.assert_allclose(many.xy[k], [alone.x, alone.y], atol=1e-3)


def test_both_handles_are_found() -> None:
    throws = find_throws(load_ice("standard"), np.array([0.3, TEE_Y]))
    assert (throws[:, 2] > 0).any()
    assert (throws[:, 2] < 0).any()


def test_a_counter_clockwise_stone_is_aimed_to_the_right_of_its_target() -> None:
    found = plan_throw(load_ice("standard"), (0.0, TEE_Y), spins=[1.0], skill="none")
    description = found.best.description
    assert description.broom_m > 0.5  # it curls left, so the broom is on the right
    assert description.ice_m == pytest.approx(description.broom_m)
    assert (description.right_hander, description.left_hander) == ("out-turn", "in-turn")
    assert 12.5 < description.hog_to_hog_s < 15  # draws on keen ice, physics.md's 13.0-14.5 s
    assert handles(-1.0) == ("in-turn", "out-turn")


def test_half_a_turn_of_the_sheet_changes_nothing() -> None:
    ice = load_ice("standard")
    away = plan_throw(ice, (0.7, 16.5), skill="club")
    home = plan_throw(ice, (-0.7, -16.5), skill="club")
    assert home.best.throw.speed == pytest.approx(away.best.throw.speed, abs=1e-6)
    assert home.best.throw.angle == pytest.approx(away.best.throw.angle, abs=1e-6)
    assert home.best.expected_miss == pytest.approx(away.best.expected_miss, abs=1e-4)


def test_expected_miss_follows_skill_and_map() -> None:
    ice = load_ice("standard")
    misses = [
        plan_throw(ice, (0, TEE_Y), skill=s).best.expected_miss for s in ("none", "elite", "club")
    ]
    assert misses[0] < 1e-3
    # Along the sheet a draw gains 0.30 m for 0.01 m/s (physics.md, effect sizes).
    along = 0.0076 * 30.0
    assert 0.7 * along < misses[1] < 1.2 * along
    assert misses[2] > 2.5 * misses[1]
    doubtful = replace(ice, friction=replace(ice.friction, sigma=0.03 * ice.friction.mu))
    uncertain = plan_throw(doubtful, (0, TEE_Y), skill="none")
    assert uncertain.map_is_uncertain
    assert uncertain.best.expected_miss > 0.05
    assert uncertain.best.miss_without_error < 5e-3


def test_the_expected_miss_is_that_of_hand_and_effects_together() -> None:
    # On flat ice without curl a hand that errs in weight alone, and a fall of the ice along the
    # sheet that is not known, both move a draw along one line: their variances add.
    ice = load_ice("paper").with_effect(ActiveEffect(name="slope", parameters={"y": 0.0}))
    hand = Skill(name="weight only", sigma_speed=0.004)
    sure = plan_throw(ice, (0, TEE_Y), spins=[0.0], skill=hand)
    assert not sure.ice_is_uncertain
    alone = sure.best.expected_miss

    def rest(fall: float) -> float:
        tilted = ActiveEffect(name="slope", parameters={"y": fall})
        return slide(replace(ice, effects=(tilted,)), sure.best.throw.release()).y

    for times in (0.5, 1.0, 2.0):
        # The mean distance of a Gaussian is sqrt(2/pi) of its standard deviation.
        sigma = times * alone / np.sqrt(2 / np.pi) / ((rest(1e-6) - rest(-1e-6)) / 2e-6)
        unsure = ActiveEffect(name="slope", parameters={"y": 0.0}, sigma={"y": sigma})
        found = plan_throw(replace(ice, effects=(unsure,)), (0, TEE_Y), spins=[0.0], skill=hand)
        assert found.ice_is_uncertain
        assert not found.map_is_uncertain
        assert found.best.expected_miss == pytest.approx(np.hypot(1.0, times) * alone, rel=0.06)
        assert found.best.player_trials.expected_miss == pytest.approx(alone)
        assert found.best.ice_trials.expected_miss == pytest.approx(times * alone, rel=0.06)
        assert found.best.map_trials.expected_miss < 5e-3


def test_a_plan_reports_effects_that_were_not_measured() -> None:
    ice = load_ice("standard")
    believed = tuple(
        replace(e, believed=("strength",) if e.name == "curl" else ()) for e in ice.effects
    )
    broom = ActiveEffect(
        name="sweeping", parameters={"friction_factor": 0.9}, believed=("friction_factor",)
    )
    guessed = replace(ice, effects=(*believed, broom))
    found = plan_throw(guessed, (0, TEE_Y), skill="none").as_dict()
    # This plan has no sweeping, so its effect does not matter.
    assert found["sweep"] is None
    assert found["believed"] == {"curl": ["strength"]}
    assert found["remarks"] == [
        "curl is assumed, not measured: throw with both handles to measure it"
    ]
    known = plan_throw(ice, (0, TEE_Y), skill="none").as_dict()
    assert known["believed"] == {}
    assert known["remarks"] == []


def test_a_plan_reports_an_effect_that_the_ice_lacks() -> None:
    ice = load_ice("paper")
    seen = np.arange(ice.friction.mu.size).reshape(ice.friction.mu.shape) % 2 == 0
    estimated = replace(ice, friction=replace(ice.friction, observed=seen))
    (bare,) = plan_throw(estimated, (0, TEE_Y), skill="none").remarks
    assert "no stone curls" in bare
    assert "curling estimate" in bare
    marked = estimated.with_effect(ActiveEffect(name="unknown"))
    assert len(plan_throw(marked, (0, TEE_Y), skill="none").remarks) == 2
    curls = estimated.with_effect(load_ice("standard").effect("curl"))
    assert plan_throw(curls, (0, TEE_Y), skill="none").remarks == []
    assert plan_throw(ice, (0, TEE_Y), skill="none").remarks == []


def test_goes_round_a_guard() -> None:
    ice = load_ice("standard")
    guard = np.array([[0.2, 14.2]])
    found = plan_throw(ice, (0.0, TEE_Y), stones=guard, skill="elite")
    path = slide(ice, found.best.throw.release(), fps=50).trajectory
    assert np.hypot(*(path.xy - guard).T).min() > 2 * ice.stone.radius
    assert found.best.trials.expected_miss < 0.5
    # The handle whose path comes down the guarded side is not taken.
    free = plan_throw(ice, (0.0, TEE_Y), spins=[found.best.throw.spin], skill="none")
    assert free.best.throw.angle == pytest.approx(found.best.throw.angle, abs=1e-4)


def test_the_same_seed_gives_the_same_plan() -> None:
    ice = uneven()
    first = plan_throw(ice, (0.4, 16.9), skill="club", seed=3).as_dict()
    assert first == plan_throw(ice, (0.4, 16.9), skill="club", seed=3).as_dict()


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ((0.0, 30.0), "off the ice"),
        ((2.2, 17.0), "side line"),
        ((0.0, 20.5), "past the back line"),
        ((np.nan, 17.0), "finite"),
    ],
)
def test_refuses_targets_no_stone_can_rest_at(target: tuple[float, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        plan_throw(load_ice("standard"), target)


def test_a_blocked_path_is_reported() -> None:
    ice = load_ice("paper")  # nothing curls: the guard is in the way of every throw
    with pytest.raises(InputError, match=r"blocked.*\(0, 14\)"):
        plan_throw(ice, (0.0, TEE_Y), stones=[[0.0, 14.0]], skill="none")
    with pytest.raises(InputError, match="is in its place"):
        plan_throw(ice, (0.0, TEE_Y), stones=[[0.1, TEE_Y]], skill="none")


def test_a_target_out_of_reach_is_reported() -> None:
    with pytest.raises(InputError, match="out of reach: at 6 m/s"):
        plan_throw(Ice.uniform(0.5), (0.0, TEE_Y))


# --- tasks --------------------------------------------------------------------------------------

STONE = (0.3, 17.6)


@pytest.mark.parametrize(
    ("task", "least"),
    [("draw", 0.95), ("guard", 0.95), ("takeout", 0.95), ("hit_and_stay", 0.9), ("peel", 0.9),
     ("freeze", 0.45)],
)  # fmt: skip
def test_tasks_are_done_as_the_environment_judges_them(task: str, least: float) -> None:
    ice = load_ice("standard")
    target = STONE if task not in ("draw", "guard") else None
    found = plan_throw(ice, task, target, skill="elite")
    assert found.as_dict()["chance_of_success"] > least
    # Thrown again in the environment, with other errors of the same hand.
    env = gymnasium.make("CurlingSheet-v0", ice=ice, task=task, direction="away",
                         throw_range=ThrowRange(speed=(1.0, 6.0)))  # fmt: skip
    mark = to_delivery(np.array(target if target else (0.0, TEE_Y)), Direction.AWAY)
    options = {} if task == "guard" else {"target": tuple(mark.tolist())}
    thrown, rewards = found.best.throw, []
    for speed, angle, spin in SKILLS["elite"].errors(40, np.random.default_rng(5)):
        env.reset(seed=1, options=options)
        made = Throw(
            speed=thrown.speed + speed, angle=thrown.angle + angle, spin=thrown.spin + spin
        )
        _, reward, _, _, info = env.step(env.unwrapped.action_of(made))
        rewards.append((reward, info["success"]))
    mean_reward, success = np.mean(rewards, axis=0)
    spread = float(np.std([reward for reward, _ in rewards])) / np.sqrt(40)
    assert mean_reward == pytest.approx(found.best.trials.expected_value, abs=4 * max(spread, 0.01))
    assert success > least - 0.25


def test_no_throw_of_a_dense_independent_search_is_more_valuable() -> None:
    ice = load_ice("standard")
    stones = np.array([STONE, (0.1, 14.3)])
    found = plan_throw(ice, "takeout", STONE, stones=stones, skill="champion")
    rng = np.random.default_rng(3)
    tried = np.zeros((3000, 6))
    tried[:, 0] = rng.uniform(2.0, 4.2, 3000)
    tried[:, 1] = rng.uniform(-0.09, 0.09, 3000)
    tried[:, 2] = rng.choice([-1.6, -1.0, 1.0, 1.6], 3000)
    skill = SKILLS["champion"]
    rough = [
        s.expected_value for s in run_trials([ice], tried, found.objective, skill, n=16, seed=1)
    ]
    best = tried[np.argsort(rough)[-30:]]
    fine = [
        s.expected_value for s in run_trials([ice], best, found.objective, skill, n=512, seed=2)
    ]
    assert found.best.trials.expected_value > max(fine) - 0.03


def test_the_forgiving_throw_is_preferred() -> None:
    # A gap just wide enough: without error both ways are perfect, with error the wide one is.
    ice = load_ice("paper")
    stones = np.array([(0.33, 14.5), (-0.33, 14.5), (0.0, TEE_Y)])
    exact = plan_throw(ice, "takeout", (0.0, TEE_Y), stones=stones, skill="none", spins=[1.0])
    club = plan_throw(ice, "takeout", (0.0, TEE_Y), stones=stones, skill="club", spins=[1.0])
    assert exact.best.trials.success.all()
    tried = run_trials(
        [ice],
        np.array([[exact.best.throw.speed, exact.best.throw.angle, 1.0, 0.0, 0.0, 0.0]]),
        club.objective, SKILLS["club"], n=1024, seed=4,
    )  # fmt: skip
    assert club.best.trials.expected_value > tried[0].expected_value - 0.02


def test_score_draws_past_a_guard_or_takes_out_whichever_is_more_valuable() -> None:
    ice = load_ice("standard")
    empty = plan_throw(ice, "score", skill="elite")
    assert empty.best.trials.expected_value == pytest.approx(1.0, abs=0.01)
    stones, own = [(0.0, TEE_Y + 0.1), (-1.2, 17.0)], [False, True]
    found = plan_throw(ice, "score", stones=stones, own=own, skill="elite")
    assert found.best.trials.expected_value > 1.3  # the other stone goes, both own ones count


def test_sweeping_is_planned_where_the_ice_knows_it() -> None:
    # Such a throw is too hard by hand: only swept stones reach the tee.
    ice = load_ice("standard").with_effect(
        ActiveEffect(name="sweeping", parameters={"friction_factor": 0.9, "curl_factor": 0.3})
    )
    stones = [(0.45, 15.0), (-0.45, 15.0)]
    found = plan_throw(ice, "draw", stones=stones, skill="elite")
    plain = plan_throw(load_ice("standard"), "draw", stones=stones, skill="elite")
    assert plain.as_dict()["sweep"] is None
    assert found.best.sweep is not None  # the straighter way through the port
    assert found.best.trials.expected_value > plain.best.trials.expected_value
    assert plan_throw(ice, (0.0, TEE_Y), skill="elite").best.sweep is None  # no reason to


def test_hand_and_map_are_separated() -> None:
    ice = load_ice("standard")
    doubtful = replace(ice, friction=replace(ice.friction, sigma=0.02 * ice.friction.mu))
    found = plan_throw(doubtful, (0, TEE_Y), skill="elite").as_dict()
    both, hand, chart = (
        found[name]["sigma_along_m"]
        for name in ("spread", "spread_of_the_hand", "spread_of_the_map")
    )
    assert both == pytest.approx(np.hypot(hand, chart), rel=0.2)
    assert hand > 0.1
    assert chart > 0.1


def test_the_second_choice_is_another_shot() -> None:
    ice = load_ice("standard")
    stones = [(0.3, 17.6), (0.1, 14.2)]
    for found in (
        plan_throw(ice, "takeout", STONE, stones=stones, skill="club"),
        plan_throw(ice, (0.0, TEE_Y), skill="club"),
    ):
        best, second = found.best.throw, found.second.throw
        assert best.spin * second.spin < 0 or abs(second.speed / best.speed - 1) > 0.1
        value = found.second.trials.expected_value
        assert value <= found.best.trials.expected_value + 0.05 * abs(value)


def test_the_meaning_of_a_miss_is_stated() -> None:
    ice = load_ice("standard")
    draw = plan_throw(ice, (0.0, TEE_Y), skill="club")
    assert "from the target to the stone's place of rest" in draw.expectation(draw.best)
    assert " in (" in draw.expectation(draw.best, Units.FEET)
    hit = plan_throw(ice, "takeout", STONE, skill="club")
    expected = hit.expectation(hit.best)
    assert "succeed (the struck stone is out of play)" in expected
    assert "miss" not in expected
    assert hit.as_dict()["miss_means"] is None
    exact = plan_throw(ice, (0.0, TEE_Y), skill="none")
    assert exact.expectation(exact.best) == ""


def test_points_need_the_teams_of_the_stones() -> None:
    with pytest.raises(InputError, match="team"):
        plan_throw(load_ice("standard"), "score", stones=[(0.0, TEE_Y)])


def test_a_call_in_feet() -> None:
    words = describe(load_ice("standard"), Throw(speed=2.1, angle=-0.05, spin=1.0),
                     np.array([0.0, TEE_Y]), Direction.AWAY)  # fmt: skip
    assert "m of ice" in words.call
    assert words.as_dict()["call"] == words.call
    reported = words.call_in(Units.FEET)
    assert f"{int(words.ice_m / 0.3048)} ft" in reported
    assert " m of ice" not in reported


def test_the_picture_shows_the_team_of_each_stone(tmp_path) -> None:
    """Own stones are red, the opponents' yellow, and neither without teams."""
    ice, stones = load_ice("standard"), [(-0.9, 16.6), (0.9, 17.6)]
    red, yellow = np.array([200, 67, 63]), np.array([242, 194, 48])
    seen = []
    for own in ([True, False], [False, False], None):
        found = plan_throw(ice, (0.0, TEE_Y), stones=stones, own=own, skill="none")
        draw_plan(ice, found, tmp_path / "plan.png")
        picture = imread(tmp_path / "plan.png")[..., :3] * 255
        seen.append([int((np.abs(picture - c).max(axis=2) < 3).sum()) for c in (red, yellow)])
    both, theirs, without = seen
    assert both[0] > theirs[0] + 100
    assert theirs[1] > both[1] + 100
    assert without[1] == 0


def test_a_target_mid_sheet_is_questioned():
    remarks = plan_throw("standard", (0.0, 0.0), skill="none").remarks
    assert "is mid-sheet, where no stone stays" in remarks[0]
    assert "the away tee is at (0, 17.3735)" in remarks[0]
    assert not any(
        "mid-sheet" in one for one in plan_throw("standard", (0, TEE_Y), skill="none").remarks
    )


@pytest.mark.parametrize(
    ("wanted", "says"),
    [
        ((3, (0, TEE_Y)), "expected an Ice"),
        (("standard", None), "target must be"),
        (("standard", (0, 1, 2)), r"target must be \(x, y\)"),
        (("standard", "wiggle"), "unknown task 'wiggle'"),
        (("standard", "takeout", {"mark": "here"}), r"mark must be \(x, y\)"),
        (("standard", (0, TEE_Y), {"stones": 3}), "stones must be places"),
        (("standard", (0, TEE_Y), {"skill": 3}), "unknown skill"),
        (("standard", (0, TEE_Y), {"delivery": 3}), "unknown delivery"),
        (("standard", (0, TEE_Y), {"seed": -1}), "seed must be a whole number"),
        (("standard", (0, TEE_Y), {"own": [True]}), "own must have True or False for each of 0"),
        (
            ("standard", (0, TEE_Y), {"wind": 1}),
            "unknown option 'wind' of plan_throw; expected one of ice, ",
        ),
    ],
)
def test_impossible_requests_are_refused_with_the_valid_ones(wanted, says):
    *given, options = (*wanted, {}) if len(wanted) == 2 else wanted
    with pytest.raises(InputError, match=says):
        plan_throw(*given, **options)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"spins": "both"}, "spins must be numbers"),
        ({"spins": []}, "no spin to try"),
        ({"x": "left"}, "x must lie above"),
        ({"delivery": "hog"}, "unknown delivery"),
        ({"candidates": 0}, "candidates must be a whole number"),
        ({"seed": 1.5}, "seed must be a whole number"),
        ({"wind": 1}, "unknown option 'wind' of plan_throw; expected one of ice, target, mark"),
    ],
)
def test_a_wrong_option_of_a_task_is_refused_with_the_valid_ones(options, says):
    with pytest.raises(InputError, match=says):
        plan_throw("standard", "draw", **options)
