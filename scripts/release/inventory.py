"""What is installed in an environment: distributions, their licences and sizes, what they bundle.

Run by the environment's own Python, with the standard library alone, it prints JSON.
"""

from __future__ import annotations

import json
import re
from importlib import metadata
from pathlib import Path
from typing import Any

SELF_DESCRIBED = re.compile(rb"lib(?:av|sw)\w+ license: ([^\0\n]{3,80})")
"""What each of FFmpeg's libraries says of its own licence."""
CLASSIFIED = "License :: OSI Approved :: "
BUNDLED = re.compile(
    r"(?:^|/)[\w.-]+\.libs/(lib[^/]+?)(?:-[0-9a-f]{8})*(?:\.(\d[\d.]*))?\.so(?:\.([\d.]+))?$"
)
"""A shared library that a wheel has brought with it, as auditwheel names it."""


def licence_of(about: Any) -> str:
    """The licence of a distribution by its metadata, in few words.

    Parameters
    ----------
    about : metadata with `get` and `get_all`
    """
    if expression := about.get("License-Expression"):
        return str(expression)
    told = [c for c in about.get_all("Classifier") or () if c.startswith(CLASSIFIED)]
    if told:
        return ", ".join(c.removeprefix(CLASSIFIED) for c in told)
    text = (about.get("License") or "").strip()
    return text if 0 < len(text) <= 60 and "\n" not in text else "see its files"


def bundled_in(distribution: metadata.Distribution) -> list[dict[str, str]]:
    """Shared libraries of others in a distribution: name, version, and what each says itself."""
    found: dict[tuple[str, str], dict[str, str]] = {}
    for file in distribution.files or ():
        if match := BUNDLED.search(str(file)):
            own = SELF_DESCRIBED.search(Path(str(file.locate())).read_bytes())
            name, version = match[1], match[3] or match[2] or ""
            said = own[1].decode("ascii", "replace") if own else ""
            found[name, version] = {"name": name, "version": version, "says": said}
    return [found[key] for key in sorted(found)]


def size_of(distribution: metadata.Distribution) -> int:
    """Bytes of a distribution's files, without compiled bytecode."""
    paths = [Path(str(file.locate())) for file in distribution.files or ()]
    return sum(p.stat().st_size for p in paths if p.suffix != ".pyc" and p.is_file())


def inventory() -> list[dict[str, Any]]:
    """Every distribution of this environment, by name."""
    rows = [
        {
            "name": d.name,
            "version": d.version,
            "licence": licence_of(d.metadata),
            "size": size_of(d),
            "bundled": bundled_in(d),
            "requires": d.requires or [],
        }
        for d in metadata.distributions()
    ]
    return sorted(rows, key=lambda row: str(row["name"]).lower())


if __name__ == "__main__":
    print(json.dumps(inventory()))
