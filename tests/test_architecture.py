"""ARCHITECTURE.md maps every folder, every folder has its tests, and imports form no circle."""

from __future__ import annotations

import re
from graphlib import TopologicalSorter
from pathlib import Path, PurePosixPath

import grimp
import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("curling_env", "friction_estimation", "agents")


def folders() -> set[PurePosixPath]:
    """Return every folder of the three packages with a file that git would keep."""
    files = [
        path.relative_to(ROOT)
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    ]
    return {PurePosixPath(folder) for file in files for folder in list(file.parents)[:-1]}


def mapped() -> dict[PurePosixPath, str]:
    """Return every folder in the map and its description, in the order of the map.

    The map is the first fenced block below "## The map". In each of its lines stand a folder with a
    final slash and, after two spaces or more, its words; a folder inside another is indented more.
    """
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    block = re.search(r"^## The map$.*?^```text\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert block, 'ARCHITECTURE.md has no fenced block below "## The map"'
    found: dict[PurePosixPath, str] = {}
    above: list[tuple[int, PurePosixPath]] = []
    for line in block[1].splitlines():
        entry = re.fullmatch(r"( *)([\w-]+)/ {2,}(\S.*)", line)
        assert entry, f"not a folder and its words: {line!r}"
        indent = len(entry[1])
        above = [(i, folder) for i, folder in above if i < indent]
        folder = (above[-1][1] if above else PurePosixPath()) / entry[2]
        assert folder not in found, f"twice in the map: {folder}"
        found[folder] = entry[3]
        above.append((indent, folder))
    return found


def names(paths: set[PurePosixPath]) -> list[str]:
    return sorted(map(str, paths))


def test_the_map_names_every_folder_and_no_other() -> None:
    assert names(folders() - mapped().keys()) == [], "folders that the map does not name"
    assert names(mapped().keys() - folders()) == [], "folders of the map that do not exist"


@pytest.mark.parametrize("package", PACKAGES)
def test_every_folder_of_modules_has_its_tests_at_the_mirrored_place(package: str) -> None:
    """The tests of `package/folder/module.py` are in `tests/package/folder`.

    There `test_module.py` is the first place to look; a test of several modules is named for what
    they do together. A small folder may have one file, `tests/package/test_folder.py`.
    """
    untested = []
    for folder in sorted({module.parent for module in (ROOT / package).rglob("[!_]*.py")}):
        mirrored = ROOT / "tests" / folder.relative_to(ROOT)
        beside = mirrored.with_name(f"test_{mirrored.name}.py")
        if not (beside.exists() or any(mirrored.rglob("test_*.py"))):
            untested.append(str(folder.relative_to(ROOT)))
    assert untested == []


def test_every_folder_of_tests_mirrors_one_of_modules() -> None:
    ours = {
        PurePosixPath(test.parent.relative_to(ROOT / "tests"))
        for package in PACKAGES
        for test in (ROOT / "tests" / package).rglob("test_*.py")
    }
    assert names(ours - folders()) == []


def test_no_module_imports_itself_through_others() -> None:
    """Imports inside functions and those for type checkers count too."""
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    imports = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    TopologicalSorter(imports).prepare()  # a CycleError names the modules of a circle
