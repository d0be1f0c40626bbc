"""Nothing that an environment returned ever changes, and nothing done to it changes the episode."""

from __future__ import annotations

import copy

import gymnasium as gym
import numpy as np
import pytest

import curling_env

SHEETS = {"stones": 2, "throws": 2, "target": "random", "direction": "random"}
ENDS = [{}, {"observation": "dict"}, {"observation": "planes"}, {"actions": "shots"}]
OPTIONS = [("CurlingSheet-v0", SHEETS), *(("CurlingEnd-v0", options) for options in ENDS)]
MODES = ("NextStep", "SameStep", "Disabled")


def arrays_in(value):
    """All arrays of numbers in what was returned."""
    if isinstance(value, np.ndarray):
        if value.dtype != object:
            yield value
        else:
            for part in value:
                yield from arrays_in(part)
    elif isinstance(value, dict):
        for part in value.values():
            yield from arrays_in(part)
    elif isinstance(value, tuple | list):
        for part in value:
            yield from arrays_in(part)


def assert_equal(first, second):
    pairs = zip(arrays_in(first), arrays_in(second), strict=True)
    for one, other in pairs:
        np.testing.assert_array_equal(one, other)


def play(spoil, begin, step, count=7):
    """Return values of an environment and copies of them; the caller may write into them."""
    returned, copies = [], []
    for k in range(count):
        result = begin() if k == 0 else step()
        returned.append(result)
        copies.append(copy.deepcopy(list(arrays_in(result))))
        if spoil:
            for array in arrays_in(result):
                assert array.flags.writeable
                array[...] = True if array.dtype == np.bool_ else 77
    return returned, copies


def assert_kept(make):
    kept, copies = play(*make(spoil=False))
    for result, before in zip(kept, copies, strict=True):
        assert_equal(list(arrays_in(result)), before)
    _, spoilt = play(*make(spoil=True))
    assert_equal(copies, spoilt)


@pytest.mark.parametrize(("name", "options"), OPTIONS)
def test_of_single_environments(name, options):
    def make(spoil):
        env = gym.make(name, **options)
        rng, over = np.random.default_rng(0), [False]

        def step():
            if over[0]:
                over[0] = False
                return env.reset()
            space = env.action_space
            action = rng.integers(24) if options.get("actions") else rng.uniform(-1, 1, space.shape)
            result = env.step(action)
            over[0] = result[2]
            return result

        return spoil, lambda: env.reset(seed=1), step

    assert_kept(make)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("name", "options"), OPTIONS)
def test_of_many_environments_at_once(name, options, mode):
    def make(spoil):
        envs = gym.make_vec(name, num_envs=3, autoreset_mode=mode, **options)
        rng, over = np.random.default_rng(0), [np.zeros(3, dtype=np.bool_)]

        def step():
            if mode == "Disabled" and over[0].any():
                mask, over[0] = over[0], np.zeros(3, dtype=np.bool_)
                return envs.reset(options={"reset_mask": mask})
            shape = envs.action_space.shape
            shots = options.get("actions")
            result = envs.step(rng.integers(24, size=shape) if shots else rng.uniform(-1, 1, shape))
            over[0] = result[2].copy()
            return result

        return spoil, lambda: envs.reset(seed=1), step

    assert_kept(make)


@pytest.mark.parametrize("options", ENDS)
def test_of_the_two_team_game(options):
    pytest.importorskip("pettingzoo")

    def make(spoil):
        env = curling_env.curling_v0.env(ends=1, **options)
        rng = np.random.default_rng(0)

        def seen():
            return [env.last(), env.observe("home"), env.observe("away"), env.infos, env.state()]

        def begin():
            env.reset(seed=1)
            return seen()

        def step():
            env.step(int(rng.integers(24)) if options.get("actions") else rng.uniform(-1, 1, 3))
            return seen()

        return spoil, begin, step

    assert_kept(make)


def shapes(info):
    """Shape and type of every entry; no entry is nested."""
    return {name: (np.shape(value), np.asarray(value).dtype.kind) for name, value in info.items()}


@pytest.mark.parametrize(("name", "options"), OPTIONS)
def test_info_is_flat_and_keeps_its_form(name, options):
    """Names, shapes and types are the same in every step, as collectors of transitions need."""
    env = gym.make(name, **options)
    seen = []
    for seed in range(3):
        env.reset(seed=seed)
        over = False
        while not over:
            *_, over, _, info = env.step(env.action_space.sample())
            assert not any(isinstance(value, dict | tuple | list) for value in info.values())
            seen.append(shapes({k: v for k, v in info.items() if k != "status"}))
    assert all(one == seen[0] for one in seen)
    assert "O" not in {kind for _, kind in seen[0].values()}
    detailed = gym.make(name, details=True, **options)
    detailed.reset(seed=0)
    *_, info = detailed.step(env.action_space.sample())
    assert {"reward_parts", "shots" if "End" in name else "outcome"} <= info.keys()


@pytest.mark.parametrize("name", ["CurlingSheet-v0", "CurlingEnd-v0"])
def test_vectors_know_the_seeds_that_they_were_given(name):
    envs = gym.make_vec(name, num_envs=3, autoreset_mode="SameStep")
    envs.reset(seed=5)
    assert envs.unwrapped.np_random_seed == (5, 6, 7)
    assert len(envs.unwrapped.np_random) == 3
    assert envs.autoreset_mode is gym.vector.AutoresetMode.SAME_STEP
    envs.reset(seed=[1, None, 9])
    assert envs.unwrapped.np_random_seed == (1, 6, 9)


@pytest.mark.parametrize("name", ["CurlingSheet-v0", "CurlingEnd-v0"])
def test_an_unknown_option_is_the_type_error_that_every_environment_raises(name):
    for make in (gym.make, gym.make_vec):
        with pytest.raises(TypeError, match="unexpected keyword argument 'frameskip'"):
            make(name, frameskip=4)
