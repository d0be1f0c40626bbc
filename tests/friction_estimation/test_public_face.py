"""`import friction_estimation` is all that a user needs, and takes no time."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import friction_estimation
from curling_env import read_tracks, write_tracks


def test_importing_the_package_loads_neither_opencv_nor_scipy():
    program = (
        "import sys, friction_estimation as f; dir(f);"
        "print(*sorted({'cv2', 'scipy', 'numpy', 'av', 'matplotlib'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (0, ""), done.stderr


@pytest.mark.parametrize("name", friction_estimation.__all__)
def test_every_public_name_is_there_and_documented(name):
    assert getattr(friction_estimation, name).__doc__
    assert name in dir(friction_estimation)


def test_a_name_that_is_not_there_is_refused():
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = friction_estimation.no_such_name


def test_ice_is_estimated_from_a_tracks_file_by_one_call(sliding, tmp_path):
    rng = np.random.default_rng(3)
    starts = sliding.varied_starts(rng, 4)
    throws = sliding.measured_throws(sliding.uniform(0.009), starts, rng, fps=10)
    write_tracks(tmp_path / "tracks.csv", throws)
    estimate = friction_estimation.estimate_ice(read_tracks(tmp_path / "tracks.csv"))
    low, high = estimate.interval
    assert low < 0.009 < high
    assert estimate.ice.friction.observed.any()
