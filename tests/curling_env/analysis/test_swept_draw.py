"""Extra distance of a swept draw, against mechanics on paper."""

from __future__ import annotations

from dataclasses import replace

import pytest

from curling_env.analysis import sweeping_gain
from curling_env.ice import ActiveEffect, Ice, load_ice
from curling_env.sheet import HOG_LINE_Y, RULE_BOOK_STONE, TEE_Y

POINT = replace(RULE_BOOK_STONE, band_radius=0.0)
LAST_THIRD = (HOG_LINE_Y + TEE_Y) / 3


def swept(ice: Ice, sigma: float = 0.02, **parameters: float) -> Ice:
    effect = ActiveEffect(name="sweeping", parameters=parameters, sigma={"friction_factor": sigma})
    return ice.with_effect(effect)


@pytest.mark.parametrize("factor", [0.7, 0.9, 1.0, 1.2])
@pytest.mark.parametrize("mu", [0.006, 0.012])
def test_on_uniform_ice_the_remaining_distance_is_divided_by_the_factor(factor, mu):
    """Friction against the travel alone: v² = 2 g μ z for the z metres still to go."""
    gain = sweeping_gain(swept(Ice.uniform(mu, stone=POINT), friction_factor=factor))
    assert gain is not None
    assert gain.metres == pytest.approx(LAST_THIRD * (1 / factor - 1), abs=5e-3)
    assert gain.stderr == pytest.approx(0.02 * LAST_THIRD / factor**2, rel=1e-2)


def test_the_standard_error_is_how_far_the_gain_moves_with_the_factor():
    ice = load_ice("standard")

    def gain(sigma: float, factor: float):
        found = sweeping_gain(swept(ice, sigma, friction_factor=factor))
        assert found is not None
        return found

    more, usual, less = (gain(0.03, factor) for factor in (0.85, 0.88, 0.91))
    assert more.metres > usual.metres > less.metres > 0.3
    assert usual.stderr == pytest.approx((more.metres - less.metres) / 2, rel=0.02)
    assert gain(0.0, 0.88) == (pytest.approx(usual.metres), 0.0)


def test_no_remark_if_no_draw_rests():
    ice = Ice.uniform(0.009)
    assert sweeping_gain(ice) is None
    assert sweeping_gain(swept(ice, friction_factor=0.4)) is None  # swept off the sheet
    downhill = ice.with_effect(ActiveEffect(name="slope", parameters={"x": 0.0, "y": 5e-3}))
    assert sweeping_gain(swept(replace(downhill, friction=Ice.uniform(0.004).friction))) is None
