"""What shots promise, and whether their way is free, agrees with the rules and the physics."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from agents.playing.learned.features import LINES
from agents.playing.learned.prospects import prospects_of
from agents.playing.learned.ways import blocked
from curling_env.envs.game.shots import SHOTS
from curling_env.ice import load_ice
from curling_env.physics.one_stone.aim import Aim

NUMBERS = {shot.name: k for k, shot in enumerate(SHOTS)}


def position(**stones: tuple[float, float]) -> np.ndarray:
    """A position: `own1=(x, y)`, `their2=(x, y)`."""
    places = np.full((1, 16, 2), np.nan)
    for name, place in stones.items():
        places[0, int(name[-1]) - 1 + 8 * name.startswith("their")] = place
    return places


def promised(places: np.ndarray, delivered: int, *, hammer: bool, protected: bool = False):
    found = prospects_of(
        LINES, places, np.array([delivered]), np.array([hammer]), np.array([protected])
    )[0]
    return {name: float(found[k]) for name, k in NUMBERS.items()}


def test_with_the_last_stone_shots_promise_the_points_that_they_score():
    lying = position(their1=(0.3, 0.0), own1=(1.0, 0.5))
    found = promised(lying, 15, hammer=True)
    assert found["through the house"] == 0
    # The opponent lies one. A draw inside scores one, a hit on it and a stone beside it two.
    assert found["draw to the button, clockwise"] == pytest.approx(2, abs=0.3)
    assert found["hit their stone 1 on the nose, control weight"] == pytest.approx(3, abs=0.3)
    assert found["hit their stone 2 on the nose, control weight"] == 0  # there is none


def test_what_is_good_for_one_team_is_bad_for_the_other():
    lying = position(their1=(0.0, 0.0), their2=(0.2, -0.4))
    for hammer in (True, False):
        found = promised(lying, 13 + hammer, hammer=hammer)
        assert found["hit their stone 1 on the nose, board weight"] > 0.2


def test_a_guard_that_may_not_be_put_out_promises_nothing():
    lying = position(their1=(0.0, -3.0), their2=(0.0, 0.0))
    hit = "hit their stone 1 on the nose, peel weight"
    assert promised(lying, 3, hammer=True, protected=True)[hit] == 0
    assert promised(lying, 7, hammer=True)[hit] != 0
    assert promised(lying, 3, hammer=True, protected=True)[hit.replace("1", "2")] != 0


def test_ways_are_blocked_where_the_throw_touches_a_stone():
    aim = Aim(load_ice("standard"))
    rng = np.random.default_rng(3)
    agree = []
    for _ in range(40):
        stones = np.full((1, 16, 2), np.nan)
        stones[0, :5] = rng.uniform((-1.6, -4.5), (1.6, 1.0), (5, 2))
        said = blocked(stones)[0]
        for k in rng.choice(24, 3, replace=False):
            shot = SHOTS[k]
            if np.nanmin(np.hypot(*(stones[0] - shot.place).T)) < 0.4:
                continue
            throw = aim.draw(*shot.place, 1.5 * shot.handle)
            assert throw is not None
            agree.append(said[k] == (not aim.path_clears(throw, stones[0, :5], until=1.9)))
    assert len(agree) > 60
    assert np.mean(agree) > 0.9


def test_a_hit_is_blocked_only_if_both_ways_are():
    stones = position(their1=(0.0, 0.0), own1=(0.0, -3.0))
    said = {name: bool(blocked(stones)[0, k]) for name, k in NUMBERS.items()}
    assert said["hit their stone 1 on the nose, peel weight"]
    assert not said["hit own stone 1 on the nose, peel weight"]
    assert not said["hit their stone 2 on the nose, peel weight"]  # there is none
    assert not said["draw to the right of the house, clockwise"]


def test_the_order_of_an_end_is_read_from_the_observation(called):
    from agents.playing.learned.features import features_of

    env = gymnasium.make("CurlingEnd-v0", hammer="own", actions="shots")
    observation, _ = env.reset(seed=1)
    seen = features_of(observation[None])
    assert seen.whole[0, :16].argmax() == 1  # the opponent has delivered one
    assert (features_of(called.observations).whole[:, :16].sum(axis=1) == 1).all()
