"""Matérn correlations against their closed forms and one against another."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import gamma, kv

from friction_estimation.design.cramer_rao import matern

AT = np.array([0.05, 0.4, 1.0, 2.5, 7.0])


@pytest.mark.parametrize("smoothness", [1.5, 2.5])
def test_it_is_the_bessel_form(smoothness):
    z = np.sqrt(2 * smoothness) * AT / 1.7
    bessel = 2 ** (1 - smoothness) / gamma(smoothness) * z**smoothness * kv(smoothness, z)
    assert matern(AT, 1.7, smoothness) == pytest.approx(bessel)


def test_the_smoothest_is_gaussian():
    assert matern(AT, 1.7, np.inf) == pytest.approx(np.exp(-0.5 * (AT / 1.7) ** 2))


@pytest.mark.parametrize("smoothness", [1.5, 2.5, np.inf])
def test_a_place_is_wholly_alike_itself(smoothness):
    assert matern(np.zeros(1), 2.0, smoothness) == 1.0
    assert (np.diff(matern(AT, 2.0, smoothness)) < 0).all()
