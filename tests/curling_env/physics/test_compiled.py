"""What is compiled when: nothing at import, nothing a second time."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from curling_env.physics.compiled import CACHE_FOLDER

PLAY = """
import json
from numba.core import event
import numpy as np
passes = event.RecordingListener()
event.register("numba:run_pass", passes)
from curling_env.ice import load_ice
from curling_env.physics import Engine, StoneState, play_batch, slide, throw_batch
from curling_env.physics.compiled import CACHE_FOLDER
from curling_env.physics.integrator import integrate
from curling_env.throw import Throw
ice, release = load_ice("standard"), Throw(speed=2.6, spin=1.0).release()
def files():
    return {str(p): p.stat().st_mtime_ns for p in CACHE_FOLDER.rglob("*.nb*")}
before = files()
slide(ice, release)
throw_batch(ice, [release])
play_batch(ice, np.array([[[0.0, 17.0]]]), [release])
Engine(ice).play(release, [StoneState(x=0.0, y=17.0)])
print(json.dumps({
    "passes": len(passes.buffer),
    "written": sorted(files().items() - before.items()),
    "hits": sum(integrate.stats.cache_hits.values()),
    "misses": sum(integrate.stats.cache_misses.values()),
}))
"""

IMPORT = """
import json, sys
import curling_env
print(json.dumps({"loaded": sorted(sys.modules)}))
"""


def run(program: str, cache: Path | None = None) -> dict:
    """What a program in a process of its own prints; compiled code is kept in `cache`."""
    own = {} if cache is None else {"NUMBA_CACHE_DIR": str(cache)}
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | own,
    )
    return json.loads(done.stdout)


def test_a_second_start_compiles_nothing(tmp_path: Path) -> None:
    # In the usual folder another test may be compiling at this moment. What it holds need not be
    # compiled here once more.
    if CACHE_FOLDER is not None and CACHE_FOLDER.exists():
        with suppress(shutil.Error):
            shutil.copytree(CACHE_FOLDER, tmp_path / CACHE_FOLDER.name)
    run(PLAY, tmp_path)
    second = run(PLAY, tmp_path)
    assert second["written"] == []
    assert second["hits"] > 0
    assert second["misses"] == 0
    assert second["passes"] == 0


def test_importing_the_package_loads_nothing_heavy_and_compiles_nothing(tmp_path: Path) -> None:
    heavy = {"numba", "llvmlite", "torch", "cv2", "matplotlib", "pymunk", "scipy", "ray", "pygame"}
    assert not heavy & set(run(IMPORT, tmp_path)["loaded"])
    assert not list(tmp_path.iterdir())


OTHER = """
import json, sys
sys.path.insert(0, sys.argv[1])
import kernel
print(json.dumps({"answer": kernel.ask(1.0)}))
"""


def test_a_kernel_of_another_package_sees_a_change_in_its_neighbour(tmp_path: Path) -> None:
    (tmp_path / "kernel.py").write_text(
        "from curling_env.physics.compiled import compiled\n"
        "from neighbour import told\n"
        "@compiled\n"
        "def ask(x):\n"
        "    return told(x)\n"
    )
    (tmp_path / "cache").mkdir(mode=0o700)
    answers: list[float] = []
    for constant in (1, 2):
        (tmp_path / "neighbour.py").write_text(
            "from curling_env.physics.compiled import compiled\n"
            "@compiled\n"
            "def told(x):\n"
            f"    return x + {constant}\n"
        )
        program = OTHER.replace("sys.argv[1]", repr(str(tmp_path)))
        answers.append(run(program, tmp_path / "cache")["answer"])
    assert answers == [2.0, 3.0]


SLIDE = """
import json, sys
from curling_env.infrastructure import kernel_cache
from curling_env.physics.compiled import quick_log, compiled
@compiled
def half(x):
    return 0.5 * quick_log(x)
@compiled
def twice(x):
    return 4 * half(x)
found = twice(1.0)
print(json.dumps({"twice": found, "hits": sum(twice.stats.cache_hits.values())
                  + sum(half.stats.cache_hits.values()), "said": kernel_cache.remarks()}))
"""


def test_damaged_machine_code_is_compiled_again(tmp_path: Path) -> None:
    first = run(SLIDE, tmp_path)
    files = sorted(tmp_path.rglob("*.nb?"))
    assert len(files) >= 4
    for k, file in enumerate(files):
        content = file.read_bytes()
        at = len(content) // 2
        flipped = content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]
        file.write_bytes([b"", content[:100], os.urandom(len(content)), flipped][k % 4])
    assert run(SLIDE, tmp_path) == {**first, "hits": 0}
    assert run(SLIDE, tmp_path)["hits"] > 0  # what was damaged has been replaced


def test_a_cache_that_others_can_write_is_refused(tmp_path: Path) -> None:
    run(SLIDE, tmp_path)
    for folder in [tmp_path, *filter(Path.is_dir, tmp_path.rglob("*"))]:
        folder.chmod(0o777)
    found = run(SLIDE, tmp_path)
    assert found["hits"] == 0
    assert "others can write" in found["said"][0]
