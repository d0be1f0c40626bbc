"""The friction map as a Gaussian field, and how paths respond to it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.sheet import PAPER_SHEET, Sheet
from friction_estimation.design.cramer_rao import matern
from friction_estimation.discovery import (
    CARD,
    MEASURED,
    Term,
    base_model,
    crossed_by,
    field_along,
    fields_to_try,
    fit,
    fit_with_noise,
    open_session,
    predict,
    refit,
)
from friction_estimation.discovery.model.friction_field import cells_at
from friction_estimation.discovery.model.minimum import minimum_of
from friction_estimation.discovery.model.quadratic import (
    integration_cost,
    prior_gram,
    profile_amplitudes,
)
from friction_estimation.discovery.model.sensitivity import linearised_paths


@pytest.fixture(scope="module")
def lane() -> np.ndarray:
    y = np.linspace(-11.0, 17.0, 400)
    return np.column_stack([0.3 + 0.02 * y, y])


def test_where_stones_ran_the_patterns_hold_the_prior_of_the_field(lane) -> None:
    field = field_along(PAPER_SHEET, crossed_by(PAPER_SHEET, [lane]), 3.0, 2.5)
    on_lane = field.patterns_at(lane)
    own = on_lane @ on_lane.T
    apart = np.abs(lane[:, 1][:, None] - lane[:, 1])
    r = np.sqrt(5.0) * apart / 3.0
    expected = (1.0 + r + r**2 / 3.0) * np.exp(-r)  # Matérn of order 5/2
    assert np.abs(own - expected).max() < 0.15
    assert np.diag(own).mean() > 0.9
    assert field.unresolved().max() == pytest.approx(1.0, abs=0.02)  # far from every stone
    # And so they do where some of it was crossed far more often.
    often = [lane, *[lane[:150]] * 30]
    uneven = field_along(PAPER_SHEET, crossed_by(PAPER_SHEET, often), 3.0, 2.5).patterns_at(lane)
    assert np.abs(uneven @ uneven.T - own).max() < 0.05


def test_a_field_takes_over_what_another_says_where_stones_ran(lane) -> None:
    crossed = crossed_by(PAPER_SHEET, [lane])
    smooth = field_along(PAPER_SHEET, crossed, 5.0, 2.5)
    smooth = smooth.at(0.04 * np.random.default_rng(3).standard_normal(len(smooth)))
    rough = field_along(PAPER_SHEET, crossed, 1.5, np.inf).near(smooth.ln_mu)
    off = (rough.ln_mu - smooth.ln_mu).ravel()[rough.crossed]
    ln_mu = smooth.ln_mu.ravel()[rough.crossed]
    assert np.abs(off).max() < 0.2 * np.abs(ln_mu).max()
    assert np.sqrt(np.mean(off**2)) < 0.05 * np.sqrt(np.mean(ln_mu**2))


def test_small_cells_need_no_more_patterns(lane) -> None:
    narrow = Sheet(cell_size=0.1)
    fine = field_along(narrow, crossed_by(narrow, [lane]), 3.0, 2.5)
    coarse = field_along(PAPER_SHEET, crossed_by(PAPER_SHEET, [lane]), 3.0, 2.5)
    assert abs(len(fine) - len(coarse)) <= 3
    assert fine.patterns.shape[0] == 45 * 445


def test_the_four_cells_around_a_point_interpolate_its_place() -> None:
    points = np.array([[0.13, -3.4], [-1.9, 20.2]])
    cells, weights = cells_at(PAPER_SHEET, points)
    y, x = np.meshgrid(PAPER_SHEET.y_centres, PAPER_SHEET.x_centres, indexing="ij")
    assert (weights * x.ravel()[cells]).sum(axis=1) == pytest.approx(points[:, 0])
    assert (weights * y.ravel()[cells]).sum(axis=1) == pytest.approx(points[:, 1])


@pytest.fixture(scope="module")
def mapped():
    """A fit with a map, and its session."""
    from curling_env.ice import Ice
    from curling_env.physics import slide
    from curling_env.sheet import Direction
    from curling_env.throw import Throw

    rng = np.random.default_rng(4)
    y, x = np.meshgrid(PAPER_SHEET.y_centres, PAPER_SHEET.x_centres, indexing="ij")
    even = Ice.uniform(0.009)
    wavy = replace(even.friction, mu=even.friction.mu * np.exp(0.05 * np.sin(y / 2.5 + x)))
    tracks = []
    for k in range(6):
        throw = Throw(speed=rng.uniform(1.6, 2.6), angle=0.01 * (k - 2), spin=1.5)
        way = Direction.AWAY if k % 2 else Direction.HOME
        path = slide(replace(even, friction=wavy), throw.release(way), fps=15, throw=k).trajectory
        tracks.append(replace(path, xy=path.xy + rng.normal(0, 0.002, path.xy.shape)))
    plain = base_model(None, open_session(tracks))
    base = fit_with_noise(plain, open_session(tracks))
    session = base.session
    paths = [session.xy[session.rows(i)] for i in range(len(session))]
    field = field_along(PAPER_SHEET, crossed_by(PAPER_SHEET, paths), 2.0, 2.5)
    return refit(base, base.model.with_terms(Term(card=CARD, map_field=field))), wavy.mu / 0.009


def test_the_map_is_found_where_stones_ran(mapped) -> None:
    fitted, true = mapped
    field = fitted.model.map_field
    error = field.ln_mu + fitted.model.ln_mu - np.log(true * 0.009 / fitted.model.ice.friction.mu)
    error = error.ravel()[field.crossed]
    assert np.sqrt(np.mean((error - error.mean()) ** 2)) < 0.015  # of 0.035


def test_paths_respond_to_a_pattern_as_paths_on_the_changed_map_do(mapped) -> None:
    fitted, _ = mapped
    model, session = fitted.model, fitted.session
    paths = linearised_paths(model, session, fitted.states, fitted.ln_factors)
    columns = paths.responses(paths.friction, model.map_field.patterns_at(paths.xy))
    here = predict(model, session, fitted.states, fitted.ln_factors)[:, MEASURED]
    for j in (0, 4, 9):
        moved = model.vector
        moved[model.map_slice.start + j] += 1e-4
        there = predict(model.at(moved), session, fitted.states, fitted.ln_factors)[:, MEASURED]
        change = (there - here) / 1e-4
        assert np.abs(change - columns[:, :, j])[:, :2].max() < 0.004 * np.abs(change).max()


def test_the_best_amplitude_is_that_of_a_search_over_all(mapped) -> None:
    fitted, _ = mapped
    total = fitted.linear.each()[0].sum(axis=0)
    found, least = profile_amplitudes(fitted.model, total)
    tried = {}
    for amplitude in fitted.model.map_field.amplitudes:
        other = fitted.model.with_amplitude(0, float(amplitude))
        whole = total + prior_gram(other, len(total))
        tried[amplitude] = float(minimum_of(whole).value) + integration_cost(other, total)
    assert found.map_field.amplitude == min(tried, key=lambda a: tried[a])
    assert least == pytest.approx(min(tried.values()), rel=1e-8)


def test_an_earlier_map_holds_where_it_was_known() -> None:
    """The prior of the deviation is what was not known of a cell, and what changed since."""
    y = np.linspace(-15.0, 15.0, 200)
    paths = [np.column_stack([np.full(200, x), y]) for x in (-1.0, 0.0, 1.0)]
    cells = PAPER_SHEET.shape[0] * PAPER_SHEET.shape[1]
    known = np.full(cells, 0.05)
    known[PAPER_SHEET.shape[1] * 40 :] = 0.001
    field = field_along(
        PAPER_SHEET, crossed_by(PAPER_SHEET, paths), 3.2, 2.5, known=known, change=0.01
    )
    assert field.amplitudes.tolist() == [0.01]
    variance = (field.patterns**2).sum(axis=1) + field.unresolved()
    expected = 1.0 + (known / 0.01) ** 2
    assert variance == pytest.approx(expected, rel=1e-6)
    shown = (field.patterns**2).sum(axis=1)[field.crossed]
    assert np.median(shown / expected[field.crossed]) > 0.95
    tried = fields_to_try(PAPER_SHEET, paths, known)
    assert len({f.amplitude for f in tried}) == 5


def test_a_fit_that_begins_at_a_much_too_large_map_comes_back(mapped) -> None:
    """The size of the map goes no further than its coefficients, which are still large."""
    fitted, _ = mapped
    field = fitted.model.map_field
    large = Term(card=CARD, map_field=field.at(4.0 * field.values).with_amplitude(0.3))
    model = fitted.model.without(CARD.name).with_terms(large)
    begin = {"states": fitted.states, "ln_factors": fitted.ln_factors}
    again = fit(model, fitted.session, fitted.noise, **begin)
    assert again.model.map_field.amplitude < 0.25
    assert again.deviance == pytest.approx(fitted.deviance, abs=0.5)
    assert again.model.vector == pytest.approx(fitted.model.vector, abs=0.1)


def test_what_patterns_omit_is_the_rest_of_the_prior(lane) -> None:
    field = field_along(PAPER_SHEET, crossed_by(PAPER_SHEET, [lane]), 3.0, 2.5)
    left = field.unresolved_covariance()
    some = np.array([0, 40, 333, 600])
    y, x = np.meshgrid(PAPER_SHEET.y_centres, PAPER_SHEET.x_centres, indexing="ij")
    centres = np.column_stack([x.ravel(), y.ravel()])[some]
    apart = np.hypot(*(centres[:, None] - centres).transpose(2, 0, 1))
    whole = matern(apart, 3.0, 2.5)
    expected = whole - field.patterns[some] @ field.patterns[some].T
    assert left[np.ix_(some, some)] == pytest.approx(expected)
    assert np.maximum(np.diag(left), 0.0) == pytest.approx(field.unresolved(), abs=1e-12)
    known = np.where(np.arange(len(left)) == 333, 0.03, 0.0)
    earlier = replace(field, known=known, amplitude=0.04)
    size = np.where(some == 333, 1.25, 1.0)  # 3 and 4 at right angles, over 4
    assert earlier.unresolved_covariance()[np.ix_(some, some)] == pytest.approx(
        size[:, None] * whole * size - field.patterns[some] @ field.patterns[some].T
    )


def test_ice_is_crossed_between_the_rows_of_a_track_too() -> None:
    """Rows three metres apart, half a metre beside the middle of the sheet."""
    path = np.array([[0.5, -3.1], [0.5, 0.1], [0.5, 3.1]])
    crossed = crossed_by(PAPER_SHEET, [path, path])
    rows, columns = np.divmod(crossed.cells, PAPER_SHEET.shape[1])
    (column,) = set(columns.tolist())
    assert abs(PAPER_SHEET.x_centres[column] - 0.5) <= 0.25
    y = PAPER_SHEET.y_centres[rows]
    assert (np.diff(rows) == 1).all()
    assert y[0] == pytest.approx(-3.1, abs=0.25)
    assert y[-1] == pytest.approx(3.1, abs=0.25)
    assert crossed.counts.sum() == 2 * 36  # twelve points for each row
    assert np.abs(crossed.places[:, 0] - 0.5).max() <= 0.25
    assert np.diff(np.unique(crossed.places[:, 1])) == pytest.approx(0.5)
    fine = crossed_by(Sheet(cell_size=0.1), [path])
    assert np.diff(np.unique(fine.places[:, 1])).min() == pytest.approx(0.3)
    assert len(fine.cells) > 25


def test_no_field_has_more_than_120_patterns(rng) -> None:
    everywhere = rng.uniform([-2.0, -18.0], [2.0, 18.0], (4000, 2))
    field = field_along(PAPER_SHEET, crossed_by(PAPER_SHEET, [everywhere]), 0.6, 2.5)
    assert len(field) == 120
    assert field.unresolved().mean() > 0.3  # of so rough a field much is left
