"""Draws planned on an ice and thrown on the sealed one."""

from __future__ import annotations

import json

import numpy as np
import pytest
from blind import planned_draws
from blind.law import COUPLING, MU
from blind.planned_draws import SKILL, draws_on_truth, rest_on, rests_with_errors, solve
from blind.sessions import make_session, true_ice

from curling_env.ice import ActiveEffect, Ice
from curling_env.sheet import RULE_BOOK_STONE, TEE_Y

UNSWEPT = (0.0, 0.0)
TARGET = np.array([0.4, -TEE_Y])


@pytest.fixture(scope="module")
def sealed():
    truth = make_session(("curl",), np.random.default_rng(2), throws=3)[1]
    truth["numbers"][COUPLING] = RULE_BOOK_STONE.spin_coupling
    return json.loads(json.dumps(truth, default=float))


@pytest.fixture(scope="module")
def rest(sealed):
    truth = true_ice(sealed)
    return lambda throw: rest_on(truth, throw, UNSWEPT, -1.0)


def test_a_solved_throw_rests_at_the_target(rest):
    throw = solve(rest, np.array([2.0, 0.0, 1.5]), TARGET)
    assert throw is not None
    assert throw[2] == 1.5
    assert np.hypot(*(rest(throw) - TARGET)) < 1e-3


def test_no_throw_gets_past_the_ice(rest):
    assert solve(rest, np.array([2.0, 0.0, 1.5]), np.array([0.0, -40.0])) is None


def test_rests_with_errors_of_the_hand_are_those_of_throws_made_one_by_one(rest):
    throw = solve(rest, np.array([2.0, 0.0, 1.5]), TARGET)
    errors = SKILL.errors(24, np.random.default_rng(1))
    each = [rest(throw + error) for error in errors]
    np.testing.assert_allclose(rests_with_errors(rest, throw, errors), each, rtol=0, atol=0.005)


def test_draws_planned_on_the_truth_cost_nothing_and_on_other_ice_more(sealed, monkeypatch):
    monkeypatch.setattr(planned_draws, "TARGETS", 2)
    curl = ActiveEffect(name="curl", parameters=sealed["effects"]["curl"])
    mu = sealed["numbers"][MU]
    right = draws_on_truth(Ice.uniform(mu, effects=(curl,)), sealed, direction=-1.0)
    assert right["miss"] == pytest.approx(right["miss_on_truth"], rel=0.005)
    wrong = draws_on_truth(Ice.uniform(1.02 * mu, effects=(curl,)), sealed, direction=-1.0)
    assert wrong["miss_on_truth"] == pytest.approx(right["miss_on_truth"], rel=0.05)
    assert wrong["miss"] > 1.2 * right["miss"]
