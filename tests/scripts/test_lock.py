"""The lock of the environment: every version pinned, every file with its hash, no host."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
EXTRAS = re.findall(r"(?m)^EXTRAS := (\S+)$", (ROOT / "Makefile").read_text())[0].split(",")
ENTRY = re.compile(
    r"(?m)^([a-z0-9-]+)==(\S+)( ; [^\\\n]+)? \\\n((?:    --hash=sha256:[0-9a-f]{64}(?: \\)?\n)+)"
)


def test_every_requirement_is_pinned_with_hashes():
    text = (ROOT / "constraints.txt").read_text()
    entries = {name: version for name, version, _, _ in ENTRY.findall(text)}
    # Nothing stands in the file that is not a whole entry, or a remark.
    assert re.sub(r"(?m)^#.*\n", "", ENTRY.sub("", text)) == ""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    asked = project["project"]["dependencies"] + project["build-system"]["requires"]
    for extra in EXTRAS:
        asked += project["project"]["optional-dependencies"][extra]
    for wanted in map(Requirement, asked):
        version = entries[canonicalize_name(wanted.name)]
        assert wanted.specifier.contains(version), (wanted, version)
    assert "://" not in text


def test_the_core_is_the_part_of_it_that_the_package_needs_without_extras():
    files = [(ROOT / name).read_text() for name in ("constraints.txt", "constraints-core.txt")]
    everything, core = ({k[0]: k[1:] for k in ENTRY.findall(text)} for text in files)
    assert core.items() <= everything.items()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    asked = project["project"]["dependencies"] + project["build-system"]["requires"]
    assert {canonicalize_name(Requirement(k).name) for k in asked} <= core.keys()
    assert not core.keys() & {"torch", "ray", "sphinx", "pytest"}


def test_requirements_of_gpus_are_left_to_pip():
    entries = [entry[0] for entry in ENTRY.findall((ROOT / "constraints.txt").read_text())]
    assert "torch" in entries
    assert not [name for name in entries if re.match("nvidia-|cuda-|triton$", name)]
