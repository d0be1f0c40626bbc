"""The bill of materials, the licences and the sizes of what an installation brings: `make sbom`.

Installs the project with its extras in the versions of constraints.txt where nothing else is, and
writes runs/sbom/curling-sheet.cdx.json (CycloneDX, by cyclonedx-py, with the libraries that wheels
bundle), docs/licences.md and docs/size.md.
"""

from __future__ import annotations

import importlib
import json
import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from lock import EXTRAS

from release import pages
from release.artefacts import ROOT
from release.check import ENVIRONMENT, FINDING, NOT_TRIED, UV

FOLDER = ROOT / "runs" / "sbom"
DOCS = ROOT / "docs"
INSTALLED = [extra for extra in EXTRAS if extra not in NOT_TRIED]
TOOLS = ("pip", "setuptools")
"""What an environment may have by itself."""


def main() -> None:
    python = environment()
    listed = subprocess.run(
        [python, "-I", str(Path(__file__).with_name("inventory.py"))],
        check=True,
        capture_output=True,
        text=True,
    )
    rows = [row for row in json.loads(listed.stdout) if row["name"] not in TOOLS]
    bill = FOLDER / "curling-sheet.cdx.json"
    words = [sys.executable, "-m", "cyclonedx_py", "environment", str(python)]
    words += ["--pyproject", str(ROOT / "pyproject.toml"), "--output-reproducible"]
    subprocess.run([*words, "--output-file", str(bill)], check=True)
    document = with_bundled(json.loads(bill.read_text(encoding="utf-8")), rows)
    text = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    check(text, document["specVersion"])
    bill.write_text(text, encoding="utf-8")
    where = f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"
    (DOCS / "licences.md").write_text(pages.licences(rows), encoding="utf-8")
    (DOCS / "size.md").write_text(pages.sizes(rows, where), encoding="utf-8")
    print(f"{len(rows)} distributions: {bill}, docs/licences.md, docs/size.md")


def check(bill: str, version: str) -> None:
    """Hold a bill to the schema of CycloneDX.

    Raises
    ------
    SystemExit : it does not fit
    """
    # Beside cyclonedx-py, where this script runs; the tests have neither.
    schema = importlib.import_module("cyclonedx.schema")
    validation = importlib.import_module("cyclonedx.validation.json")
    validator = validation.JsonStrictValidator(schema.SchemaVersion.from_version(version))
    if fault := validator.validate_str(bill):
        raise SystemExit(f"the bill is no CycloneDX {version}: {fault}")


def environment() -> Path:
    """A clean environment with the project and its extras, in the locked versions."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    locked = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    versions = FOLDER / "versions.txt"
    versions.write_text("\n".join(re.findall(r"(?m)^([\w-]+==[^\\\n]+)", locked)) + "\n")
    place = FOLDER / "environment"
    python = place / "bin" / "python"
    installing = [*UV, "pip", "install", "--quiet", "--python", str(python), *FINDING]
    installing += ["--constraint", str(versions), f"{ROOT}[{','.join(INSTALLED)}]"]
    for step in ([*UV, "venv", "--quiet", "--python", sys.executable, str(place)], installing):
        subprocess.run(step, check=True, env=ENVIRONMENT)
    return python


def with_bundled(bill: dict[str, Any], rows: list[dict[str, Any]]) -> dict[str, Any]:
    """A bill with the shared libraries that wheels have brought with them.

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
            if licence := pages.licence_of_library(library):
                part["licenses"] = [{"license": {"name": licence}}]
            component.setdefault("components", []).append(part)
    return bill


if __name__ == "__main__":
    main()
