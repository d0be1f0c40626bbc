"""Parts of kernels: linked into what calls them, compiled once, and never called from Python."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from numba.core.errors import TypingError
from numba.core.types.functions import BaseFunction

from curling_env.ice import load_ice
from curling_env.infrastructure import kernel, kernel_compiler, part


def _place(values, k):
    return values[k] * values[k] + 0.1


def test_the_inside_of_the_installed_numba_is_known():
    # Otherwise kernels compile in numba's ordinary way, which takes half as long again.
    assert kernel_compiler.KNOWN


@pytest.fixture
def place():
    return part(_place, _nrt=False, forceinline=True)


def test_a_part_computes_in_a_kernel_what_python_does(place):
    def total(values):
        found = place(values, 0)
        for k in range(1, values.shape[0]):
            found = found / 3.0 + place(values, k)
        return found

    values = np.random.default_rng(0).normal(size=50)
    expected = _place(values, 0)
    for k in range(1, 50):
        expected = expected / 3.0 + _place(values, k)
    assert kernel(total, _nrt=False)(values) == expected


def test_a_part_is_compiled_once_whatever_constants_it_is_given(place):
    def three(values, k):
        return place(values, 0) + place(values, 1) + place(values, k)

    kernel(three, _nrt=False)(np.ones(3), 2)
    assert len(place.overloads) == 1


def test_a_part_says_that_python_cannot_call_it(place):
    def first(values):
        return place(values, 0)

    for _ in range(2):  # before it belongs to a kernel, and after
        with pytest.raises(TypeError, match=r"_place is part of kernels; .* call _place\.py_func"):
            place(np.ones(3), 0)
        kernel(first, _nrt=False)(np.ones(3))
    assert place.py_func(np.ones(3), 0) == 1.1


def test_numba_finds_types_in_its_own_way_again_whatever_came_of_a_compilation():
    def sums(values):
        return values[0] + values[1] + values[0]

    def makes_no_sense(values):
        return values.no_such_attribute + 1.0

    before = BaseFunction.get_call_type
    assert kernel(sums, _nrt=False)(np.array([2.0, 3.0])) == 7.0
    assert kernel(sums, _nrt=False)(np.array([2, 3])) == 7
    with pytest.raises(TypingError):
        kernel(makes_no_sense, _nrt=False)(np.ones(2))
    assert BaseFunction.get_call_type is before


FIRST_STEPS = """
import json
import gymnasium, curling_env
from curling_env.physics import catalogue
from curling_env.physics.many_stones import batch, common_steps
from curling_env.physics.one_stone import integrate
kernels = [batch._play_all, batch._slide_all, common_steps.slide_together, integrate.integrate]
found = []
for name, many in (
    ("CurlingSheet-v0", 0), ("CurlingEnd-v0", 0), ("CurlingSheet-v0", 2), ("CurlingEnd-v0", 2)
):
    env = gymnasium.make_vec(name, num_envs=many) if many else gymnasium.make(name)
    env.reset(seed=0)
    env.step(0 * env.action_space.sample())
    found.append({
        "kernels": sorted(k.__name__ for k in kernels if k.signatures),
        "effects": [name for name, card in catalogue().items()
                    if "_compiled" in vars(card.kernel or json)],
    })
print(json.dumps(found))
"""


def test_a_first_step_compiles_only_what_it_needs():
    """One sheet, one end, many sheets, many ends: each after those before it."""
    told = subprocess.check_output(
        [sys.executable, "-c", FIRST_STEPS], env=os.environ, text=True, timeout=300
    )
    found = json.loads(told)
    assert [one["kernels"] for one in found] == [
        ["integrate"],
        ["integrate"],
        ["_slide_all", "integrate"],
        ["_play_all", "_slide_all", "integrate"],
    ]
    for one in found:
        assert set(one["effects"]) == {effect.name for effect in load_ice("standard").effects}


def test_a_kernel_with_an_expression_of_whole_arrays_can_be_called():
    """Numba compiles such an expression with the kernel's own options, changed."""

    def spread(values):
        away = (values - 1.0) * (values + 0.5)
        return away.sum()

    values = np.arange(5.0)
    assert kernel(spread, _nrt=True)(values) == spread(values)
