"""Workers take one core each, in any environment of the user."""

from __future__ import annotations

import json
import os
import subprocess
import sys

from curling_env.infrastructure.threads import LIMITS

PROGRAM = """
import json, numpy
from threadpoolctl import threadpool_info
before = [library["num_threads"] for library in threadpool_info()]
from curling_env.infrastructure.threads import one_thread
one_thread()
import scipy.linalg
print(json.dumps([before, [library["num_threads"] for library in threadpool_info()]]))
"""


def test_libraries_that_are_loaded_and_those_that_come_later_have_one_thread():
    many = os.environ | dict.fromkeys(LIMITS, "3")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=many, capture_output=True, text=True, check=True
    )
    before, after = json.loads(done.stdout)
    assert max(before) > 1
    assert len(after) > len(before)  # SciPy brings its own
    assert set(after) == {1}
