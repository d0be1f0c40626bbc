"""Families of blind sessions: their hidden effects, and the independence of each session."""

from __future__ import annotations

import numpy as np
from blind.families import plan
from blind.hidden import GIVEN, NAMES
from measures.inference import FAMILIES

from curling_env import load_ice


def test_every_session_has_its_own_name():
    tasks = [task for kind in FAMILIES for task in plan(kind)]
    assert len({task.name for task in tasks}) == len(tasks) == 114


def test_sessions_are_repeatable_and_differ():
    first, second, *_ = plan("none")
    made = first.make(4)[0]
    np.testing.assert_array_equal(made[0].xy, first.make(4)[0][0].xy)
    assert len(made) == first.throws
    assert len(made[0]) != len(second.make(4)[0][0])


def test_maps_occur_alone_and_with_one_two_and_three_effects():
    tasks = plan("map")
    assert [sum(len(t.hidden) == n for t in tasks) for n in range(1, 5)] == [4] * 4
    for task in tasks:
        assert task.hidden[0] == "friction_map"
        assert len({name.partition(":")[0] for name in task.hidden}) == len(task.hidden)


def test_a_given_model_lacks_the_hidden_effect():
    preset = {effect.name for effect in load_ice("standard").effects}
    assert preset == set(NAMES) - set(GIVEN)
    for task in plan("model given"):
        assert task.given
        assert task.hidden[0] not in preset


def test_weak_effects_have_a_third_and_a_tenth_of_their_size():
    tasks = plan("weak")
    assert {(t.hidden, round(t.scale, 3)) for t in tasks} == {
        ((name,), scale) for name in NAMES for scale in (0.333, 0.1)
    }
