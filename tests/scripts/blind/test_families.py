"""The families of the blind benchmark: what is hidden where, and that each session stands alone."""

from __future__ import annotations

from blind.families import KINDS, plan
from blind.hidden import GIVEN, NAMES

from curling_env import load_ice


def test_every_session_has_a_name_of_its_own():
    tasks = plan(list(KINDS), 2, others=(8, 24))
    assert len({task.name for task in tasks}) == len(tasks)
    assert {task.kind for task in tasks} == set(KINDS)


def test_a_session_does_not_depend_on_the_other_families():
    alone = plan(["weak"], 1)
    among = [task for task in plan(list(KINDS), 1) if task.kind == "weak"]
    assert alone == among
    assert alone[3].make(4, film=False) == among[3].make(4, film=False)


def test_more_sessions_add_to_those_that_fewer_have():
    fewer, more = (plan(list(KINDS), count) for count in (2, 4))
    assert len(fewer) < len(more)
    assert all(task in more for task in fewer)


def test_sessions_of_one_family_differ():
    first, second, *_ = plan(["none"], 1)
    assert first.make(4, film=False)[0]["x"] != second.make(4, film=False)[0]["x"]


def test_maps_stand_alone_and_beside_one_two_and_three_effects():
    tasks = plan(["map"], 4)
    assert [sum(len(t.hidden) == n for t in tasks) for n in range(1, 5)] == [16] * 4
    for task in tasks:
        assert task.hidden[0] == "friction_map"
        assert len({name.partition(":")[0] for name in task.hidden}) == len(task.hidden)
    assert {name for task in tasks for name in task.hidden} == {"friction_map", *NAMES}


def test_a_given_model_lacks_what_is_hidden():
    preset = {effect.name for effect in load_ice("standard").effects}
    assert preset == set(NAMES) - set(GIVEN)
    for task in plan(["model given"], 1):
        assert task.given
        assert task.hidden[0] not in preset


def test_weak_effects_have_a_third_and_a_tenth_of_their_size():
    tasks = plan(["weak"], 1)
    assert {(t.hidden, round(t.scale, 3)) for t in tasks} == {
        ((name,), scale) for name in NAMES for scale in (0.333, 0.1)
    }
