"""Lessons say what every shot is worth; they are kept in files, and left and right may change."""

from __future__ import annotations

import numpy as np
import pytest

from agents.playing import Lessons, joined
from agents.playing.learned.features import features_of, positions_of
from agents.playing.learned.lessons import mirrored
from curling_env.envs import SHOTS
from curling_env.errors import InputError


def number_of(name: str) -> int:
    return [shot.name for shot in SHOTS].index(name)


@pytest.fixture
def lessons(called) -> Lessons:
    rng = np.random.default_rng(0)
    once, expected = (
        np.where(called.masks, rng.normal(size=called.masks.shape), np.nan).astype(np.float32)
        for _ in range(2)
    )
    return Lessons(observations=called.observations, once=once, expected=expected)


def assert_same(one: Lessons, other: Lessons) -> None:
    for name in ("observations", "once", "expected"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_a_mirror_exchanges_left_and_right(lessons):
    other = mirrored(lessons)
    before, after = positions_of(lessons.observations), positions_of(other.observations)
    np.testing.assert_allclose(after, before * [-1, 1])
    assert_same(mirrored(other), lessons)
    for name in (
        "draw to the {} of the house, {}clockwise",
        "hit their stone 3 on its {}, {}peel weight",
    ):
        clockwise = ("", "counter-") if "clockwise" in name else ("", "")
        left, right = (
            number_of(name.format(s, c)) for s, c in zip(("left", "right"), clockwise, strict=True)
        )
        np.testing.assert_array_equal(other.once[:, right], lessons.once[:, left])
        np.testing.assert_array_equal(other.expected[:, right], lessons.expected[:, left])


def test_lessons_are_joined_and_taken_apart(lessons):
    both = joined([lessons, mirrored(lessons)])
    assert len(both) == 2 * len(lessons)
    assert_same(both[: len(lessons)], lessons)


def test_a_file_gives_lessons_back_and_others_are_refused(lessons, tmp_path):
    lessons.save(tmp_path / "l.npz")
    assert_same(Lessons.load(tmp_path / "l.npz"), lessons)
    parts = {
        "observations": lessons.observations,
        "once": lessons.once,
        "expected": lessons.expected,
    }
    for wrong, said in (
        ({"once": lessons.once}, "holds no lessons of ends"),
        ({**parts, "once": lessons.once[:, :7]}, "another list of shots"),
        ({**parts, "observations": lessons.observations[:, :20]}, "flat observations"),
    ):
        np.savez(tmp_path / "wrong.npz", **wrong)
        with pytest.raises(InputError, match=said):
            Lessons.load(tmp_path / "wrong.npz")


def test_what_is_seen_tells_whose_stones_count_and_which_shots_there_are(lessons, called):
    seen = features_of(called.observations, lessons.once)
    assert all(np.isfinite(part).all() for part in seen)
    lying = np.isfinite(positions_of(called.observations)[..., 0])
    assert (seen.there.sum(axis=1) == lying.sum(1)).all()
    np.testing.assert_array_equal(seen.possible, called.masks > 0)
    assert (seen.whole[:, :16].sum(axis=1) == 1).all()
    with pytest.raises(InputError, match="flat observations"):
        features_of(np.zeros((1, 20)), lessons.once[:1])
