"""The mutation tester: what it changes, how it draws, and what becomes of a mutant."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import mutation
from mutants.operators import mutants_of
from mutants.touched import Touched, distance

SOURCE = '''"""Not 1 + 1."""

from curling_env.physics.compiled import compiled

LIMIT: float = 3


@compiled
def kernel(x: int = 1) -> float:
    """Not 2 < 3."""
    return x * 2


def clamp(x, low, names=()):
    if x < low and not names:
        raise ValueError(f"{x + 1} is below {low}")
    names.append(x)
    progress("half", 0.5)
    return min(x, LIMIT)
'''


def test_operators_conditions_numbers_and_statements_change_and_words_do_not(tmp_path):
    (tmp_path / "sample.py").write_text(SOURCE)
    found = list(mutants_of("area", tmp_path, "sample.py"))
    changes = {(m.original, m.mutant) for m in found}
    assert changes == {
        ("LIMIT: float = 3", "LIMIT: float = 4"),
        ("def kernel(x: int = 1) -> float:", "def kernel(x: int = 2) -> float:"),
        ("return x * 2", "return None"),
        ("return x * 2", "return x / 2"),
        ("return x * 2", "return x * 3"),
        ("if x < low and not names:", "if (not (x < low and not names)):"),
        ("if x < low and not names:", "if x <= low and not names:"),
        ("if x < low and not names:", "if x > low and not names:"),
        ("if x < low and not names:", "if x < low or not names:"),
        ("if x < low and not names:", "if x < low and names:"),
        ('raise ValueError(f"{x + 1} is below {low}")', "pass"),
        ("names.append(x)", "pass"),
        ("return min(x, LIMIT)", "return None"),
        ("return min(x, LIMIT)", "return max(x, LIMIT)"),
    }
    hidden = {m.original for m in found if m.hidden}
    assert hidden == {"LIMIT: float = 3", "def kernel(x: int = 1) -> float:", "return x * 2"}
    assert all(m.is_python(tmp_path) for m in found)


def test_a_sample_is_even_over_the_areas_and_goes_by_its_seed():
    root = Path(mutation.__file__).parent.parent
    drawn = mutation.draw(root, 30, 1, list(mutation.AREAS))
    assert Counter(m.area for m in drawn) == dict.fromkeys(mutation.AREAS, 5)
    assert drawn == mutation.draw(root, 30, 1, list(mutation.AREAS))
    assert drawn != mutation.draw(root, 30, 2, list(mutation.AREAS))


def test_the_closest_and_quickest_tests_come_first():
    touched = Touched(
        bodies={},
        seconds={"tests/a/test_m.py::slow": 9, "tests/a/test_m.py::quick": 1, "tests/b/t.py::x": 0},
        lines={"a/m.py": {test: {3} for test in
               ("tests/b/t.py::x", "tests/a/test_m.py::slow", "tests/a/test_m.py::quick")}},
    )  # fmt: skip
    one = mutation.Mutant("", "a/m.py", 3, 0, 0, "", "", "", 3, 3, False)
    assert touched.tests_for(one, []) == [
        "tests/a/test_m.py::quick",
        "tests/a/test_m.py::slow",
        "tests/b/t.py::x",
    ]
    assert distance("a/m.py", "tests/a/test_n.py::x") == 1
