"""`CurlingEnd-v0`: the contract of Gymnasium, the rules at work, and states that branch."""

from __future__ import annotations

import copy
from dataclasses import FrozenInstanceError, replace

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import curling_env  # noqa: F401  (registers the environments)
from curling_env.envs import AGENT
from curling_env.errors import InputError
from curling_env.game import TYPICAL_EVOLUTION, Call, Team
from curling_env.throw import Throw


def make(**settings):
    return gym.make("CurlingEnd-v0", details=True, **settings).unwrapped


def play_out(env, actions):
    """Observations, rewards and the last info of an end."""
    seen, rewards, info = [], [], {}
    for action in actions:
        observation, reward, over, _, info = env.step(action)
        seen.append(observation)
        rewards.append(reward)
        if over:
            break
    return seen, rewards, info


def actions_of(env, n=8, seed=0):
    rng = np.random.default_rng(seed)
    return [rng.uniform(-1, 1, env.action_space.shape).astype(np.float32) for _ in range(n)]


@pytest.mark.parametrize("kind", ["flat", "dict", "planes"])
def test_it_keeps_gymnasiums_contract(kind):
    check_env(make(observation=kind), skip_render_check=True)


def test_it_draws_itself_without_a_display():
    env = make(render_mode="rgb_array")
    env.reset(seed=1)
    before = env.render()
    env.step(np.zeros(3, dtype=np.float32))
    after = env.render()
    assert before.dtype == np.uint8
    assert before.shape == after.shape
    assert before.shape[2] == 3
    assert (before != after).any()


@pytest.mark.parametrize("hammer", ["own", "opponent"])
def test_each_side_delivers_eight_stones_and_the_hammer_is_last(hammer):
    env = make(hammer=hammer)
    env.reset(seed=3)
    assert env.state.game.end.delivered == (1 if hammer == "own" else 0)
    shots, steps, over = [], 0, False
    while not over:
        _, reward, over, _, info = env.step(np.zeros(3, dtype=np.float32))
        shots += info["shots"]
        steps += 1
    assert steps == 8
    assert shots[-1].team is (AGENT if hammer == "own" else AGENT.other)
    home, away = info["score"]
    assert reward == home - away
    assert min(home, away) == 0


def test_the_same_seed_is_the_same_end_and_another_is_not():
    env = make(ice_evolution=TYPICAL_EVOLUTION, sweeping="scripted")
    actions = actions_of(env)
    runs = []
    for seed in (5, 5, 6):
        env.reset(seed=seed, options={"hammer": "opponent"})
        runs.append(np.array(play_out(env, actions)[0]))
    assert np.array_equal(runs[0], runs[1])
    assert not np.array_equal(runs[0], runs[2])


def test_a_state_put_back_goes_on_exactly_as_before():
    env = make(ice_evolution=TYPICAL_EVOLUTION, opponent="rulebased")
    env.reset(seed=11, options={"hammer": "opponent"})
    actions = actions_of(env)
    play_out(env, actions[:3])
    kept = env.state
    first = play_out(env, actions[3:])
    env.state = copy.deepcopy(kept)
    again = play_out(env, actions[3:])
    assert np.array_equal(np.array(first[0]), np.array(again[0]))
    assert first[1] == again[1]

    other = make(ice_evolution=TYPICAL_EVOLUTION, opponent="rulebased")
    other.reset(seed=99, options={"state": kept})
    elsewhere = play_out(other, actions[3:])
    assert np.array_equal(np.array(first[0]), np.array(elsewhere[0]))

    env.state = replace(kept, seed=kept.seed + 1)
    luck = play_out(env, actions[3:])
    assert not np.array_equal(np.array(first[0]), np.array(luck[0]))


def test_a_search_clones_a_state_without_copying_it():
    env = make(ice_evolution=TYPICAL_EVOLUTION)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    state = env.state
    assert copy.deepcopy(state) is copy.copy(state) is state
    assert state.wear is not None
    assert not state.wear.flags.writeable
    with pytest.raises(FrozenInstanceError):
        state.seed = 1


def test_a_state_that_is_not_the_agents_turn_is_refused():
    env = make(hammer="opponent")
    env.reset(seed=0)
    state = env.state
    after, _ = env.simulator.play(state, Call(throw=Throw(speed=2.0)))
    with pytest.raises(InputError, match="agent"):
        env.state = after


def test_the_agent_sees_the_known_ice_and_throws_on_the_true_one():
    heavy = make(ice="fcv1", known_ice="standard", skill="none", hammer="opponent")
    light = make(ice="standard", known_ice="standard", skill="none", hammer="opponent")
    seen = [env.reset(seed=1)[0] for env in (heavy, light)]
    assert np.array_equal(*seen)
    call = Call(throw=Throw(speed=2.1, spin=1.5))
    rests = []
    for env in (heavy, light):
        *_, info = env.step(env.action_of(call))
        rests.append(info["shots"][0].outcome.delivered.y)
    assert abs(rests[0] - rests[1]) > 0.05


def test_sweeping_carries_a_stone_farther():
    env = make(sweeping="action", skill="none", hammer="opponent")
    rests = []
    for sweep in (None, (2.0, 20.0)):
        env.reset(seed=0)
        throw = Throw(speed=1.9, spin=1.5)
        *_, info = env.step(env.action_of(Call(throw=throw, sweep=sweep)))
        rests.append(info["shots"][0].outcome.delivered.y)
    assert rests[1] > rests[0] + 0.5


def test_a_guard_taken_out_too_early_is_put_back_and_counts_as_a_fault():
    env = make(hammer="own", skill="none", opponent_skill="none", opponent="rulebased")
    env.reset(seed=0)
    guard = env.state.game.end.stones[0]
    assert guard.y < -2
    from curling_env.physics import Aim

    hit = Aim(env.simulator.ice).through(guard.x, guard.y, 3.2, 1.5)
    _, _, _, _, info = env.step(env.action_of(Call(throw=hit)))
    assert info["shots"][0].ruling.fault == "free_guard_zone"
    assert info["reward_parts"]["fault"] == -1.0
    assert guard in env.state.game.end.stones


def test_planes_show_every_stone_on_its_own_plane():
    env = make(observation="planes", hammer="own", skill="none", opponent_skill="none")
    seen, _ = env.reset(seed=0)
    own, theirs = seen["planes"][:2]
    assert own.sum() == 0
    area = 0.1**2 * theirs.sum()
    assert area == pytest.approx(np.pi * 0.145**2, rel=0.25)


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"opponent": "absent"}, "absent"),
        ({"hammer": "mine"}, "hammer"),
        ({"observation": "smell"}, "smell"),
        ({"sweeping": "always"}, "sweeping"),
        ({"rules": "backyard"}, "backyard"),
        ({"skill": "god"}, "god"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings, word):
    with pytest.raises(InputError, match=word):
        make(**settings)


def test_actions_that_are_no_numbers_are_refused():
    env = make()
    env.reset(seed=0)
    with pytest.raises(InputError, match="3 finite numbers"):
        env.step(np.array([0.0, np.nan, 0.0]))
    with pytest.raises(InputError, match="3 finite numbers"):
        env.step(np.zeros(4))
    assert Team.HOME is AGENT


def test_every_number_of_a_flat_observation_has_a_name():
    env = make(hammer="opponent", opponent="draw")
    seen, _ = env.reset(seed=0)
    names = env.observation.names
    assert len(names) == len(set(names)) == len(seen)
    result = dict(zip(names, seen, strict=True))
    assert result["hammer"] == -1.0
    assert result["own stones left"] == 1.0
    assert result["guards protected"] == 1.0
    seen, *_ = env.step(env.action_of(Call(throw=Throw(speed=2.09, angle=-0.045, spin=1.5))))
    result = dict(zip(names, seen, strict=True))
    assert result["own stone 1 present"] == 1.0
    stone = next(s for s in env.state.game.end.stones if s.team is AGENT)
    assert result["own stone 1 x"] == pytest.approx(stone.x / (env.simulator.ice.sheet.width / 2))


def test_the_agent_has_its_power_play_and_its_choice_in_the_action():
    env = gym.make(
        "CurlingEnd-v0", rules="mixed_doubles_2024", hammer="own", choices="action"
    ).unwrapped
    env.reset(seed=0, options={"power_play": "left"})
    assert env.state.game.end.power_play == "left"
    assert env.state.game.power_plays == (AGENT,)
    assert env.action_space.shape == (7,)
    assert env.chooser is env.opponent
    for number, put_back in ((0.5, True), (-0.5, False)):
        env.step(np.float32([-1, 0, 0, number, 0, -1, -1]))
        assert env.chooser.puts_back(None, None) is put_back
    with pytest.raises(InputError, match="no power play"):
        gym.make("CurlingEnd-v0", hammer="own").reset(options={"power_play": "left"})
    doubles = gym.make("CurlingEnd-v0", rules="mixed_doubles_2024", hammer="opponent")
    with pytest.raises(InputError, match="the opponent decides on a power play"):
        doubles.reset(seed=0, options={"power_play": "left"})


FACTS = {
    "a stone": lambda s: replace(s, game=with_end(s, stones=s.game.end.stones[1:])),
    "where it lies": lambda s: replace(s, game=with_end(s, stones=shifted(s.game.end.stones))),
    "stones delivered": lambda s: replace(s, game=with_end(s, delivered=s.game.end.delivered - 2)),
    "the score": lambda s: replace(s, game=replace(s.game, line_score=((1, 0),))),
    "our power play": lambda s: replace(s, game=replace(s.game, power_plays=(Team.AWAY,))),
    "their power play": lambda s: replace(s, game=replace(s.game, power_plays=(Team.HOME,))),
    "the clock": lambda s: replace(s, clock=s.clock + 600.0),
    "throws played": lambda s: replace(s, throws=s.throws + 10),
    "wear": lambda s: replace(s, wear=None),
}


def with_end(state, **changes):
    return replace(state.game, end=replace(state.game.end, **changes))


def shifted(stones):
    return (stones[0]._replace(x=stones[0].x + 0.1), *stones[1:])


@pytest.mark.parametrize("kind", ["flat", "dict", "planes"])
@pytest.mark.parametrize("fact", FACTS)
def test_no_fact_that_decides_is_kept_from_the_agent(fact, kind):
    """Each is changed alone."""
    env = make(
        rules="mixed_doubles_2024", ice_evolution="typical", hammer="opponent", observation=kind
    )
    env.reset(seed=0)
    for _ in range(2):
        env.step(env.action_of(Call(throw=Throw(speed=2.08, angle=-0.04, spin=1.5))))
    state = env.state
    assert state.game.power_plays == ()
    seen = []
    for one in (state, FACTS[fact](state)):
        seen.append(flat(env.reset(options={"state": one})[0]))
    assert not np.array_equal(*seen)


def flat(observation):
    if isinstance(observation, dict):
        return np.concatenate([part.ravel() for part in observation.values()])
    return observation.ravel()


def test_future_changes_of_the_ice_are_observed():
    seen = [
        make(ice_evolution=evolution, hammer="opponent").reset(seed=0)[0]
        for evolution in ("none", {"frost": 0.02}, {"wear": -0.003}, {"frost": 0.04})
    ]
    assert len({tuple(one) for one in seen}) == 4


def test_a_policy_plays_as_an_opponent_what_it_sees_as_the_agent_would():
    met = []

    class Learner:
        def predict(self, observation, deterministic=False):
            met.append((observation, deterministic))
            return np.float32([-0.2, 0.1, 0.5]), None

    env = make(opponent=Learner(), hammer="own", skill="none")
    _, info = env.reset(seed=0)
    ((seen, is_best),) = met
    assert is_best
    assert seen in env.observation_space
    result = dict(zip(env.observation.names, seen, strict=True))
    assert (result["stones delivered"], result["hammer"]) == (0.0, -1.0)
    assert info["shots"][0].thrown == env.call_of(np.float32([-0.2, 0.1, 0.5])).throw


class Recurrent:
    """A model that remembers how many observations of an end it saw, as a recurrent one would."""

    def __init__(self):
        self.asked = []

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        self.asked.append(state)
        return np.zeros(3, dtype=np.float32), 1 if state is None else state + 1


def test_a_recurrent_policy_remembers_the_end_that_it_plays():
    learner = Recurrent()
    env = make(opponent=learner, hammer="opponent")
    for seed in range(2):
        env.reset(seed=seed)
        play_out(env, actions_of(env))
    assert learner.asked == 2 * [None, *range(1, 8)]
    many = gym.make_vec("CurlingEnd-v0", num_envs=3, opponent=learner, hammer="opponent")
    learner.asked.clear()
    many.reset(seed=0)
    for _ in range(8):
        many.step(np.zeros((3, 3), dtype=np.float32))
    assert learner.asked == [k for k in (None, *range(1, 8)) for _ in range(3)]


def test_past_selves_join_the_opponents_and_each_episode_draws_one():
    env = make(opponent=["draw"])
    env.opponents.append(lambda seen: np.zeros(3))
    env.opponents.append("rulebased")
    names = []
    for seed in range(12):
        env.reset(seed=seed)
        names.append(env.opponent.name)
    assert set(names) == {"draw", "policy", "rulebased"}
    for seed in range(12):
        env.reset(seed=seed)
        assert env.opponent.name == names[seed]


def test_a_potential_pays_on_the_way_and_takes_back_at_the_end():
    """The parts of an end add up to minus the potential of its beginning."""

    def nearest(game, team):
        stones = [s for s in game.end.stones if s.team is team]
        return 0.5 + sum(np.exp(-np.hypot(s.x, s.y)) for s in stones)

    env = make(potential=nearest, skill="none", hammer="opponent")
    many = gym.make_vec(
        "CurlingEnd-v0", num_envs=2, potential=nearest, skill="none", hammer="opponent"
    )
    env.reset(seed=0)
    many.reset(seed=0)
    action = env.action_of(Call(throw=Throw(speed=2.08, angle=-0.04, spin=1.5)))
    total, over = 0.0, False
    while not over:
        _, reward, over, _, info = env.step(action)
        *_, result = many.step(np.stack([action] * 2))
        parts = info["reward_parts"]
        assert reward == pytest.approx(parts["points"] + parts["potential"])
        total += parts["potential"]
    assert total == pytest.approx(-0.5)
    assert result["reward_potential"][0] == pytest.approx(parts["potential"], abs=0.05)
    half = make(potential={"of": nearest, "discount": 0.5}, hammer="opponent")
    half.reset(seed=0)
    rise = half.potential.rise(0.5, half.state.game, AGENT)
    assert rise == pytest.approx(0.25 - 0.5)
