"""The examples of the pages: every fenced block, and what is said of it in a comment above.

A block in `python` or `sh` is run, in `json`, `csv` or `toml` read; `text` is no example. Above a
block may stand ``<!-- file: NAME -->``, under which it is kept for those that follow, or
``<!-- not run: WHY -->``.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from website.pages import ROOT_PAGES

_FENCED = re.compile(r"^( *)```(\S*)[^\n]*\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)
_REMARK = re.compile(r"<!-- (file|not run): (.+?) -->\s*\Z")
_NAMED = re.compile(r'(?:"""|# )(\w+\.py)\b')


@dataclass(frozen=True, kw_only=True)
class Example:
    """A fenced block of a page.

    Parameters
    ----------
    line : where its first line stands
    language : as its fence says
    text : without the page's indentation
    file : the name under which it is kept, or nothing
    not_run : why it is not run, or nothing
    """

    line: int
    language: str
    text: str
    file: str = ""
    not_run: str = ""


def pages(root: Path) -> dict[str, Path]:
    """All written pages by their names, the README among them; decisions and schemas have none."""
    docs = root / "docs"
    found = {path.relative_to(docs).as_posix(): path for path in sorted(docs.rglob("*.md"))}
    kept = {n: p for n, p in found.items() if not n.startswith(("decisions/", "schemas/"))}
    return {**{name: root / name for name in ("README.md", *ROOT_PAGES)}, **kept}


def examples(page: str) -> Iterator[Example]:
    """Every fenced block of a page, but for those that are directions to the site's builder."""
    for found in _FENCED.finditer(page):
        language, text = found[2], textwrap.dedent(found[3])
        if language.startswith("{"):
            continue
        remark = _REMARK.search(page[: found.start()].rstrip() + "\n")
        said = {remark[1]: remark[2]} if remark else {}
        named = _NAMED.match(text) if language == "python" else None
        yield Example(
            line=page.count("\n", 0, found.start()) + 2,
            language=language,
            text=text,
            file=said.get("file", named[1] if named else ""),
            not_run=said.get("not run", ""),
        )
