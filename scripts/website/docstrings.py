"""Conversion of NumPy docstrings to field lists, with words and units after the colon."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

_SECTION = re.compile(
    r"^(Parameters|Returns|Yields|Raises|Source|Attributes|Notes)\n-{3,}\n", re.MULTILINE
)
_ENTRY = re.compile(r"^(\*{0,2}[\w, .*]+?) : (.*(?:\n[ ]+.*)*)", re.MULTILINE)
_LABELS = {"Parameters": "param", "Attributes": "param", "Raises": "raises"}


def setup(app: Sphinx) -> dict[str, Any]:
    app.connect("autodoc-process-docstring", _process)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _process(*given: Any) -> None:
    lines: list[str] = given[-1]
    lines[:] = field_list(lines)


def field_list(lines: list[str]) -> list[str]:
    """Return a docstring in reStructuredText.

    Parameters
    ----------
    lines : without its indentation
    """
    before, *sections = _SECTION.split("\n".join(lines))
    out = _paragraphs(before.split("\n"))
    for title, body in zip(sections[::2], sections[1::2], strict=True):
        out.append("")
        if title in _LABELS:
            out += [
                f":{_LABELS[title]} {_names(name)}: {_escaped(_joined(words))}"
                for name, words in _ENTRY.findall(body)
            ]
        else:
            label = ":returns:" if title in ("Returns", "Yields") else f"**{title}.**"
            out.append(f"{label} {_escaped(_joined(body))}")
    return [*out, ""]


def _joined(text: str) -> str:
    return " ".join(text.split())


def _names(names: str) -> str:
    return names.replace("*", r"\*").replace(", ", r",\ ")


def _paragraphs(lines: list[str]) -> list[str]:
    """Keep plain text unchanged; an indented block below a colon is an example."""
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
    """Escape a line for reStructuredText, except parts in backticks."""
    parts = re.split(r"(``.*?``|`.*?`)", text)
    return "".join(
        part if part.startswith("`") else re.sub(r"([*|_\\])", r"\\\1", part) for part in parts
    )
