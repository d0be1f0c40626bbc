"""Stones are numbered in order of play and known again."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.trajectory import Trajectory
from friction_estimation.tracking import StoneNumbers

RED, YELLOW, BLUE = "#c81e28", "#e6d214", "#2040b4"


def stone(begin, end):
    xy = np.linspace(begin, end, 5)
    return Trajectory(t=np.arange(5.0), xy=xy)


HACK = (0.0, -17.0)


def test_colours_take_turns_and_a_stone_that_was_picked_up_is_itself_again():
    numbers = StoneNumbers()
    thrown = [
        numbers.of([stone(HACK, (0.1 * k, 5.0 + k))], [c])
        for k, c in enumerate([RED, YELLOW, RED, None, BLUE, YELLOW])
    ]
    # The handle that is not seen may be of any stone; it is taken for the one longest not thrown.
    assert thrown == [[0], [1], [0], [1], [2], [1]]


def test_a_stone_that_still_lies_there_is_not_the_one_that_is_thrown():
    numbers = StoneNumbers()
    assert numbers.of([stone(HACK, (0.0, 17.0))], [RED]) == [0]
    lies = stone((0.02, 17.01), (0.02, 17.01))
    assert numbers.of([stone(HACK, (0.5, 16.0)), lies], [RED, RED]) == [1, 0]
    # Both lie there now; stone 0 is hit and moves on.
    hit = stone((0.02, 17.01), (0.3, 18.0))
    rests = stone((0.5, 16.0), (0.5, 16.0))
    assert numbers.of([stone(HACK, (0.0, 16.8)), rests, hit], [YELLOW, RED, RED]) == [2, 1, 0]
    moved = stone((0.3, 18.0), (0.3, 18.0))
    assert numbers.of([stone(HACK, (1.0, 15.0)), moved], [RED, RED]) == [1, 0]


def test_stones_that_lay_there_from_the_beginning_come_after_the_first_thrown_one():
    others = [stone((x, 15.0), (x, 15.0)) for x in (-1.0, 1.0)]
    assert StoneNumbers().of([stone(HACK, (0, 16.0)), *others], [RED, BLUE, None]) == [0, 1, 2]


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (RED, "#af3459", True),
        (RED, "#854b51", True),  # washed out by compression
        (RED, "#64141a", True),  # in the shade
        (RED, YELLOW, False),
        (BLUE, YELLOW, False),
        (RED, BLUE, False),
        (RED, "#808080", True),  # ambiguous
    ],
)
def test_hue_tells_handles_apart(one, other, same):
    numbers = StoneNumbers()
    assert numbers.of([stone(HACK, (0.0, 5.0))], [one]) == [0]
    assert numbers.of([stone(HACK, (0.3, 6.0))], [other]) == [0 if same else 1]
