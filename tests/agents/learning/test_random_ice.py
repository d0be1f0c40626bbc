"""Random ices: their stated spread, and the agent's knowledge of them."""

from __future__ import annotations

import numpy as np
import pytest

from agents.learning import RandomIces
from curling_env.errors import InputError
from curling_env.ice import load_ice


def test_ices_have_the_stated_spread() -> None:
    ices, rng = RandomIces(level=0.06, areas=0.04, error=0.015), np.random.default_rng(0)
    drawn = [ices.draw(rng) for _ in range(60)]
    log_mu = np.log([ice.friction.mu for ice, _ in drawn]) - np.log(0.0082)
    # Sixty ices tell a spread to about a tenth of it; an ice has some ten areas along its middle.
    assert log_mu.mean(axis=(1, 2)).std() == pytest.approx(0.06, rel=0.3)
    assert log_mu.std(axis=(1, 2)).mean() == pytest.approx(0.04, rel=0.15)
    error = np.log([known.friction.mu / ice.friction.mu for ice, known in drawn])
    assert error.std() == pytest.approx(0.015, rel=0.1)
    curl = [ice.effect("curl").parameters["strength"] for ice, _ in drawn]
    assert np.std(np.log(curl)) == pytest.approx(0.1, rel=0.3)


def test_the_known_ice_does_not_change_the_true_one() -> None:
    ices = RandomIces()
    by = {k: ices.draw(np.random.default_rng(4), k) for k in ("map", "mean", "nothing")}
    for ice, _ in by.values():
        np.testing.assert_array_equal(ice.friction.mu, by["map"][0].friction.mu)
    assert not by["map"][1].friction.is_uniform
    assert by["mean"][1].friction.is_uniform
    assert by["mean"][1].friction.mu.mean() == pytest.approx(by["map"][1].friction.mu.mean())
    np.testing.assert_array_equal(by["nothing"][1].friction.mu, load_ice("standard").friction.mu)


def test_no_spread_is_the_base_ice() -> None:
    ices = RandomIces(level=0.0, areas=0.0, curl=0.0, error=0.0)
    for ice in ices.draw(np.random.default_rng(1)):
        np.testing.assert_allclose(ice.friction.mu, 0.0082)
        assert ice.effects == load_ice("standard").effects


@pytest.mark.parametrize("wrong", [{"level": -0.1}, {"areas": 1.5}, {"length": 0.0}])
def test_invalid_spreads_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError):
        RandomIces(**wrong)
