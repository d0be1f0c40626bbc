"""Ice features of the observation: one for everything that affects a throw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.envs import KnownIce
from curling_env.envs.known_ice import BANDS, ice_features, ice_names, squash, stone_names
from curling_env.ice import ActiveEffect, FrictionMap, Ice, load_ice
from curling_env.physics import catalogue
from curling_env.sheet import PAPER_SHEET, Direction

CARDS = [card for card in catalogue().values() if card.is_physical and card.acts != "map"]
FACTS = [(card, parameter) for card in CARDS for parameter in card.parameters]


def named(ice: Ice, direction: Direction = Direction.AWAY) -> dict[str, float]:
    return dict(zip(ice_names(), ice_features(ice, direction).tolist(), strict=True))


def with_effect(name: str, **parameters: float) -> Ice:
    return load_ice("standard").with_effect(ActiveEffect(name=name, parameters=parameters))


def values_of(card) -> dict[str, float]:
    """A value of each parameter that does something, and lies within its bounds."""
    given = {}
    for number, parameter in enumerate(card.parameters):
        low, high = max(parameter.low, -8.0), min(parameter.high, 8.0)
        given[parameter.name] = low + (high - low) * (0.3 + 0.03 * number)
    return given | ({"variable": 2.0, "low": -5.0, "high": 9.0} if card.name == "residual" else {})


@pytest.mark.parametrize(("card", "parameter"), FACTS, ids=lambda fact: fact.name)
def test_no_parameter_of_a_known_effect_is_kept_from_the_agent(card, parameter):
    """Each is changed alone, from a usual value and from a large one."""
    ices = []
    given = values_of(card)
    for share in (0.02, 0.9):
        high = min(parameter.high, 20.0)
        if parameter.name == "variable":
            changed = 4.0 if share > 0.5 else 3.0
        else:
            changed = given[parameter.name] + share * (high - given[parameter.name])
        if parameter.name == card.search.stone:
            changed = round(changed) + 1
        one = ActiveEffect(name=card.name, parameters={**given, parameter.name: changed})
        ices.append(Ice.uniform(0.008, effects=(one,)))
    ices.append(Ice.uniform(0.008, effects=(ActiveEffect(name=card.name, parameters=given),)))
    everyone = range(40)
    features = [
        np.append(KnownIce(ice).features(Direction.AWAY), KnownIce(ice).of_stones(everyone))
        for ice in ices
    ]
    for k, one in enumerate(features):
        assert np.abs(one).max() <= 1
        for other in features[k + 1 :]:
            assert not np.array_equal(one, other)


def test_an_absent_effect_and_one_that_does_nothing_read_alike():
    plain = ice_features(load_ice("standard"), Direction.AWAY)
    for card in CARDS:
        if card.search.stone is None and set(card.neutral) == {p.name for p in card.parameters}:
            ice = with_effect(card.name, **card.neutral)
            if load_ice("standard").effect(card.name) is None:
                np.testing.assert_array_equal(ice_features(ice, Direction.AWAY), plain)


def test_usual_effects_read_as_their_cards_scale_them():
    away, home = (
        named(with_effect("slope", x=1e-3, y=-5e-4), direction) for direction in Direction
    )
    names = ("speed_dependent_friction.exponent", "curl.strength", "curl.speed_exponent")
    assert [away[name] for name in names] == pytest.approx([0.25, 0.41, 0.2], abs=1e-3)
    assert (away["slope.x"], away["slope.y"]) == pytest.approx((0.5, -0.25))
    assert (home["slope.x"], home["slope.y"]) == pytest.approx((-0.5, 0.25))


def test_two_patches_are_observed_in_the_direction_of_play():
    first = {"x_min": -2.0, "x_max": -0.5, "y_min": 10.0, "y_max": 14.0, "factor": 1.1}
    ice = with_effect("friction_patch", **first)
    turned = with_effect(
        "friction_patch", x_min=0.5, x_max=2.0, y_min=-14.0, y_max=-10.0, factor=1.1
    )
    np.testing.assert_allclose(
        ice_features(ice, Direction.AWAY), ice_features(turned, Direction.HOME), atol=1e-6
    )
    assert not np.allclose(ice_features(ice, Direction.AWAY), ice_features(ice, Direction.HOME))
    again = {**first, "factor": 0.9}
    both = named(ice.with_effect(ActiveEffect(name="friction_patch", parameters=again)))
    assert both["friction_patch.factor"] == pytest.approx(0.5)
    assert both["friction_patch 2.factor"] == pytest.approx(-0.5)


def test_a_table_over_the_sheet_is_read_backwards_from_the_other_end():
    knots = {f"log_factor_{k}": 0.01 * k for k in range(7)}
    back = {f"log_factor_{k}": 0.01 * (6 - k) for k in range(7)}
    ice = with_effect("residual", variable=2.0, low=-3.0, high=9.0, **knots)
    turned = with_effect("residual", variable=2.0, low=-9.0, high=3.0, **back)
    np.testing.assert_allclose(
        ice_features(ice, Direction.HOME), ice_features(turned, Direction.AWAY), atol=1e-6
    )


def test_wear_under_contacts_and_along_paths_is_observed_as_one_sum():
    both = named(with_effect("pebble_wear", along_path=-0.002, under_contacts=-0.001))
    assert both == named(with_effect("pebble_wear", along_path=-0.003))
    assert both["pebble_wear.along_path"] == pytest.approx(-0.3)
    assert "pebble_wear.under_contacts" not in both


def test_heavy_bands_are_seen_where_they_are():
    mu = np.full(PAPER_SHEET.shape, 0.0082)
    mu[60:, :4] *= 1.1
    friction = FrictionMap(mu=mu, sigma=0 * mu, observed=np.ones(mu.shape, dtype=bool))
    uneven = replace(load_ice("standard"), friction=friction)
    away, home = (named(uneven, direction) for direction in Direction)
    assert away["friction of band 8, left"] > 0.3 > 0 > away["friction of band 8, right"]
    assert away["friction of band 1, left"] < 0
    assert home["friction of band 1, right"] > 0.05
    assert home["friction of band 8, left"] < 0


def test_wear_is_observed_band_by_band():
    known = KnownIce(load_ice("standard"))
    wear = np.zeros(PAPER_SHEET.shape)
    wear[70:, 4] = -0.01
    wear[30, :] = 0.02
    seen = known.wear(wear, Direction.AWAY).reshape(BANDS, 3)
    assert seen[7, 1] < -0.02
    assert (seen[3:5] == 0).all()
    assert (seen.max(axis=1) > 0).sum() == 1
    assert known.wear(wear, Direction.HOME).reshape(BANDS, 3).max() > 0
    assert not known.wear(None, Direction.AWAY).any()


def test_biased_stones_are_observed_by_their_identifier():
    known = KnownIce(with_effect("stone_bias", stone=3.0, factor=1.02, curl_factor=0.8))
    numbers = known.of_stones([2, 3])
    assert stone_names() == ("stone_bias.factor", "stone_bias.curl_factor")
    assert not numbers[0].any()
    np.testing.assert_allclose(numbers[1], [0.2, -0.4], atol=1e-6)


def test_numbers_are_observed_as_they_are_or_squashed_but_never_clipped():
    values = np.array([-30.0, -3.0, -0.4, 0.0, 0.4, 0.5, 0.6, 3.0, 30.0])
    shown = squash(values)
    assert (np.diff(shown) > 0).all()
    assert np.abs(shown).max() < 1
    np.testing.assert_array_equal(shown[2:6], values[2:6])
