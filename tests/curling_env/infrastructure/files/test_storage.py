"""Results are complete or absent; every error in an input has its place."""

from __future__ import annotations

import json
import os
import re
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from curling_env.errors import InputError, OutputError
from curling_env.infrastructure import (
    atomic_path,
    format_json,
    make_directory,
    read_json,
    read_table,
    read_text,
    write_json,
    write_table,
    write_text,
)
from curling_env.infrastructure.files.table import MAX_INTEGER


def names(directory: Path) -> list[str]:
    return sorted(entry.name for entry in directory.iterdir())


# --- writing


def test_a_written_file_is_complete_and_alone(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "in\nout µ\n")
    assert (tmp_path / "a.txt").read_bytes() == "in\nout µ\n".encode()
    assert names(tmp_path) == ["a.txt"]


def test_the_permissions_are_those_of_any_new_file(tmp_path: Path) -> None:
    (tmp_path / "plain").touch()
    write_text(tmp_path / "ours", "")
    modes = {stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("plain", "ours")}
    assert len(modes) == 1


@pytest.mark.parametrize("fault", [RuntimeError, KeyboardInterrupt, SystemExit])
def test_a_failure_half_way_leaves_the_old_file(tmp_path: Path, fault: type[BaseException]) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(fault), atomic_path(path) as draft:
        draft.write_text("half of the ne")
        raise fault
    assert path.read_text() == "old"
    assert names(tmp_path) == ["a.txt"]


def test_the_draft_has_the_suffix_and_directory_of_the_result(tmp_path: Path) -> None:
    with atomic_path(tmp_path / "film.mp4") as draft:
        assert draft.suffix == ".mp4"
        assert draft.parent == tmp_path


def test_a_missing_directory_is_named(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="no directory .*nowhere"):
        write_text(tmp_path / "nowhere" / "a.txt", "")


def test_a_file_in_the_place_of_a_directory(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="no directory"):
        write_text(tmp_path / "file" / "a.txt", "")
    with pytest.raises(OutputError, match="a file is in its place"):
        make_directory(tmp_path / "file")


def test_a_directory_in_the_place_of_a_file(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="is a directory"):
        write_text(tmp_path, "")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_an_unwritable_directory(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(OutputError, match="permission denied"):
            write_text(tmp_path / "a.txt", "")
    finally:
        tmp_path.chmod(0o700)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_a_full_device_is_reported_and_not_replaced() -> None:
    with pytest.raises(OutputError, match="/dev/full: .*no space left"):
        write_text("/dev/full", "a")
    assert Path("/dev/full").is_char_device()


def test_a_full_disk_leaves_nothing(tmp_path: Path) -> None:
    """A limit on the size of files simulates the disk: writing fails half-way."""
    program = (
        "import resource, sys\n"
        "from curling_env.errors import OutputError\n"
        "from curling_env.infrastructure.files.storage import write_text\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))\n"
        "try:\n"
        "    write_text(sys.argv[1], 'x' * 100_000)\n"
        "except OutputError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, tmp_path / "big.txt"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == f"{tmp_path / 'big.txt'}: cannot be written: file too large"
    assert names(tmp_path) == []


def test_an_error_about_another_file_is_not_blamed_on_the_output(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), atomic_path(tmp_path / "a.txt"):
        (tmp_path / "input").read_text()
    assert names(tmp_path) == []


def test_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to("real.txt")
    write_text(tmp_path / "link.txt", "new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "real.txt").read_text() == "new"


@pytest.mark.skipif(not Path("/dev/stdout").exists(), reason="this system has no /dev/stdout")
def test_names_of_streams_are_appended_to_and_never_replaced(tmp_path: Path) -> None:
    module = "curling_env.infrastructure.files.storage"
    program = f"from {module} import write_text; write_text('/dev/stdout', 'new')"
    with (tmp_path / "log").open("w") as log:
        log.write("old, ")
        log.flush()
        subprocess.run([sys.executable, "-c", program], stdout=log, check=True)
    assert (tmp_path / "log").read_text() == "old, new"


def test_a_refusal_inside_the_block_is_passed_on(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="too small"), atomic_path(tmp_path / "a.mp4"):
        raise OutputError("the picture is too small")
    assert names(tmp_path) == []


def test_a_directory_is_made_with_its_parents_once(tmp_path: Path) -> None:
    made = make_directory(tmp_path / "a" / "b")
    assert made == tmp_path / "a" / "b"
    (made / "file").touch()
    assert make_directory(str(made)) == made
    assert names(made) == ["file"]


# --- JSON

plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**53), 2**53)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


@given(document=plain)
def test_json_contains_the_inputs(document: object) -> None:
    assert json.loads(format_json(document)) == document


def test_numpy_becomes_plain_and_rows_stay_on_a_line(tmp_path: Path) -> None:
    write_json(tmp_path / "a.json", {"mu": np.zeros((2, 3)), "n": np.int64(3), "file": Path("a")})
    text = (tmp_path / "a.json").read_text()
    assert text.count("[0.0, 0.0, 0.0]") == 2
    assert read_json(tmp_path / "a.json") == {"mu": [[0.0] * 3] * 2, "n": 3, "file": "a"}


def test_json_is_laid_out_for_people() -> None:
    document = {"rows": [[1, 2], [3.5, None]], "none": {}, 7: [], "name": {"ä": (True, "ö")}}
    assert format_json(document).splitlines() == [
        "{",
        '  "rows": [',
        "    [1, 2],",
        "    [3.5, null]",
        "  ],",
        '  "none": {},',
        '  "7": [],',
        '  "name": {',
        '    "ä": [true, "ö"]',
        "  }",
        "}",
    ]


def test_json_has_no_word_for_nan(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="JSON"):
        write_json(tmp_path / "a.json", {"mu": float("nan")})
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b'{"a": 1,\n "b": }', "row 2, column 7: not JSON"),
        (b"", "row 1, column 1: not JSON"),
        (b'{"a": NaN}', "NaN is not a JSON number"),
        (b'{"a": -Infinity}', "-Infinity is not a JSON number"),
        (b"\xff\xfe\x00", "not a text file"),
        (b"[" * 100_000, "nested too deep"),
    ],
)
def test_bad_json(tmp_path: Path, content: bytes, complaint: str) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=complaint) as caught:
        read_json(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_reading_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_text(tmp_path / "a")
    with pytest.raises(InputError, match="is a directory"):
        read_text(tmp_path)


# --- tables


def table_of(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "a.csv"
    path.write_text(text)
    return path


@given(values=st.lists(st.floats(allow_infinity=False, width=64), min_size=1))
def test_numbers_survive_the_file_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory, values: list[float]
) -> None:
    path = tmp_path_factory.mktemp("table") / "a.csv"
    write_table(path, {"throw": range(len(values)), "t": values})
    table = read_table(path, required=["throw"], optional=["t"])
    assert table.integers("throw").tolist() == list(range(len(values)))
    assert np.array_equal(table.numbers("t"), values, equal_nan=True)


def test_blanks_bytes_and_spare_columns(tmp_path: Path) -> None:
    path = table_of(tmp_path, "\ufeffthrow, t ,note,swept\n1, 0.5 ,a;b,\n\n2,1e-1,,1\n")
    table = read_table(path, required=["throw", "t"], optional=["swept", "clock"])
    assert len(table) == 2
    assert "throw" in table
    assert "note" not in table
    assert "clock" not in table
    assert table.numbers("t").tolist() == [0.5, 0.1]
    assert np.array_equal(table.numbers("swept"), [np.nan, 1], equal_nan=True)
    assert table.where(1, "t") == "row 4, column t"  # the empty line counts, as in an editor


def test_cells_can_be_had_as_text_and_blank_ones_where_the_caller_allows_them(
    tmp_path: Path,
) -> None:
    table = read_table(table_of(tmp_path, "throw,t\n 1 ,\n2,nan\n"), required=["throw", "t"])
    assert list(table.text("throw")) == ["1", "2"]
    assert table.where(1) == "row 3"
    assert np.isnan(table.numbers("t", blank=True)).all()
    with pytest.raises(InputError, match="row 2, column t: expected a number, found an empty cell"):
        table.numbers("t")
    optional = read_table(table_of(tmp_path, "throw,t\n1,\n"), required=["throw"], optional=["t"])
    with pytest.raises(InputError, match="found an empty cell"):
        optional.numbers("t", blank=False)
    with pytest.raises(InputError, match="found an empty cell"):
        optional.integers("t")


def test_a_long_cell_is_cut_in_the_message(tmp_path: Path) -> None:
    for cell, shown in (("x" * 40, "x" * 40), ("x" * 41, "x" * 37 + "...")):
        table = read_table(table_of(tmp_path, f"t\n{cell}\n"), required=["t"])
        with pytest.raises(InputError, match=f"found '{re.escape(shown)}'$"):
            table.numbers("t")


def test_identifiers_are_exact_up_to_the_largest_whole_number_of_a_float(tmp_path: Path) -> None:
    path = table_of(tmp_path, f"throw\n{MAX_INTEGER}\n-{MAX_INTEGER}\n")
    assert read_table(path, required=["throw"]).integers("throw").tolist() == [2**53, -(2**53)]
    with pytest.raises(InputError, match="expected a whole number, found '9007199254740994'"):
        read_table(table_of(tmp_path, "throw\n9007199254740994\n"), required=["throw"]).integers(
            "throw"
        )


def test_a_whole_number_is_never_blank(tmp_path: Path) -> None:
    path = table_of(tmp_path, "throw,x\n1,2\n,3\n")
    with pytest.raises(InputError, match="row 3, column throw: expected a number, found an empty"):
        read_table(path, required=["throw", "x"]).integers("throw")


def test_the_same_table_as_parquet(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    write_table(tmp_path / "a.parquet", {"a": [None, 2.5], "b": np.array([True, False])})
    assert parquet.read_table(tmp_path / "a.parquet").to_pydict() == {"a": [None, 2.5], "b": [1, 0]}
    assert names(tmp_path) == ["a.parquet"]


def test_a_requested_column_is_never_taken_for_a_misspelt_one(tmp_path: Path) -> None:
    path = table_of(tmp_path, "throw,clocks\n1,2\n")
    table = read_table(path, required=["clocks"], optional=["clock", "throw"])
    assert table.numbers("clocks").tolist() == [2.0]
    with pytest.raises(InputError, match=r"unknown column 'clocks'; did you mean clock\?"):
        read_table(path, required=["throw"], optional=["clock"])


def test_none_and_booleans_are_written(tmp_path: Path) -> None:
    write_table(tmp_path / "a.csv", {"a": [None, 2.5], "b": np.array([True, False])})
    assert (tmp_path / "a.csv").read_text() == "a,b\n,1\n2.5,0\n"


def test_a_long_table_is_written_as_a_short_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    columns = {"a": np.arange(7), "b": [0.5, None, 1.5, 2.0, np.nan, 1e-9, 3.0]}
    write_table(tmp_path / "at_once.csv", columns)
    monkeypatch.setattr("curling_env.infrastructure.files.storage._ROWS_AT_A_TIME", 3)
    write_table(tmp_path / "in_parts.csv", columns)
    assert (tmp_path / "in_parts.csv").read_text() == (tmp_path / "at_once.csv").read_text()
    assert (tmp_path / "at_once.csv").read_text().count("\n") == 8


def test_columns_of_different_length_or_without_end_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="different length"):
        write_table(tmp_path / "a.csv", {"a": [1, 2], "b": [1]})
    for column in ([np.inf], [1.0, -np.inf], [None, np.inf]):
        with pytest.raises(ValueError, match="infinite"):
            write_table(tmp_path / "a.csv", {"a": column})
    assert names(tmp_path) == []


@pytest.mark.parametrize("cell", ["", "nan", "inf", "-inf", "1,5", "fast", "1e999"])
def test_cells_that_are_not_numbers_are_found(tmp_path: Path, cell: str) -> None:
    path = table_of(tmp_path, f'throw,t\n0,1.0\n0,"{cell}"\n')
    table = read_table(path, required=["throw", "t"])
    with pytest.raises(InputError, match="a.csv, row 3, column t: expected a number"):
        table.numbers("t")


@pytest.mark.parametrize("cell", ["1.5", "", "1e30", "one"])
def test_cells_that_are_not_whole_numbers_are_found(tmp_path: Path, cell: str) -> None:
    table = read_table(table_of(tmp_path, f"throw,t\n{cell},0\n"), required=["throw"])
    with pytest.raises(InputError, match="row 2, column throw: expected a"):
        table.integers("throw")


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "is empty"),
        (",,\n1,2,3\n", "is empty"),
        ("throw,t,x\n0,0,0\n", "row 1: missing column y; the header has throw, t, x"),
        ("t,x\n0,0\n", "missing columns throw, y"),
        ("throw,t,x,y,t\n0,0,0,0,0\n", "column t is given twice"),
        ("throw,t,x,y,sweept\n0,0,0,0,0\n", "unknown column 'sweept'; did you mean swept?"),
        ("throw,t,x,y\n0,0,0,0\n0,0,0\n", "row 3: expected 4 cells as in the header, found 3"),
        ('throw,t,x,y\n0,0,"0,0\n', "row 2: not a CSV table"),
    ],
)
def test_bad_tables(tmp_path: Path, text: str, complaint: str) -> None:
    path = table_of(tmp_path, text)
    with pytest.raises(InputError) as caught:
        read_table(path, required=["throw", "t", "x", "y"], optional=["swept"])
    assert complaint in str(caught.value)
    assert str(caught.value).startswith(str(path))
