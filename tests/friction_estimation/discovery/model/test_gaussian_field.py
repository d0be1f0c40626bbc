"""Displacements of measured positions that all throws share: of a camera, and of light gates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import halfcauchy

from curling_env.sheet import TEE_Y
from friction_estimation.discovery import ripple_over
from friction_estimation.discovery.model.gaussian_field import GatePlaces, SystematicError


@pytest.fixture
def places() -> list[np.ndarray]:
    y = np.linspace(-15.0, 20.0, 300)
    return [np.column_stack([0.1 * y, y]), np.column_stack([0 * y, y[::-1]])]


def test_what_no_throw_can_tell_is_left_out(places):
    ripple = ripple_over(places, 1.5)
    for even in (np.ones_like(ripple.nodes), ripple.nodes / 10.0):
        assert np.abs(ripple.root.T @ even).max() < 1e-6
    assert np.sqrt(np.mean((ripple.root**2).sum(axis=1))) == pytest.approx(1.0, abs=0.15)


def test_it_displaces_along_the_sheet_by_place_alone(places, rng):
    ripple = ripple_over(places, 1.5)
    ripple = ripple.at(0.004 * rng.normal(size=len(ripple)))
    there, back = (ripple.displacement(xy, np.zeros(len(xy))) for xy in places)
    assert np.allclose(there, back[::-1], atol=1e-12)
    assert np.all(there[:, 0] == 0)
    columns = ripple.columns(places[0], np.ones(300))
    assert np.allclose(columns @ ripple.values, there, atol=1e-12)


def test_between_nodes_it_follows_waves_of_two_metres(places):
    ripple = ripple_over(places, 0.8)
    wave = np.sin(2 * np.pi * ripple.nodes / 2.5)
    fitted = ripple.at(np.linalg.lstsq(ripple.root, wave, rcond=1e-9)[0])
    y = np.linspace(-10.0, 15.0, 400)
    shown = fitted.displacement(np.column_stack([0 * y, y]), 0 * y)[:, 1]
    assert np.sqrt(np.mean((shown - np.sin(2 * np.pi * y / 2.5)) ** 2)) < 0.1


def test_beyond_the_last_node_it_stays(places, rng):
    ripple = ripple_over(places, 1.5)
    ripple = ripple.at(rng.normal(size=len(ripple)))
    ends = ripple.displacement(np.array([[0.0, 20.0], [0.5, 25.0]]), np.zeros(2))
    assert ends[0, 1] == ends[1, 1]


def test_the_amplitude_has_a_half_cauchy_prior_of_three_millimetres(places):
    ripple = ripple_over(places, 1.5)
    amplitudes = np.array([0.001, 0.003, 0.02])
    priors = [ripple.with_amplitude(a).hyperprior for a in amplitudes]
    expected = -2.0 * halfcauchy.logpdf(amplitudes, scale=0.003)
    assert np.diff(priors) == pytest.approx(np.diff(expected))
    assert ripple.amplitudes == pytest.approx(0.003 * np.sqrt(2.0) ** np.arange(-8, 5))


# --- systematic errors ---------------------------------------------------------------------------


@pytest.fixture
def camera_error() -> SystematicError:
    """The error of a camera whose tracks claim four millimetres."""
    nodes = np.linspace(-18.0, 18.0, 9)
    error = SystematicError(nodes=nodes, claimed=4e-3, amplitude=6e-3, values=np.zeros(42))
    assert len(error) == 42
    return error


def test_a_cameras_error_is_as_large_as_its_prior_says(camera_error):
    """Its variance at a place: even, growing across, over the whole sheet, and with the heading."""
    xy = np.array([[0.0, 0.0], [1.5, -7.0], [-2.0, 13.0], [0.4, TEE_Y]])
    columns = camera_error.columns(xy, np.array([0.0, 1.0, -2.0, 4.0]))
    covariance = np.einsum("ncj,j,mdj->cdnm", columns, camera_error.deviations**2, columns)
    along, x = xy[:, 1] / TEE_Y, xy[:, 0]
    turned = 2e-3  # the least amplitude: half of what is claimed
    expected = 6e-3**2 * (1 + x**2) + 4e-3**2 * (along**2 + along**4) + turned**2
    for axis in range(2):
        assert np.diag(covariance[axis, axis]) == pytest.approx(expected, rel=0.02)
        # Between two places it falls with their distance along the sheet, over seven metres.
        between = 6e-3**2 * np.exp(-0.5) + turned**2 * np.cos(1.0)
        assert covariance[axis, axis, 0, 1] == pytest.approx(between, rel=0.02)
    assert np.einsum("nn->n", covariance[0, 1]) == pytest.approx(0.0, abs=1e-12)


def test_over_the_whole_sheet_a_scale_and_a_bend_are_off(camera_error):
    values = np.zeros(42)
    values[[-6, -3]] = 0.002, 0.004  # the scale of x, the bend of y; at the tees
    xy = np.array([[0.5, -TEE_Y], [0.0, 0.0], [1.0, TEE_Y / 2], [0.0, TEE_Y]])
    shown = camera_error.at(values).displacement(xy, np.zeros(4))
    assert shown == pytest.approx(np.array([[-2, 4], [0, 0], [1, 1], [2, 4]]) * 1e-3)


def test_a_point_beside_the_centre_turns_with_the_stone(camera_error):
    values = np.zeros(42)
    values[-2:] = 0.003, 0.001  # ahead of the centre, and to its left
    theta = np.array([0.0, np.pi / 2, np.pi])
    shown = camera_error.at(values).displacement(np.full((3, 2), 4.0), theta)
    assert shown == pytest.approx(np.array([[3, 1], [-1, 3], [-3, -1]]) * 1e-3)


@pytest.mark.parametrize(
    ("claimed", "least", "most"), [(1e-3, 5e-4, 3e-3), (4e-3, 2e-3, 8e-3), (0.3, 2e-3, 8e-3)]
)
def test_what_the_tracks_claim_bounds_the_amplitude_of_the_error(
    camera_error, claimed, least, most
):
    tried = replace(camera_error, claimed=claimed).amplitudes
    assert tried[[0, -1]] == pytest.approx([least, most])
    assert np.diff(np.log(tried)) == pytest.approx(np.full(5, np.log(most / least) / 5))


def test_every_gate_has_its_own_place():
    gates = GatePlaces(
        places=np.array([-11.0, 4.0, 9.0]), amplitude=0.01, values=np.array([1e-3, 0.0, -5e-3])
    )
    xy = np.array([[0.0, -10.9], [0.3, 4.2], [0.0, 8.8], [-0.2, 9.1]])
    assert gates.displacement(xy, np.zeros(4)).tolist() == [
        [0.0, 1e-3],
        [0.0, 0.0],
        [0.0, -5e-3],
        [0.0, -5e-3],
    ]
