"""Draws to every lane, checked against single slides on ice that was made for it."""

from __future__ import annotations

from dataclasses import replace
from math import hypot

import numpy as np
import pytest

from agents.coaching import LANES
from agents.coaching.lane_draws import lane_draws
from curling_env.ice import load_ice
from curling_env.physics import slide
from curling_env.sheet import TEE_Y, Direction


def ice_with(mu=None, sigma=0.0, observed=None):
    ice = load_ice("standard")
    friction = ice.friction
    return replace(
        ice,
        friction=replace(
            friction,
            mu=friction.mu if mu is None else mu,
            sigma=np.full_like(friction.mu, sigma),
            observed=friction.observed if observed is None else observed,
        ),
    )


@pytest.mark.parametrize("direction", list(Direction))
def test_every_draw_rests_on_its_lane(direction):
    ice = load_ice("standard")
    draws = lane_draws(ice, direction)
    assert [draw.lane for draw in draws] == [lane for lane in LANES for _ in range(2)]
    for draw in draws:
        rest = slide(ice, draw.throw.release(direction))
        assert hypot(direction * rest.x - draw.lane, direction * rest.y - TEE_Y) < 0.01
        assert draw.seconds_sigma is None
        assert draw.ice_sigma is None
        assert draw.seen == 1.0
        # A stone that turns clockwise curls to the right: the broom is to the left of its rest.
        side = draw.description.broom_m - draw.lane
        assert side * draw.throw.spin > 0
        assert 0.8 < abs(side) < 2.0


def test_a_heavy_side_asks_for_more_weight():
    ice = load_ice("standard")
    mu = ice.friction.mu.copy()
    mu[:, ice.sheet.x_centres > 0.3] *= 1.05
    heavy_right = ice_with(mu)
    away = {(d.lane, d.throw.spin): d for d in lane_draws(heavy_right)}
    home = {(d.lane, d.throw.spin): d for d in lane_draws(heavy_right, Direction.HOME)}
    for spin in (1.5, -1.5):
        left, right = away[LANES[0], spin], away[LANES[-1], spin]
        assert right.description.hog_to_hog_s < left.description.hog_to_hog_s - 0.1
        # For a thrower in the other direction that side is on the left.
        left, right = home[LANES[0], spin], home[LANES[-1], spin]
        assert left.description.hog_to_hog_s < right.description.hog_to_hog_s - 0.1


def test_standard_errors_follow_those_of_the_ice():
    once, twice = (lane_draws(ice_with(sigma=s), lanes=(0.0,))[0] for s in (5e-5, 1e-4))
    assert twice.seconds_sigma == pytest.approx(2 * once.seconds_sigma, rel=0.1)
    assert twice.ice_sigma == pytest.approx(2 * once.ice_sigma, rel=0.1)
    # One per cent of friction is 0.07 s of a draw; errors alike over 2 m average over the way.
    assert 0.003 < twice.seconds_sigma < 0.07


def test_ice_without_throws_is_reported():
    ice = load_ice("standard")
    seen = np.ones_like(ice.friction.mu, dtype=bool)
    seen[:, ice.sheet.x_centres < -0.8] = False
    left = lane_draws(ice_with(observed=seen), lanes=(-1.219, 1.219))
    shares = [draw.seen for draw in left]
    assert max(shares[:2]) < 0.9
    assert min(shares[2:]) == 1.0
