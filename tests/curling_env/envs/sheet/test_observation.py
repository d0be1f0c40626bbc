"""Observation of `CurlingSheet-v0`; test_known_ice.py tests its ice features."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

import curling_env  # noqa: F401  (registers the environments)
from curling_env.ice import ActiveEffect, load_ice


def make(**options):
    return gymnasium.make("CurlingSheet-v0", **options).unwrapped


def observed(env, seed=0):
    observation, _ = env.reset(seed=seed)
    return dict(zip(env.observation.names, observation, strict=True))


def test_every_number_has_a_name_and_usual_stones_read_zero():
    result = observed(make(stones=2, throws=2))
    assert result["throws left"] == 1
    assert result["clock"] == result["next stone stone_bias.factor"] == 0
    assert result["stone 1 team"] == result["stone 2 team"] == -1


def test_a_biased_stone_is_observed_where_it_lies_and_before_it_is_thrown():
    ice = load_ice("standard")
    for stone, factor in ((1, 1.04), (101, 0.97)):
        parameters = {"stone": stone, "factor": factor}
        ice = ice.with_effect(ActiveEffect(name="stone_bias", parameters=parameters))
    env = make(ice=ice, stones=((0.5, 0.5), (-0.5, 0.5)), throws=3)
    result = observed(env)
    assert result["stone 1 stone_bias.factor"] == 0
    assert result["stone 2 stone_bias.factor"] == pytest.approx(0.4)
    assert result["next stone stone_bias.factor"] == 0
    seen, *_ = env.step(np.float32([0.0, 0.3, 0.5]))
    result = dict(zip(env.observation.names, seen, strict=True))
    assert result["next stone stone_bias.factor"] == pytest.approx(-0.3)
    assert result["clock"] > 0
