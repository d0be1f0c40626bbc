"""Notebooks are stored without outputs, and run; `make notebooks` runs the longer ones."""

from __future__ import annotations

from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat", reason="make setup installs it")
nbclient = pytest.importorskip("nbclient", reason="make setup installs it")

NOTEBOOKS = sorted((Path(__file__).parents[2] / "docs" / "notebooks").glob("*.ipynb"))


def test_there_are_four_each_with_a_title():
    assert [path.stem[0] for path in NOTEBOOKS] == ["1", "2", "3", "4"]
    for path in NOTEBOOKS:
        first = nbformat.read(path, as_version=4).cells[0]
        assert first.cell_type == "markdown"
        assert first.source.startswith("# ")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_are_kept_without_outputs(path: Path):
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    for cell in notebook.cells:
        assert not cell.metadata, "make format"
        assert not cell.get("outputs"), "make format"
        assert cell.get("execution_count") is None, "make format"
    assert set(notebook.metadata) <= {"kernelspec", "language_info"}


def test_the_cheapest_one_runs_and_finds_the_hidden_effect(monkeypatch, tmp_path):
    monkeypatch.setenv("PYDEVD_DISABLE_FILE_VALIDATION", "1")
    (path,) = [path for path in NOTEBOOKS if path.stem == "3-discover"]
    client = nbclient.NotebookClient(
        nbformat.read(path, as_version=4),
        timeout=300,
        kernel_name="python3",
        resources={"metadata": {"path": str(tmp_path)}},
    )
    text = "".join(
        output.get("text", "")
        for cell in client.execute().cells
        for output in cell.get("outputs", ())
    )
    assert "The model lacks a slope of the ice" in text
    assert "slope.y = 3.0" in text
    assert "Nothing is missing" in text
