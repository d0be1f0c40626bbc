"""The lock of the environment: every version fixed, every file known by its hash, no host named."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import lock
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
ENTRY = re.compile(
    r"(?m)^([a-z0-9-]+)==(\S+)( ; [^\\\n]+)? \\\n((?:    --hash=sha256:[0-9a-f]{64}(?: \\)?\n)+)"
)


def test_everything_asked_for_is_fixed_with_hashes():
    text = (ROOT / "constraints.txt").read_text()
    entries = {name: version for name, version, _, _ in ENTRY.findall(text)}
    # Nothing stands in the file that is not a whole entry, or a remark.
    assert re.sub(r"(?m)^#.*\n", "", ENTRY.sub("", text)) == ""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    asked = project["project"]["dependencies"] + project["build-system"]["requires"]
    for extra in lock.EXTRAS:
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


def test_what_only_gpus_need_is_left_to_pip():
    kept = "torch==2.13.0 \\\n    --hash=sha256:ab\n"
    left = (
        "nvidia-nvtx==1 ; sys_platform == 'linux' \\\n    --hash=sha256:cd\ntriton==3 \\\n    --x\n"
    )
    assert lock.without_gpu("# remark\n" + left + kept) == kept
