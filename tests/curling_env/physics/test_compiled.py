"""Time of compilation: nothing at import, nothing a second time."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from curling_env.ice import load_ice
from curling_env.physics.compiled import CACHE_FOLDER, compiled, inlined, part

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


def run(program: str, cache: Path | None = None) -> Any:
    """Return the output of a program in a separate process; compiled code is cached in `cache`."""
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
    if CACHE_FOLDER.exists():
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
        "from neighbour import doubled\n"
        "@compiled\n"
        "def ask(x):\n"
        "    return doubled(x)\n"
    )
    (tmp_path / "cache").mkdir(mode=0o700)
    answers: list[float] = []
    for constant in (1, 20):  # of other lengths: Python tells apart two files of one second by size
        (tmp_path / "neighbour.py").write_text(
            "from curling_env.physics.compiled import compiled\n"
            "@compiled\n"
            "def doubled(x):\n"
            f"    return x + {constant}\n"
        )
        program = OTHER.replace("sys.argv[1]", repr(str(tmp_path)))
        answers.append(run(program, tmp_path / "cache")["answer"])
    assert answers == [2.0, 21.0]


KERNELS = """
import json
from curling_env.infrastructure import kernel_cache
from curling_env.physics.compiled import quick_log, compiled
@compiled
def half(x):
    return 0.5 * quick_log(x)
@compiled
def twice(x):
    return 4 * half(x)
found = twice(3.0)
print(json.dumps({"twice": found, "hits": sum(twice.stats.cache_hits.values())
                  + sum(half.stats.cache_hits.values()), "remarks": kernel_cache.remarks()}))
"""


@pytest.fixture
def cache(tmp_path: Path) -> Path:
    folder = tmp_path / "cache"
    folder.mkdir()
    return folder


@pytest.fixture
def kernels(tmp_path: Path) -> str:
    """Return a program that runs kernels in a file."""
    file = tmp_path / "kernels.py"
    file.write_text(KERNELS)
    return f"exec(compile(open({str(file)!r}).read(), {str(file)!r}, 'exec'))"


def test_damaged_machine_code_is_compiled_again(kernels: str, cache: Path) -> None:
    def flip(content: bytes) -> bytes:
        at = len(content) // 2
        return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]

    first = run(kernels, cache)
    files = sorted(cache.rglob("*.nb?"))
    assert len(files) == 4
    # One kernel is damaged in one way, and the other at the same time in another.
    for damages in ((lambda _: b"", flip), (lambda c: os.urandom(len(c)), lambda c: c[:100])):
        for k, file in enumerate(files):
            file.write_bytes(damages[k // 2](file.read_bytes()))
        assert run(kernels, cache) == {**first, "hits": 0}
    assert run(kernels, cache)["hits"] > 0  # what was damaged has been replaced


def test_an_unwritable_cache_is_not_fatal(kernels: str, cache: Path) -> None:
    first = run(kernels, cache)
    for index in cache.rglob("*.nbi"):
        index.unlink()
        index.mkdir()
    found = run(kernels, cache)
    assert found["twice"] == first["twice"]
    assert "cannot be written" in found["remarks"][0]


def test_a_cache_that_others_can_write_is_refused(kernels: str, cache: Path) -> None:
    run(kernels, cache)
    for folder in filter(Path.is_dir, cache.rglob("*")):
        folder.chmod(0o777)
    found = run(kernels, cache)
    assert found["hits"] == 0
    assert "others can write" in found["remarks"][0]


def test_a_kernel_without_a_file_is_not_kept(cache: Path) -> None:
    # Nothing would tell that its constants have changed.
    first, second = run(KERNELS, cache), run(KERNELS.replace("4 *", "5 *"), cache)
    assert second["twice"] / first["twice"] == pytest.approx(5 / 4)
    assert not list(cache.rglob("*.nb?"))


@pytest.mark.parametrize("kind", [part, inlined])
def test_a_part_computes_the_same_in_a_kernel_and_in_python(kind) -> None:
    def in_python(values, k):
        return values[k] * values[k] + 0.1

    place = kind(in_python)

    def total(values):
        found = place(values, 0)
        for k in range(1, values.shape[0]):
            found = found / 3.0 + place(values, k)
        return found

    values = np.random.default_rng(0).normal(size=50)
    expected = total(values)
    assert compiled(total)(values) == expected
    assert total(values) == expected
    assert len(place._compiled.signatures) == 1  # not another one for the constant


def test_a_kernel_with_an_expression_of_whole_arrays_can_be_called() -> None:
    def spread(values):
        away = (values - 1.0) * (values + 0.5)
        return away.sum()

    values = np.arange(5.0)
    assert compiled(spread, allocates=True)(values) == spread(values)


FIRST_STEPS = """
import json
import gymnasium, curling_env
from curling_env.physics import catalogue
from curling_env.physics import batch, events, integrator
kernels = [batch._play_all, batch._slide_all, integrator.integrate, events.advance_and_sample]
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


def test_a_first_step_compiles_only_the_needed_kernels() -> None:
    """One sheet, one end, many sheets, many ends: each after those before it."""
    found = run(FIRST_STEPS)
    assert [one["kernels"] for one in found] == [
        ["advance_and_sample", "integrate"],
        ["advance_and_sample", "integrate"],
        ["_slide_all", "advance_and_sample", "integrate"],
        ["_slide_all", "advance_and_sample", "integrate"],
    ]
    for one in found:
        assert set(one["effects"]) == {effect.name for effect in load_ice("standard").effects}
