"""Figures as files."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure

from curling_env.render import save_figure


@pytest.mark.parametrize(
    ("name", "begins"),
    [("a.png", b"\x89PNG"), ("plan", b"\x89PNG"), ("a.b", b"\x89PNG"), ("a.PDF", b"%PDF")],
)
def test_a_figure_has_exactly_its_name(tmp_path, name, begins):
    save_figure(Figure(figsize=(1, 1)), tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_bytes().startswith(begins)
