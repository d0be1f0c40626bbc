"""Priors, amplitudes and the spread, against densities that are written out."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from curling_env.physics import catalogue
from curling_env.sheet import PAPER_SHEET
from friction_estimation.discovery import CARD, Term, crossed_by, field_along, neutral_values
from friction_estimation.discovery.model.candidates import Belief
from friction_estimation.discovery.model.gaussian_field import CameraRipple, GatePlaces
from friction_estimation.discovery.model.linearisation import eliminate_factor
from friction_estimation.discovery.model.minimum import minimum_of, project_out, projected
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.quadratic import (
    _map_amplitude,
    bounded_step,
    integration_cost,
    prior_gram,
    profile_amplitudes,
    profile_spread,
)

ANY_ICE: Any = SimpleNamespace()
MEMBERS = 3


@pytest.fixture
def fields(rng):
    """A model with gates, a ripple, a map and a term with a prior, in this order."""
    places = GatePlaces(
        places=np.array([-5.0, 5.0]), amplitude=0.01, values=np.array([0.004, -0.006])
    )
    nodes = np.linspace(-8.0, 8.0, MEMBERS)
    ripple = CameraRipple(nodes=nodes, length=1.5, values=np.array([0.001, 0.0, -0.002]))
    y = np.linspace(-8.0, 8.0, 40)
    lane = [np.column_stack([0 * y, y])]
    field = field_along(PAPER_SHEET, crossed_by(PAPER_SHEET, lane), 8.0, np.inf)
    field = field.at(0.03 * rng.normal(size=len(field)))
    card = catalogue()["curl"]
    term = Term(
        card=card,
        values=neutral_values(card, strength=0.01, speed_exponent=0.5),
        free=("strength", "speed_exponent"),
        beliefs={"speed_exponent": Belief(mean=0.2, sd=0.1), "spin_exponent": Belief(mean=0, sd=1)},
    )
    return Model(
        ice=ANY_ICE,
        ln_mu=0.1,
        ln_coupling=-0.2,
        systematic_error=places,
        ripple=ripple,
        terms=(Term(card=CARD, map_field=field), term),
    )


def test_parameters_stand_in_the_order_of_their_names(fields):
    size = len(fields.map_field)
    expected = ["ln_mu", "ln_coupling", "systematic_error_0", "systematic_error_1"]
    expected += ["ripple_0", "ripple_1", "ripple_2", *(f"map_{k}" for k in range(size))]
    names = fields.names
    assert [name for _, name in names] == [*expected, "strength", "speed_exponent"]
    assert fields.ripple_slice == slice(4, 7)
    assert fields.map_slice == slice(7, 7 + size)
    vector = fields.vector
    assert vector[:7] == pytest.approx([0.1, -0.2, 0.004, -0.006, 0.001, 0.0, -0.002])
    assert vector[-2:].tolist() == [0.01, 0.5]
    assert len(vector) == len(names)
    moved = fields.at(vector + 1e-3)
    assert moved.vector == pytest.approx(vector + 1e-3)
    assert moved.terms[1].values["spin_exponent"] == fields.terms[1].values["spin_exponent"]
    low, high = fields.bounds
    card = fields.terms[1].card
    assert low[:2].tolist() == [-3.0, -1.0]
    assert high[:2].tolist() == [3.0, 1.0]
    assert np.isneginf(low[2:-2]).all()
    assert np.isposinf(high[2:-2]).all()
    strength, exponent = card.parameter("strength"), card.parameter("speed_exponent")
    assert low[-2:].tolist() == [strength.low, exponent.low]
    assert high[-2:].tolist() == [strength.high, exponent.high]
    far = fields.at(np.full(len(vector), 1e3))
    assert (far.ln_mu, far.ln_coupling) == (3.0, 1.0)
    assert far.terms[1].values["strength"] == strength.high
    (belief,) = fields.beliefs
    assert belief == (len(vector) - 1, 0.5, Belief(mean=0.2, sd=0.1))


def test_another_amplitude_is_that_of_one_field_alone(fields):
    before = [field.amplitude for _, field in fields.fields]
    for which in range(3):
        changed = fields.with_amplitude(which, 0.5)
        after = [field.amplitude for _, field in changed.fields]
        assert after == [0.5 if k == which else a for k, a in enumerate(before)]
        assert changed.vector == pytest.approx(fields.vector)


def test_the_prior_is_the_density_of_all_that_is_known_beforehand(fields, rng):
    """Of steps of any parameters: −2 ln of Gaussians, less that of their middle."""
    size = len(fields.vector) + 1
    gram = prior_gram(fields, size)
    assert gram == pytest.approx(gram.T)
    sd = np.full(size - 1, np.inf)
    sd[1], sd[2:4], sd[4:7], sd[-1] = 0.15, 0.01, fields.ripple.amplitude, 0.1
    sd[fields.map_slice] = fields.map_field.amplitude
    mean = np.zeros(size - 1)
    mean[-1] = 0.2
    known = np.isfinite(sd)
    for _ in range(3):
        step = 0.01 * rng.normal(size=size - 1)
        value = (fields.vector + step)[known]
        expected = -2 * norm.logpdf(value, mean[known], sd[known])
        expected += 2 * norm.logpdf(0.0, 0.0, sd[known])
        move = np.append(-step, 1.0)
        assert move @ gram @ move == pytest.approx(expected.sum())
    without = prior_gram(fields, size, fields=False)
    assert not without[fields.map_slice, fields.map_slice].any()
    assert without[2:7, 2:7] == pytest.approx(gram[2:7, 2:7])
    assert without[1, -1] == gram[1, -1]


@pytest.fixture
def total(fields, rng):
    """Information of throws on all parameters, as columns and a residual."""
    count = len(fields.vector)
    columns = rng.normal(size=(60, count)) * np.where(np.arange(count) < 2, 10.0, 60.0)
    residual = columns[:, 7:] @ rng.normal(0.0, 0.02, count - 7) + rng.normal(size=60)
    whole = np.column_stack([columns, residual])
    return whole.T @ whole


def test_integrating_over_fields_is_a_determinant(fields, total):
    """The determinant of the covariance of what is measured, over that of the noise."""
    places = np.arange(2, fields.map_slice.stop)
    sd = np.concatenate([field.deviations for _, field in fields.fields])
    root = np.linalg.cholesky(total[np.ix_(places, places)] + 1e-9 * np.eye(len(places)))
    covariance = np.eye(len(places)) + root.T @ np.diag(sd**2) @ root
    priors = sum(field.hyperprior for _, field in fields.fields)
    expected = np.linalg.slogdet(covariance)[1] + priors
    assert integration_cost(fields, total) == pytest.approx(expected, rel=1e-6)
    bare = replace(fields, systematic_error=None, ripple=None, terms=fields.terms[1:])
    assert integration_cost(bare, np.eye(5)) == 0.0


def value_of(model, total):
    whole = total + prior_gram(model, len(total))
    return float(minimum_of(whole).value) + integration_cost(model, total)


def test_the_amplitude_of_a_map_beside_other_fields_is_that_of_a_search(fields, total):
    amplitude = _map_amplitude(fields, total)
    tried = {
        a: value_of(fields.with_amplitude(2, float(a)), total) for a in fields.map_field.amplitudes
    }
    assert amplitude == min(tried, key=tried.__getitem__)


def test_no_other_amplitude_of_one_field_is_better(fields, total):
    found, least = profile_amplitudes(fields, total)
    assert least == pytest.approx(value_of(found, total), rel=1e-9)
    for which, (_, field) in enumerate(found.fields):
        for amplitude in field.amplitudes.tolist():
            other = found.with_amplitude(which, amplitude)
            assert value_of(other, total) > least - 1e-6
    assert least < value_of(fields, total)


def test_parameters_at_several_bounds_stop_there_and_the_others_are_best(rng):
    """Against a search over the free ones, given those that stopped."""
    card = catalogue()["slope"]
    term = Term(card=card, values={"x": 0.0, "y": 0.0}, free=("x", "y"))
    model = Model(ice=ANY_ICE, terms=(term,))
    low, high = model.bounds
    columns = rng.normal(size=(20, 4)) @ np.diag([1.0, 1.0, 1e3, 1e3])
    wanted = np.array([0.2, 5.0, 0.5 * high[2], 4.0 * low[3]])
    whole = np.column_stack([columns, columns @ wanted])
    total = whole.T @ whole
    step = bounded_step(total, minimum_of(total).step, model)
    assert step[1] == high[1]
    assert step[3] == low[3]
    free = [0, 2]
    rest = columns @ wanted - columns[:, [1, 3]] @ step[[1, 3]]
    best = np.linalg.lstsq(columns[:, free], rest)[0]
    assert step[free] == pytest.approx(np.clip(best, low[free], high[free]))
    inside = bounded_step(total, 0.5 * low, replace(model, ln_mu=0.0))
    assert inside == pytest.approx(0.5 * low)


def test_the_spread_is_that_of_the_frictions_of_throws(rng):
    """Throws that show their friction alone: −2 ln of a Gaussian of their variance and error."""
    throws, error = 40, 0.004
    own = 0.02 * rng.normal(size=throws)
    h = np.full(throws, error**-2)
    reduced = np.zeros((throws, 3, 3))  # the factor, one shared parameter, and the residual
    reduced[:, 0, 0], reduced[:, 0, 2] = h, h * own
    reduced[:, 2, 0], reduced[:, 2, 2] = h * own, h * own**2
    reduced[:, 1, 1] = 1.0
    spread, value = profile_spread(reduced, np.zeros(throws), np.zeros((2, 2)))

    def deviance(tau):
        variance = tau**2 + error**2
        return (own**2 / variance).sum() + throws * np.log(variance / error**2)

    exact = np.sqrt(np.mean(own**2) - error**2)
    assert spread == pytest.approx(exact, rel=0.01)
    assert value == pytest.approx(deviance(spread))
    assert value == pytest.approx(deviance(exact), abs=0.05)
    # Around other factors it is the same.
    around = 0.01 * rng.normal(size=throws)
    left = own - around
    reduced[:, 0, 2] = reduced[:, 2, 0] = h * left
    reduced[:, 2, 2] = h * left**2
    again, same = profile_spread(reduced, around, np.zeros((2, 2)))
    assert (again, same) == (pytest.approx(spread), pytest.approx(value))
    grams, log_terms = eliminate_factor(reduced, around, spread)
    assert grams[:, -1, -1].sum() + log_terms.sum() == pytest.approx(value)


def test_a_quadratic_with_columns_projected_out_has_them_at_their_best(rng):
    columns, values = rng.normal(size=(30, 5)) * [1.0, 1e3, 1.0, 1e-3, 5.0], rng.normal(size=30)
    whole = np.column_stack([columns, values])
    gram = whole.T @ whole
    left = project_out(gram, 2)
    first = columns[:, :2]
    rest = whole[:, 2:] - first @ np.linalg.lstsq(first, whole[:, 2:])[0]
    scale = np.sqrt(np.diag(gram)[2:])
    assert left / np.outer(scale, scale) == pytest.approx(
        rest.T @ rest / np.outer(scale, scale), abs=1e-7
    )
    # With some kept, others at their best, and the last one fixed.
    kept, others = np.array([4, 0]), np.array([2])
    some = projected(gram, kept, others)
    part = whole[:, [4, 0, 5]]
    rest = part - columns[:, 2:3] @ np.linalg.lstsq(columns[:, 2:3], part)[0]
    assert some == pytest.approx(rest.T @ rest, rel=1e-6, abs=1e-6)


def test_the_level_of_a_quadratic_is_the_integral_of_its_density(rng):
    """In one and two dimensions, by sums over a grid."""
    columns, values = rng.normal(size=(12, 2)), rng.normal(size=12)
    for count in (1, 2):
        whole = np.column_stack([columns[:, :count], values])
        found = minimum_of(whole.T @ whole)
        axis, width = np.linspace(-6.0, 6.0, 601, retstep=True)
        steps = np.stack(np.meshgrid(*[axis] * count, indexing="ij"), axis=-1).reshape(-1, count)
        square = ((values - steps @ columns[:, :count].T) ** 2).sum(axis=1)
        integral = np.exp(-0.5 * square).sum() * width**count
        expected = -2.0 * np.log(integral) + count * np.log(2 * np.pi)
        assert float(found.level) == pytest.approx(expected, rel=1e-6)
        covariance = np.linalg.inv(columns[:, :count].T @ columns[:, :count])
        peak = multivariate_normal(found.step, covariance).logpdf(found.step)
        assert float(found.level - found.value) == pytest.approx(
            2.0 * peak + count * np.log(2 * np.pi)
        )
        assert found.pivots.prod() == pytest.approx(np.linalg.det(covariance) ** -0.5)
