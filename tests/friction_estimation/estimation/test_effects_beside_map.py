"""Effects fitted together with the map, on throws that another program threw."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice
from friction_estimation import estimate_ice


@pytest.fixture(scope="module")
def thrown(sliding) -> dict[float, SimpleNamespace]:
    """Twelve throws on uneven ice, with and without friction that follows the speed."""
    out = {}
    for exponent in (0.0, 0.25):
        rng = np.random.default_rng(7)
        field = sliding.random_field(rng, mu=0.009, spread=0.06, length=3.0)
        starts = sliding.varied_starts(rng, 12, spin=0.0)
        tracks = sliding.measured_throws(field, starts, rng, exponent=exponent, fps=15)
        found = estimate_ice(tracks)
        sheet = found.ice.sheet
        truth = field(*np.meshgrid(sheet.x_centres, sheet.y_centres))
        out[exponent] = SimpleNamespace(tracks=tracks, found=found, truth=truth)
    return out


@pytest.mark.parametrize("exponent", [0.0, 0.25])
def test_the_exponent_is_separated_from_the_map(thrown, exponent):
    ice = thrown[exponent].found.ice
    speed = ice.effect("speed_dependent_friction")
    assert 0 < speed.sigma["exponent"] < 0.01
    assert abs(speed.parameters["exponent"] - exponent) < 3.5 * speed.sigma["exponent"]
    assert ice.effect("slope") is None  # the ice is level


def test_map_is_as_good_as_if_the_effect_were_known(thrown):
    case = thrown[0.25]
    law = ActiveEffect(name="speed_dependent_friction", parameters={"exponent": 0.25})
    given = estimate_ice(case.tracks, effects="none", start=Ice.uniform(0.0085, effects=(law,))).ice
    ignorant = estimate_ice(case.tracks, effects="none").ice
    seen = case.found.ice.friction.observed & given.friction.observed

    def error(ice: Ice) -> float:
        return float(np.sqrt(np.mean((ice.friction.mu / case.truth - 1)[seen] ** 2)))

    assert error(case.found.ice) < 1.2 * error(given) + 2e-3
    assert error(ignorant) > 3 * error(case.found.ice)


def test_stones_that_do_not_turn_say_nothing_of_curl(thrown):
    curl = thrown[0.25].found.ice.effect("curl")
    assert "strength" in curl.believed
    assert curl.sigma["strength"] > 0.7 * 0.0025


def test_without_effects_those_of_the_start_stay(thrown):
    law = ActiveEffect(name="curl", parameters={"strength": 0.004})
    start = Ice.uniform(0.0085, effects=(law,))
    found = estimate_ice(thrown[0.25].tracks[:6], effects="none", start=start)
    assert found.ice.effects == (law,)
