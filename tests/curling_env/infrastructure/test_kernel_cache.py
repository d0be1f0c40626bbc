"""The first start reports compilation; without a cache every start is only slower."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

USE_KERNELS = """
import numpy as np

from curling_env.physics import catalogue
from friction_estimation.appearance.kernels.picture_kernels import blur  # other sources

print(catalogue()["air_drag"].kernel.address != 0)
blur(np.ones((1, 2, 2), np.float32), 1, 1, 0.5, 0.0, 0.0, False, np.ones((1, 3, 1, 1), np.float32))
"""


def start(cache: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache), "HOME": str(cache)}
    environment.pop("NUMBA_CACHE_DIR", None)
    return subprocess.run(
        [sys.executable, "-c", USE_KERNELS],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )


def test_only_the_first_start_reports_compilation(tmp_path):
    first, second = start(tmp_path), start(tmp_path)
    assert first.stdout == second.stdout == "True\n"
    assert first.stderr.count("compiling the physics for this machine, once") == 1
    assert first.stderr.count("\n") == 1
    assert second.stderr == ""


def test_it_runs_without_a_writable_cache():
    found = start(Path("/dev/null/nowhere"))
    assert found.returncode == 0, found.stderr
    assert found.stdout == "True\n"
    assert found.stderr.count("compiled code is not cached") == 1


def test_a_user_without_a_home_is_warned():
    program = (
        "import pathlib\n"
        "def nowhere(_=None):\n"
        "    raise RuntimeError\n"
        "pathlib.Path.home = nowhere\n" + USE_KERNELS
    )
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    environment.pop("XDG_CACHE_HOME", None)
    found = subprocess.run(
        [sys.executable, "-c", program],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert found.stdout == "True\n", found.stderr
    assert found.stderr.count("compiled code is not cached") == 1
