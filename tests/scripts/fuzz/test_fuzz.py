"""Some inputs of the fuzzer: the same inputs every time, and none ends uncleanly."""

from __future__ import annotations

import random
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.mark.slow
def test_no_input_ends_uncleanly(tmp_path: Path) -> None:
    # A process of its own: the fuzzer forks, and must hold nothing of the tests.
    done = subprocess.run(
        [sys.executable, "-m", "fuzz", "--seed", "16", "--inputs", "15", "--minutes", "4",
         "--light", "--keep", tmp_path],
        cwd=ROOT / "scripts",
        capture_output=True,
        text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]


def test_the_fuzzer_notices_what_is_unclean(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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
    said = "import sys; print('curling: ' + 'x' * 400, file=sys.stderr); sys.exit(2)"
    assert ends(said) == ("long line",)
    monkeypatch.setattr(runs, "MAX_SECONDS", 0.2)
    assert "too long" in ends("import time; time.sleep(5)")


def test_damaged_files_differ_and_stay_small() -> None:
    from fuzz.mutations import damaged

    content = b'{"format": "curling-ice/1", "friction": {"mu": [[0.008, 0.009]]}}'
    rng = random.Random(1)
    found = [damaged(content, rng) for _ in range(300)]
    assert len(set(found)) > 200
    assert max(map(len, found)) < 200_000
