"""Prior of a learned appearance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from friction_estimation.appearance import (
    PARTS,
    TURNED_ALIKE,
    UPRIGHT,
    Appearance,
    ShapePrior,
    StoneModel,
)

TYPICAL = StoneModel(radius=0.143, height=0.1143)


def look_of(model, *, has_handle=True):
    rng = np.random.default_rng(4)
    colours = rng.uniform(80, 140, (len(PARTS), 3))
    return Appearance(model=model, colours=colours, noise=np.ones(3), has_handle=has_handle)


@pytest.mark.parametrize("ties", [UPRIGHT, TURNED_ALIKE])
@pytest.mark.parametrize("has_handle", [True, False])
def test_its_equations_are_the_slope_and_bend_of_its_misfit(ties, has_handle):
    look = look_of(replace(TYPICAL, bevel_height=0.04, foot_inset=0.05), has_handle=has_handle)
    free = ShapePrior(typical=TYPICAL, ties=ties).of(look)
    matrix, pull = free.equations(look)
    step = (
        np.random.default_rng(5).normal(0, 1, free.rows.shape[1])
        * np.r_[free.spread, np.full(3 * free.parts, 5.0)]
    )

    def misfit(share):
        return free.misfit(free.with_values(look, free.values(look) + share * step))

    slope, bend = (misfit(1) - misfit(-1)) / 2, misfit(1) + misfit(-1) - 2 * misfit(0)
    assert slope == pytest.approx(-2 * pull @ step, rel=1e-6)
    assert bend == pytest.approx(2 * step @ matrix @ step, rel=1e-6)


def test_a_band_far_from_half_the_height_is_unlike_a_stone():
    even = replace(TYPICAL, foot_height=0.03, bevel_height=0.03)
    prior = ShapePrior(typical=even)

    def unlikely(model):
        look = look_of(model)
        return prior.of(look).misfit(look) - prior.of(look_of(even)).misfit(look_of(even))

    thick = replace(even, foot_height=0.04, bevel_height=0.04)
    high = replace(even, foot_height=0.04, bevel_height=0.02)
    assert unlikely(high) > unlikely(thick) + 9


def test_a_stone_is_turned_alike_or_not_by_its_insets_too():
    cone = look_of(replace(TYPICAL, foot_inset=0.10, bevel_inset=0.01))
    either, alike = ShapePrior(typical=TYPICAL), ShapePrior(typical=TYPICAL, ties=TURNED_ALIKE)
    assert alike.of(cone).misfit(cone) > either.of(cone).misfit(cone) + 50
