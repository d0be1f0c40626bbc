"""Files of one result appear together or not at all, and no input is overwritten."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from curling_env.errors import OutputError
from curling_env.infrastructure import (
    at_once,
    atomic_path,
    check_writable,
    command_files,
    current_path,
    fitted,
    folder_of_drafts,
    kind_of,
    make_directory,
    note_input,
    read_text,
    together,
    write_json,
    write_table,
    write_text,
)

TRACKS = {"throw": [0], "t": [0.0], "x": [0.0], "y": [0.0], "theta": [0.0]}


def names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


def left_over(folder: Path, name: str) -> list[str]:
    """Return the remains of a process that was killed while it wrote a file, and a result."""
    program = (
        "import os, signal, sys\n"
        "from pathlib import Path\n"
        "from curling_env.infrastructure.files.writing import atomic_path, folder_of_drafts\n"
        "with folder_of_drafts(Path(sys.argv[1])) as folder, atomic_path(sys.argv[2]) as draft:\n"
        "    (folder / 'a.txt').write_text('half')\n"
        "    draft.write_text('half')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", program, folder, folder / name], check=False)
    assert done.returncode == -signal.SIGKILL
    return [path for path in names(folder) if path.startswith(".") and "~" in path]


# --- together


def test_files_of_one_result_appear_at_the_end(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("old")
    with together():
        write_text(tmp_path / "a.txt", "new")
        write_text(tmp_path / "b.txt", "new")
        assert (tmp_path / "a.txt").read_text() == "old"
        assert not (tmp_path / "b.txt").exists()
        assert current_path(tmp_path / "a.txt").read_text() == "new"
    assert (tmp_path / "a.txt").read_text() == (tmp_path / "b.txt").read_text() == "new"
    assert names(tmp_path) == ["a.txt", "b.txt"]


@pytest.mark.parametrize("fault", [OutputError("full"), KeyboardInterrupt()])
def test_a_fault_leaves_all_files_as_they_were(tmp_path: Path, fault: BaseException) -> None:
    (tmp_path / "a.txt").write_text("old")
    with pytest.raises(type(fault)), together():
        write_text(tmp_path / "a.txt", "new")
        write_text(tmp_path / "b.txt", "new")
        raise fault
    assert names(tmp_path) == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "old"


def test_a_name_that_cannot_be_given_undoes_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a.txt", "b.txt"):
        (tmp_path / name).write_text("old")
    replace = Path.replace

    def refuse(self: Path, target: Path) -> Path:
        if Path(target).name == "b.txt" and not self.name.startswith(".before"):
            raise OSError(28, "No space left on device")
        return replace(self, target)

    with pytest.raises(OutputError, match=r"b\.txt: cannot be written: no space"), together():
        for name in ("a.txt", "b.txt", "c.txt"):
            write_text(tmp_path / name, "new")
        monkeypatch.setattr(Path, "replace", refuse)
    monkeypatch.undo()
    assert names(tmp_path) == ["a.txt", "b.txt"]
    assert {(tmp_path / name).read_text() for name in names(tmp_path)} == {"old"}


def test_files_kept_for_a_repetition_appear_immediately(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), together():
        write_text(tmp_path / "result", "half")
        with at_once():
            write_text(tmp_path / "kept", "done")
        assert [path.name for path in tmp_path.iterdir() if path.name[0] != "."] == ["kept"]
        raise KeyboardInterrupt
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]


def test_leftovers_of_killed_processes_are_removed_with_the_next_result(
    tmp_path: Path,
) -> None:
    (tmp_path / "tracks.csv").write_text("throw,t,x,y,theta\n0,0,0,0,0\n")
    assert len(left_over(tmp_path, "tracks.csv")) == 2
    assert (tmp_path / "tracks.csv").read_text() == "throw,t,x,y,theta\n0,0,0,0,0\n"
    write_table(tmp_path / "other.csv", TRACKS)
    assert names(tmp_path) == ["other.csv", "tracks.csv"]


def test_files_that_others_are_writing_stay(tmp_path: Path) -> None:
    theirs = tmp_path / "theirs.csv"
    with atomic_path(theirs) as draft:
        for name in (".x~.csv", "x~1234-1-0123abcd.csv", draft.name.replace("~", "~ffff", 1)):
            (tmp_path / name).touch()
        before = names(tmp_path)
        write_table(tmp_path / "own.csv", TRACKS)
        assert names(tmp_path) == sorted([*before, "own.csv"])


# --- a folder of drafts


def test_the_files_of_a_folder_appear_together(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("old")
    with folder_of_drafts(tmp_path) as folder:
        write_text(folder / "a.txt", "new")
        (folder / "inner").mkdir()
        (folder / "inner" / "b.txt").write_text("new")  # as another process writes it
        assert (tmp_path / "a.txt").read_text() == "old"
    assert names(tmp_path) == ["a.txt", "inner"]
    assert (tmp_path / "a.txt").read_text() == (tmp_path / "inner" / "b.txt").read_text() == "new"


@pytest.mark.parametrize("fault", [OutputError("full"), KeyboardInterrupt()])
def test_a_fault_leaves_the_folder_as_it_was(tmp_path: Path, fault: BaseException) -> None:
    (tmp_path / "a.txt").write_text("old")
    with pytest.raises(type(fault)), folder_of_drafts(tmp_path) as folder:
        write_text(folder / "a.txt", "new")
        raise fault
    assert names(tmp_path) == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "old"


def test_a_result_of_another_kind_in_a_folder_leaves_all_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "b.txt").write_bytes(b"\x89PNG of a coach")
    with pytest.raises(OutputError, match="a picture"), folder_of_drafts(tmp_path) as folder:
        write_text(folder / "a.txt", "new")
        write_text(folder / "b.txt", "new")
    assert names(tmp_path) == ["b.txt"]


def test_an_error_names_the_place_of_the_result(tmp_path: Path) -> None:
    with (
        pytest.raises(OutputError, match=f"^{tmp_path}/no/a.txt: "),
        folder_of_drafts(tmp_path) as folder,
    ):
        write_text(folder / "no" / "a.txt", "new")


# --- where may be written


def test_inputs_are_not_overwritten_under_any_name(tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("a,b\n1,2\n")
    (tmp_path / "link.csv").symlink_to("r.csv")
    os.link(tmp_path / "r.csv", tmp_path / "hard.csv")
    (tmp_path / "folder").mkdir()
    with command_files():
        read_text(tmp_path / "r.csv")
        for name in ("r.csv", "link.csv", "hard.csv", "folder/../r.csv"):
            with pytest.raises(OutputError, match="is an input of this command"):
                write_table(tmp_path / name, {"a": [3], "b": [4]})
        write_table(tmp_path / "new.csv", {"a": [3], "b": [4]})
        read_text(tmp_path / "new.csv")  # what it wrote itself it may write again
        write_table(tmp_path / "new.csv", {"a": [5], "b": [6]})
    assert (tmp_path / "r.csv").read_text() == "a,b\n1,2\n"
    write_table(tmp_path / "r.csv", {"a": [3], "b": [4]})  # from Python one may


@pytest.mark.parametrize(
    ("name", "content", "kind"),
    [
        ("film", b"\0\0\0\x20ftypisom", "film"),
        ("picture", b"\x89PNG\r\n", "picture"),
        ("ice", b'{"format": "curling-ice/1", "sheet": {}}', "ice"),
        ("scene", b'{"stone": {}, "corners_px": {}}', "scene"),
        ("game", b'{"format":"curling-game/1"}\n{"line_score":[]}\n', "game"),
        ("page", b"<!DOCTYPE html><html>", "page"),
        ("releases", b"throw,x,y,vx,vy,theta,omega\n", "releases"),
        ("notes", b"throw,athlete,stone,called,note\n0,Ada,3,draw,\n", "table"),
        ("letter", b"Dear Ada,\nsweep!\n", "table"),
        ("binary", bytes(range(256)), "other"),
    ],
)
def test_a_file_of_another_kind_is_not_replaced(
    tmp_path: Path, name: str, content: bytes, kind: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    assert kind_of(path) == kind
    with pytest.raises(OutputError, match="is not replaced"):
        write_table(path, TRACKS)
    with pytest.raises(OutputError, match="is not replaced by a table of tracks"):
        check_writable(path, kinds=("tracks",))
    assert path.read_bytes() == content


def test_a_file_of_the_same_kind_or_an_empty_one_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "empty").touch()
    for name in ("new.csv", "new.csv", "empty"):
        write_table(tmp_path / name, TRACKS)
    write_json(tmp_path / "a.json", {"mu": 1})
    write_json(tmp_path / "a.json", {"mu": 2, "more": 1})


def test_a_link_that_leads_to_itself(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(OutputError, match="cannot be written"):
        write_text(tmp_path / "loop", "")


def test_folders_made_for_a_command_that_fails_vanish_again(tmp_path: Path) -> None:
    with pytest.raises(OutputError), command_files():
        make_directory(tmp_path / "a" / "b")
        raise OutputError("no")
    assert names(tmp_path) == []


def test_an_input_named_beforehand_is_refused_too(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("a")
    with command_files():
        note_input(tmp_path / "a")
        check_writable(tmp_path / "b")
        with pytest.raises(OutputError, match="is an input of this command"):
            check_writable(tmp_path / "a")


def test_a_long_name_in_any_script_leaves_room_for_the_draft(tmp_path: Path) -> None:
    with atomic_path(tmp_path / ("🥌" * 60 + ".csv")) as draft:
        draft.write_text("x")
    assert len(names(tmp_path)) == 1


@pytest.mark.parametrize("name", ["x" * 250 + ".mp4", "é" * 150, "🥌" * 200 + ".csv", "short"])
def test_a_derived_name_is_cut_by_bytes_and_keeps_its_ending(tmp_path: Path, name: str) -> None:
    derived = fitted(name, ".times.csv")
    assert derived.endswith(".times.csv")
    assert name.startswith(derived.removesuffix(".times.csv"))
    assert derived == f"{name}.times.csv" or 252 <= len(derived.encode()) <= 255
    (tmp_path / derived).touch()
