"""Untrusted files are refused with their place at little cost, whatever their content."""

from __future__ import annotations

import io
import json
import os
import zipfile
from pathlib import Path
from threading import Thread
from typing import Annotated, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from curling_env.errors import InputError
from curling_env.infrastructure import (
    Column,
    Document,
    checked,
    confined,
    ordinary_file,
    read_arrays,
    read_bytes,
    read_json,
    read_table,
    read_text,
    read_yaml,
    within,
    write_arrays,
)
from curling_env.infrastructure.files import limits

# --- bytes


@pytest.mark.parametrize("name", ["/dev/zero", "/dev/null"])
def test_a_device_is_no_file(name: str) -> None:
    with pytest.raises(InputError, match="is a device"):
        read_bytes(name)
    with pytest.raises(InputError, match="not an ordinary file"):
        ordinary_file(name)


def test_a_pipe_is_read_to_its_end(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    content = os.urandom(300_000)
    writer = Thread(target=pipe.write_bytes, args=(content,))
    writer.start()
    assert read_bytes(pipe) == content
    writer.join()


def test_a_pipe_without_a_writer_times_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.setattr(limits, "ORPHAN_PIPE_TIMEOUT", 0.1)
    with pytest.raises(InputError, match="this pipe sends nothing"):
        read_bytes(tmp_path / "pipe")
    # One who holds the other end is waited for longer, and not for ever.
    monkeypatch.setattr(limits, "PIPE_TIMEOUT", 0.2)
    silent = os.open(tmp_path / "pipe", os.O_RDWR)
    with pytest.raises(InputError, match="this pipe sends nothing"):
        read_bytes(tmp_path / "pipe")
    os.close(silent)


def test_a_file_larger_than_its_limit_is_refused_unread(tmp_path: Path) -> None:
    with (tmp_path / "huge").open("wb") as file:
        file.truncate(limits.MAX_TEXT_BYTES + 1)  # takes no room on the disk
    with pytest.raises(InputError, match="is too large; expected at most 512 MB"):
        read_text(tmp_path / "huge")


def test_files_named_in_files_are_below_their_folder(tmp_path: Path) -> None:
    (tmp_path / "game").mkdir()
    (tmp_path / "ice.json").touch()
    (tmp_path / "game" / "ice.json").touch()
    (tmp_path / "game" / "link.json").symlink_to("../ice.json")
    source = tmp_path / "game" / "game.jsonl"
    assert confined("ice.json", source.parent, source=source).name == "ice.json"
    for name in ("../ice.json", str(tmp_path / "ice.json"), "link.json", "/dev/zero"):
        with pytest.raises(InputError, match="outside its own folder"):
            confined(name, source.parent, source=source)
    with pytest.raises(InputError, match="expected a file"):
        confined(".", source.parent, source=source)


# --- JSON


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ('{"a": ' + "9" * 5000 + "}", "5000 digits"),
        ('{"a": 1e999}', "too large"),
        ("[" * 40 + "]" * 40, "nested too deep"),
        ('{"a": ' + "[" * 100_000, "nested too deep"),
        ("\0", "zero byte"),
    ],
)
def test_json_beyond_all_measure(tmp_path: Path, content: str, complaint: str) -> None:
    (tmp_path / "a.json").write_text(content)
    with pytest.raises(InputError, match=complaint):
        read_json(tmp_path / "a.json")


class Inner(Document):
    speed: Annotated[float, within(0.0, 6.0, "m/s")]


class Outer(Document):
    inner: list[Inner]
    named: dict[str, Annotated[float, within(0.0, 1.0)]] = {}


@pytest.mark.parametrize(
    ("document", "where", "problem"),
    [
        ({}, None, "missing inner"),
        ({"inner": [], "x": 1}, None, "unknown key x"),
        ({"inner": [{"speed": 2.0}, {"speed": 7}]}, "inner[1].speed", "at most 6.0, found 7"),
        ({"inner": [{"speed": "fast"}]}, "inner[0].speed", "expected a number, found text"),
        ({"inner": [{"speed": 10**400}]}, "inner[0].speed", "number out of range"),
        ({"inner": {}}, "inner", "expected a list, found an object"),
        ({"inner": [], "named": {"a": 0.5, "b": 2}}, "named.b", "at most 1.0, found 2"),
        ({"inner": [], "\ud800": 1}, None, "half a character"),
    ],
)
def test_a_document_is_refused_with_its_place(document: Any, where: Any, problem: str) -> None:
    before = json.dumps(document, default=str) if "10" in problem else None
    with pytest.raises(InputError) as refused:
        checked(document, Outer)
    assert refused.value.where == where
    assert problem in refused.value.problem
    assert before is None or json.dumps(document, default=str) == before


# --- tables


@pytest.mark.parametrize("number", ["1_000", "٣", "１２", "1e400", "0x10", "nan", "inf"])
def test_numbers_that_only_python_reads(tmp_path: Path, number: str) -> None:
    (tmp_path / "a.csv").write_text(f"a\n{number}\n", encoding="utf-8")
    with pytest.raises(InputError, match="expected a number"):
        read_table(tmp_path / "a.csv", required=("a",)).numbers("a")


def test_a_number_that_the_column_cannot_hold(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("sigma\n0.1\n-1\n")
    column = Column(name="sigma", unit="m", low=0.0, high=10.0)
    with pytest.raises(InputError, match="row 3, column sigma: .* from 0 to 10 m, found '-1'"):
        read_table(tmp_path / "a.csv", columns=(column,)).numbers("sigma")


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ("a" + ",a" * 300 + "\n", "301 columns"),
        ("a,b\n" + "x" * 5000 + ",1\n", "too long; expected at most 1000 characters"),
        ('a,b\n"1,2\n', "not a CSV table"),
    ],
)
def test_tables_beyond_all_measure(tmp_path: Path, content: str, complaint: str) -> None:
    (tmp_path / "a.csv").write_text(content)
    with pytest.raises(InputError, match=complaint):
        read_table(tmp_path / "a.csv", required=("a",))


def test_an_empty_row_is_refused_where_rows_are_counted(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t\n0\n\n1\n\n")
    assert len(read_table(tmp_path / "a.csv", required=("t",))) == 2
    with pytest.raises(InputError, match="row 3: is empty"):
        read_table(tmp_path / "a.csv", required=("t",), empty_rows=False)
    (tmp_path / "a.csv").write_text("t\n0\n1\n\n")
    assert len(read_table(tmp_path / "a.csv", required=("t",), empty_rows=False)) == 2


# --- arrays


def arrays_file() -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, a=np.arange(50.0), b=np.array(["hog"]), c=np.array(3))
    return file.getvalue()


GOOD = arrays_file()


@given(bit=st.integers(0, 8 * len(GOOD) - 1))
def test_a_flipped_bit_is_noticed_or_changes_nothing(tmp_path_factory: Any, bit: int) -> None:
    content = bytearray(GOOD)
    content[bit // 8] ^= 1 << bit % 8
    path = tmp_path_factory.getbasetemp() / "flipped.npz"
    path.write_bytes(content)
    try:
        found = read_arrays(path)
    except InputError:
        return
    if "a" in found:  # else the bit was in its name
        np.testing.assert_array_equal(found["a"], np.arange(50.0))


def packed(name: str, content: bytes, **options: Any) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, **options) as archive:
        archive.writestr(name, content)
    return file.getvalue()


def npy(array: Any) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


HEADER = npy(np.zeros(3))


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"", "cannot be read"),
        (npy(np.zeros(3)), "not a zip"),
        (
            packed("a.npy", HEADER.replace(b"(3,)", b"(9,)")),
            "EOF: reading array data, expected 72 bytes got 24",
        ),
        (packed("a.npy", HEADER.replace(b"(3,)", b"(2,)")), "differs from its header"),
        (packed("a.npy", HEADER.replace(b"(3,)", b"(-1,)"[:4])), "cannot be read"),
        (packed("a.npy", HEADER.replace(b"<f8", b"|O8")), "cannot be read|neither numbers"),
        (packed("a.npy", npy(np.zeros(3, dtype=complex))), "expected numbers or text"),
        (packed("a.npy", b"x"), "cannot be read"),
    ],
)
def test_invalid_arrays_are_refused(tmp_path: Path, content: bytes, complaint: str) -> None:
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(InputError, match=complaint):
        read_arrays(tmp_path / "a.npz", what="a model")


def test_a_small_file_that_would_fill_the_memory_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_bytes(packed("a.npy", bytes(700 * 2**20), compresslevel=1))
    assert (tmp_path / "a.npz").stat().st_size < 4 * 2**20
    with pytest.raises(InputError, match="700 MB unpacked"):
        read_arrays(tmp_path / "a.npz", what="a model")


def test_arrays_survive_their_file(tmp_path: Path) -> None:
    given = {"a": np.arange(6.0).reshape(2, 3), "b": np.array("text"), "c": np.array([True])}
    write_arrays(tmp_path / "a.npz", given)
    found = read_arrays(tmp_path / "a.npz")
    assert found.keys() == given.keys()
    for name, array in given.items():
        np.testing.assert_array_equal(found[name], array)
    assert read_arrays(tmp_path / "a.npz", only={"b"}).keys() == {"b"}


# --- YAML


BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (BOMB, "at most 20000"),
        ("a: 2024-13-45", "not readable YAML"),
        ('a: !!float "x"', "not readable YAML"),
        ("a: .inf", "not finite"),
        ("a: [", "line 1|line 2"),
        ("&a [*a]", "nested too deep|cannot|not YAML"),
        ("!!python/object/apply:os.system [ls]", "not YAML"),
        ("- " * 500 + "x", "nested too deep"),
    ],
)
def test_yaml_beyond_all_measure(tmp_path: Path, text: str, complaint: str) -> None:
    pytest.importorskip("yaml")
    (tmp_path / "a.yml").write_text(text)
    with pytest.raises(InputError, match=complaint):
        read_yaml(tmp_path / "a.yml")


def test_aliases_are_read(tmp_path: Path) -> None:
    pytest.importorskip("yaml")
    (tmp_path / "a.yml").write_text("a: &a {x: 1}\nb:\n  <<: *a\n  y: 2\n")
    assert read_yaml(tmp_path / "a.yml") == {"a": {"x": 1}, "b": {"x": 1, "y": 2}}


@pytest.mark.parametrize(
    ("limit", "stated"),
    [
        (limits.MAX_JSON_BYTES / 2**20, "64 MB"),
        (limits.MAX_TEXT_BYTES / 2**20, "512 MB"),
        (limits.MAX_ARRAY_BYTES / 2**20, "640 MB"),
        (limits.MAX_YAML_BYTES / 2**20, "1 MB"),
        (limits.MAX_JSON_DEPTH, "32 levels"),
        (limits.MAX_DIGITS, "30 digits"),
        (limits.MAX_COLUMNS, "256 columns"),
        (limits.MAX_CELL, "1000 characters"),
        (limits.MAX_ROWS / 1e6, "5 million rows"),
        (limits.MAX_YAML_NODES, "20000 entries"),
        (limits.MAX_PICTURE_PIXELS / 1e6, "36 million pixels"),
        (limits.MAX_FRAME_PIXELS / 1e6, "16.8 million pixels"),
        (limits.MAX_FRAMES / 1e6, "2 million frames"),
        (limits.MAX_MEMBERS, "10000 arrays"),
    ],
)
def test_the_limits_are_in_the_documentation(limit: float, stated: str) -> None:
    text = (Path(__file__).parents[4] / "docs" / "files.md").read_text(encoding="utf-8")
    assert stated in text
    assert float(stated.split()[0]) == limit
