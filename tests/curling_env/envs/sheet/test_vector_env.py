"""Many sheets at once behave as single ones, in Gymnasium's vector form."""

from __future__ import annotations

import warnings
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import DictInfoToList, RecordEpisodeStatistics

import curling_env  # noqa: F401  (registers the environments)
from curling_env.envs import CurlingSheetVectorEnv
from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, load_ice
from curling_env.sheet import TEE_Y, Direction

N = 6
ROUNDING = 1e-12
"""Largest difference of lone throws: the same slide, rounded in another order."""
HIT = 3e-4
"""Largest difference of the places of stones that have met [m].

Single sheets play them in the engine, these in the batch. Each follows the way to a contact to some
hundredths of a millimetre, and a contact magnifies that ten times: at the tolerance of environments
nine of ten single hits agree to 0.14 mm and all of 323 to 0.4 mm (docs/results.md, Physics). Steps
that were fine enough for 0.1 mm would take three times as long.
"""
MODES = ("NextStep", "SameStep")


def heavier_or_keener(rng):
    """A distribution of ices of a user's own, of which only the mean is known."""
    usual = load_ice("standard")
    mu = usual.friction.mu * rng.uniform(0.9, 1.1)
    return replace(usual, friction=replace(usual.friction, mu=mu)), usual


def make(n: int = N, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return gymnasium.make_vec("CurlingSheet-v0", num_envs=n, **options)


def one_by_one(mode: str, **options):
    return gymnasium.make_vec(
        "CurlingSheet-v0",
        num_envs=N,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        **options,
    )


def some_actions(rng: np.random.Generator, n: int = N):
    """Actions over the whole range of weights, most of which stay between the side lines."""
    return rng.uniform(-1, 1, (n, 3)).astype(np.float32) * np.float32([1, 0.7, 0.4])


# --- as single sheets -----------------------------------------------------------------------------

WORN = load_ice("standard").with_effect(
    ActiveEffect(name="pebble_wear", parameters={"rate": -0.02})
)
CERTAIN = load_ice("standard")
DOUBTFUL = replace(CERTAIN, friction=replace(CERTAIN.friction, sigma=0.03 * CERTAIN.friction.mu))
LONE = [
    {"ice": DOUBTFUL, "ice_sigma": True, "target": "random", "direction": "random"},
    {},
    {"ice": load_ice("fcv1"), "direction": "random", "delivery": "hack"},
    {"ice": WORN, "throws": 3, "target": (0.4, -0.7)},
    {"ices": ["standard", "paper", DOUBTFUL], "skill": "champion", "throws": 2},
    {"ices": heavier_or_keener, "direction": "random"},
    {"ices": {"level": 0.05, "pool": 3}, "throws": 2, "direction": "random"},
]
"""Options under which engine and batch agree, with Gymnasium's form of `info`."""


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("options", LONE)
def test_many_sheets_behave_as_single_ones(options, mode, rng):
    # Stones of one episode may meet; most do not.
    bound = ROUNDING if options.get("throws", 1) == 1 else HIT
    many, single = make(autoreset_mode=mode, **options), one_by_one(mode, **options)
    stories = [envs.reset(seed=7) for envs in (many, single)]
    for _ in range(7):
        np.testing.assert_allclose(stories[0][0], stories[1][0], atol=bound)
        assert_same_info(stories[0][-1], stories[1][-1], bound)
        actions = some_actions(rng)
        steps = [envs.step(actions) for envs in (many, single)]
        for a, b in zip(steps[0][1:4], steps[1][1:4], strict=True):
            np.testing.assert_allclose(a, b, atol=bound)
            assert a.dtype == b.dtype
        stories = [(step[0], step[-1]) for step in steps]


def assert_same_info(many: dict, single: dict, bound: float) -> None:
    """The same names, masks and numbers, except of what only single sheets keep."""
    apart = {"trajectory", "outcome", "_trajectory", "_outcome"}
    assert many.keys() - apart == single.keys() - apart
    for name in many.keys() - apart:
        a, b = many[name], single[name]
        if isinstance(a, dict):
            assert_same_info(a, b, bound)
        elif name in ("status", "direction"):
            assert a.dtype == b.dtype
            assert a.tolist() == b.tolist()
            assert [type(one) for one in a] == [type(one) for one in b]
        elif name == "throw":
            for one, other in zip(a, b, strict=True):
                assert type(one) is type(other)
                assert one is None or one.__dict__ == pytest.approx(other.__dict__)
        elif a.dtype == object and name == "final_obs":
            np.testing.assert_allclose(np.stack(a), np.stack(b), atol=bound)
        else:
            assert a.dtype == b.dtype
            np.testing.assert_allclose(a, b, atol=bound)


def test_hits_end_as_on_single_sheets(rng):
    options = {"stones": ((0.0, 0.0), (-0.6, -1.5), (0.7, -2.5)), "throws": 2}
    many, single = make(64, **options), make(1, vectorization_mode="sync", details=True, **options)
    many.reset(seed=0)
    actions = some_actions(rng, 64) * np.float32([1, 0.3, 0.3])
    seen, rewards, *_, info = many.step(actions)
    met = 0
    for i in range(64):
        single.reset(seed=0)
        alone = single.step(actions[i : i + 1])
        outcome = alone[-1]["outcome"][0]
        met += len(outcome.contacts) == 1
        if len(outcome.contacts) <= 1:
            assert info["status"][i] == outcome.delivered_status.value
            np.testing.assert_allclose(seen[i], alone[0][0], atol=HIT)
            assert rewards[i] == pytest.approx(alone[1][0], abs=4 * HIT)
    assert met > 10


@pytest.mark.parametrize("knows", ["map", "mean", "nothing"])
@pytest.mark.parametrize("stones", [0, 3])
def test_drawn_ices_are_thrown_on_together_as_on_single_sheets(knows, stones):
    options = {"ices": {"knows": knows}, "stones": stones, "direction": "random", "throws": 2}
    many = make(40, autoreset_mode="SameStep", **options)
    seen, _ = many.reset(seed=7)
    single = gymnasium.make("CurlingSheet-v0", **options).unwrapped
    actions = some_actions(np.random.default_rng(0), 40)
    after, rewards, *_, info = many.step(actions)
    same = 0
    for k in range(40):
        np.testing.assert_allclose(single.reset(seed=7 + k)[0], seen[k], atol=1e-12)
        # What is known of the ice is what its file would say.
        alike = single.ices.known_as(single.known_ice).features(single.direction)
        np.testing.assert_allclose(single.ice_features(single.direction), alike, atol=2e-6)
        one, reward, _, _, answer = single.step(actions[k])
        same += np.allclose(one, after[k], atol=HIT) and answer["status"] == info["status"][k]
        if not stones:
            assert reward == pytest.approx(rewards[k], abs=1e-2)
    assert same >= (36 if stones else 40)


def test_a_stone_with_a_friction_of_its_own_keeps_it():
    bias = load_ice("standard").with_effect(
        ActiveEffect(name="stone_bias", parameters={"stone": 101, "factor": 1.2})
    )
    envs = make(2, ice=bias, throws=2, autoreset_mode="SameStep")
    envs.reset(seed=0)
    far = [envs.step(np.float32([[0.0, a, 0.0]] * 2))[-1] for a in (-0.2, 0.2)]
    assert far[1]["final_info"]["distance_m"][0] > far[0]["distance_m"][0] + 1.0


# --- seeds and episodes ---------------------------------------------------------------------------


def test_a_seed_counts_up_from_sheet_to_sheet():
    options = {"stones": 3, "target": "random"}
    seen, _ = make(**options).reset(seed=11)
    again, _ = make(**options).reset(seed=list(range(11, 11 + N)))
    np.testing.assert_array_equal(seen, again)
    alone = gymnasium.make("CurlingSheet-v0", **options)
    for i in range(N):
        np.testing.assert_array_equal(seen[i], alone.reset(seed=11 + i)[0])
    envs = make(**options)
    first = envs.reset(seed=3)[0]
    assert np.abs(envs.reset()[0] - first).max() > 0.05
    np.testing.assert_array_equal(envs.reset(seed=3)[0], first)


@pytest.mark.parametrize("form", [np.int64(5), (5, 6, 7), np.arange(5, 8), [5, None, 7]])
def test_seeds_come_in_every_form(form):
    options = {"stones": 3, "target": "random"}
    seen, _ = make(3, **options).reset(seed=form)
    usual, _ = make(3, **options).reset(seed=5)
    same = [True, form[1] is not None if isinstance(form, list) else True, True]
    np.testing.assert_array_equal((seen == usual).all(axis=1), same)
    for wrong, says in (("5", "seed must be"), (-1, "at least 0"), (True, "seed must be")):
        with pytest.raises(InputError, match=says):
            make(3).reset(seed=wrong)


def test_disabled_episodes_begin_only_when_asked(rng):
    envs = make(autoreset_mode="Disabled", throws=2)
    sync = one_by_one("Disabled", throws=2)
    for one in (envs, sync):
        one.reset(seed=0)
    for _ in range(2):
        actions = some_actions(rng)
        steps = [one.step(actions) for one in (envs, sync)]
    np.testing.assert_array_equal(steps[0][2], steps[1][2])
    assert steps[0][2].all()
    with pytest.raises(InputError, match="environment 0 is over"):
        envs.step(actions)
    mask = np.arange(N) != 2
    seen, _ = envs.reset(options={"reset_mask": mask})
    assert (seen[:, 2] == mask).all()
    with pytest.raises(InputError, match="environment 2 is over"):
        envs.step(actions)


def test_an_ice_asked_for_holds_for_one_episode(rng):
    """The known ice is the one asked for too, unless another is given."""
    envs = make(3)
    usual, _ = envs.reset(seed=0)
    actions = np.tile(some_actions(rng, 1), (3, 1)) * np.float32([0.2, 0.2, 1.0])
    far = envs.step(actions)[-1]["distance_m"]
    mask = np.array([False, True, False])
    envs.reset(seed=0)
    seen, _ = envs.reset(options={"ice": "paper", "reset_mask": mask})
    assert (np.abs(seen - usual).max(axis=1) > 0.1).tolist() == mask.tolist()
    other = envs.step(actions)[-1]["distance_m"]
    assert (np.abs(other - far) > 0.2).tolist() == mask.tolist()
    seen, _ = envs.reset(options={"ice": "paper", "known_ice": "standard"})
    np.testing.assert_array_equal(seen, usual)
    assert np.abs(envs.step(actions)[-1]["distance_m"] - other[1]).max() < 1e-9
    envs.step(actions)
    np.testing.assert_allclose(envs.step(actions)[-1]["distance_m"], far)


def test_only_the_masked_begin_again(rng):
    envs = make(throws=3)
    envs.reset(seed=0)
    after = envs.step(some_actions(rng))[0]
    mask = np.arange(N) % 2 == 0
    seen, info = envs.reset(options={"reset_mask": mask, "target": (0.5, 0.5)})
    np.testing.assert_array_equal(seen[~mask], after[~mask])
    assert (seen[mask, 2] == 1).all()
    np.testing.assert_array_equal(info["_target"], mask)
    np.testing.assert_allclose(info["target"][mask], [[0.5, TEE_Y + 0.5]] * mask.sum())


def test_an_over_episode_begins_at_the_step_its_mode_says(rng):
    following, same = (make(autoreset_mode=AutoresetMode(mode)) for mode in MODES)
    assert following.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    for envs in (following, same):
        envs.reset(seed=0)
    actions = some_actions(rng)
    (a, reward_a, over_a, _, info_a), (b, reward_b, over_b, _, info_b) = (
        envs.step(actions) for envs in (following, same)
    )
    np.testing.assert_array_equal(reward_a, reward_b)
    assert over_a.all()
    assert over_b.all()
    assert (a[:, 2] == 0).all()
    assert (b[:, 2] == 1).all()
    np.testing.assert_array_equal(np.stack(info_b["final_obs"]), a)
    np.testing.assert_array_equal(info_b["final_info"]["distance_m"], info_a["distance_m"])
    rested, reward, over, *_ = following.step(actions)
    np.testing.assert_array_equal(rested, b)
    assert not reward.any()
    assert not over.any()


# --- the contract of Gymnasium --------------------------------------------------------------------


@pytest.mark.parametrize("mode", MODES)
def test_many_sheets_keep_the_contract_of_gymnasium(mode, rng):
    envs = make(autoreset_mode=mode, stones=2, throws=2, target="random")
    assert isinstance(envs.unwrapped, CurlingSheetVectorEnv)
    assert envs.spec.id == "CurlingSheet-v0"
    answer = DictInfoToList(RecordEpisodeStatistics(envs))
    seen, infos = answer.reset(seed=1)
    assert len(infos) == N
    episodes = 0
    for _ in range(6):
        assert seen in envs.observation_space
        seen, rewards, over, cut, infos = answer.step(envs.action_space.sample())
        assert rewards.shape == over.shape == cut.shape == (N,)
        assert rewards.dtype == np.float64
        assert over.dtype == cut.dtype == np.bool_
        assert all(np.isfinite(info["target"]).all() for info in infos)
        episodes += sum("episode" in info for info in infos)
    assert episodes >= 2 * N
    answer.close()


def test_what_is_handed_out_stays_as_it_was(rng):
    envs = make(throws=3)
    first, info = envs.reset(seed=0)
    kept = first.copy(), info["target"].copy()
    envs.step(some_actions(rng))
    np.testing.assert_array_equal(first, kept[0])
    np.testing.assert_array_equal(info["target"], kept[1])


@pytest.mark.parametrize("mode", [*MODES, "Disabled"])
def test_a_later_step_leaves_what_earlier_ones_returned(mode, rng):
    envs = gymnasium.make_vec("CurlingSheet-v0", num_envs=3, throws=2, autoreset_mode=mode)
    envs.reset(seed=0)
    returned, copies = [], []
    for _ in range(4):
        result = envs.step(envs.action_space.sample())[:4]
        returned.append(result)
        copies.append([array.copy() for array in result])
        if mode == "Disabled" and result[2].any():
            envs.reset(options={"reset_mask": result[2].copy()})
    assert any(result[2].any() for result in returned)
    for result, copy in zip(returned, copies, strict=True):
        for array, before in zip(result, copy, strict=True):
            np.testing.assert_array_equal(array, before)
    returned[-1][2][:] = False  # the caller's own
    envs.step(envs.action_space.sample())


def test_trajectories_come_when_asked_for(rng):
    actions = some_actions(rng)
    with_paths, without = make(fps=10, stones=1, throws=2), make(stones=1, throws=2)
    answer = []
    for envs in (with_paths, without):
        envs.reset(seed=4)
        answer.append([envs.step(actions) for _ in range(2)])
    for (a, *_, info), (b, *_, bare) in zip(*answer, strict=True):
        np.testing.assert_allclose(a, b, atol=HIT)
        assert "trajectory" not in bare
        for path, outcome in zip(info["trajectory"], info["outcome"], strict=True):
            assert path.xy[-1] == pytest.approx((outcome.delivered.x, outcome.delivered.y))


def test_both_ends_look_the_same_on_even_ice():
    actions = np.float32([[0.0, -0.3, 0.3]] * 2)
    stories = []
    for end in Direction:
        envs = make(2, direction=end, stones=((0.3, 0.4),), target=(0.2, -0.3))
        stories.append((envs.reset(seed=0)[0], *envs.step(actions)[:2]))
    for a, b in zip(*stories, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)


# --- bad input ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"n": 0}, "num_envs"),
        ({"autoreset_mode": "Never"}, "autoreset_mode must be one of 'NextStep', 'SameStep'"),
        ({"render_mode": "rgb_array"}, "not shown"),
        ({"stones": 16}, "at most 16 stones"),
        ({"stones": ((3.0, 0.0),)}, "inside the side lines"),
        ({"throws": 0}, "at least one throw"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, says):
    with pytest.raises(InputError, match=says):
        CurlingSheetVectorEnv(options.pop("n", 2), **options)


def test_steps_that_make_no_sense_are_refused():
    envs = make(2)
    with pytest.raises(InputError, match="reset"):
        envs.step(np.zeros((2, 3)))
    with pytest.raises(InputError, match="a seed for each"):
        envs.reset(seed=[1])
    with pytest.raises(InputError, match="unknown option"):
        envs.reset(options={"wind": 3})
    envs.reset(seed=0)
    for actions, says in ((np.zeros(3), "shape"), (np.full((2, 3), np.nan), "finite")):
        with pytest.raises(InputError, match=says):
            envs.step(actions)


def test_stones_that_overlap_are_refused():
    envs = make(2, stones=((0.0, 0.0), (0.1, 0.0)))
    envs.reset(seed=0)
    with pytest.raises(InputError, match="one place"):
        envs.step(np.zeros((2, 3)))
