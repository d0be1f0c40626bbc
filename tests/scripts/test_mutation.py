"""The mutation tester: its areas, and the tests of a changed module."""

from __future__ import annotations

import subprocess

import mutation
import pytest

OF_LAW = ("tests/curling_env/physics/test_law.py", "tests")


def test_every_area_has_separate_modules():
    found = [mutation.modules(mutation.ROOT, area) for area in mutation.AREAS]
    assert all(found)
    assert len({path for paths in found for path in paths}) == sum(map(len, found))


@pytest.mark.parametrize(
    ("module", "statuses", "run", "verdict"),
    [
        ("curling_env/sheet.py", [0, 0], ["tests/curling_env/test_sheet.py", "tests"], 0),
        ("curling_env/sheet.py", [1], ["tests/curling_env/test_sheet.py"], 1),
        ("curling_env/physics/law.py", [0, 5, 0], [*OF_LAW, "tests/curling_env/physics"], 0),
        ("curling_env/physics/law.py", [0, 5, 1], [*OF_LAW, "tests/curling_env/physics"], 1),
    ],
)
def test_own_tests_come_first_and_those_of_the_folder_last(
    monkeypatch, module, statuses, run, verdict
):
    monkeypatch.chdir(mutation.ROOT)
    asked = []

    def recorded(command, **_):
        asked.append(command[-1])
        return subprocess.CompletedProcess(command, statuses.pop(0), "")

    monkeypatch.setattr(subprocess, "run", recorded)
    assert mutation.tested(module, ["tests"]) == verdict
    assert asked == run
