"""CurlingSheet-v0: the checks of Gymnasium and stable-baselines3, and what it promises."""

from __future__ import annotations

import sys
import warnings
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import curling_env  # noqa: F401  (registers the environments)
from curling_env.analysis import rest_spread
from curling_env.envs import RewardWeights, ThrowRange
from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice, load_ice, save_ice
from curling_env.physics import Aim, slide
from curling_env.sheet import HACK_Y, TEE_Y, Direction, to_delivery
from curling_env.throw import FROM_HACK, Throw

DRAW = Throw(speed=2.1, angle=-0.05, spin=1.0)
"""A throw that comes to rest close to the button of standard ice."""


def make(**options):
    return gymnasium.make("CurlingSheet-v0", details=True, **options).unwrapped


def throw(env, shot: Throw = DRAW):
    return env.step(env.action_of(shot))


# --- the checkers ---------------------------------------------------------------------------------

VARIANTS = [
    {},
    {"ice": "paper"},
    {"stones": 8},
    {"throws": 4, "stones": ((0.0, 0.0), (0.5, -3.0)), "direction": "home"},
    {"target": "random", "direction": "random", "throws": 2},
]


@pytest.mark.parametrize("options", VARIANTS)
def test_the_checkers_of_gymnasium_and_stable_baselines_find_nothing(options):
    from stable_baselines3.common.env_checker import check_env as check_for_training

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(render_mode="rgb_array", **options))
        check_for_training(make(**options))


@pytest.mark.parametrize("options", VARIANTS)
def test_the_same_seed_gives_the_same_episode(options):
    env = make(**options)
    stories = []
    for _ in range(2):
        env.action_space.seed(3)
        first, _ = env.reset(seed=11)
        steps = [env.step(env.action_space.sample())[:2] for _ in range(options.get("throws", 1))]
        stories.append([first, *[o for o, _ in steps], [r for _, r in steps]])
    for a, b in zip(*stories, strict=True):
        np.testing.assert_array_equal(a, b)


# --- actions --------------------------------------------------------------------------------------


def test_actions_and_throws_convert_both_ways():
    env = make()
    for action in np.random.default_rng(0).uniform(-1, 1, (20, 3)):
        np.testing.assert_allclose(env.action_of(env.throw_of(action)), action, atol=1e-6)
    fast = env.throw_range.speed[1]
    assert env.throw_of((5.0, 0.0, 0.0)).speed == pytest.approx(fast)
    assert env.action_of(Throw(speed=5.9)) == pytest.approx([1, 0, 0], abs=1e-6)


@pytest.mark.parametrize("action", [(0, 0), (0, 0, np.nan), (0, 0, 0, 0)])
def test_an_action_is_three_finite_numbers(action):
    env = make()
    env.reset(seed=0)
    with pytest.raises(InputError, match="three finite numbers"):
        env.step(np.array(action))


# --- the throw ------------------------------------------------------------------------------------


def test_a_step_throws_the_stone_and_reports_what_happened():
    env = make()
    env.reset(seed=0)
    observation, reward, over, cut, info = throw(env)
    assert over
    assert not cut
    alone = slide(load_ice("standard"), DRAW.release())
    stone = info["outcome"].delivered
    assert np.hypot(stone.x - alone.x, stone.y - alone.y) < 0.01  # float32 actions
    assert info["status"] == "rest"
    assert info["distance_m"] == pytest.approx(np.hypot(stone.x, stone.y - TEE_Y))
    assert info["throw"].speed == pytest.approx(DRAW.speed)
    assert info["trajectory"].xy[-1] == pytest.approx((stone.x, stone.y))
    assert info["reward_parts"]["in_house"] == 1
    assert reward == pytest.approx(env.weights.total(_parts(info)))
    assert env.observation_space.contains(observation)


def _parts(info):
    from curling_env.envs import RewardParts

    return RewardParts(**info["reward_parts"])


def test_nearer_is_better_and_out_is_worst():
    env = make()
    rewards = []
    for shot in (
        DRAW,
        replace(DRAW, speed=2.14),
        replace(DRAW, speed=1.95),
        replace(DRAW, speed=3),
    ):
        env.throw_range = ThrowRange(speed=(1.0, 4.0))
        env.reset(seed=0)
        rewards.append(throw(env, shot)[1])
    assert rewards == sorted(rewards, reverse=True)


def test_the_reward_follows_its_weights():
    env = make(weights=RewardWeights(distance=0, precision=0, in_house=7.0, out_of_play=0))
    env.reset(seed=0)
    assert throw(env)[1] == 7.0
    with pytest.raises(InputError, match="weight of distance"):
        RewardWeights(distance=float("inf"))


def test_stones_stay_for_the_throws_that_follow():
    env = make(throws=3, direction="home")
    first, _ = env.reset(seed=0)
    over = []
    for k in range(3):
        observation, _, done, _, info = throw(env, replace(DRAW, angle=DRAW.angle + 0.03 * (k - 1)))
        over.append(done)
        seen = dict(zip(env.observation.names, observation, strict=True))
        assert seen[f"stone {k + 1} team"] == 1
        assert seen["throws left"] == pytest.approx(1 - (k + 1) / 3)
    assert over == [False, False, True]
    assert len(info["outcome"].stones) == 3
    # The last stone in the observation is where it came to rest, in the delivery frame.
    stone = info["outcome"].delivered
    place = env.observation.scaled(to_delivery((stone.x, stone.y), Direction.HOME))
    np.testing.assert_allclose(observation[-2:], place, atol=1e-6)
    assert env.reset(seed=0)[0] == pytest.approx(first)


def test_ice_wears_from_throw_to_throw_and_is_new_after_reset():
    ice = load_ice("standard").with_effect(
        ActiveEffect(name="pebble_wear", parameters={"rate": -0.02})
    )
    env = make(ice=ice, throws=2)
    env.reset(seed=0)
    far = [throw(env, replace(DRAW, angle=a, speed=1.95))[4] for a in (0.03, -0.08)]
    y = [info["outcome"].delivered.y for info in far]
    assert y[1] > y[0] + 0.2
    env.reset(seed=0)
    again = throw(env, replace(DRAW, angle=0.03, speed=1.95))[4]
    assert again["outcome"].delivered.y == y[0]


def test_both_ends_look_the_same_on_even_ice():
    seen = []
    for direction in ("away", "home"):
        env = make(stones=((0.3, 0.4), (-0.5, -2.0)), target=(0.2, -0.3), direction=direction)
        start, _ = env.reset(seed=0)
        end, reward, *_ = throw(env)
        seen.append((start, end, reward))
    for a, b in zip(*seen, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)


def test_stones_are_hit():
    env = make(stones=((0.0, 0.0),))
    env.reset(seed=0)
    assert throw(env)[4]["outcome"].contacts


# --- true and known ice ---------------------------------------------------------------------------


def test_the_agent_observes_the_known_ice_and_throws_on_the_true_one(uneven_ice):
    true, believed = uneven_ice, load_ice("standard")
    env = make(ice=true, known_ice=believed)
    result, _ = env.reset(seed=0)
    np.testing.assert_array_equal(result, make(ice=believed).reset(seed=0)[0])
    stone = throw(env)[4]["outcome"].delivered
    alone = slide(true, DRAW.release())
    assert np.hypot(stone.x - alone.x, stone.y - alone.y) < 0.01


def test_the_range_of_actions_tells_nothing_of_the_true_ice():
    ranges = [make(ice=ice, known_ice="standard").throw_range for ice in ("fcv1", "standard")]
    assert ranges[0] == ranges[1] != make(ice="fcv1").throw_range


def test_ice_files_and_presets_serve(tmp_path, uneven_ice):
    save_ice(uneven_ice, tmp_path / "ice.json")
    a, b = make(ice=tmp_path / "ice.json"), make(ice=uneven_ice)
    a.reset(seed=0)
    b.reset(seed=0)
    assert throw(a)[1] == throw(b)[1]


# --- pictures -------------------------------------------------------------------------------------


def test_pictures_follow_the_game():
    env = make(render_mode="rgb_array", stones=2)
    env.reset(seed=0)
    before = env.render()
    assert before.shape == (720, 1280, 3)
    assert before.dtype == np.uint8
    throw(env)
    after = env.render()
    assert (before != after).any(axis=2).sum() > 1000
    frames = list(env.frames(speed=8.0))
    assert len(frames) > 60
    np.testing.assert_array_equal(frames[-1], after)


def test_a_window_shows_the_throw():
    env = make(render_mode="human")
    env.reset(seed=0)
    throw(env, replace(DRAW, speed=1.9))
    assert env.render() is None
    env.close()
    env.close()


def test_without_pygame_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    env = make(render_mode="human")
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'curling-sheet\[viewer\]'"):
        env.reset(seed=0)


# --- bad input ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"ice": "no such ice"}, "no such ice file"),
        ({"throws": 0}, "at least one throw"),
        ({"fps": 0}, "fps"),
        ({"target": "anywhere"}, "random"),
        ({"target": (5.0, 0.0)}, "within"),
        ({"target": (0.0, float("nan"))}, "within"),
        ({"direction": "up"}, "direction"),
        ({"stones": 200}, "no room"),
        ({"stones": ((0, 0), (0.1, 0))}, "one place"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, says):
    with pytest.raises(InputError, match=says):
        env = make(**options)
        env.reset(seed=0)
        throw(env)


def test_an_unknown_render_mode_is_refused():
    from curling_env.envs import CurlingSheetEnv

    with pytest.raises(InputError, match="render_mode"):
        CurlingSheetEnv(render_mode="ansi")


# --- ice that is not known exactly ----------------------------------------------------------------


def doubtful_ice() -> Ice:
    """Championship ice with standard errors of its map and of curl."""
    ice = load_ice("standard")
    curl = replace(ice.effect("curl"), sigma={"strength": 6e-4})
    friction = replace(ice.friction, sigma=0.02 * ice.friction.mu)
    return replace(ice.without_effect("curl").with_effect(curl), friction=friction)


def test_every_episode_may_have_an_ice_of_its_own():
    env = make(ice=doubtful_ice(), ice_sigma=True)
    first, _ = env.reset(seed=1)
    one = env.thrown_ice
    again, _ = env.reset()
    other = env.thrown_ice
    assert (one.friction.mu != other.friction.mu).any()
    assert one.effect("curl").parameters != other.effect("curl").parameters
    # What the agent knows stays the same.
    np.testing.assert_array_equal(first, again)
    env.reset(seed=1)
    np.testing.assert_array_equal(env.thrown_ice.friction.mu, one.friction.mu)
    assert env.thrown_ice.effects == one.effects


def test_rests_scatter_as_the_ice_allows():
    env = make(ice=doubtful_ice(), ice_sigma=True)
    env.reset(seed=0)
    rests = []
    for _ in range(300):
        env.reset()
        *_, info = throw(env)
        rests.append(info["trajectory"].xy[-1])
    spread = rest_spread(doubtful_ice(), DRAW.release())
    np.testing.assert_allclose(np.std(rests, axis=0), spread, rtol=0.15)


def test_the_ice_of_the_file_is_thrown_on_unless_asked_for():
    ice = doubtful_ice()
    env = make(ice=ice)
    env.reset(seed=1)
    assert env.thrown_ice is ice
    with pytest.raises(InputError, match="ice_sigma"):
        make(ice="standard", ice_sigma=True)


def test_throws_may_begin_at_the_hack():
    env = make(ice="fcv1", delivery="hack", direction="home")
    env.reset(seed=0)
    slow, fast = env.throw_range.speed
    assert fast <= 4.0
    draw = Aim(load_ice("fcv1"), Direction.HOME, delivery=FROM_HACK).draw(0.0, 0.0, 1.5)
    assert slow < draw.speed < fast
    *_, info = env.step(env.action_of(draw))
    assert info["trajectory"].xy[0] == pytest.approx([0.0, HACK_Y])
    assert info["distance_m"] < 0.05
    with pytest.raises(InputError, match="hog-line, hack"):
        make(delivery="tee")
