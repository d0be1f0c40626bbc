"""Results that must stay as they were: documents, pages and pictures beside the tests.

A test that asserts one fact of a result leaves the rest free. A snapshot holds all of it: text
exactly, numbers to three thousandths, pictures as small grey copies. After a wanted change,
``CURLING_SNAPSHOTS=write pytest TEST`` writes the snapshots of a test again; read what changed
before it is committed.
"""

from __future__ import annotations

import base64
import json
import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

RELATIVE, ABSOLUTE = 3e-3, 2e-6
"""Differences of numbers that count as rounding of another machine."""
WIDTH = 240
"""Width of the kept copy of a picture [px]."""
GREY_LEVELS = 12
"""Difference of a pixel of that copy that counts as rounding."""
LEFT_OUT = {"provenance", "closure"}
"""Keys of documents that differ between machines, the second as a ratio of small differences."""
NUMBER = re.compile(r"[-−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
PICTURE = re.compile(r"data:image/png;base64,([A-Za-z0-9+/=]+)")
STYLE = re.compile(r"<style>.*?</style>", re.DOTALL)
FOOTER = re.compile(r"<footer>.*?</footer>", re.DOTALL)
BLOCK = re.compile(r"(</?(?:p|tr|h\d|li|section|figure|details)\b)")


@dataclass(frozen=True, kw_only=True)
class Snapshots:
    """The snapshots of one test.

    Parameters
    ----------
    folder : where they are
    name : the test's, with its parameters
    """

    folder: Path
    name: str

    def document(self, content: Any, what: str = "") -> None:
        """Compare what JSON can hold."""
        flat = _flat("", json.loads(json.dumps(content)))
        _check_lines(self._path(what, "txt"), [f"{name} {value}" for name, value in flat])

    def page(self, html: str) -> None:
        """Compare a page without its style and footer; its pictures have separate snapshots."""
        for k, found in enumerate(PICTURE.findall(html)):
            self.picture(base64.b64decode(found), f"{k + 1}")
        for shown in (PICTURE, STYLE, FOOTER):
            html = shown.sub("", html)
        _check_lines(self._path("page", "txt"), BLOCK.sub(r"\n\1", html).split("\n"))

    def picture(self, png: bytes, what: str = "") -> None:
        """Compare a picture with its small grey copy."""
        whole = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_GRAYSCALE)
        height = round(whole.shape[0] * WIDTH / whole.shape[1])
        small = cv2.resize(whole, (WIDTH, height), interpolation=cv2.INTER_AREA)
        path = self._path(what, "png")
        if _is_written(path):
            path.write_bytes(cv2.imencode(".png", small)[1].tobytes())
        kept = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        assert small.shape == kept.shape, path.name
        off = np.abs(small.astype(int) - kept).max()
        assert off <= GREY_LEVELS, f"{path.name}: a pixel is off by {off} grey levels"

    def _path(self, what: str, kind: str) -> Path:
        return self.folder / f"{'-'.join(filter(None, (self.name, what)))}.{kind}"


def _is_written(path: Path) -> bool:
    """Return whether a snapshot is to be written; its folder then exists."""
    asked = os.environ.get("CURLING_SNAPSHOTS") == "write"
    assert asked or path.exists(), f"no snapshot {path}; see tests/snapshots.py"
    path.parent.mkdir(parents=True, exist_ok=True)
    return asked


def _flat(name: str, value: Any) -> Iterator[tuple[str, str]]:
    """Yield a line for each value, and one for each list of values."""
    if isinstance(value, dict):
        for key in sorted(value.keys() - LEFT_OUT):
            yield from _flat(f"{name}.{key}", value[key])
    elif isinstance(value, list) and any(isinstance(item, dict | list) for item in value):
        for k, item in enumerate(value):
            yield from _flat(f"{name}[{k}]", item)
    elif isinstance(value, list):
        yield name, " | ".join(map(_text, value))
    else:
        yield name, _text(value)


def _text(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _check_lines(path: Path, lines: list[str]) -> None:
    if _is_written(path):
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    kept = path.read_text(encoding="utf-8").removesuffix("\n").split("\n")
    for found, before in zip(lines, kept, strict=False):
        assert _same(found, before), f"{path.name}: {found!r}, before {before!r}"
    assert len(lines) == len(kept), path.name


def _same(found: str, before: str) -> bool:
    """Return whether two lines are equal but for the rounding of their numbers."""
    if found == before:
        return True
    if NUMBER.sub("", found) != NUMBER.sub("", before):
        return False
    pairs = zip(NUMBER.findall(found), NUMBER.findall(before), strict=True)
    return all(_near(one, other) for one, other in pairs)


def _near(one: str, other: str) -> bool:
    """Return whether two numbers agree; those with few digits by one in the last."""
    a, b = (float(text.replace("−", "-")) for text in (one, other))
    decimals = len(other.partition(".")[2]) if "e" not in other else 9
    last = 10.0**-decimals if 0 < decimals < 4 else 0.0
    return math.isclose(a, b, rel_tol=RELATIVE, abs_tol=max(ABSOLUTE, 1.01 * last))
