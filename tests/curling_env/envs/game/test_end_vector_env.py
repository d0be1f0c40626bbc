"""Many ends at once are played as single ends are."""

from __future__ import annotations

import pickle

import gymnasium as gym
import numpy as np
import pytest

import curling_env  # noqa: F401  (registers the environments)
from curling_env.envs import CurlingEndVectorEnv
from curling_env.errors import InputError
from curling_env.game import TYPICAL_EVOLUTION, Call, IceEvolution
from curling_env.ice import ActiveEffect, load_ice
from curling_env.physics import Aim
from curling_env.sheet import Direction


def make(n, **settings):
    return gym.make_vec(
        "CurlingEnd-v0",
        num_envs=n,
        vectorization_mode="vector_entry_point",
        **{"details": True, **settings},
    )


SWEPT = {"sweeping": "scripted", "skill": "club"}


def biased(factors):
    """Standard ice on which some stones, by identifier, have their own friction."""
    ice = load_ice("standard")
    for stone, factor in factors.items():
        parameters = {"stone": float(stone), "factor": factor}
        ice = ice.with_effect(ActiveEffect(name="stone_bias", parameters=parameters))
    return ice


SETTINGS = {
    "still": {},
    "rulebased": {"opponent": "rulebased", "hammer": "own"},
    "frost": {"ice_evolution": IceEvolution(frost=0.3)},
    "swept": SWEPT,
    "sweeping as action": {"sweeping": "action"},
    "biased stones": {"ice": biased({2: 1.1, 9: 0.9})},
    "mixed doubles": {"rules": "mixed_doubles_2024", "opponent": "rulebased"},
    "two players": {"rules": "mixed_doubles_2024", "skill": ("club", "none")},
    "choices as action": {"choices": "action"},
    "from the hack": {"delivery": "hack", "ice": "fcv1", "rules": "digital_curling"},
    "ice_evolution": {"ice_evolution": TYPICAL_EVOLUTION, **SWEPT},
}


@pytest.mark.parametrize("name", SETTINGS)
def test_each_is_the_end_that_is_played_alone(name):
    """Each delivery begins from the same position: collisions multiply small differences."""
    settings, n = SETTINGS[name], 5
    many, alone = make(n, **settings), gym.make("CurlingEnd-v0", details=True, **settings).unwrapped
    seen, _ = many.reset(seed=20)
    for k in range(n):
        assert np.allclose(alone.reset(seed=20 + k)[0], seen[k], atol=2e-3)
    rng = np.random.default_rng(0)
    spread = np.float32([0.5, 0.4, 1.0, 1.0, 1.0, 1.0, 1.0])[: many.single_action_space.shape[0]]
    same, struck, longest = [], 0, 0
    while True:
        before = many.unwrapped.states
        actions = (rng.uniform(-1, 1, (n, len(spread))) * spread).astype(np.float32)
        seen, rewards, over, _, _ = many.step(actions)
        for k in range(n):
            alone.state = before[k]
            one, reward, ended, _, info = alone.step(actions[k])
            struck += any(shot.outcome.contacts for shot in info["shots"])
            same.append(np.allclose(one, seen[k], atol=2e-3) and ended == over[k])
            if same[-1]:
                assert reward == rewards[k]
                after, other = many.unwrapped.states[k], alone.state
                assert (after.throws, after.clock) == (other.throws, other.clock)
                if after.wear is not None:
                    assert np.array_equal(after.wear, other.wear)
        longest += 1
        if over.any():
            break
    assert longest >= 5
    assert struck > 5
    assert np.mean(same) >= (1.0 if name == "living" else 0.95)


def test_stones_with_a_friction_of_their_own_run_accordingly():
    heavy = biased(dict.fromkeys(range(8), 1.3))
    ends = []
    for ice in (load_ice("standard"), heavy):
        many = make(
            2, ice=ice, skill="none", hammer="opponent", opponent="draw", known_ice="standard"
        )
        many.reset(seed=0)
        draw = Aim(load_ice("standard"), Direction.AWAY).draw(1.3, -0.5, 1.5)
        many.step(np.tile(many.unwrapped.action_of(Call(throw=draw)), (2, 1)))
        ends.append(many.unwrapped.states[0].game.end.stones)
    assert {s.team.label for s in ends[1]} == {"away"}  # the home team's stones stop short
    assert {s.team.label for s in ends[0]} == {"home", "away"}


def test_an_end_that_is_over_begins_again():
    many = make(3, hammer="opponent", skill="none")
    first, _ = many.reset(seed=1)
    for _ in range(8):
        _, rewards, over, _, info = many.step(np.zeros((3, 3), dtype=np.float32))
    assert over.all()
    assert (info["reward_parts"]["points"] == rewards).all()
    assert [own - theirs for own, theirs in info["score"]] == rewards.tolist()
    again, rewards, over, _, _ = many.step(np.zeros((3, 3), dtype=np.float32))
    assert np.array_equal(first, again)
    assert not rewards.any()
    assert not over.any()


MODES = ("NextStep", "SameStep", "Disabled")


@pytest.mark.parametrize("mode", MODES)
def test_observations_equal_those_of_single_ends(mode):
    """Names, masks, types and shapes, step for step; and numbers, where stones have not met."""
    n, settings = 3, {"hammer": "random", "skill": "none", "opponent": "draw"}
    many = make(n, autoreset_mode=mode, **settings)
    assert many.metadata["autoreset_mode"].value == mode
    sync = gym.make_vec(
        "CurlingEnd-v0",
        num_envs=n,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        details=True,
        **settings,
    )
    stories = [envs.reset(seed=(4, 5, 6)) for envs in (many, sync)]
    assert_same(*stories[0], *stories[1])
    # Guards to the side, which the opponent's draws do not meet.
    actions = np.float32([[-0.9, 0.02, 1.0]] * n)
    over = 0
    for _ in range(10):
        steps = [envs.step(actions) for envs in (many, sync)]
        for a, b in zip(steps[0][1:4], steps[1][1:4], strict=True):
            assert a.dtype == b.dtype
            assert a.tolist() == b.tolist()
        assert_same(steps[0][0], steps[0][4], steps[1][0], steps[1][4])
        over += steps[0][2].sum()
        if mode == "Disabled" and steps[0][2].any():
            break
    assert over == n


def assert_same(seen, info, other_seen, other_info):
    assert seen.dtype == other_seen.dtype
    assert seen.shape == other_seen.shape
    assert_same_info(info, other_info)


def assert_same_info(many, single):
    assert many.keys() == single.keys()
    for name, value in many.items():
        if isinstance(value, dict):
            assert_same_info(value, single[name])
            continue
        assert value.dtype == single[name].dtype, name
        assert value.shape == single[name].shape
        if name == "shots":
            for ours, theirs in zip(value, single[name], strict=True):
                assert_same_shots(ours, theirs)
        elif name == "final_obs":
            assert [x is None for x in value] == [x is None for x in single[name]]
        else:
            assert value.tolist() == single[name].tolist()


def assert_same_shots(ours, theirs):
    if ours is None or theirs is None:
        assert ours is theirs
        return
    assert len(ours) == len(theirs)
    for a, b in zip(ours, theirs, strict=True):
        assert (a.end, a.number, a.team, a.stone, a.call) == (
            b.end,
            b.number,
            b.team,
            b.stone,
            b.call,
        )
        assert a.thrown == b.thrown
        assert a.direction is b.direction
        assert a.put_back == b.put_back
        if not b.outcome.contacts:
            assert a.outcome.status == b.outcome.status
            assert [s.stone for s in a.outcome.stones] == [s.stone for s in b.outcome.stones]
            assert a.outcome.delivered.x == pytest.approx(b.outcome.delivered.x, abs=2e-3)
            assert a.outcome.delivered.y == pytest.approx(b.outcome.delivered.y, abs=2e-3)
            assert a.outcome.time == pytest.approx(b.outcome.time, abs=1e-2)
            assert a.outcome.ends[:-1] == b.outcome.ends[:-1]


def test_only_the_masked_begin_anew_and_states_are_gone_on_from():
    many = make(3, autoreset_mode="Disabled", hammer="opponent")
    begun, _ = many.reset(seed=[1, None, 3])
    actions = np.zeros((3, 3), dtype=np.float32)
    after, *_ = many.step(actions)
    kept = many.unwrapped.states
    mask = np.array([True, False, False])
    seen, info = many.reset(seed=1, options={"reset_mask": mask, "hammer": "own"})
    assert np.array_equal(seen[1:], after[1:])
    assert not np.array_equal(seen[0], begun[0])
    assert info["_shots"].tolist() == mask.tolist()
    assert len(info["shots"][0]) == 1
    seen, info = many.reset(options={"state": kept})
    assert np.array_equal(seen, after)
    assert info["shots"].tolist() == [(), (), ()]
    seen, _ = many.reset(options={"state": kept[2]})
    assert np.array_equal(seen, np.stack([after[2]] * 3))
    with pytest.raises(InputError, match="a state for each of 3"):
        many.reset(options={"state": kept[:2]})
    with pytest.raises(InputError, match="state must be a GameState"):
        many.reset(options={"state": 3})


def test_ices_and_opponents_of_each_end_are_those_of_single_ends():
    settings = {
        "ices": ["standard", "fcv1"],
        "opponent": ["draw", "rulebased", lambda seen: np.zeros(3)],
        "hammer": "opponent",
    }
    many, alone = make(6, **settings), gym.make("CurlingEnd-v0", details=True, **settings).unwrapped
    seen, _ = many.reset(seed=0)
    actions = np.tile(np.float32([-0.6, 0.3, 1.0]), (6, 1))
    after, *_ = many.step(actions)
    names = set()
    for k in range(6):
        first, _ = alone.reset(seed=k)
        np.testing.assert_allclose(first, seen[k], atol=1e-6)
        names.add(alone.opponent.name)
        one, *_, result = alone.step(actions[k])
        if not any(shot.outcome.contacts for shot in result["shots"]):
            np.testing.assert_allclose(one, after[k], atol=2e-3)
    assert len(names) > 1
    assert np.abs(seen - seen[0]).max() > 0.01


def test_ends_that_share_an_ice_share_what_simulates_them():
    many = make(8, ices={"pool": 2}, hammer="opponent").unwrapped
    rng = np.random.default_rng(0)
    assert len({id(many.ices.draw(rng)) for _ in range(16)}) == 2


def test_steps_that_make_no_sense_are_refused():
    many = make(2)
    with pytest.raises(InputError, match="reset"):
        many.step(np.zeros((2, 3)))
    many.reset(seed=np.int64(3))
    with pytest.raises(InputError, match=r"shape \(2, 3\)"):
        many.step(np.zeros((3, 3)))
    for wrong in ({"num_envs": 0}, {"num_envs": True}):
        with pytest.raises(InputError, match="num_envs"):
            CurlingEndVectorEnv(**wrong)


@pytest.mark.parametrize("kind", ["dict", "planes"])
def test_other_observations_come_in_batches(kind):
    many = make(2, observation=kind)
    seen, _ = many.reset(seed=0)
    assert many.observation_space.contains(seen)


def test_options_of_a_single_end_are_refused():
    with pytest.raises(InputError, match="render_mode"):
        make(2, render_mode="rgb_array")


@pytest.mark.parametrize("many", [False, True])
def test_an_end_that_was_put_aside_goes_on_as_it_would_have(many):
    settings = {"opponent": "rulebased", "skill": "club"}
    env = make(2, **settings) if many else gym.make("CurlingEnd-v0", details=True, **settings)
    env.reset(seed=4)
    action = np.zeros(env.action_space.shape, np.float32)
    _, _, _, _, info = env.step(action)
    copied = pickle.loads(pickle.dumps(env))
    result = pickle.loads(pickle.dumps(info["shots"]))
    assert list(result) == list(info["shots"])
    for _ in range(3):
        (seen, reward, *_), (again, same, *_) = env.step(action), copied.step(action)
        assert np.array_equal(seen, again)
        assert np.array_equal(reward, same)
