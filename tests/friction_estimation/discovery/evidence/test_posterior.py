"""Draws from the posterior agree with the intervals, with the truth and with their own data."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.physics import slide
from curling_env.sheet import Direction
from curling_env.throw import Throw
from friction_estimation.discovery import CARD as MAP_CARD
from friction_estimation.discovery import (
    SessionNoise,
    Term,
    base_model,
    crossed_by,
    draw_posterior,
    field_along,
    fit_with_noise,
    linearise,
    map_errors,
    open_session,
    predict,
    refit,
    sensitivities,
    standard_errors,
)
from friction_estimation.discovery.evidence.posterior import (
    _draw_factors,
    _root,
    cells_of,
    log_variances,
    quadratic,
    release_precisions,
    throw_constants,
)
from friction_estimation.discovery.tuning import RELEASE_SIGMA, USUAL_SPREAD

from ..conftest import plain_session

WHITE = SessionNoise(white=(0.004, 0.004, 0.02), fading=(0.0,) * 3, memory=(0.1,) * 3)
SPREAD = 3e-4


def test_draws_have_the_standard_errors_and_the_same_seed_the_same_draws(curl_fit):
    fitted = curl_fit(scatter=0.01)
    drawn = draw_posterior(fitted, np.random.default_rng(1))
    low, high = np.quantile(drawn.shared, [0.025, 0.975], axis=0)
    sigma = np.array([standard_errors(fitted)[name] for name in drawn.names])
    assert (high - low) / (2 * 1.96) == pytest.approx(sigma, rel=0.12)
    assert np.abs(drawn.shared.mean(axis=0) - fitted.model.vector) == pytest.approx(0, abs=0.2)
    again = draw_posterior(fitted, np.random.default_rng(1))
    assert np.array_equal(drawn.states, again.states)
    assert np.array_equal(drawn.log_likelihood, again.log_likelihood)


def test_frictions_of_throws_are_those_that_were_thrown(rng):
    ln_mu = np.log(0.009) + rng.normal(0.0, 0.01, 20)
    tracks = []
    for k, each in enumerate(ln_mu):
        throw = Throw(speed=1.4 + 0.07 * k, spin=1.5 * (-1) ** (k // 2), x=0.3 * (-1) ** k)
        release = throw.release(Direction.AWAY if k % 2 else Direction.HOME, order=k)
        path = slide(Ice.uniform(float(np.exp(each))), release, fps=15, throw=k).trajectory
        tracks.append(replace(path, xy=path.xy + rng.normal(0, 0.004, path.xy.shape)))
    session = open_session(tracks)
    fitted = fit_with_noise(base_model(None, session), session)
    drawn = draw_posterior(fitted, np.random.default_rng(1))
    level = np.log(fitted.model.ice.friction.mu.mean())
    found = level + drawn.shared[:, :1] + drawn.ln_factors
    low, high = np.quantile(found, [0.025, 0.975], axis=0)
    assert ((low < ln_mu) & (ln_mu < high)).sum() >= 17
    assert (high - low).max() < 0.008  # a throw shows its own friction well
    assert np.quantile(drawn.spreads, 0.02) < 0.01 < np.quantile(drawn.spreads, 0.98)


def test_releases_lie_around_the_fitted_ones_and_predict_the_tracks(curl_fit):
    fitted = curl_fit(throws=8)
    drawn = draw_posterior(fitted, np.random.default_rng(1), draws=400)
    off = (drawn.states.mean(axis=0) - fitted.states) / drawn.states.std(axis=0)
    assert np.abs(off).max() < 0.5
    # A draw of everything foretells the rows of its throws as closely as the fit does.
    model = fitted.model.at(drawn.shared[7])
    path = predict(model, fitted.session, drawn.states[7], drawn.ln_factors[7])
    miss = fitted.session.xy - path[:, :2]
    assert float(np.sqrt((miss**2).mean())) < 1.5 * fitted.noise.position


def test_few_throws_have_the_usual_spread(curl_fit):
    fitted = curl_fit(throws=8)
    alone = replace(
        fitted,
        session=fitted.session.only([0, 1, 2]),
        linear=replace(fitted.linear, grams=fitted.linear.grams[:3], ln_factors=np.zeros(3)),
        states=fitted.states[:3],
    )
    drawn = draw_posterior(alone, np.random.default_rng(1), draws=400)
    assert (drawn.spreads == USUAL_SPREAD).all()
    assert 0.0 < drawn.ln_factors.std() < 1.2 * USUAL_SPREAD


@pytest.fixture
def one_throw(curl_fit):
    """A fit of one throw with white noise; its rows and derivatives, in units of the noise.

    Throws differ in friction by as much as the throw itself leaves open.
    """
    fitted = curl_fit(throws=8)
    one, state, factor = fitted.session.only([2]), fitted.states[2:3], np.zeros(1)
    linear = linearise(fitted.model, one, WHITE, state, factor)[1]
    alone = replace(
        fitted, session=one, noise=WHITE, linear=linear, states=state, only_spread=SPREAD
    )
    predicted, columns = sensitivities(fitted.model, one, state, factor)
    noise = (np.array(WHITE.white) * one.sigma[:, [0, 0, 1]]).ravel()
    residual = (one.observed - predicted[:, [0, 1, 4]]).ravel() / noise
    return alone, noise, residual, columns.reshape(len(noise), -1) / noise[:, None]


def test_the_likelihood_is_a_density_of_the_rows(one_throw):
    """Of white noise it is that of a Gaussian whose covariance is written out."""
    alone, noise, residual, columns = one_throw
    constant = 2 * np.log(noise).sum() + len(noise) * np.log(2 * np.pi)

    def deviance(left, spread):
        weak = columns[:, :7] * np.append(RELEASE_SIGMA, spread)
        covariance = np.eye(len(left)) + weak @ weak.T
        log_det = np.linalg.slogdet(covariance)[1]
        return left @ np.linalg.solve(covariance, left) + log_det + constant

    found = alone.linear.reduced[0, -1, -1] + throw_constants(alone)[0]
    assert found == pytest.approx(deviance(residual, 0.0), abs=0.1)
    # A draw has the density at its shared parameters, with the friction of the throw unknown.
    drawn = draw_posterior(alone, np.random.default_rng(1), draws=4)
    assert (drawn.spreads == SPREAD).all()
    for shared, ln_density in zip(drawn.shared, drawn.log_likelihood[:, 0], strict=True):
        left = residual - columns[:, 7:] @ (shared - alone.model.vector)
        assert -2 * ln_density == pytest.approx(deviance(left, SPREAD), abs=0.1)


def test_release_and_friction_of_a_throw_are_drawn_from_their_gaussian(one_throw):
    """Given the shared parameters it is that of a least-squares problem, written out."""
    alone, _, residual, columns = one_throw
    drawn = draw_posterior(alone, np.random.default_rng(1))
    own = columns[:, :7]
    prior = np.diag(np.append(RELEASE_SIGMA, SPREAD) ** -2)
    covariance = np.linalg.inv(own.T @ own + prior)
    left = residual - (drawn.shared - alone.model.vector) @ columns[:, 7:].T
    steps = np.column_stack([drawn.states[:, 0] - alone.states[0], drawn.ln_factors])
    off = steps - left @ own @ covariance
    deviations = np.sqrt(np.diag(covariance))
    assert off.mean(axis=0) / deviations == pytest.approx(0, abs=0.08)
    assert np.cov(off.T) / np.outer(deviations, deviations) == pytest.approx(
        covariance / np.outer(deviations, deviations), abs=0.1
    )


def test_ln_variance_counts_what_was_measured(curl_fit):
    session = curl_fit(throws=8).session
    heading = session.theta.copy()
    heading[session.rows(0)] = np.nan
    n = session.rows(0).stop
    place, turn = (np.log(session.sigma[:n]).sum(axis=0) + n * np.log([0.004, 0.02])).tolist()
    assert log_variances(session, WHITE)[0] == pytest.approx(2 * (2 * place + turn))
    assert log_variances(replace(session, theta=heading), WHITE)[0] == pytest.approx(4 * place)


def test_the_map_is_drawn_with_its_standard_errors(curl_fit):
    fitted = curl_fit(throws=10)
    paths = [fitted.session.xy[fitted.session.rows(i)] for i in range(10)]
    sheet = fitted.model.ice.sheet
    field = field_along(sheet, crossed_by(sheet, paths), 2.0, 1.5)
    mapped = refit(fitted, fitted.model.with_terms(Term(card=MAP_CARD, map_field=field)))
    drawn = draw_posterior(mapped, np.random.default_rng(1))
    assert drawn.mu is not None
    assert drawn.mu.shape == (2000, *fitted.model.ice.sheet.shape)
    sigma = map_errors(mapped)
    assert sigma is not None
    ratio = np.log(drawn.mu).std(axis=0) / sigma
    assert np.median(ratio) == pytest.approx(1.0, abs=0.05)
    assert 0.8 < ratio.min() < ratio.max() < 1.3
    off = np.abs(np.log(drawn.mu / 0.009).mean(axis=0)) / sigma
    assert np.median(off) < 1.5  # the ice has no map


def test_the_square_of_what_is_left_after_a_step_is_written_out(rng):
    columns, values = rng.normal(size=(3, 10, 2)), rng.normal(size=(3, 10))
    whole = np.concatenate([columns, values[:, :, None]], axis=2)
    grams, steps = np.einsum("kni,knj->kij", whole, whole), rng.normal(size=(4, 2))
    left = values[None] - np.einsum("kni,mi->mkn", columns, steps)
    assert quadratic(grams, steps) == pytest.approx((left**2).sum(axis=2))


def test_a_release_is_believed_weakly_but_for_a_spin_that_was_not_seen():
    session = plain_session(throws=2)
    theta = session.theta.copy()
    theta[session.rows(1)] = np.nan
    seen, blind = release_precisions(replace(session, theta=theta))
    assert seen == pytest.approx(RELEASE_SIGMA**-2)
    assert blind[:4] == pytest.approx(seen[:4])
    assert blind[5] == pytest.approx(0.6**-2, rel=1e-3)
    assert blind[4] > 1e12  # the heading stays as it is


def test_a_root_has_its_covariance_also_without_full_rank(rng):
    rows = rng.normal(size=(2, 3)) * [1e3, 1.0, 1e-3]
    covariance = rows.T @ rows
    scale = np.sqrt(np.diag(covariance))
    root = _root(covariance)
    assert root @ root.T / np.outer(scale, scale) == pytest.approx(
        covariance / np.outer(scale, scale), abs=1e-7
    )
    assert np.isfinite(_root(np.zeros((2, 2)))).all()


def test_without_a_spread_all_throws_have_the_same_friction(rng):
    """With one, they are drawn around what each throw says and all throws have."""
    reduced = np.zeros((2, 3, 3))
    reduced[:, 0, 0] = 1e4, 1e6
    reduced[:, 0, 1] = 1e4, 0.0  # a step of the shared parameter is taken for its friction
    reduced[:, 0, 2] = 100.0, -1000.0
    factors = np.array([0.01, 0.02])
    steps = np.full((4000, 1), 0.003)
    assert not _draw_factors(reduced, factors, 0.0, steps, rng).any()
    drawn = _draw_factors(reduced, factors, 0.01, steps, rng)
    h = np.array([1e4, 1e6])
    says = factors + np.array([100.0 - 30.0, -1000.0]) / h  # each throw alone
    precision = h + 1e4
    assert drawn.mean(axis=0) == pytest.approx(h * says / precision, abs=3e-4)
    assert drawn.std(axis=0) == pytest.approx(precision**-0.5, rel=0.05)


def test_only_a_map_has_cells_and_only_of_so_many_that_they_fit_in_memory(rng):
    model: Any = SimpleNamespace(map_field=None)
    assert cells_of(model, np.zeros((1, 2)), rng) is None
    for cells, drawn in ((4001, False), (4, True)):
        field = SimpleNamespace(
            patterns=np.arange(float(cells))[:, None], amplitude=0.01,
            unresolved_covariance=lambda n=cells: np.diag(np.arange(float(n))),
        )  # fmt: skip
        mu = np.full((2, 2), 0.01) * [[1.0, 2.0], [1.0, 1.0]]
        ice = SimpleNamespace(friction=SimpleNamespace(mu=mu))
        model = SimpleNamespace(map_field=field, map_slice=slice(2, 3), ice=ice)
        vectors = np.tile([0.1, 5.0, 0.02], (3000, 1))
        found = cells_of(model, vectors, rng)
        assert (found is not None) == drawn
    assert found is not None
    assert found.shape == (3000, 2, 2)
    left = np.log(found / mu).reshape(3000, 4)
    assert left.mean(axis=0) == pytest.approx(0.1 + 0.02 * np.arange(4), abs=2e-3)
    assert left.std(axis=0) == pytest.approx(0.01 * np.sqrt(np.arange(4)), rel=0.06)
