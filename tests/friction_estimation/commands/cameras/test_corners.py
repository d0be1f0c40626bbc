"""`curling corners` says what is wrong before it opens a page."""

from __future__ import annotations

import pytest

from curling_env.commands.cli import main


@pytest.mark.parametrize("sheet", ["44.5", "44.5x", "long x wide", "-1x4.5", "nanx4"])
def test_a_sheet_that_is_none_is_refused_in_one_line(tmp_path, capsys, sheet):
    words = ["corners", str(tmp_path / "end.mp4"), "-o", str(tmp_path / "end.json")]
    assert main([*words, "--no-browser", "--sheet", sheet]) == 2
    said = capsys.readouterr().err.strip()
    assert len(said.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
