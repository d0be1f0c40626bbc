"""A bias of the camera: its nodes, what a throw sees of it, and its prior."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.inversion.throw.camera_bias import (
    NO_BIAS,
    CameraBias,
    bias_root,
    zero_bias_over,
)
from friction_estimation.inversion.throw.path import PATH_STEP, StonePath
from friction_estimation.inversion.tuning import CAMERA_BIAS_NODE_SPACING

NODES = np.linspace(-6.0, 6.0, 9)


def bias(values) -> CameraBias:
    return CameraBias(nodes=NODES, values=np.asarray(values, float), sigma=np.full(9, 1e-3))


def straight(direction: float) -> StonePath:
    y = direction * PATH_STEP * np.arange(240)
    points = np.column_stack([0 * y, y - direction * 5.0])
    return StonePath(origin=0.0, points=points, heading=np.tile([0.0, direction], (len(points), 1)))


def test_between_nodes_it_is_smooth_and_beyond_them_constant(rng):
    values = rng.normal(0, 1e-3, 9)
    one = bias(values)
    assert one.at(NODES) == pytest.approx(values)
    assert one.at(np.array([-20.0, 20.0])) == pytest.approx(values[[0, -1]])
    assert one.node_weights(np.linspace(-8, 8, 33)).sum(axis=1) == pytest.approx(1.0)
    line = bias(0.001 * NODES)
    assert line.at(np.linspace(-6, 6, 25)) == pytest.approx(0.001 * np.linspace(-6, 6, 25))


def test_a_throw_the_other_way_sees_the_other_sign():
    distance = np.array([1.0, 4.0, 7.0])
    values = np.sin(NODES)
    away, home = (bias(values).along_path(straight(d), distance) for d in (1.0, -1.0))
    assert away @ values == pytest.approx(bias(values).at(distance - 5.0))
    assert home @ values == pytest.approx(-bias(values).at(5.0 - distance))
    assert NO_BIAS.along_path(straight(1.0), distance).shape == (3, 0)


def test_its_size_weighs_nodes_by_how_well_they_are_known():
    even = bias(np.full(9, 2e-3))
    assert even.size == pytest.approx(2e-3)
    known = CameraBias(nodes=NODES[:2], values=np.array([1e-3, 9e-3]), sigma=np.array([1e-4, 1e-2]))
    weights = np.array([1e-4, 1e-2]) ** -2.0
    mean = (weights * known.values**2).sum() / weights.sum()
    assert known.size == pytest.approx(np.sqrt(mean))
    assert NO_BIAS.size == 0.0
    assert len(NO_BIAS) == 0


def test_nodes_span_where_stones_were_seen():
    made = zero_bias_over([np.array([-3.0, 2.0]), np.array([-1.0, 6.0])])
    assert (made.nodes[0], made.nodes[-1]) == (-3.0, 6.0)
    assert np.diff(made.nodes).max() <= CAMERA_BIAS_NODE_SPACING
    assert len(made) == int(np.ceil(9 / CAMERA_BIAS_NODE_SPACING)) + 1
    assert not made.values.any()
    assert len(zero_bias_over([np.array([0.0, 1.0])])) == 6


def test_the_prior_leaves_out_what_release_and_scale_take_up():
    root = bias_root(NODES, 2.0)
    correlation = root @ root.T
    assert correlation @ np.ones(9) == pytest.approx(0, abs=1e-9)
    assert correlation @ NODES == pytest.approx(0, abs=1e-9)
    assert (np.linalg.eigvalsh(correlation) > -1e-12).all()
    assert np.linalg.matrix_rank(correlation, tol=1e-9) == 7
    # Apart from these two it is Matérn 5/2.
    r = np.sqrt(5) * np.abs(NODES[:, None] - NODES) / 2.0
    plain = (1 + r + r**2 / 3) * np.exp(-r)
    even, _ = np.linalg.qr(np.column_stack([np.ones(9), NODES]))
    out = np.eye(9) - even @ even.T
    assert correlation == pytest.approx(out @ plain @ out, abs=1e-9)
