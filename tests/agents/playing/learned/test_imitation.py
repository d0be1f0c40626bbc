"""A recorded throw is taken for the shot of the list that it was."""

from __future__ import annotations

import numpy as np
import pytest

from agents.playing.learned.features import features_of, positions_of
from agents.playing.learned.imitation import (
    KINSHIP,
    Lessons,
    lessons_of,
    mirrored,
    shot_of,
)
from curling_env.envs.game.shots import SHOTS
from curling_env.errors import InputError
from curling_env.ice import load_ice


def number_of(name: str) -> int:
    return [shot.name for shot in SHOTS].index(name)


def test_throws_for_shots_of_the_list_are_recognised(called):
    aimed = [call.shot == SHOTS[k].name for k, call in zip(called.shots, called.calls, strict=True)]
    throws = [call.throw for call in called.calls]
    lessons = lessons_of(load_ice("standard"), called.observations, throws)
    assert len(lessons) == len(throws)  # all were shots of the list
    alike = lessons.shots == called.shots
    # Another stone may lie in the way, and is then what is hit.
    assert alike[aimed].mean() > 0.85
    draws = np.array([SHOTS[k].kind == "draw" for k in called.shots])
    assert alike[draws & aimed].all()


STONES = np.full((16, 2), np.nan)
STONES[[0, 9]] = (0.0, -2.5), (0.2, 0.1)


@pytest.mark.parametrize(
    ("way", "weight", "spin", "name"),
    [
        ([(0.2, -30.0), (0.2, 3.0)], 1.25, 1.0, "hit own stone 1 on its right, board weight"),
        ([(0.4, -30.0), (0.4, 3.0)], 1.7, 1.0, "hit their stone 2 on its right, peel weight"),
        ([(1.5, -30.0), (1.5, 3.0)], 1.4, 1.0, "through the house"),
        ([(1.0, -30.0), (0.2, -0.25)], 1.0, 1.0, "freeze to their stone 2"),
        ([(1.0, -30.0), (0.15, -1.45)], 0.99, -1.0, "guard their stone 2"),
        ([(1.0, -30.0), (1.1, 0.2)], 1.0, -1.0, "draw to the right of the house, clockwise"),
    ],
)
def test_what_a_throw_was_follows_from_its_way_on_the_empty_sheet(way, weight, spin, name):
    assert SHOTS[shot_of(np.array(way), weight, spin, STONES)].name == name


def test_a_throw_near_no_shot_is_none():
    assert shot_of(np.array([(0.0, -30.0), (2.0, -5.5)]), 0.9, 1.0, STONES) == -1


def test_a_mirror_exchanges_left_and_right(called):
    lessons = Lessons(observations=called.observations, shots=called.shots)
    other = mirrored(lessons)
    before, after = positions_of(called.observations), positions_of(other.observations)
    np.testing.assert_allclose(after, before * [-1, 1])
    again = mirrored(other)
    assert (again.shots == lessons.shots).all()
    np.testing.assert_array_equal(again.observations, lessons.observations)
    one = Lessons(
        observations=called.observations[:1],
        shots=np.array([number_of("draw to the left of the house, clockwise")]),
    )
    assert SHOTS[mirrored(one).shots[0]].name == "draw to the right of the house, counter-clockwise"


def test_what_is_seen_tells_whose_stones_count(called):
    seen = features_of(called.observations)
    assert all(np.isfinite(part).all() for part in seen)
    assert (
        seen.there.sum(axis=1) == np.isfinite(positions_of(called.observations)[..., 0]).sum(1)
    ).all()
    with pytest.raises(InputError, match="flat observations"):
        features_of(np.zeros((1, 20)))


def test_a_shot_speaks_most_for_itself_and_never_for_another_stone():
    assert (KINSHIP.argmax(axis=1) == np.arange(len(SHOTS))).all()
    np.testing.assert_allclose(KINSHIP.sum(axis=1), 1, atol=1e-5)
    hit = "hit %s stone 1 on the nose, peel weight"
    one, other = number_of(hit % "own"), number_of(hit % "their")
    assert KINSHIP[one, other] == 0
