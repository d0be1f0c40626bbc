"""The bound against formulas and against counting."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.sheet import PAPER_SHEET
from curling_env.throw import Release, Throw
from friction_estimation.design import throw_response, uniform_bound
from tests.friction_estimation.design.cell_bound import cell_bound

G = 9.80665


def test_long_straight_window_is_the_textbook_formula():
    """var(a) = 720 σ²/(N T⁴) for N even samples of a uniformly slowed stone over T."""
    mu, fps, distance = 0.009, 50.0, 20.0
    speed = 2.5
    end = (speed - np.sqrt(speed**2 - 2 * G * mu * distance)) / (G * mu)
    expected = np.sqrt(720 * 0.005**2 / (fps * end * end**4)) / G
    found = uniform_bound([speed], mu=mu, noise=0.005, fps=fps, distance=distance)
    assert found == pytest.approx(expected, rel=0.02)


def test_five_alike_throws_are_root_five_better():
    one = uniform_bound([1.6], mu=0.0019, noise=0.005, fps=30, distance=21.945)
    five = uniform_bound([1.6] * 5, mu=0.0019, noise=0.005, fps=30, distance=21.945)
    assert five == pytest.approx(one / np.sqrt(5))


def test_monte_carlo_of_a_least_squares_fit_sits_on_the_bound(rng):
    mu, t = 0.009, np.arange(0, 2.0 / (G * 0.009), 1 / 30)
    basis = np.column_stack([np.ones_like(t), t, -0.5 * G * t**2])
    path = basis @ [0.0, 2.0, mu]
    found = [
        np.linalg.lstsq(basis, path + rng.normal(0, 0.005, len(t)), rcond=None)[0][2]
        for _ in range(2000)
    ]
    bound = uniform_bound([2.0], mu=mu, noise=0.005, fps=30)
    assert np.std(found) == pytest.approx(bound, rel=0.06)


@pytest.mark.parametrize("fps", [10.0, 25.0])
def test_all_cells_together_respond_as_one_friction_does(fps):
    """The weights of the cells add up to one, so their responses add up to −½gμt²."""
    release = Throw(speed=1.4, x=0.3, angle=0.01).release()
    response = throw_response(release, mu=0.009, fps=fps, sheet=PAPER_SHEET)
    seconds = 1.4 / (G * 0.009)
    t = np.arange(0.0, seconds - 0.01, 1 / fps)
    assert len(response.response) == pytest.approx(len(t), abs=1)
    t = np.arange(len(response.response)) / fps
    whole = -0.5 * G * 0.009 * t**2
    basis = np.column_stack([np.ones_like(t), t])
    whole -= basis @ np.linalg.lstsq(basis, whole, rcond=None)[0]
    assert response.response.sum(axis=1) == pytest.approx(whole, abs=2e-4)
    # What is left of each cell's response is beyond any start and speed.
    assert np.abs(basis.T @ response.response).max() < 1e-6
    rows, columns = np.divmod(response.crossed, PAPER_SHEET.shape[1])
    reach = -10.9725 + 1.4**2 / (2 * G * 0.009)
    assert PAPER_SHEET.y_centres[rows.min()] == pytest.approx(-10.9725, abs=0.5)
    assert PAPER_SHEET.y_centres[rows.max()] == pytest.approx(reach, abs=0.5)
    assert set(columns.tolist()) <= {4, 5}
    assert set(response.crossed.tolist()) <= set(response.touched.tolist())


def cells(count, **changes):
    numbers = {"mu": 0.009, "noise": 0.005, "fps": 30, "spread": 0.06, "length": 3.0} | changes
    releases = [Throw(speed=2.0, x=0.1 * k).release() for k in range(count)]
    return cell_bound(releases, **numbers)


def test_more_throws_and_less_noise_tell_more_everywhere():
    one, three, quiet = cells(1), cells(3), cells(1, noise=0.001)
    assert (three.sigma <= one.sigma + 1e-12).all()
    assert (quiet.sigma <= one.sigma + 1e-12).all()
    assert three.rmse < one.rmse


def test_far_from_every_path_the_prior_remains():
    bound = cells(2, length=1.0)
    assert bound.sigma[0, 0] == pytest.approx(0.009 * 0.06, rel=0.1)
    assert not bound.crossed[0].any()
    assert bound.crossed[40, 4]
    assert bound.sigma[40, 4] < 0.5 * bound.sigma[0, 0]


def test_an_even_ice_is_known_as_well_as_one_number():
    """A field with hardly any spread leaves one number to find, up to the spread itself."""
    release = Release(x=0.0, y=-10.9725, vx=0.0, vy=2.0)
    bound = cell_bound([release], mu=0.009, noise=0.005, fps=30, spread=1e-6, length=3.0)
    expected = uniform_bound([2.0], mu=0.009, noise=0.005, fps=30)
    assert bound.rmse == pytest.approx(expected, rel=0.03)


def test_numbers_that_make_no_sense_are_refused():
    with pytest.raises(InputError, match="noise must be positive"):
        uniform_bound([2.0], mu=0.009, noise=0.0, fps=30)
    with pytest.raises(InputError, match="speed must be positive"):
        uniform_bound([-1.0], mu=0.009, noise=0.005, fps=30)
    with pytest.raises(InputError, match="too short"):
        uniform_bound([2.0], mu=0.009, noise=0.005, fps=30, distance=0.01)
