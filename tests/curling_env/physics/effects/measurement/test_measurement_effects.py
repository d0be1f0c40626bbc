"""Errors of the measurement: the camera's report, by the formulas of their cards."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics import acceleration, catalogue

XY = np.array([[0.0, 0.0], [1.0, -20.0], [-0.5, 15.0]])


def test_a_point_off_the_centre_turns_with_the_stone():
    theta = np.array([0.0, np.pi / 2, np.pi])
    moved = catalogue()["tracking_offset"].displacement(XY, theta, {"forward": 0.05, "left": 0.02})
    assert moved == pytest.approx(np.array([[0.05, 0.02], [-0.02, 0.05], [-0.05, -0.02]]))


def test_a_lens_moves_places_away_from_its_axis():
    values = {"k1": 0.01, "k2": -0.004, "centre_x": 0.5, "centre_y": 2.0}
    moved = catalogue()["lens_distortion"].displacement(XY, np.zeros(3), values)
    for place, found in zip(XY, moved, strict=True):
        out = place - [0.5, 2.0]
        q = (out @ out) / 20.0**2
        assert found == pytest.approx(out * (0.01 * q - 0.004 * q**2))
    # The strengths are displacement over radius at 20 m from the axis.
    edge = catalogue()["lens_distortion"].displacement(
        np.array([[12.0, 16.0]]), np.zeros(1), {"k1": 0.01, "k2": 0.0, "centre_x": 0, "centre_y": 0}
    )
    assert edge == pytest.approx(0.01 * np.array([[12.0, 16.0]]))


@pytest.mark.parametrize(
    ("card", "format_"),
    [
        (catalogue()["tracking_offset"], dict.fromkeys(("forward", "left"), (-0.2, 0.2, None))),
        (
            catalogue()["lens_distortion"],
            {
                "k1": (-0.3, 0.3, None),
                "k2": (-0.3, 0.3, 0.0),
                "centre_x": (-10.0, 10.0, 0.0),
                "centre_y": (-25.0, 25.0, 0.0),
            },
        ),
        (catalogue()["scale_error"], {"factor": (0.5, 2.0, None)}),
        (catalogue()["frame_rate_error"], {"factor": (0.5, 2.0, None)}),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_ice_files_keep_their_meaning_and_a_stone_feels_nothing(card, format_):
    assert {p.name: (p.low, p.high, p.default) for p in card.parameters} == format_
    assert card.acts == "measurement"
    given = {p.name: p.low + 0.7 * (p.high - p.low) for p in card.parameters}
    ice = Ice.uniform(0.009, effects=(ActiveEffect(name=card.name, parameters=given),))
    states = np.array([[0.2, 1.0, 0.1, 2.0, 1.5]])
    plain = acceleration(Ice.uniform(0.009), states)
    assert acceleration(ice, states) == pytest.approx(plain, abs=1e-15)
