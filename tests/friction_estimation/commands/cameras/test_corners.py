"""`curling corners` reports errors before it opens a page."""

from __future__ import annotations

import pytest


@pytest.mark.parametrize("sheet", ["44.5", "44.5x", "long x wide", "-1x4.5", "nanx4"])
def test_an_invalid_sheet_is_refused_in_one_line(curling, tmp_path, sheet):
    words = ("corners", tmp_path / "end.mp4", "-o", tmp_path / "end.json")
    assert curling(*words, "--no-browser", "--sheet", sheet).complaint
    assert list(tmp_path.iterdir()) == []
