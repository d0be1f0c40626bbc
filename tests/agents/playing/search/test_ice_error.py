"""Uncertainty of the ice in a search."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agents.playing.search.ice_error import curl_error, friction_error, ice_error
from agents.playing.search.tuning import CHANGING_ICE_ERROR, MIN_ERROR
from curling_env.game import TYPICAL_EVOLUTION, GameSimulator
from curling_env.ice import load_ice

STANDARD = load_ice("standard")


def view_of(**settings):
    simulator = GameSimulator("standard", **settings)
    return simulator.view(simulator.begin_end(simulator.new_game(0)))


def measured(sigma: float, *, curl: float = 0.0, observed: slice = slice(None)):
    """Return the standard ice, as if it had been measured with these relative errors."""
    friction = STANDARD.friction
    seen = np.zeros_like(friction.observed)
    seen[:, observed] = True
    errors = np.where(seen, sigma, 0.5) * friction.mu
    effects = tuple(
        replace(e, sigma={"strength": curl * e.parameters["strength"]}) if e.name == "curl" else e
        for e in STANDARD.effects
    )
    return replace(
        STANDARD,
        friction=replace(friction, sigma=errors, observed=seen),
        effects=effects,
    )


def test_on_ice_that_is_known_and_stays_there_is_next_to_none():
    np.testing.assert_allclose(ice_error(view_of(), 2.0), MIN_ERROR)


def test_ice_that_changes_is_less_sure():
    changing = ice_error(view_of(ice_evolution=TYPICAL_EVOLUTION), 2.0)
    assert (changing >= CHANGING_ICE_ERROR).all()


def test_the_uncertainty_of_measured_ice_is_that_of_its_map():
    error = ice_error(view_of(known_ice=measured(0.01, curl=0.01)), 2.0)
    # 1 % of the friction of a stretch are 0.46 % on the whole way, and that 0.23 % of the speed; a
    # hundredth of 1.2 m of curl over 28.3 m.
    assert error[0] == pytest.approx(np.hypot(0.0046, MIN_ERROR[0]), rel=0.01)
    assert error[1] == pytest.approx(np.hypot(0.012 / 28.35, MIN_ERROR[1]), rel=0.01)
    assert error[2] == MIN_ERROR[2]
    surer = ice_error(view_of(known_ice=measured(0.002)), 2.0)
    assert surer[0] < error[0] / 3.5


def test_a_poor_map_counts_no_more_than_changing_ice():
    poor = ice_error(view_of(known_ice=measured(0.2, curl=0.9)), 2.0)
    np.testing.assert_allclose(poor[:2], np.hypot(CHANGING_ICE_ERROR, MIN_ERROR)[:2])


def test_cells_that_no_stone_crossed_do_not_count_where_others_were_measured():
    one = friction_error(measured(0.02, observed=slice(3, 6)))
    assert one == pytest.approx(friction_error(measured(0.02)))
    assert friction_error(measured(0.02, observed=slice(0, 0))) == pytest.approx(25 * one)


def test_a_curl_without_sigma_has_no_error():
    assert curl_error(STANDARD) == 0.0
    assert curl_error(load_ice("paper")) == 0.0
