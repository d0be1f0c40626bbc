"""Random ices: their stated spread, and the agent's knowledge of them."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.analysis import ice_uncertainty
from curling_env.envs.random_ice import RandomIces
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


def test_the_same_seed_is_the_same_ice_whatever_signs_eigenvectors_have(monkeypatch) -> None:
    lengths = {
        "length": 3.1,
        "breadth": 1.1,
        "error_length": 2.1,
    }  # of no other test: roots are kept
    first = RandomIces(**lengths).draw(np.random.default_rng(0))
    eigh, rng = np.linalg.eigh, np.random.default_rng(1)

    def flipped(matrix):
        values, vectors = eigh(matrix)
        return values, vectors * rng.choice([-1.0, 1.0], len(values))

    ice_uncertainty._correlation_root.cache_clear()
    monkeypatch.setattr(np.linalg, "eigh", flipped)
    again = RandomIces(**lengths).draw(np.random.default_rng(0))
    ice_uncertainty._correlation_root.cache_clear()
    for one, other in zip(first, again, strict=True):
        np.testing.assert_allclose(one.friction.mu, other.friction.mu, rtol=1e-9)


def test_ices_drawn_together_are_those_drawn_alone() -> None:
    distribution = RandomIces()
    drawn = distribution.draw_many([np.random.default_rng(k) for k in range(5)])
    for k in range(5):
        ice, known = distribution.draw(np.random.default_rng(k))
        np.testing.assert_array_equal(drawn.ices.ice(k).friction.mu, ice.friction.mu)
        np.testing.assert_array_equal(drawn.estimate(k).friction.mu, known.friction.mu)
        assert drawn.ices.ice(k).effects == ice.effects
