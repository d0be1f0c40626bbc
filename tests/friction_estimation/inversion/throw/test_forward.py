"""The motion of a stone along its path, and its sensitivities."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, FrictionMap, Ice
from curling_env.sheet import PAPER_SHEET
from friction_estimation.inversion.throw.fitted import initialise_throw
from friction_estimation.inversion.throw.forward import LawOnMap, sensitivities
from friction_estimation.tracks.free_slide import free_slide


@pytest.mark.parametrize("interpolation", ["bilinear", "cell"])
def test_sensitivities_are_the_derivatives_of_the_motion(sliding, rng, interpolation):
    tracks = sliding.measured_throws(
        sliding.uniform(0.009), sliding.varied_starts(rng, 2), rng, curl=0.006
    )
    effects = (
        ActiveEffect(name="speed_dependent_friction", parameters={"exponent": 0.2}),
        ActiveEffect(name="slope", parameters={"x": 1e-4, "y": 2e-4}),
    )
    mu = np.full(PAPER_SHEET.shape, 0.009)
    friction = FrictionMap(mu=mu, sigma=0 * mu, observed=mu > 0, interpolation=interpolation)
    law = LawOnMap.of(Ice(friction=friction, effects=effects))
    throw = initialise_throw(free_slide(tracks[0]), 0)
    field = rng.normal(0, 0.05, mu.size)
    law = law.with_field(np.log(0.009), field)
    motion = law.integrate(throw.inputs, throw.start, throw.speed)
    cells, weights = law.cell_weights(throw.inputs.path.at(motion.distance))
    shares = weights * law.mu.ravel()[cells]
    shares /= shares.sum(axis=1, keepdims=True)
    crossed, release, by_cell = sensitivities(motion, cells, shares)
    moving = motion.speed > 0.3
    change = rng.normal(0, 1e-3, len(crossed))
    other = field.copy()
    other[crossed] += change
    changed = law.with_field(np.log(0.009), other)
    moved = changed.integrate(throw.inputs, throw.start, throw.speed)
    bent = moved.distance - motion.distance
    # Constant cells that differ by 5 % make the path itself jump; Gauss-Newton needs no more.
    tolerance = 0.03 if interpolation == "bilinear" else 0.25
    assert np.abs(bent - by_cell @ change)[moving].max() < tolerance * np.abs(bent).max()
    faster = law.integrate(throw.inputs, throw.start, throw.speed + 1e-3)
    expected = (faster.distance - motion.distance) / 1e-3
    assert np.allclose(expected[moving], release[moving, 1], rtol=tolerance, atol=0.05)
