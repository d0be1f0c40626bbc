"""All throws together correct the ice of each."""

from __future__ import annotations

import numpy as np
import pytest

from agents.coaching.misses.ices import Parts, agree

SIGMA = 0.3
"""Standard deviation of the ice's error [m]."""


def throws(rng, count, *, off, own=0.1):
    """Return throws with a part of the ice's and an unexplained one, on an ice that is `off`
    short.
    """
    ices = SIGMA * rng.standard_normal(200)
    ices -= ices.mean()
    found = []
    for _ in range(count):
        unexplained = own * rng.standard_normal()
        value = np.array([[0.0, 1.0 + off], [0.0, unexplained - off]])
        draws = np.repeat(value[None], 200, axis=0)
        draws[:, 0, 1] += ices
        draws[:, 1, 1] -= ices
        found.append(Parts(value=value, draws=draws))
    return found


def test_an_ice_that_is_off_is_corrected():
    rng = np.random.default_rng(1)
    found = agree(throws(rng, 16, off=0.4), rng)
    assert found.left[1] == pytest.approx(-0.4, abs=0.08)
    for one in found.parts:
        assert one.value[0, 1] == pytest.approx(1.0, abs=0.08)
        assert one.draws[:, 0, 1].std() < 0.15 * SIGMA + 0.03
        assert one.draws[:, 0, 1].mean() == pytest.approx(one.value[0, 1], abs=0.02)
    assert found.remark is None


def test_parts_still_add_up():
    rng = np.random.default_rng(2)
    before = throws(rng, 8, off=0.2)
    for one, other in zip(before, agree(before, rng).parts, strict=True):
        assert other.value.sum(axis=0) == pytest.approx(one.value.sum(axis=0))
        assert other.draws.sum(axis=1) == pytest.approx(one.draws.sum(axis=1))


def test_few_throws_correct_nothing():
    rng = np.random.default_rng(3)
    before = throws(rng, 3, off=0.4)
    assert agree(before, rng).parts == before


def test_an_ice_off_by_more_than_its_errors_is_reported():
    rng = np.random.default_rng(4)
    found = agree(throws(rng, 16, off=3.0), rng)
    assert "3.0" in found.remark
    assert "short of the prediction of this ice file" in found.remark
