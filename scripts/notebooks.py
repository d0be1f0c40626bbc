"""Execute the notebooks of docs/notebooks, as pages with their outputs, or strip their outputs.

`make notebooks` writes runs/notebooks/NAME.html; the notebooks themselves are kept without outputs
(`python scripts/notebooks.py --strip`), so that a change of one shows what was changed.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).parents[1]
NOTEBOOKS = tuple(sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")))


def main() -> None:
    options = argparse.ArgumentParser(prog="notebooks", description=__doc__)
    options.add_argument("--strip", action="store_true", help="take outputs away instead")
    options.add_argument("names", nargs="*", help="beginnings of names; all by default")
    given = options.parse_args()
    wanted = [p for p in NOTEBOOKS if not given.names or p.name.startswith(tuple(given.names))]
    if given.strip:
        for path in wanted:
            strip(path)
        return
    from nbconvert import HTMLExporter  # brings a web of packages

    folder = ROOT / "runs" / "notebooks"
    folder.mkdir(parents=True, exist_ok=True)
    for path in wanted:
        begun = time.monotonic()
        page, _ = HTMLExporter(template_name="basic").from_notebook_node(executed(path))
        (folder / f"{path.stem}.html").write_text(PAGE.format(page), encoding="utf-8")
        print(f"{folder / path.stem}.html: {time.monotonic() - begun:.0f} s", flush=True)


PAGE = """<!doctype html><meta charset="utf-8">
<style>body {{ max-width: 60rem; margin: 2rem auto; font-family: sans-serif; line-height: 1.5 }}
pre {{ padding: 0.5rem; background: #f5f5f5; overflow-x: auto }} img {{ max-width: 100% }}
td, th {{ padding: 0.1rem 0.6rem }} .anchor-link {{ display: none }}</style>
{}
"""


def read(path: Path) -> Any:
    """A notebook, checked against its format."""
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    return notebook


def executed(path: Path) -> Any:
    """A notebook after all its cells have run, in a process of its own.

    Raises
    ------
    nbclient.exceptions.CellExecutionError : a cell fails
    """
    os.environ.setdefault("PYDEVD_DISABLE_FILE_VALIDATION", "1")
    notebook = read(path)
    client = NotebookClient(
        notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(ROOT)}}
    )
    return client.execute()


def faults(path: Path) -> list[str]:
    """What a notebook has that is not to be kept, one line each."""
    notebook = read(path)
    told: list[str] = []
    for cell in notebook.cells:
        if cell.cell_type == "code" and (cell.outputs or cell.execution_count is not None):
            told.append(f"{path.name}: {cell.id} has outputs")
        if cell.metadata:
            told.append(f"{path.name}: {cell.id} has metadata")
    if set(notebook.metadata) - {"kernelspec", "language_info"}:
        told.append(f"{path.name} has metadata")
    return told


def strip(path: Path) -> None:
    """Take away what `faults` tells."""
    notebook = read(path)
    for cell in notebook.cells:
        cell.metadata = {}
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    kept = {"kernelspec", "language_info"}
    notebook.metadata = {k: v for k, v in notebook.metadata.items() if k in kept}
    notebook.metadata["language_info"] = {"name": "python"}
    nbformat.write(notebook, path)


if __name__ == "__main__":
    main()
