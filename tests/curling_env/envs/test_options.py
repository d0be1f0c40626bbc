"""Options are plain data; a wrong one is reported in one line with the valid ones."""

from __future__ import annotations

import json
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

import curling_env
from curling_env.envs import CurlingSheetEnv, RewardWeights, ThrowRange
from curling_env.errors import InputError
from curling_env.game import TYPICAL_EVOLUTION, IceEvolution
from curling_env.ice import ice_document, load_ice
from curling_env.throw import FROM_HACK, Delivery, Skill

PLAIN = {
    "CurlingSheet-v0": {
        "ice": "standard",
        "ices": {"level": 0.02, "knows": "mean"},
        "skill": {"sigma_speed": 0.01, "sigma_angle": 0.002},
        "weights": {"distance": 2.0},
        "throw_range": {"speed": [1.8, 2.4]},
        "delivery": {"line_y": 10.5},
        "target": [0.5, -0.5],
        "stones": [[1.0, -2.0]],
    },
    "CurlingEnd-v0": {
        "ices": ["standard", "fcv1"],
        "skill": "club",
        "opponent_skill": {"sigma_angle": 0.01},
        "ice_evolution": {"frost": 0.02},
        "rules": {"name": "mixed_doubles_2024"},
        "weights": {"win": 1.0},
        "opponent": ["draw", "rulebased"],
    },
}


@pytest.mark.parametrize("name", PLAIN)
def test_a_specification_goes_through_json(name):
    env = gym.make(name, **PLAIN[name])
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    seen = [one.reset(seed=7)[0] for one in (env, again)]
    np.testing.assert_array_equal(*seen)
    steps = [one.step(np.float32([0.1, 0.2, 0.3])) for one in (env, again)]
    np.testing.assert_array_equal(steps[0][0], steps[1][0])
    many = gym.make_vec(name, num_envs=2, **json.loads(json.dumps(PLAIN[name])))
    np.testing.assert_allclose(many.reset(seed=7)[0][0], seen[0], atol=1e-6)


def test_plain_data_means_what_objects_mean():
    plain = gym.make("CurlingSheet-v0", **PLAIN["CurlingSheet-v0"]).unwrapped
    assert plain.weights == RewardWeights(distance=2.0)
    assert plain.throw_range == ThrowRange(speed=(1.8, 2.4))
    assert plain.delivery == Delivery(line_y=10.5)
    assert plain.skill == Skill(name="own", sigma_speed=0.01, sigma_angle=0.002)
    hit = gym.make("CurlingSheet-v0", task="takeout", weights={"success": 3.0}).unwrapped
    assert hit.weights == replace(hit.task.weights, success=3.0)
    end = gym.make("CurlingEnd-v0", **PLAIN["CurlingEnd-v0"]).unwrapped
    assert end.simulator.ice_evolution == IceEvolution(frost=0.02)
    assert (
        end.simulator.rules.name
        == gym.make("CurlingEnd-v0", rules="mixed_doubles_2024").unwrapped.simulator.rules.name
    )
    usual = gym.make("CurlingEnd-v0", ice_evolution="typical", delivery="hack").unwrapped
    assert usual.simulator.ice_evolution == TYPICAL_EVOLUTION
    assert usual.simulator.delivery == FROM_HACK
    document = json.loads(json.dumps(ice_document(load_ice("fcv1"))))
    assert gym.make("CurlingSheet-v0", ice=document).unwrapped.ice.sheet.width == 4.75


WRONG = {
    "CurlingSheet-v0": [
        (
            {"ice": 3},
            "expected an Ice, an ice file or one of club, fcv1, fitted, paper, standard",
        ),
        ({"task": 3}, "is not a task"),
        ({"throws": "2"}, "throws must be a whole number"),
        ({"throws": True}, "throws must be a whole number"),
        ({"weights": 3}, "weights must be a RewardWeights or a mapping of distance"),
        ({"weights": {"luck": 1}}, "weights has no 'luck'"),
        ({"throw_range": (1, 2)}, "throw_range must be a ThrowRange or a mapping of speed"),
        ({"throw_range": {"angle": [0, 0.1]}}, "lacks 'speed'"),
        ({"ices": 3}, "ices must be a list of ices"),
        ({"ices": []}, "got none"),
        ({"ices": {"levels": 0.1}}, "ices has no 'levels'"),
        ({"ices": {"knows": "everything"}}, "knows must be one of map"),
        ({"ices": {"pool": -1}}, "pool must be a whole number"),
        ({"ices": [("standard", "paper", "fcv1")]}, "an ice and what is known of it"),
        ({"ices": ["standard", "nowhere.json"]}, "no such ice file"),
        ({"ices": ["standard"], "ice_sigma": True}, "either ices or ice_sigma"),
        ({"skill": "god"}, "unknown skill 'god'"),
        ({"skill": 0.1}, "unknown skill '0.1'"),
        ({"skill": {"sigma": 0.1}}, "skill has no 'sigma'"),
        ({"delivery": ["hack"]}, "expected one of hog-line, hack"),
        ({"direction": ["away"]}, "direction must be"),
        ({"stones": True}, "stones must be a number or places"),
        ({"level": True}, "level must be"),
        ({"level": 1, "target": (0.0, 0.0)}, "level needs a random target or a number of stones"),
        ({"skill": {"sigma_speed": True}}, "sigma_speed of skill must be a number, got True"),
        ({"ices": {"level": False}}, "level of ices must be a number, got False"),
        ({"fps": "30"}, "fps must lie"),
        ({"ice_sigma": 1}, "ice_sigma must be True or False"),
        ({"render_mode": "ascii"}, "rgb_array_list"),
        ({"wind": 3}, "unknown option 'wind' of CurlingSheet-v0; expected one of ice, known_ice"),
    ],
    "CurlingEnd-v0": [
        ({"ice": 3}, "expected an Ice"),
        ({"opponent": 3}, "opponent must be a player's name"),
        ({"opponent": []}, "got none"),
        ({"opponent": ["draw", "absent"]}, "unknown player 'absent'"),
        ({"hammer": 1}, "hammer must be 'own' or 'opponent' or 'random'"),
        ({"rules": 3}, "unknown set of rules 3"),
        ({"rules": {"name": "mixed_doubles_2024", "stone": 5}}, "unknown rule 'stone'"),
        ({"ice_evolution": "usual"}, "ice_evolution must be one of none, typical"),
        ({"ice_evolution": 3}, "ice_evolution must be an IceEvolution or a mapping of wear"),
        ({"weights": [1]}, "weights must be a GameRewardWeights"),
        ({"weights": {"points": True}}, "points of weights must be a number, got True"),
        ({"potential": 3}, "potential must be a function of a game and a team"),
        ({"potential": "luck"}, "unknown potential 'luck'"),
        ({"observation": 3}, "observation must be"),
        ({"choices": None}, "choices must be"),
        ({"skill": ["elite", "club"]}, "expected one skill, or one for each of 4 players, got 2"),
        ({"opponent_skill": []}, "expected one skill, or one for each of 4 players, got 0"),
        ({"throws": 3}, "unknown option 'throws' of CurlingEnd-v0; expected one of ice, known_ice"),
    ],
}


@pytest.mark.parametrize(
    ("name", "options", "says"), [(name, *case) for name in WRONG for case in WRONG[name]]
)
def test_a_wrong_option_is_reported_with_the_valid_ones(name, options, says):
    for make in (gym.make, gym.make_vec):
        if options.get("render_mode") and make is gym.make_vec:
            continue
        with pytest.raises(InputError, match=says) as raised:
            make(name, **options)
        assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("name", "options", "says"),
    [
        ("CurlingSheet-v0", {"wind": 3}, "unknown option 'wind'; expected one of target, stones"),
        ("CurlingSheet-v0", [("ice", "paper")], "options of reset must be a mapping"),
        ("CurlingSheet-v0", {"ice": 3}, "expected an Ice"),
        ("CurlingEnd-v0", {"state": 3}, "state must be a GameState"),
        ("CurlingEnd-v0", {"hammer": "mine"}, "hammer must be"),
        ("CurlingEnd-v0", {"hammer": 0}, "hammer must be"),
        ("CurlingEnd-v0", {"power_play": "middle"}, "power_play must be 'left' or 'right'"),
        ("CurlingEnd-v0", {"ice": "nowhere"}, "no such ice file"),
    ],
)
def test_a_wrong_option_of_reset_is_reported_with_the_valid_ones(name, options, says):
    for env in (gym.make(name), gym.make_vec(name, num_envs=2)):
        with pytest.raises(InputError, match=says):
            env.unwrapped.reset(options=options)


def test_a_wrong_option_of_the_two_team_game_is_reported():
    pytest.importorskip("pettingzoo")
    for options, says in (
        ({"skill": ["club"]}, "one for both teams or a pair"),
        ({"skill": 0.1}, "unknown skill '0.1'"),
        (
            {"hammer": "own"},
            "unknown option 'hammer' of curling_v0; expected one of ice, known_ice",
        ),
        ({"ends": 2.5}, "ends must be a whole number"),
        ({"max_cycles": 0}, "max_cycles must be a whole number of at least 1"),
        ({"weights": 3}, "weights must be"),
    ):
        with pytest.raises(InputError, match=says):
            curling_env.curling_v0.env(**options)
    env = curling_env.curling_v0.raw_env(rules="mixed_doubles_2024")
    with pytest.raises(InputError, match="reset"):
        env.step(env.action_space("home").sample())
    with pytest.raises(InputError, match="power_play must be"):
        env.reset(options={"power_play": "middle"})
    with pytest.raises(InputError, match="state must be"):
        env.reset(options={"state": 3})


@pytest.mark.parametrize("name", ["CurlingSheet-v0", "CurlingEnd-v0"])
def test_steps_out_of_turn_are_refused(name):
    env = gym.make(name).unwrapped
    action = np.zeros(3, dtype=np.float32)
    with pytest.raises(InputError, match="reset"):
        env.step(action)
    env.reset(seed=0)
    over = False
    while not over:
        _, _, over, _, _ = env.step(action)
    with pytest.raises(InputError, match=r"is over; call reset\(\)"):
        env.step(action)
    env.reset()
    env.step(action)


@pytest.mark.parametrize("name", ["CurlingSheet-v0", "CurlingEnd-v0"])
def test_actions_are_numbers(name):
    env = gym.make(name).unwrapped
    env.reset(seed=0)
    for wrong in ("left", {"speed": 1.0}, None, [0.0, np.nan, 0.0]):
        with pytest.raises(InputError, match="an action must be"):
            env.step(wrong)


def test_a_subclass_may_have_more_options_and_rejects_unknown_ones():
    class Windy(CurlingSheetEnv):
        def __init__(self, *, wind: float = 0.0, **options):
            super().__init__(**options)
            self.wind = wind

    assert Windy(wind=2.0, throws=2).throws == 2
    with pytest.raises(
        TypeError, match="unknown option 'rain'.*unexpected keyword argument 'rain'"
    ):
        Windy(rain=1.0)


@pytest.mark.parametrize("name", ["CurlingSheet-v0", "CurlingEnd-v0"])
def test_seeds_are_whole_numbers_of_any_kind(name):
    env = gym.make(name, **({"stones": 2} if "Sheet" in name else {})).unwrapped
    np.testing.assert_array_equal(env.reset(seed=np.int64(4))[0], env.reset(seed=4)[0])
    for wrong in ("4", 4.0, -1, True):
        with pytest.raises(InputError, match="seed must be a whole number"):
            env.reset(seed=wrong)


def test_another_ice_holds_where_it_is_set_or_for_one_episode():
    env = gym.make("CurlingSheet-v0").unwrapped
    throw = np.float32([0.2, 0.3, 0.5])

    def miss(**asked):
        env.reset(seed=0, options=asked)
        return env.step(throw)[-1]["distance_m"]

    usual = miss()
    other = miss(ice="paper")
    assert abs(other - usual) > 0.1
    assert env.thrown_ice.stone.radius == load_ice("paper").stone.radius
    assert miss() == usual
    env.ice = "paper"
    assert miss() == other
    end = gym.make("CurlingEnd-v0", skill="none").unwrapped
    seen = [end.reset(seed=3, options=asked)[0] for asked in ({}, {"ice": "fcv1"}, {})]
    assert np.abs(seen[0] - seen[1]).max() > 0.1
    np.testing.assert_array_equal(seen[0], seen[2])


def test_drawn_ices_follow_from_the_seed_alone():
    env = gym.make("CurlingSheet-v0", ices="random", skill="club", details=True).unwrapped
    drawn, seen = [], []
    for seed in (1, 2, 1):
        seen.append(env.reset(seed=seed)[0])
        drawn.append(env.thrown_ice.friction.mu)
        seen[-1] = np.append(seen[-1], env.step(np.zeros(3))[-1]["throw"].speed)
    np.testing.assert_array_equal(drawn[0], drawn[2])
    np.testing.assert_array_equal(seen[0], seen[2])
    assert np.abs(drawn[0] / drawn[1] - 1).max() > 0.01
    # The observation holds the estimate, and the throw is not the intended one.
    assert env.known_ice.friction.mu.std() > 0
    assert not np.array_equal(env.known_ice.friction.mu, env.thrown_ice.friction.mu)
    assert seen[0][-1] != pytest.approx(env.throw_of(np.zeros(3)).speed)


def test_a_known_ice_is_observed_on_every_drawn_one(tmp_path):
    from curling_env.ice import save_ice

    for name in ("standard", "fcv1"):
        save_ice(load_ice(name), tmp_path / f"{name}.json")
    env = gym.make("CurlingSheet-v0", ices=tmp_path, known_ice="standard").unwrapped
    widths = set()
    for seed in range(8):
        seen, _ = env.reset(seed=seed)
        widths.add(env.thrown_ice.sheet.width)
        assert env.known_ice is env.ices.known_ice
    assert len(widths) == 2
    usual, _ = gym.make("CurlingSheet-v0").reset(seed=0)
    np.testing.assert_array_equal(seen, usual)
