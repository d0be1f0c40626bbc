"""Examples of the pages: every fenced block, and its instructions in a comment above.

Blocks of `python` or `sh` are run, those of `json`, `csv` or `toml` parsed; `text` is no example. A
comment above a block may be ``<!-- file: NAME -->``, which saves it for the next blocks, or ``<!--
not run: WHY -->``, which skips it.
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
    """Fenced block of a page.

    Parameters
    ----------
    line : number of its first line
    language : language of its fence
    text : without the page's indentation
    file : name under which it is kept; empty for none
    not_run : reason why it is not run; empty if it is run
    """

    line: int
    language: str
    text: str
    file: str = ""
    not_run: str = ""


def pages(root: Path) -> dict[str, Path]:
    """Return all written pages by their names, with the README; decisions and schemas have none."""
    docs = root / "docs"
    found = {path.relative_to(docs).as_posix(): path for path in sorted(docs.rglob("*.md"))}
    kept = {n: p for n, p in found.items() if not n.startswith(("decisions/", "schemas/"))}
    return {**{name: root / name for name in ("README.md", *ROOT_PAGES)}, **kept}


def examples(page: str) -> Iterator[Example]:
    """Yield every fenced block of a page, except directives to the site's builder."""
    for found in _FENCED.finditer(page):
        language, text = found[2], textwrap.dedent(found[3])
        if language.startswith("{"):
            continue
        remark = _REMARK.search(page[: found.start()].rstrip() + "\n")
        options = {remark[1]: remark[2]} if remark else {}
        named = _NAMED.match(text) if language == "python" else None
        yield Example(
            line=page.count("\n", 0, found.start()) + 2,
            language=language,
            text=text,
            file=options.get("file", named[1] if named else ""),
            not_run=options.get("not run", ""),
        )
