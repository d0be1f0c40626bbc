"""What the agent observes of the ice."""

from __future__ import annotations

import numpy as np

import curling_env  # noqa: F401  (registers the environments)
from curling_env.envs.sheet.observation import BANDS, ice_features
from curling_env.ice import ActiveEffect, load_ice
from curling_env.sheet import Direction


def test_heavy_bands_are_seen_where_they_are(uneven_ice):
    names = [f"{band + 1} {lane}" for band in range(BANDS) for lane in ("left", "middle", "right")]
    away = dict(zip(names, ice_features(uneven_ice, Direction.AWAY)[1:], strict=False))
    home = dict(zip(names, ice_features(uneven_ice, Direction.HOME)[1:], strict=False))
    assert away["8 left"] > 0.3 > 0 > away["8 right"]
    assert away["1 left"] < 0
    assert home["1 right"] > 0.05
    assert home["8 left"] < 0


def test_effects_are_known_and_slopes_turn_with_the_direction():
    slope = ActiveEffect(name="slope", parameters={"x": 1e-3, "y": -5e-4})
    away, home = (
        ice_features(load_ice("standard").with_effect(slope), end)[-7:] for end in Direction
    )
    np.testing.assert_allclose(away[:5], [0.25, 0.41, 0.2, 0.475, 0.23], atol=1e-3)
    np.testing.assert_allclose(away[5:], [0.5, -0.25])
    np.testing.assert_allclose(home[5:], [-0.5, 0.25])
