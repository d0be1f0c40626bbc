"""Lengths, cells and frames."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from curling_env.errors import InputError
from curling_env.sheet import (
    BACK_LINE_Y,
    HACK_Y,
    HOG_LINE_Y,
    HOG_TO_TEE,
    HOUSE_RADIUS,
    PAPER_SHEET,
    PAPER_STONE,
    RING_RADII,
    RULE_BOOK_STONE,
    TEE_Y,
    WORLD_CURLING_SHEET,
    Direction,
    Sheet,
    Stone,
    tee,
    to_delivery,
    to_sheet,
)

directions = st.sampled_from(list(Direction))
places = st.tuples(st.floats(-2.5, 2.5), st.floats(-23, 23))


def test_the_lines_are_the_rule_books():
    assert pytest.approx(34.747) == 2 * TEE_Y
    assert pytest.approx(21.945) == 2 * HOG_LINE_Y
    assert pytest.approx(6.401) == HOG_TO_TEE
    assert pytest.approx(1.829) == BACK_LINE_Y - TEE_Y
    assert pytest.approx(1.829) == HACK_Y - BACK_LINE_Y
    assert RING_RADII == (1.829, 1.219, 0.610, 0.152)
    assert RING_RADII[0] == HOUSE_RADIUS


def test_the_papers_sheet_has_89_rows_of_9_cells():
    assert PAPER_SHEET.shape == (89, 9)
    assert (PAPER_SHEET.length, PAPER_SHEET.width) == (44.5, 4.5)
    assert PAPER_SHEET.x_centres[[0, 4, 8]] == pytest.approx([-2.0, 0.0, 2.0])
    assert PAPER_SHEET.y_centres[[0, 44, 88]] == pytest.approx([-22.0, 0.0, 22.0])


def test_a_last_partial_cell_counts():
    assert WORLD_CURLING_SHEET.shape == (92, 10)
    assert Sheet(cell_size=0.25).shape == (178, 18)


@pytest.mark.parametrize("sheet", [PAPER_SHEET, WORLD_CURLING_SHEET, Sheet(cell_size=0.3)])
def test_every_centre_is_in_its_own_cell(sheet):
    points = np.stack(np.meshgrid(sheet.x_centres, sheet.y_centres), axis=-1)
    rows, columns = sheet.cell_of(points)
    np.testing.assert_array_equal(
        rows, np.arange(sheet.shape[0])[:, None].repeat(sheet.shape[1], 1)
    )
    np.testing.assert_array_equal(columns[0], np.arange(sheet.shape[1]))


def test_points_off_the_ice_take_the_nearest_cell():
    rows, columns = PAPER_SHEET.cell_of([(-9.0, 99.0), (9.0, -99.0)])
    assert rows.tolist() == [88, 0]
    assert columns.tolist() == [0, 8]


def test_the_ice_ends_at_its_corners():
    for corner in PAPER_SHEET.corners.values():
        assert PAPER_SHEET.contains(corner)
        assert not PAPER_SHEET.contains(np.array(corner) * [1.001, 1.0])
        assert not PAPER_SHEET.contains(np.array(corner) * [1.0, 1.001])
    assert PAPER_SHEET.corners == {
        "home_left": (-2.25, -22.25),
        "home_right": (2.25, -22.25),
        "away_left": (-2.25, 22.25),
        "away_right": (2.25, 22.25),
    }


@given(places, directions)
def test_frames_convert_both_ways(place, direction):
    np.testing.assert_allclose(
        to_sheet(to_delivery(place, direction), direction), place, atol=1e-12
    )


@given(places, directions)
def test_frames_keep_distances_and_velocities_follow_positions(place, direction):
    start, step = np.array(place), np.array([0.3, -0.2])
    moved = to_delivery(start + step, direction) - to_delivery(start, direction)
    np.testing.assert_allclose(direction * step, moved, atol=1e-12)
    assert np.hypot(*moved) == pytest.approx(np.hypot(*step))


def test_the_playing_tee_is_the_origin_and_play_runs_along_y():
    for direction in Direction:
        assert to_delivery(tee(direction), direction) == pytest.approx((0, 0))
        start, line = to_delivery([(0, -direction * HOG_LINE_Y), (0, 0)], direction)
        assert start[1] < line[1] < 0
    # x is to the right of play: what is right at one end is left at the other.
    assert to_delivery((1.0, 0.0), Direction.AWAY)[0] == 1.0
    assert to_delivery((1.0, 0.0), Direction.HOME)[0] == -1.0


@pytest.mark.parametrize(
    "lengths",
    [
        {"length": -1},
        {"width": float("nan")},
        {"cell_size": 0},
        {"length": 30},
        {"width": 3},
        {"cell_size": 5},
        {"length": 501},
        {"width": 501},
        {"cell_size": 0.0044},  # 1.03e7 cells
    ],
)
def test_sheets_that_cannot_be_are_refused(lengths):
    with pytest.raises(InputError):
        Sheet(**lengths)


def test_a_sheet_may_just_hold_both_houses_and_be_one_cell_wide():
    smallest = Sheet(length=2 * BACK_LINE_Y, width=2 * HOUSE_RADIUS, cell_size=2 * HOUSE_RADIUS)
    assert smallest.shape == (11, 1)
    with pytest.raises(InputError, match="both houses"):
        Sheet(length=2 * BACK_LINE_Y - 1e-6)
    with pytest.raises(InputError, match="both houses"):
        Sheet(width=2 * HOUSE_RADIUS - 1e-6)


def test_the_stones_are_the_rule_books_and_the_papers():
    stone = RULE_BOOK_STONE
    assert 2 * np.pi * stone.radius <= 0.914
    assert (stone.mass, stone.height, stone.band_radius) == (19.1, 0.1143, 0.0625)
    assert stone.inertia == pytest.approx(0.5 * stone.mass * stone.radius**2, rel=1e-3)
    assert (stone.restitution, stone.stone_friction) == (0.85, 0.2)
    assert stone.spin_coupling == pytest.approx(19.1 * 0.0625**2 / 0.2008)
    assert (PAPER_STONE.mass, 2 * PAPER_STONE.radius, PAPER_STONE.height) == (19.96, 0.21, 0.15)
    assert PAPER_STONE.inertia == pytest.approx(0.5 * 19.96 * 0.105**2)


@pytest.mark.parametrize(
    "value",
    [
        {"band_radius": 0.0},
        {"band_radius": 0.145},
        {"restitution": 0.0},
        {"restitution": 1.0},
        {"stone_friction": 0.0},
        {"mass": 0.1},
        {"mass": 1000.0},
        {"height": 0.001},
        {"height": 1.0},
        {"radius": 0.01, "band_radius": 0.01},
        {"radius": 1.0},
    ],
)
def test_a_stone_may_have_the_values_at_the_edge(value):
    assert Stone(**value) == Stone(**value)


@pytest.mark.parametrize(
    "value",
    [
        *({name: x} for name in ("mass", "radius", "height", "inertia") for x in (0, -1, np.inf)),
        *({name: x} for name in ("mass", "radius", "height") for x in (1e-4, 1001.0)),
        {"radius": 1.01},
        {"height": 1.01},
        {"band_radius": -1e-9},
        {"band_radius": 0.146},
        {"restitution": -1e-9},
        {"restitution": 1.01},
        {"stone_friction": -1e-9},
        {"stone_friction": float("inf")},
        {"stone_friction": float("nan")},
    ],
)
def test_stones_that_cannot_be_are_refused(value):
    with pytest.raises(InputError, match=next(iter(value))):
        Stone(**value)
