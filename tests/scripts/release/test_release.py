"""The pieces of `make release-check` and `make sbom`; both themselves are run before a release."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import zipfile
from email.message import Message
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from release import bill, check, smoke
from release.check import ROOT, faults_of, tracked_files, wheel_faults

import curling_env


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Build the wheel with setuptools from a copy of the files in git."""
    folder = tmp_path_factory.mktemp("source")
    for name in [*tracked_files(), "pyproject.toml", "README.md", "LICENSE"]:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    program = "from setuptools import build_meta; print(build_meta.build_wheel('.'))"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return folder / done.stdout.split()[-1]


def test_the_wheel_has_exactly_the_files_of_git(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert wheel_faults(names, tracked_files()) == []
    for name in ("curling.py", "curling_env/presets/standard.json", "agents/py.typed"):
        assert name in names


def test_missing_and_extra_files_of_a_wheel_are_listed():
    good = ["curling.py", *(f"{package}/py.typed" for package in smoke.PACKAGES)]
    licence = "curling_sheet-1.dist-info/licenses/LICENSE"
    assert wheel_faults([*good, licence], good) == []
    assert wheel_faults(good, good) == ["the wheel lacks its licence"]
    faults = wheel_faults([*good[:-1], "tests/test_a.py", licence], good)
    assert faults == [
        "the wheel lacks agents/py.typed",
        "the wheel has tests/test_a.py, which git does not",
    ]


def test_every_extra_has_a_separate_trial():
    tried = smoke.IMPORTED.keys() | smoke.TRIED.keys()
    assert set(check.PROJECT["optional-dependencies"]) - set(check.NOT_TRIED) <= tried
    requires = check.PROJECT["requires-python"].removeprefix(">=")
    assert requires == check.PYTHONS[0]


def test_a_python_that_is_not_there_or_does_not_run_is_not_checked(tmp_path, monkeypatch):
    shim = tmp_path / "python3.12"
    shim.write_text("#!/bin/sh\nexit 127\n")
    shim.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("PYENV_ROOT", str(tmp_path))
    assert [check.interpreter(version) for version in check.PYTHONS] == [None] * len(check.PYTHONS)
    planned = check.plan(tmp_path, tmp_path / "w", tmp_path / "s")
    assert all(python is None for python, _, _ in planned.values())
    assert {"python3.12", "sdist", "oldest", "train"} <= planned.keys()
    assert not planned.keys() & set(check.NOT_TRIED)


@pytest.mark.parametrize(
    ("entries", "licence"),
    [
        ([("License-Expression", "MIT"), ("License", "BSD")], "MIT"),
        ([("Classifier", "License :: OSI Approved :: BSD License")], "BSD License"),
        ([("License", "Apache 2.0")], "Apache 2.0"),
        ([("License", "Permission is hereby granted, " * 20)], "see its files"),
        ([], "see its files"),
    ],
)
def test_a_licence_in_few_words(entries, licence):
    about = Message()
    for name, value in entries:
        about[name] = value
    assert bill.licence_of(about) == licence


@pytest.mark.parametrize(
    ("path", "name", "version"),
    [
        ("av.libs/libx264-d6533a8d.so.165", "libx264", "165"),
        ("numpy.libs/libgfortran-040039e1-0352e75f.so.5.0.0", "libgfortran", "5.0.0"),
        ("scipy.libs/libscipy_openblas-6cdc3b4a.so", "libscipy_openblas", None),
        ("cv2.libs/libopenblasp-r0-59ffcd50.3.15.so", "libopenblasp-r0", "3.15"),
        ("pillow.libs/libavif-c6062d5f.so.16.4.2", "libavif", "16.4.2"),
    ],
)
def test_bundled_libraries_are_known_by_their_names(path, name, version):
    found = bill.BUNDLED.search(path)
    assert found is not None
    assert (found[1], found[3] or found[2]) == (name, version)
    assert bill.licence_of_library({"name": name, "version": "", "stated": ""})


def test_the_film_libraries_declare_x264():
    bundled = {entry["name"]: entry for entry in bill.bundled_in(metadata.distribution("av"))}
    if not bundled:
        pytest.skip("this PyAV was built against the system's FFmpeg")
    assert bundled["libavcodec"]["stated"].startswith("LGPL")
    assert bill.licence_of_library(bundled["libx264"]) == "GPL-2.0-or-later"


def test_requirements_are_followed_through_extras_and_markers():
    def row(name, *requires):
        return {"name": name, "requires": list(requires)}

    rows = [
        row("a", "b>=1", "d; extra == 'more'", "e; python_version < '3'"),
        *(row("B", "c"), row("c", "a"), row("d"), row("e"), row("f")),
    ]
    assert bill.closure(rows, ["a"]) == {"a", "b", "c"}
    assert bill.closure(rows, ["a[more]"]) == {"a", "b", "c", "d"}
    assert bill.closure(rows, ["g"]) == set()


def test_a_bill_has_the_libraries_that_wheels_bundle():
    library = {"name": "libx264", "version": "165", "stated": ""}
    found = bill.with_bundled(
        {"components": [{"name": "av"}, {"name": "rich"}]}, [{"name": "av", "bundled": [library]}]
    )
    (part,) = found["components"][0]["components"]
    assert part["name"] == "libx264"
    assert part["licenses"] == [{"license": {"name": "GPL-2.0-or-later"}}]
    assert found["components"][1] == {"name": "rich"}


@pytest.mark.parametrize("page", ["licences.md", "size.md"])
def test_the_pages_have_every_package_of_a_bare_installation(page):
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    if page == "licences.md":
        for asked in check.PROJECT["dependencies"]:
            name = canonicalize_name(Requirement(asked).name)
            assert f"| {name} |" in text.lower(), "run `make sbom`"
    for name in ("numba", "opencv-python-headless", "av", "scipy"):
        assert name in text


def test_a_built_wheel_and_sdist_are_read(wheel, tmp_path):
    import tarfile

    with tarfile.open(tmp_path / "a.tar.gz", "w:gz") as archive:
        for name in (*tracked_files(), "pyproject.toml", "README.md", "LICENSE"):
            archive.add(ROOT / name, f"a-1/{name}")
    assert faults_of(wheel, tmp_path / "a.tar.gz") == ["the sdist lacks PKG-INFO"]


def test_the_version_is_the_same_everywhere():
    version = check.PROJECT["version"]
    assert curling_env.__version__ == version
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    dated = re.search(rf"(?m)^version: {re.escape(version)}\ndate-released: (\S+)$", citation)
    assert dated is not None
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## [{version}] - {dated[1]}\n" in changes
    classifiers = check.PROJECT["classifiers"]
    for python in check.PYTHONS:
        assert f"Programming Language :: Python :: {python}" in classifiers
