"""Bill of materials, licences and sizes of an installation: `make sbom`.

Installs the project with its extras in the versions of constraints.txt in a clean environment, and
writes runs/sbom/curling-sheet.cdx.json (CycloneDX, by cyclonedx-py, with the libraries that wheels
bundle), docs/licences.md and docs/size.md.
"""

from __future__ import annotations

import json
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from release.check import ENVIRONMENT, FINDING, NOT_TRIED, PROJECT, ROOT, UV

FOLDER = ROOT / "runs" / "sbom"
DOCS = ROOT / "docs"
TOOLS = ("pip", "setuptools")
"""Packages that every environment contains."""
NOT_INSTALLED = (*NOT_TRIED, "rllib", "offline")
"""Extras that need a separate environment, or are for the project's developers."""
SELF_DESCRIBED = re.compile(rb"lib(?:av|sw)\w+ license: ([^\0\n]{3,80})")
"""Licence string in each of FFmpeg's libraries."""
CLASSIFIED = "License :: OSI Approved :: "
BUNDLED = re.compile(
    r"(?:^|/)[\w.-]+\.libs/(lib[^/]+?)(?:-[0-9a-f]{8})*(?:\.(\d[\d.]*))?\.so(?:\.([\d.]+))?$"
)
"""Shared library in a wheel, as auditwheel names it."""


LIBRARIES = (
    (r"libav(codec|device|filter|format|util)|libsw\w+", ""),  # FFmpeg, which states it itself
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
"""Licences of bundled libraries as stated by their authors, by the first matching name."""
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


def main() -> None:
    python = environment()
    site = next((python.parents[1] / "lib").glob("python3*/site-packages"))
    rows = [row for row in inventory([str(site)]) if row["name"] not in TOOLS]
    bill = FOLDER / "curling-sheet.cdx.json"
    words = [sys.executable, "-m", "cyclonedx_py", "environment", str(python)]
    words += ["--pyproject", str(ROOT / "pyproject.toml"), "--output-reproducible"]
    subprocess.run([*words, "--output-file", str(bill)], check=True)
    document = with_bundled(json.loads(bill.read_text(encoding="utf-8")), rows)
    bill.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    where = f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"
    (DOCS / "licences.md").write_text(licences(rows), encoding="utf-8")
    (DOCS / "size.md").write_text(sizes(rows, where), encoding="utf-8")
    print(f"{len(rows)} distributions: {bill}, docs/licences.md, docs/size.md")


def environment() -> Path:
    """Make a clean environment with the project and its extras, in the locked versions."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    locked = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    versions = FOLDER / "versions.txt"
    versions.write_text("\n".join(re.findall(r"(?m)^([\w-]+==[^\\\n]+)", locked)) + "\n")
    place = FOLDER / "environment"
    python = place / "bin" / "python"
    extras = [e for e in PROJECT["optional-dependencies"] if e not in NOT_INSTALLED]
    installing = [*UV, "pip", "install", "--quiet", "--python", str(python), *FINDING]
    installing += ["--constraint", str(versions), f"{ROOT}[{','.join(extras)}]"]
    for step in ([*UV, "venv", "--quiet", "--python", sys.executable, str(place)], installing):
        subprocess.run(step, check=True, env=ENVIRONMENT)
    return python


def with_bundled(bill: dict[str, Any], rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return a bill with the shared libraries that wheels have brought with them.

    Parameters
    ----------
    bill : CycloneDX document of an environment; it is changed
    rows : its inventory
    """
    bundled = {row["name"].lower(): row["bundled"] for row in rows if row["bundled"]}
    for component in bill["components"]:
        for library in bundled.get(component["name"].lower(), ()):
            part: dict[str, Any] = {"type": "library", "name": library["name"]}
            if library["version"]:
                part["version"] = library["version"]
            if licence := licence_of_library(library):
                part["licenses"] = [{"license": {"name": licence}}]
            component.setdefault("components", []).append(part)
    return bill


# --- the inventory of an environment --------------------------------------------------------------


def licence_of(about: Any) -> str:
    """Return the licence of a distribution by its metadata, in few words.

    Parameters
    ----------
    about : metadata with `get` and `get_all`
    """
    if expression := about.get("License-Expression"):
        return str(expression)
    declared = [c for c in about.get_all("Classifier") or () if c.startswith(CLASSIFIED)]
    if declared:
        return ", ".join(c.removeprefix(CLASSIFIED) for c in declared)
    text = (about.get("License") or "").strip()
    return text if 0 < len(text) <= 60 and "\n" not in text else "see its files"


def bundled_in(distribution: metadata.Distribution) -> list[dict[str, str]]:
    """Return shared libraries of others in a distribution: name, version, and its own statement."""
    found: dict[tuple[str, str], dict[str, str]] = {}
    for file in distribution.files or ():
        if match := BUNDLED.search(str(file)):
            own = SELF_DESCRIBED.search(Path(str(file.locate())).read_bytes())
            name, version = match[1], match[3] or match[2] or ""
            stated = own[1].decode("ascii", "replace") if own else ""
            found[name, version] = {"name": name, "version": version, "stated": stated}
    return [found[key] for key in sorted(found)]


def size_of(distribution: metadata.Distribution) -> int:
    """Return the bytes of a distribution's files, without compiled bytecode."""
    paths = [Path(str(file.locate())) for file in distribution.files or ()]
    return sum(p.stat().st_size for p in paths if p.suffix != ".pyc" and p.is_file())


def inventory(path: list[str] | None = None) -> list[dict[str, Any]]:
    """Return every distribution in some folders, or of this environment, by name."""
    rows = [
        {
            "name": d.name,
            "version": d.version,
            "licence": licence_of(d.metadata),
            "size": size_of(d),
            "bundled": bundled_in(d),
            "requires": d.requires or [],
        }
        for d in metadata.distributions(path=path or sys.path)
    ]
    return sorted(rows, key=lambda row: str(row["name"]).lower())


# --- the pages ------------------------------------------------------------------------------------


def licences(rows: list[dict[str, Any]]) -> str:
    """Return the page of licences."""
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
    """Return the page of sizes.

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
        if not added or name in NOT_INSTALLED:
            continue
        largest = sorted(added, key=lambda row: -row["size"])[:3]
        parts = ", ".join(f"{row['name']} {_mb(row['size'])}" for row in largest)
        extras.append(f"| `{name}` | {_mb(sum(row['size'] for row in added))} | {parts} |")
    return _template("size").format(where=where, base="\n".join(lines), extras="\n".join(extras))


def closure(rows: list[dict[str, Any]], asked: Iterable[str]) -> set[str]:
    """Return the names of all direct and indirect requirements that are in an inventory."""
    there = {key(row): row for row in rows}
    found: set[tuple[str, str]] = set()
    waiting = [Requirement(text) for text in asked]
    while waiting:
        wanted = waiting.pop()
        name = canonicalize_name(wanted.name)
        for extra in {"", *wanted.extras}:
            if name in there and (name, extra) not in found:
                found.add((name, extra))
                brought = map(Requirement, there[name]["requires"])
                waiting += [
                    k for k in brought if not k.marker or k.marker.evaluate({"extra": extra})
                ]
    return {name for name, _ in found}


def licence_of_library(library: dict[str, str]) -> str:
    """Return the licence that a bundled library states, or else its authors."""
    if library["stated"]:
        return library["stated"]
    fits = (text for name, text in LIBRARIES if re.fullmatch(name, library["name"]))
    return next(fits, "")


def key(row: dict[str, Any]) -> str:
    """Return the normalised name of a distribution."""
    return canonicalize_name(row["name"])


def _template(name: str) -> str:
    return Path(__file__).with_name(f"{name}.template.md").read_text(encoding="utf-8")


def _licence_table(rows: list[dict[str, Any]]) -> str:
    return "\n".join(f"| {row['name']} | {row['version']} | {row['licence']} |" for row in rows)


def _mb(size: float) -> str:
    return f"{size / 1e6:.0f} MB" if size >= 1e6 else f"{size / 1e6:.1f} MB"


if __name__ == "__main__":
    main()
