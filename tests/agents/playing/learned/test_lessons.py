"""Lessons have the value of every shot, may be mirrored, and a network learns them."""

from __future__ import annotations

import numpy as np
import pytest
from learn.lessons import Lessons, mirrored

from agents.playing.learned.features import features_of, positions_of
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


def test_the_input_has_counting_stones_and_existing_shots(lessons, called):
    seen = features_of(called.observations, lessons.once)
    assert all(np.isfinite(part).all() for part in seen)
    lying = np.isfinite(positions_of(called.observations)[..., 0])
    assert (seen.there.sum(axis=1) == lying.sum(1)).all()
    np.testing.assert_array_equal(seen.possible, called.masks > 0)
    assert (seen.whole[:, :16].sum(axis=1) == 1).all()
    with pytest.raises(InputError, match="flat observations"):
        features_of(np.zeros((1, 20)), lessons.once[:1])


def test_gradients_are_of_the_same_network(network, called):
    torch = pytest.importorskip("torch")
    from learn.cloning import ShotModule

    module, seen = ShotModule(network), network.seen(called.observations[::5])
    with torch.no_grad():
        worths, values = module(seen)
    np.testing.assert_allclose(worths, network.worths(seen), atol=1e-4)
    assert values.shape == (len(worths),)
    np.testing.assert_array_equal(module.network().worths(seen), network.worths(seen))


def test_cloning_learns_a_rule(called):
    pytest.importorskip("torch")
    from learn.cloning import clone

    # The rule: with the hammer draw to the button, without it throw through the house.
    seen = np.repeat(called.observations, 3, axis=0)
    hammer = seen[:, 2] > 0
    there = np.repeat(called.masks, 3, axis=0) > 0
    there[:, 0] = True
    once, worth = (np.where(there, points, np.nan).astype(np.float32) for points in (0.0, -1.0))
    worth[np.arange(len(seen)), np.where(hammer, 0, len(SHOTS) - 1)] = 1.0
    lessons = Lessons(observations=seen, once=once, expected=worth)
    network, lost = clone(lessons, epochs=8, batch=24, held_out=0.2)
    assert lost < 0.3
    shots = network.worths(features_of(called.observations, once[::3])).argmax(axis=1)
    assert ((shots == len(SHOTS) - 1) == (called.observations[:, 2] < 0)).all()
