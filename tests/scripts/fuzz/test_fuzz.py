"""Some inputs of the fuzzer: the same inputs every time, and none ends uncleanly."""

from __future__ import annotations

import json
import random
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.mark.slow
def test_no_input_ends_uncleanly(tmp_path: Path) -> None:
    # A separate process: the fuzzer forks, and must hold nothing of the tests.
    words = [sys.executable, "-m", "fuzz", "--seed", "16", "--light", "--keep", tmp_path]
    done = subprocess.run(
        [*words, "--inputs", "25"],
        cwd=ROOT / "scripts",
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
    report = json.loads((tmp_path / "seed-16.json").read_text())
    assert report["inputs"] == 25 == sum(report["by_target"].values())
    assert report["unclean"] == 0


def test_the_fuzzer_notices_unclean_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from fuzz import runs

    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "mine").write_text("mine")

    def ends(program: str) -> tuple[str, ...]:
        monkeypatch.setattr("curling_env.commands.cli.main", lambda _: exec(program, {}) or 0)
        return runs.run(["throw"], folder).faults

    assert ends("") == ()
    assert ends("raise SystemExit(2)") == ("0 lines",)
    assert ends("raise KeyError") == ("status 1", "traceback")
    assert ends("import os, signal; os.kill(os.getpid(), signal.SIGKILL)") == ("status -9",)
    assert ends("import pathlib; pathlib.Path('mine').unlink()") == ("lost ['mine']",)
    kept = "open('o.csv', 'w').close(); print('curling: {}', file=sys.stderr); sys.exit(2)"
    assert ends("import sys; " + kept.format("bad")) == ("left ['o.csv']",)
    assert ends("import sys; " + kept.format("already written: o.csv")) == ()
    program = "import sys; print('curling: ' + 'x' * 400, file=sys.stderr); sys.exit(2)"
    assert ends(program) == ("long line",)
    given = {"fails": lambda path: 1 / 0}
    assert runs.run(["read", "fails", "mine"], folder, given=given).faults == (
        "status 1",
        "traceback",
    )
    monkeypatch.setattr(runs, "MAX_SECONDS", 0.2)
    assert "too long" in ends("import time; time.sleep(5)")


def test_inputs_are_the_same_for_a_seed_and_have_every_kind_of_fault() -> None:
    from fuzz.__main__ import drawn
    from fuzz.inputs import KINDS, Input, inputs
    from fuzz.targets import make_targets

    good = {"ice.json": ICE, "t.csv": TRACKS, "st.json": b'[{"x": 0.3, "y": 17.0}]'}
    targets = make_targets(good)
    assert {"convert t.csv", "read ice.json"} <= {target.name for target in targets}

    def some(seed: int, size: int) -> list[Input]:
        found: list[Input] = []
        drawn(inputs(targets, [b"POST / HTTP/1.1\r\n\r\n{}"]), seed, size, found.append)
        return found

    first = some(1, 50)
    assert len(first) == 50
    assert first == some(1, 50)
    others = [some(seed, 100) for seed in range(2, 6)]
    assert first != others[0]
    names = " ".join(one.name for drawing in (first, *others) for one in drawing)
    assert [k for k in KINDS if k not in names and k not in ("damage", "message")] == []
    assert max(len(k) for one in first for k in one.files.values() if "large" not in one.name) < 1e6


ICE = b'{"format": "curling-ice/1", "friction": {"mu": [[0.008, 0.009]]}}'
TRACKS = b"throw,t,x,y,theta\n" + b"".join(b"0,%d,0.1,%d,0\n" % (k, k) for k in range(9))


@pytest.mark.parametrize("content", [ICE, TRACKS], ids=["json", "csv"])
def test_damaged_files_differ_and_stay_small(content: bytes) -> None:
    from fuzz.mutations import damaged, enlarged

    rng = random.Random(1)
    found = [damaged(content, rng) for _ in range(300)]
    assert len(set(found)) > 200
    assert max(map(len, found)) < 400_000
    assert len(enlarged(content, rng)) > 5_000_000


def test_columns_are_scaled_and_tables_cut_to_their_headings() -> None:
    from fuzz.mutations import damaged

    rng = random.Random(1)
    found = [damaged(TRACKS, rng) for _ in range(2000)]
    assert b"throw,t,x,y,theta\n" in found
    scaled = (lines.split(b"\n")[1:-1] for lines in found if lines.count(b"\n") == 10)
    assert any(all(b"e-9," in line for line in lines) for lines in scaled)
