"""The settings all tests share: `make test` repeats its examples, `make soak` draws new ones."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PROPERTY = """
from hypothesis import given
from hypothesis import strategies as st

@given(st.floats(0, 1), st.integers())
def test_any(x, n):
    with open("examples.txt", "a") as file:
        print(x, n, file=file)
"""


def examples(folder: Path, profile: str, seed: int) -> list[str]:
    """Return the examples of a property in a run of pytest with our conftest."""
    folder.mkdir()
    (folder / "test_property.py").write_text(PROPERTY)
    shutil.copy(Path(__file__).with_name("conftest.py"), folder)
    subprocess.run(
        [sys.executable, "-m", "pytest", "-q", f"--hypothesis-seed={seed}", "-m", "hypothesis"],
        cwd=folder,
        env=os.environ | {"CURLING_HYPOTHESIS": profile, "PYTEST_ADDOPTS": ""},
        check=True,
        capture_output=True,
    )
    return (folder / "examples.txt").read_text().splitlines()


def test_every_ordinary_run_tries_the_same_examples(tmp_path: Path) -> None:
    one, two = (examples(tmp_path / str(seed), "repeatable", seed) for seed in (1, 2))
    assert one == two


def test_two_seeds_of_soak_try_different_examples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CI", "true")  # where hypothesis would otherwise draw no new ones
    one, again, two = (
        examples(tmp_path / name, "soak", seed) for name, seed in (("a", 1), ("b", 1), ("c", 2))
    )
    assert one == again
    assert len(one) >= 500
    assert len(set(one) & set(two)) < 0.3 * len(set(one))
