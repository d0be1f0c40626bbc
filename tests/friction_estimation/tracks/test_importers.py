"""Tracks exported by other programs, in their formats."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.trajectory import read_tracks
from friction_estimation.tracks import Along, on_sheet, read_export

# One row every 40 ms: a stone that slides along the program's x axis, a little to its left.
TIMES = 0.04 * np.arange(40)
X, Y = 2.0 * TIMES - 0.05 * TIMES**2, 0.1 * TIMES


def quoted(value, decimal):
    return '"' + f"{value:.5f}".replace(".", decimal) + '"'


def kinovea_table(decimal=".", time=1000.0, header="Time"):
    """Two trajectories; the second begins later, so that its first cells are empty."""
    rows = [f'"{header}","stone/0/X","stone/0/Y","other/0/X","other/0/Y"']
    for i, (t, x, y) in enumerate(zip(TIMES, X, Y, strict=True)):
        cells = [quoted(v, decimal) for v in (time * t, x, y)]
        rows.append(
            ",".join([*cells, *([quoted(x + 1, decimal), cells[2]] if i > 4 else ["", ""])])
        )
    return "\r\n".join(rows)


def kinovea_text():
    rows = [f"{1000 * t:.1f} {x:.5f} {y:.5f}" for t, x, y in zip(TIMES, X, Y, strict=True)]
    return "\n".join(["#Kinovea Trajectory data export", "#T X Y", "", "# stone", *rows, ""])


def tracker(separator, multi=False, names=True):
    head = ["#multi:"] if multi else []
    if names:
        head.append(separator.join(["", "mass A", "", "mass B", ""]) if multi else "mass A")
    columns = ["t", "x", "y", "x", "y"] if multi else ["t", "x", "y"]
    rows = [head, [separator.join(columns) + separator]]
    for t, x, y in zip(TIMES, X, Y, strict=True):
        cells = [f"{v:.6E}" for v in ((t, x, y, x, -y) if multi else (t, x, y))]
        rows.append([separator.join(cells) + separator])
    return "\n".join(row for part in rows for row in part)


FORMS = {
    "Kinovea CSV": (kinovea_table(), "stone", 2),
    "Kinovea CSV, decimal commas": (kinovea_table(decimal=","), "stone", 2),
    "Kinovea CSV, seconds": (kinovea_table(time=1.0), "stone", 2),
    "Kinovea CSV, unit in the header": (kinovea_table(header="Time (ms)"), "stone", 2),
    "Kinovea text": (kinovea_text(), "stone", 1),
    "Tracker, tabs": (tracker("\t"), "mass A", 1),
    "Tracker, commas": (tracker(","), "mass A", 1),
    "Tracker, semicolons": (tracker(";"), "mass A", 1),
    "Tracker, no names": (tracker("\t", names=False), "mass 0", 1),
    "Tracker, two masses": (tracker("\t", multi=True), "mass A", 2),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_gives_the_same_points(tmp_path, form):
    text, name, count = FORMS[form]
    (tmp_path / "export.txt").write_text("\ufeff" + text, encoding="utf-8")
    series = read_export(tmp_path / "export.txt")
    assert len(series) == count
    assert series[0].name == name
    np.testing.assert_allclose(series[0].t, TIMES, atol=1e-6)
    np.testing.assert_allclose(series[0].xy, np.column_stack([X, Y]), atol=1e-5)


def test_a_point_that_is_seen_later_begins_later(tmp_path):
    (tmp_path / "k.csv").write_text(kinovea_table())
    other = read_export(tmp_path / "k.csv")[1]
    assert other.name == "other"
    assert len(other.t) == len(TIMES) - 5
    np.testing.assert_allclose(other.xy[:, 0], X[5:] + 1, atol=1e-5)


@pytest.mark.parametrize(
    ("along", "expected"),
    [
        (Along.x, (-0.2, 3.0)),
        (Along.y, (3.0, 0.2)),
        (Along.minus_x, (0.2, -3.0)),
        (Along.minus_y, (-3.0, -0.2)),
    ],
)
def test_axes_are_turned_never_mirrored(tmp_path, along, expected):
    """Three along the program's first axis and 0.2 to the left of it, from the axes' crossing."""
    (tmp_path / "k.csv").write_text(tracker("\t"))
    series = read_export(tmp_path / "k.csv")
    moved = [type(k)(name=k.name, t=k.t, xy=np.tile([30.0, 2.0], (len(k.t), 1))) for k in series]
    track = on_sheet(moved, metres=0.1, origin=(0.5, -10.0), along=along)[0]
    np.testing.assert_allclose(track.xy[0] - [0.5, -10.0], expected, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "contains no rows"),
        ("a,b\n1,2\n", "row 1: not a table of Kinovea or Tracker"),
        ("#multi:\n", "row 1: not a table of Kinovea or Tracker"),
        ("#multi:\nt,x,y\n", "0 positions"),
        (tracker("\t").replace(f"{X[3]:.6E}", "soon"), "row 6: expected a number, found 'soon'"),
        (kinovea_table().replace('"80.00000"', '"0:00:08"'), "in seconds or milliseconds"),
        (kinovea_table().replace('"120.00000"', '"20.00000"'), "row 5: time must increase"),
        ("mass A\nt\tx\ty\n0\t1\t1\n", "'mass A' has 1 positions"),
    ],
)
def test_other_files_are_refused_with_the_place(tmp_path, text, words):
    (tmp_path / "bad.txt").write_text(text)
    with pytest.raises(InputError) as refused:
        read_export(tmp_path / "bad.txt")
    assert words in str(refused.value)


def test_the_command_writes_tracks_that_the_rest_reads(curling, tmp_path):
    (tmp_path / "k.csv").write_text(kinovea_table())
    out = tmp_path / "tracks.csv"
    done = curling("convert", tmp_path / "k.csv", "--origin", "home_hog_centre", "-o", out)
    assert done.status == 0
    assert done.json()["throws"] == 2
    tracks = read_tracks(out)
    np.testing.assert_allclose(tracks[0].xy[0], [0.0, -11.0233], atol=1e-4)
    np.testing.assert_allclose(tracks[0].xy[-1] - tracks[0].xy[0], [-Y[-1], X[-1]], atol=2e-5)
    away = curling("convert", tmp_path / "k.csv", "--origin", "0,90", "-o", out)
    assert "is not on the sheet" in away.complaint
    assert "--origin" in curling("convert", tmp_path / "k.csv", "--origin", "moon").complaint


def test_tables_leave_as_parquet(curling, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    (tmp_path / "k.csv").write_text(kinovea_table())
    curling("convert", tmp_path / "k.csv", "-o", tmp_path / "tracks.csv")
    curling("convert", tmp_path / "tracks.csv", "-o", tmp_path / "tracks.parquet")
    table = parquet.read_table(tmp_path / "tracks.parquet")
    assert table.column_names[:5] == ["throw", "t", "x", "y", "theta"]
    own = np.concatenate([track.xy for track in read_tracks(tmp_path / "tracks.csv")])
    np.testing.assert_array_equal(table["x"].to_numpy(), own[:, 0])
    assert table["theta"].null_count == len(own)  # no heading was exported
    assert curling("simulate", "--help").status == 0
    cells = tmp_path / "cells.parquet"
    from curling_env.ice import load_ice, save_ice

    save_ice(load_ice("standard"), tmp_path / "ice.json")
    assert curling("convert", tmp_path / "ice.json", "-o", cells).json()["rows"] == 9 * 89
    assert parquet.read_table(cells).num_rows == 9 * 89
