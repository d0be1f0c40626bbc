"""Pages of the notebooks: their text and code, without running them."""

from __future__ import annotations

import json
from pathlib import Path

INDEX = "notebooks/README.md"


def pages(docs: Path) -> dict[str, str]:
    """A page for each notebook of docs/notebooks, by its name."""
    return {
        f"notebooks/{path.stem}.md": page(path) for path in sorted(docs.glob("notebooks/*.ipynb"))
    }


def page(path: Path) -> str:
    """A notebook as Markdown, with the file itself to take away below its title."""
    parts: list[str] = []
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        text = "".join(cell["source"])
        parts.append(text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```")
    title, _, rest = parts[0].partition("\n")
    parts[0] = f"{title}\n\n{{download}}`The notebook <{path.name}>`\n{rest}"
    return "\n\n".join(parts) + "\n"


def linked(index: str) -> str:
    """The list of notebooks with links to their pages."""
    return index.replace(".ipynb)", ".md)")
