"""All pages of the site in one folder: from docs/, from the root, and those made from the code."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from website import commands, effects, notebooks, observations, python_api

ROOT_PAGES = {
    "ARCHITECTURE.md": "architecture.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
}
"""Place on the site of documents in the repository's root."""
ELSEWHERE = {**ROOT_PAGES, "README.md": "index.md"}
_LINK = re.compile(r"(\]\()([^)\s]+)(\))")
_DATE = re.compile(r"\| (\d{4}-\d\d-\d\d) (?=\|)")
_PER_CENT = re.compile(r"(?<=\d) %")


def gather(root: Path, folder: Path) -> None:
    """Write all pages, and remove old ones that no longer exist.

    Unchanged files keep their time, so that Sphinx reads only the changed ones.
    """
    texts, copied = pages(root)
    wanted = {folder / name for name in (*texts, *copied)}
    for old in [path for path in folder.rglob("*") if path.is_file() and path not in wanted]:
        old.unlink()
    for name, text in texts.items():
        page = folder / name
        page.parent.mkdir(parents=True, exist_ok=True)
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")
    for name, source in copied.items():
        page = folder / name
        page.parent.mkdir(parents=True, exist_ok=True)
        if not page.exists() or page.stat().st_mtime != source.stat().st_mtime:
            shutil.copy2(source, page)


def pages(root: Path) -> tuple[dict[str, str], dict[str, Path]]:
    """Return the texts of all pages by their names, and the files that are copied with them."""
    texts: dict[str, str] = {}
    copied: dict[str, Path] = {}
    docs = root / "docs"
    for path in sorted(docs.rglob("*")):
        name = path.relative_to(docs).as_posix()
        if path.suffix == ".md":
            text = path.read_text(encoding="utf-8")
            texts[name] = observations.filled_in(relinked(text, name, below="docs/"))
        elif path.is_file():
            copied[name] = path
    for source, name in ROOT_PAGES.items():
        texts[name] = relinked((root / source).read_text(encoding="utf-8"), name, below="")
    texts["decisions/README.md"] += _hidden_contents("[a-z]*")
    if notebooks.INDEX in texts:
        index = texts[notebooks.INDEX].replace(".ipynb)", ".md)")
        texts[notebooks.INDEX] = index + _hidden_contents("[0-9]*")
    texts |= notebooks.pages(docs)
    texts |= {**commands.pages(), **effects.pages(), **python_api.pages()}
    return {name: with_whole_cells(text) for name, text in texts.items()}, copied


def relinked(text: str, name: str, *, below: str) -> str:
    """Return a page with links to the documents' places on the site.

    Parameters
    ----------
    text : the page in Markdown
    name : its place on the site
    below : base of its relative links in the repository: ``docs/``, or empty for the root's
    """
    up = "../" * name.count("/")

    def elsewhere(link: re.Match[str]) -> str:
        target, hash_mark, anchor = link[2].partition("#")
        if below and target.startswith(f"{up}../"):
            place = ELSEWHERE.get(target.removeprefix(f"{up}../"))
        elif not below:
            place = ELSEWHERE.get(target, target.removeprefix("docs/") if target else None)
        else:
            place = None
        if place is None or "://" in target:
            return link[0]
        return f"{link[1]}{up}{place}{hash_mark}{anchor}{link[3]}"

    return _LINK.sub(elsewhere, text)


def with_whole_cells(text: str) -> str:
    """Return a page whose tables do not break dates at their hyphens or percentages before their
    sign.
    """
    lines, fenced = text.split("\n"), False
    for k, line in enumerate(lines):
        fenced ^= line.lstrip().startswith("```")
        if line.startswith("|") and not fenced:
            dated = _DATE.sub(r'| <span class="date">\1</span> ', line)
            lines[k] = _PER_CENT.sub("\N{NO-BREAK SPACE}%", dated)
    return "\n".join(lines)


def _hidden_contents(*entries: str) -> str:
    lines = "\n".join(entries)
    return f"\n```{{toctree}}\n:hidden:\n:glob:\n\n{lines}\n```\n"
