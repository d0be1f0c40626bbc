"""Contact of a stone with lines, to the edge of the stone."""

from __future__ import annotations

import pytest

from curling_env.errors import InputError
from curling_env.game import Lines
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, HOUSE_RADIUS, TEE_Y

LINES = Lines()
R = LINES.stone_radius
HAIR = 1e-9


def test_a_stone_has_a_size_and_a_sheet_holds_its_house():
    assert (LINES.width, LINES.stone_radius) == (4.75, 0.145)
    assert Lines(width=2 * HOUSE_RADIUS, stone_radius=1e-6).width == 2 * HOUSE_RADIUS
    for wrong in ({"stone_radius": 0.0}, {"width": 2 * HOUSE_RADIUS - 1e-6}):
        with pytest.raises(InputError):
            Lines(**wrong)


@pytest.mark.parametrize("side", [-1, 1])
def test_the_side_line_is_touched_by_the_stones_edge(side):
    edge = side * (LINES.width / 2 - R)
    assert LINES.on_sheet(edge * (1 - HAIR), 0.0)
    assert not LINES.on_sheet(edge, 0.0)


def test_a_stone_is_past_a_line_when_all_of_it_is():
    back, hog = BACK_LINE_Y - TEE_Y + R, HOG_LINE_Y - TEE_Y + R
    assert LINES.on_sheet(0.0, back - HAIR)
    assert not LINES.on_sheet(0.0, back + HAIR)
    assert LINES.past_hog_line(-HOG_LINE_Y + TEE_Y + hog)
    assert LINES.past_hog_line(hog + HAIR)
    assert not LINES.past_hog_line(hog - HAIR)


def test_a_stone_is_in_the_house_as_soon_as_it_overhangs_the_ring():
    reach = HOUSE_RADIUS + R
    assert LINES.reach == reach
    for x, y in ((0.6, 0.8), (-1.0, 0.0), (0.0, -1.0)):
        assert LINES.in_house(x * reach * (1 - HAIR), y * reach * (1 - HAIR))
        assert not LINES.in_house(x * reach * (1 + HAIR), y * reach * (1 + HAIR))


def test_a_guard_is_clear_of_the_tee_line_and_of_the_house():
    assert LINES.in_free_guard_zone(0.0, -3.0)
    assert not LINES.in_free_guard_zone(0.0, -1.9)  # overhangs the house
    assert LINES.in_free_guard_zone(2.1, -R - HAIR)
    assert not LINES.in_free_guard_zone(2.1, -R)  # touches the tee line
    assert not LINES.in_free_guard_zone(0.0, 3.0)


def test_by_some_rules_a_guards_centre_alone_is_before_the_tee_line():
    lines = Lines(whole_guard=False)
    assert lines.in_free_guard_zone(2.1, -HAIR)
    assert not lines.in_free_guard_zone(2.1, 0.0)
    assert not lines.in_free_guard_zone(2.1, 0.5)


def test_the_centre_line_has_a_width():
    touching = R + 0.0127 / 2
    assert LINES.touches_centre_line(-touching + HAIR)
    assert not LINES.touches_centre_line(touching + HAIR)
