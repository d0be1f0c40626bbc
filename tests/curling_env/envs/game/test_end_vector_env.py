"""Many ends at once are played as single ends are."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import curling_env  # noqa: F401  (registers the environments)
from curling_env.errors import InputError
from curling_env.game import TYPICAL_EVOLUTION, Call, IceEvolution
from curling_env.ice import ActiveEffect, load_ice
from curling_env.physics.one_stone.aim import Aim
from curling_env.sheet import Direction


def make(n, **settings):
    return gym.make_vec(
        "CurlingEnd-v0", num_envs=n, vectorization_mode="vector_entry_point", **settings
    )


SWEPT = {"sweeping": "scripted", "skill": "club"}


def biased(factors):
    """Standard ice on which some stones, by identifier, have a friction of their own."""
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
    "stones of their own": {"ice": biased({2: 1.1, 9: 0.9})},
    "mixed doubles": {"rules": "mixed_doubles_2024", "opponent": "rulebased"},
    "choices as action": {"choices": "action"},
    "from the hack": {"delivery": "hack", "ice": "fcv1", "rules": "digital_curling"},
    "ice_evolution": {"ice_evolution": TYPICAL_EVOLUTION, **SWEPT},
}


@pytest.mark.parametrize("name", SETTINGS)
def test_each_is_the_end_that_is_played_alone(name):
    """Each delivery begins from the same position: collisions multiply small differences."""
    settings, n = SETTINGS[name], 5
    many, alone = make(n, **settings), gym.make("CurlingEnd-v0", **settings).unwrapped
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
        many = make(2, ice=ice, skill="none", hammer="opponent", known_ice="standard")
        many.reset(seed=0)
        draw = Aim(load_ice("standard"), Direction.AWAY).draw(1.3, -0.5, 1.5)
        many.step(np.tile(many.unwrapped.single.action_of(Call(throw=draw)), (2, 1)))
        ends.append(many.unwrapped.states[0].game.end.stones)
    assert {s.team.label for s in ends[1]} == {"away"}  # the home team's stones stop short
    assert {s.team.label for s in ends[0]} == {"home", "away"}


def test_an_end_that_is_over_begins_anew():
    many = make(3, hammer="opponent", skill="none")
    first, _ = many.reset(seed=1)
    for _ in range(8):
        _, _, over, _, info = many.step(np.zeros((3, 3), dtype=np.float32))
    assert over.all()
    assert set(info["points"]) <= set(range(-8, 9))
    again, rewards, over, _, _ = many.step(np.zeros((3, 3), dtype=np.float32))
    assert np.array_equal(first, again)
    assert not rewards.any()
    assert not over.any()


@pytest.mark.parametrize("kind", ["dict", "planes"])
def test_other_observations_come_in_batches(kind):
    many = make(2, observation=kind)
    seen, _ = many.reset(seed=0)
    assert many.observation_space.contains(seen)


def test_options_of_a_single_end_are_refused():
    with pytest.raises(InputError, match="render_mode"):
        make(2, render_mode="rgb_array")
