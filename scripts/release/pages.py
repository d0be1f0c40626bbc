"""The pages docs/licences.md and docs/size.md, from the inventory of an environment."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from release.artefacts import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
LIBRARIES = (
    (r"libav(codec|device|filter|format|util)|libsw\w+", ""),  # FFmpeg, which says it itself
    (r"libx264|libx265", "GPL-2.0-or-later"),
    (r"lib(scipy_)?openblas.*", "BSD-3-Clause"),
    (r"libgfortran|libgomp", "GPL-3.0-or-later WITH GCC-exception-3.1"),
    (r"libquadmath|libasound|libgnutls|libfluidsynth|libsndfile", "LGPL-2.1-or-later"),
    (r"libmpg123", "LGPL-2.1-only"),
    (r"libSDL2.*", "Zlib"),
    (r"libogg|libvorbis\w*|libopusfile|libFLAC|libwavpack|libhdf5\w*", "BSD-3-Clause"),
    (r"libaec|libsz", "BSD-2-Clause"),
    (r"libportmidi|libxmp", "MIT"),
    (r"libmp3lame", "LGPL-2.0-or-later"),
    (r"libgmp|libunistring|libnettle|libhogweed", "LGPL-3.0-or-later OR GPL-2.0-or-later"),
    (r"libcrypto|libssl", "OpenSSL"),
    (r"libopencore-amr\w+", "Apache-2.0"),
    (r"libSvtAv1Enc", "BSD-3-Clause-Clear"),
    (r"libvpx|libwebp\w*|libsharpyuv|libopus|libzstd", "BSD-3-Clause"),
    (r"libdav1d|libaom|libavif|libopenjp2", "BSD-2-Clause"),
    (r"libX\w+|libxcb.*|libdrm|libvpl|liblcms2|libbrotli\w+|libharfbuzz", "MIT or like it"),
    (r"libpng\d*", "libpng-2.0"),
    (r"libtiff", "libtiff"),
    (r"libjpeg", "IJG AND BSD-3-Clause"),
    (r"liblzma", "0BSD"),
    (r"libfreetype", "FTL OR GPL-2.0-or-later"),
)
"""Licences of libraries that wheels bundle, by the first fitting name, as their authors say."""
PURPOSE = {
    "llvmlite": "compiles the physics (with Numba)",
    "numba": "compiles the physics",
    "opencv-python-headless": "pictures, cameras, tracking",
    "scipy": "fits, estimation, discovery",
    "av": "films in and out (FFmpeg)",
    "numpy": "arrays",
    "matplotlib": "figures of reports",
    "fonttools": "Matplotlib's fonts",
    "pillow": "Matplotlib's pictures",
    "kiwisolver": "Matplotlib's layouts",
    "gymnasium": "the environments",
    "pymunk": "stones in contact",
    "typer": "the command",
    "pydantic-core": "the command (Typer)",
    "pygments": "the command (colours)",
    "msgspec": "files checked",
    "curling-sheet": "this project",
}


def licences(rows: list[dict[str, Any]]) -> str:
    """The page of licences."""
    base = closure(rows, PROJECT["dependencies"])
    own = [row for row in rows if row["name"] == "curling-sheet"]
    first = [row for row in rows if key(row) in base]
    others = [row for row in rows if row not in first and row not in own]
    bundled = [
        f"| {library['name']} | {library['version']} | {row['name']} "
        f"| {licence_of_library(library)} |"
        for row in rows
        for library in row["bundled"]
    ]
    return _template("licences").format(
        base=_licence_table(first), others=_licence_table(others), bundled="\n".join(bundled)
    )


def sizes(rows: list[dict[str, Any]], where: str) -> str:
    """The page of sizes.

    Parameters
    ----------
    rows : inventory of an environment with every extra
    where : system and Python that it was measured on
    """
    base = closure(rows, PROJECT["dependencies"])
    first = [row for row in rows if key(row) in base or row["name"] == "curling-sheet"]
    large = sorted((r for r in first if r["size"] >= 2e6), key=lambda row: -row["size"])
    small = [row for row in first if row not in large]
    total = sum(row["size"] for row in first)
    lines = [
        f"| {row['name']} {row['version']} | {_mb(row['size'])} | {PURPOSE.get(key(row), '')} |"
        for row in large
    ]
    lines.append(f"| {len(small)} others | {_mb(sum(row['size'] for row in small))} | |")
    lines.append(f"| **all** | **{_mb(total)}** | |")
    extras: list[str] = []
    for name, asked in PROJECT["optional-dependencies"].items():
        added = [row for row in rows if key(row) in closure(rows, asked) - base]
        if not added or name in ("dev", "docs", "rllib") or not installed(rows, asked):
            continue
        largest = sorted(added, key=lambda row: -row["size"])[:3]
        parts = ", ".join(f"{row['name']} {_mb(row['size'])}" for row in largest)
        extras.append(f"| `{name}` | {_mb(sum(row['size'] for row in added))} | {parts} |")
    return _template("size").format(where=where, base="\n".join(lines), extras="\n".join(extras))


def closure(rows: list[dict[str, Any]], asked: Iterable[str]) -> set[str]:
    """Names of all that requirements bring, of what is in an inventory."""
    there = {key(row): row for row in rows}
    found: set[str] = set()
    waiting = [Requirement(text) for text in asked]
    while waiting:
        wanted = waiting.pop()
        name = canonicalize_name(wanted.name)
        extras = wanted.extras or {""}
        if name not in there or (name in found and extras == {""}):
            continue
        first, found = name not in found, found | {name}
        for inner in map(Requirement, there[name]["requires"]):
            chosen = [
                extra
                for extra in extras
                if inner.marker is None or inner.marker.evaluate({"extra": extra})
            ]
            if chosen and (first or inner.marker is not None):
                waiting.append(inner)
        if extras != {""}:
            waiting.append(Requirement(name))
    return found


def installed(rows: list[dict[str, Any]], asked: Iterable[str]) -> bool:
    """Whether an inventory has everything that is named."""
    there = {key(row) for row in rows}
    return all(canonicalize_name(Requirement(text).name) in there for text in asked)


def licence_of_library(library: dict[str, str]) -> str:
    """The licence of a bundled library: what it says itself, or what its authors say."""
    if library["says"]:
        return library["says"]
    fits = (text for name, text in LIBRARIES if re.fullmatch(name, library["name"]))
    return next(fits, "")


def key(row: dict[str, Any]) -> str:
    """The name under which a distribution is asked for."""
    return canonicalize_name(row["name"])


def _template(name: str) -> str:
    return Path(__file__).with_name(f"{name}.template.md").read_text(encoding="utf-8")


def _licence_table(rows: list[dict[str, Any]]) -> str:
    return "\n".join(f"| {row['name']} | {row['version']} | {row['licence']} |" for row in rows)


def _mb(size: float) -> str:
    return f"{size / 1e6:.0f} MB" if size >= 1e6 else f"{size / 1e6:.1f} MB"
