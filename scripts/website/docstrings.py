"""The house's docstrings as field lists: NumPy's sections, with words and units after the colon."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

_SECTION = re.compile(r"^(Parameters|Returns|Yields|Raises|Source|Attributes|Notes)$")
_ENTRY = re.compile(r"^(\*{0,2}[\w, .*]+?) : (.*)$")


def setup(app: Sphinx) -> dict[str, Any]:
    app.connect("autodoc-process-docstring", _process)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _process(*given: Any) -> None:
    lines: list[str] = given[-1]
    lines[:] = field_list(lines)


def field_list(lines: list[str]) -> list[str]:
    """A docstring in reStructuredText.

    Parameters
    ----------
    lines : without its indentation
    """
    before, sections = _split(lines)
    out = _paragraphs(before)
    for title, body in sections:
        out += ["", *_fields(title, body)]
    return [*out, ""]


def _split(lines: list[str]) -> tuple[list[str], list[tuple[str, list[str]]]]:
    before: list[str] = []
    sections: list[tuple[str, list[str]]] = []
    at = 0
    while at < len(lines):
        rule = lines[at + 1] if at + 1 < len(lines) else ""
        if _SECTION.match(lines[at]) and re.match(r"^-{3,}$", rule):
            sections.append((lines[at], []))
            at += 2
            continue
        (sections[-1][1] if sections else before).append(lines[at])
        at += 1
    return before, sections


def _fields(title: str, body: list[str]) -> list[str]:
    if title in ("Parameters", "Attributes", "Raises"):
        label = "raises" if title == "Raises" else "param"
        return [f":{label} {_names(name)}: {_escaped(words)}" for name, words in _entries(body)]
    words = _escaped(_joined(body))
    if title in ("Returns", "Yields"):
        return [f":returns: {words}"]
    return [f"**{title}.** {words}"]


def _names(names: str) -> str:
    return names.replace("*", r"\*").replace(", ", r",\ ")


def _entries(body: list[str]) -> list[tuple[str, str]]:
    entries: list[tuple[str, list[str]]] = []
    for line in body:
        found = _ENTRY.match(line)
        if found:
            entries.append((found[1], [found[2]]))
        elif entries:
            entries[-1][1].append(line)
    return [(name, _joined(words)) for name, words in entries]


def _joined(lines: list[str]) -> str:
    return " ".join(line.strip() for line in lines if line.strip())


def _paragraphs(lines: list[str]) -> list[str]:
    """Plain text as it stands; what is indented below a colon is an example."""
    out: list[str] = []
    literal = False
    for at, line in enumerate(lines):
        indented = line.startswith("    ")
        if indented and not literal and (at == 0 or not lines[at - 1].strip()):
            out += ["::", ""]
            literal = True
        elif line.strip() and not indented:
            literal = False
        out.append(line if literal or not line.strip() else _escaped(line))
    return out


def _escaped(text: str) -> str:
    """Text without meaning for reStructuredText, except what stands in backticks."""
    parts = re.split(r"(``.*?``|`.*?`)", text)
    return "".join(
        part if part.startswith("`") else re.sub(r"([*|_\\])", r"\\\1", part) for part in parts
    )
