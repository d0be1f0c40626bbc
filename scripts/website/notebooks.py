"""A page for every notebook: its words and its code. Notebooks are kept without outputs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

FOLDERS = ("notebooks", "docs/notebooks")


def pages(root: Path) -> dict[str, str]:
    """A page for each notebook of the repository, and their list; nothing where there is none."""
    found = [path for folder in FOLDERS for path in sorted((root / folder).glob("*.ipynb"))]
    texts = {f"notebooks/{path.stem}.md": page(path, root) for path in found}
    if not texts:
        return {}
    texts["notebooks/index.md"] = "\n".join(
        [
            "# Notebooks",
            "",
            "To be run cell by cell. Each makes the files that it needs.",
            "",
            "```{toctree}",
            "",
            *(path.stem for path in found),
            "```",
            "",
        ]
    )
    return texts


def page(path: Path, root: Path) -> str:
    """A notebook in Markdown, its first heading as it stands there."""
    notebook = json.loads(path.read_text(encoding="utf-8"))
    parts = [part for cell in notebook["cells"] if (part := _cell(cell))]
    where = f"*This is the notebook* `{path.relative_to(root).as_posix()}`."
    return "\n\n".join([parts[0], where, *parts[1:]]) + "\n"


def _cell(cell: dict[str, Any]) -> str:
    source = cell["source"]
    text = source if isinstance(source, str) else "".join(source)
    return f"```python\n{text.rstrip()}\n```" if cell["cell_type"] == "code" else text.rstrip()
