"""The count of points agrees with counting stone by stone, as a curler does."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from curling_env.game import Lines, RestingStone, Team, count, points_of

LINES = Lines()


def counted_one_by_one(places, own):
    """Count points of the own team outwards from the tee up to a stone of the other team."""
    distances = [
        (float(np.hypot(x, y)), bool(mine))
        for (x, y), mine in zip(places, own, strict=True)
        if np.hypot(x, y) <= LINES.reach
    ]
    points = 0
    nearest_is_own = min(distances, default=(0.0, True))[1]
    for _, mine in sorted(distances):
        if mine is not nearest_is_own:
            break
        points += 1
    return points if nearest_is_own else -points


def test_many_positions_are_counted_as_one_by_one(rng):
    places = rng.normal(0.0, 1.2, (200, 6, 2))
    places[rng.random((200, 6)) < 0.2] = np.nan
    own = np.array([True, False, True, False, False, True])
    points = points_of(places, own, LINES.reach)
    wanted = [counted_one_by_one(position, own) for position in places]
    assert points.tolist() == wanted
    assert {np.sign(number) for number in wanted} == {-1, 0, 1}


def test_a_position_is_counted_for_the_team_that_scores(rng):
    for _ in range(100):
        places = rng.normal(0.0, 1.2, (6, 2))
        own = rng.random(6) < 0.5
        stones = tuple(
            RestingStone(team=Team.HOME if mine else Team.AWAY, number=k, x=float(x), y=float(y))
            for k, ((x, y), mine) in enumerate(zip(places, own, strict=True))
        )
        team, number = count(LINES, stones)
        wanted = counted_one_by_one(places, own)
        assert number == abs(wanted)
        assert team is (None if wanted == 0 else Team.HOME if wanted > 0 else Team.AWAY)


@given(st.floats(0.0, 1.9), st.floats(0.0, 6.28), st.floats(0.0, 6.28))
def test_stones_at_equal_distances_do_not_count(distance, turn, other):
    places = distance * np.array([[np.cos(turn), np.sin(turn)], [np.cos(other), np.sin(other)]])
    assert points_of(places, np.array([True, False]), LINES.reach, measure=1e-6) == 0
