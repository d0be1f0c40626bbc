"""Workers end with their parent, however that ends, and block no other process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from curling_env.errors import InputError
from curling_env.infrastructure.executor import executor

PARENT = """
import os, sys, time
from curling_env.infrastructure.executor import executor
from {module} import sleep

if __name__ == "__main__":
    with executor(2) as work:
        for _ in work.map(sleep, [0, 0, 600, 600]):
            print("begun", flush=True)
"""
WORK = """
import os, pathlib, time

def sleep(seconds):
    pathlib.Path(f"worker-{os.getpid()}").touch()
    time.sleep(seconds)
"""


def is_there(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"  # it has ended, and its status was not read


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are looked up in /proc")
def test_a_killed_parent_leaves_no_worker_and_no_open_pipe(tmp_path):
    (tmp_path / "sleeping.py").write_text(WORK)
    (tmp_path / "parent.py").write_text(PARENT.format(module="sleeping"))
    parent = subprocess.Popen(
        [sys.executable, "parent.py"], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert parent.stdout is not None
    assert [parent.stdout.readline() for _ in range(2)] == [b"begun\n"] * 2
    workers = [int(path.name.partition("-")[2]) for path in tmp_path.glob("worker-*")]
    assert workers
    os.kill(parent.pid, signal.SIGKILL)
    # The pipes close, so that whoever reads them can go on; a worker that held one would not.
    parent.communicate(timeout=120)
    deadline = time.monotonic() + 60
    while any(map(is_there, workers)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(map(is_there, workers))


@pytest.mark.parametrize("count", ["0", "-1", "two", "", "1.5", "1" * 5000, "\u0663", "ray:2"])
def test_an_invalid_number_of_workers_is_refused(count):
    with pytest.raises(InputError, match="workers must be"), executor(count):
        pass
