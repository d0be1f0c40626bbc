"""Notebooks are kept without outputs, and run; `make notebooks` runs those that take longer."""

from __future__ import annotations

from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat", reason="make setup installs it")
pytest.importorskip("nbclient", reason="make setup installs it")
import notebooks  # noqa: E402


def test_there_are_four_each_with_a_title():
    assert [path.stem[0] for path in notebooks.NOTEBOOKS] == ["1", "2", "3", "4"]
    for path in notebooks.NOTEBOOKS:
        first = notebooks.read(path).cells[0]
        assert first.cell_type == "markdown"
        assert first.source.startswith("# ")


@pytest.mark.parametrize("path", notebooks.NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_are_kept_without_outputs(path: Path):
    assert notebooks.faults(path) == [], "python scripts/notebooks.py --strip"


def test_outputs_and_metadata_are_told_and_stripped(tmp_path: Path):
    cell = nbformat.v4.new_code_cell("1 + 1", execution_count=1, id="a")
    cell.outputs = [nbformat.v4.new_output("stream", text="2")]
    cell.metadata["collapsed"] = True
    notebook = nbformat.v4.new_notebook(cells=[cell], metadata={"widgets": {}})
    path = tmp_path / "n.ipynb"
    nbformat.write(notebook, path)
    assert len(notebooks.faults(path)) == 3
    notebooks.strip(path)
    assert notebooks.faults(path) == []
    assert notebooks.read(path).cells[0].source == "1 + 1"


def test_the_cheapest_one_runs_and_finds_what_is_hidden():
    (path,) = [path for path in notebooks.NOTEBOOKS if path.stem == "3-discover"]
    said = "".join(
        output.get("text", "")
        for cell in notebooks.executed(path).cells
        for output in cell.get("outputs", ())
    )
    assert "The model lacks a slope of the ice" in said
    assert "slope.y = 3.0" in said
    assert "Nothing is missing" in said
