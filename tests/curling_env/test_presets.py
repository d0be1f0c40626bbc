"""The presets against their published numbers."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.ice import load_ice
from curling_env.physics import Slide, slide
from curling_env.sheet import HOG_LINE_Y, TEE_Y
from curling_env.throw import Throw

FAR = np.array([-5.0, 5.0, -30.0, 30.0])


def straight(ice, speed: float, spin: float = 1.0) -> Slide:
    return slide(ice, Throw(speed=speed, angle=0, spin=spin).release(), bounds=FAR, fps=100)


def hog_to_hog(path: Slide) -> float:
    """Return the time at which the centre reaches the far hog line [s]."""
    assert path.trajectory is not None
    y, t = path.trajectory.xy[:, 1], path.trajectory.t
    return float(np.interp(HOG_LINE_Y, y, t))


@pytest.mark.parametrize(
    ("speed", "stop", "time", "between_hogs", "curl", "turns"),
    [
        (1.945, 24.2, 22.26, 16.47, 1.217, 2.71),
        (2.091, 28.346, 24.32, 13.80, 1.470, 2.95),
        (2.152, 30.175, 25.18, 13.05, 1.583, 3.05),
        (2.211, 32.004, 26.03, 12.43, 1.698, 3.14),
    ],
)
def test_fcv1_gives_the_competition_simulators_table(
    speed: float, stop: float, time: float, between_hogs: float, curl: float, turns: float
) -> None:
    path = straight(load_ice("fcv1"), speed)
    printed = 0.05 if stop == 24.2 else 0.0  # that row is given to a decimetre only
    assert path.y + HOG_LINE_Y == pytest.approx(stop, abs=0.01 + printed)
    assert path.time == pytest.approx(time, abs=0.02)
    assert hog_to_hog(path) == pytest.approx(between_hogs, abs=0.02)
    assert -path.x == pytest.approx(curl, abs=0.01)
    assert path.theta / (2 * np.pi) == pytest.approx(turns, abs=0.01)


def test_a_draw_on_standard_ice_is_a_championship_draw() -> None:
    path = straight(load_ice("standard"), 2.097)
    assert path.y == pytest.approx(TEE_Y, abs=0.15)
    assert 24.0 <= path.time <= 25.0
    assert 13.0 <= hog_to_hog(path) <= 14.5
    assert 1.1 <= -path.x <= 1.5
    assert 2.0 <= path.theta / (2 * np.pi) <= 4.0


def test_club_ice_runs_and_curls_as_a_clubs_was_measured() -> None:
    # Jensen & Shegelski (2004), as quoted by Penner: 2.09 m/s, 1.01 rad/s, 25.6 m, 0.78 m.
    path = straight(load_ice("club"), 2.09, spin=1.01)
    assert path.y + HOG_LINE_Y == pytest.approx(25.6, abs=0.1)
    assert -path.x == pytest.approx(0.78, abs=0.02)
    draw = straight(load_ice("club"), 2.188)
    assert draw.y == pytest.approx(TEE_Y, abs=0.15)
    assert 23.5 <= draw.time <= 24.0


def test_paper_ice_stops_a_stone_at_the_coulomb_distance() -> None:
    path = straight(load_ice("paper"), 0.9, spin=0.0)
    assert path.y + HOG_LINE_Y == pytest.approx(0.9**2 / (2 * 0.0019 * 9.80665), abs=1e-5)
    assert path.time == pytest.approx(0.9 / (0.0019 * 9.80665), abs=1e-5)


@pytest.mark.parametrize(
    ("name", "sheet", "cells", "stone"),
    [
        # The paper's tables 1 and 2; the rule book's C1; Digital Curling's simulator and server.
        ("standard", (44.5, 4.5), (89, 9), (19.1, 0.145, 0.1143, 0.2008, 0.85, 0.2)),
        ("fitted", (44.5, 4.5), (89, 9), (19.1, 0.145, 0.1143, 0.2008, 0.85, 0.2)),
        ("club", (44.5, 4.5), (89, 9), (19.1, 0.145, 0.1143, 0.2008, 0.85, 0.2)),
        ("paper", (44.5, 4.5), (89, 9), (19.96, 0.105, 0.15, 0.110029, 0.85, 0.2)),
        ("fcv1", (45.72, 4.75), (92, 10), (19.96, 0.145, 0.1143, 0.209830, 1.0, 0.2)),
    ],
)
def test_sheets_and_stones_are_those_of_their_sources(name, sheet, cells, stone) -> None:
    ice = load_ice(name)
    assert (ice.sheet.length, ice.sheet.width) == sheet
    assert ice.friction.mu.shape == cells
    given = ice.stone
    assert (
        given.mass, given.radius, given.height, given.inertia, given.restitution,
        given.stone_friction,
    ) == pytest.approx(stone, rel=1e-5)  # fmt: skip
