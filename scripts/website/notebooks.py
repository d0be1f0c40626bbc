"""Pages of the notebooks: their text and code, without running them."""

from __future__ import annotations

from pathlib import Path

INDEX = "notebooks/README.md"


def pages(docs: Path) -> dict[str, str]:
    """Return a page for each notebook of docs/notebooks, by its name."""
    return {
        f"notebooks/{path.stem}.md": page(path) for path in sorted(docs.glob("notebooks/*.ipynb"))
    }


def page(path: Path) -> str:
    """Return a notebook as Markdown, with the file itself for download below its title."""
    from nbconvert import MarkdownExporter

    title, _, rest = MarkdownExporter().from_filename(str(path))[0].strip().partition("\n")
    return f"{title}\n\n{{download}}`The notebook <{path.name}>`\n{rest}\n"
