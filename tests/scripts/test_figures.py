"""figures.json is valid, its page is up to date, and changed figures are noticed."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import figures
import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def project(tmp_path, monkeypatch):
    """Make a folder with a separate figures.json: an area, a count and one that needs a folder."""
    monkeypatch.setattr(figures, "ROOT", tmp_path)
    monkeypatch.setattr(figures, "FIGURES", tmp_path / "figures.json")
    monkeypatch.setattr(figures, "PAGE", tmp_path / "docs" / "results.md")
    (tmp_path / "docs").mkdir()
    (tmp_path / "areas.py").write_text('print(\'{"area": 2.0, "count": 7}\')')
    common = {"question": "Areas", "command": f"{sys.executable} areas.py", "seconds": 1}
    common |= {"date": "2026-11-27", "commit": "1234567"}

    def write(area=2.0, needs="", **other):
        rows = [
            {"name": "app.areas.area", "label": "area", "value": area, "tolerance": 0.1,
             "unit": "m²", "direction": "lower", "needs": needs} | common,
            {"name": "app.areas.count", "label": "count", "value": 7, "tolerance": 0,
             "unit": "", "direction": "higher", "needs": needs} | common,
        ]  # fmt: skip
        rows[0] |= other
        figures.FIGURES.write_text(json.dumps(rows))

    write()
    return write


def check(*options):
    """Exit status of `figures.py check`, in this process."""
    try:
        figures.app(["check", *options], standalone_mode=True)
    except SystemExit as exit:
        return exit.code
    return 0


def test_the_projects_own_file_is_sound_and_the_page_is_made_from_it():
    own = figures.load()
    assert {figure.group for figure in own} == set(figures.GROUPS)
    text = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    assert text == figures.page(own)
    assert len(text.splitlines()) <= 400


def test_every_measure_of_the_file_exists():
    for figure in figures.load():
        words = figure.command.split()
        if words[:2] == ["python", "scripts/measure.py"]:
            group, name = words[2].split(".")
            assert name in import_module(f"measures.{group}").MEASURES
            assert figure.name.startswith(f"{group}.{name}.")


def test_the_quick_set_of_each_group_takes_ten_minutes_of_two_cores_at_most():
    for group in figures.GROUPS:
        quick = {k.command: k.seconds for k in figures.load() if k.group == group and not k.long}
        assert sum(quick.values()) <= 2 * 600, group


@pytest.mark.parametrize(
    ("recorded", "status", "output"),
    [(2.05, 0, "2 same"), (2.5, 0, "better"), (1.5, 1, "worse")],
)
def test_changed_figures_are_listed_and_worse_ones_fail(project, capsys, recorded, status, output):
    project(area=recorded)
    assert check("app") == status
    assert output in capsys.readouterr().out


def test_a_command_that_fails_or_lacks_a_figure_fails_with_its_reason(project, capsys):
    project(name="app.areas.volume")
    assert check() == 1
    assert "failed  app.areas.volume" in capsys.readouterr().out
    (figures.ROOT / "areas.py").write_text("raise SystemExit('no ice')")
    assert check() == 1
    assert "no ice" in capsys.readouterr().out


def test_figures_with_missing_files_are_skipped_and_reported(project, capsys):
    project(needs="films")
    with pytest.raises(figures.FigureError, match="no figure matches"):
        check()
    rows = json.loads(figures.FIGURES.read_text())
    rows[1] |= {"command": rows[1]["command"] + " again", "needs": ""}
    figures.FIGURES.write_text(json.dumps(rows))
    assert check() == 0
    output = capsys.readouterr().out
    assert "not measured: figures that need films" in output
    assert "1 figures: 1 same" in output
    (figures.ROOT / "films").mkdir()
    assert check() == 0
    assert "2 figures: 2 same" in capsys.readouterr().out


def test_new_values_are_written_with_their_commit_and_the_page(project, capsys):
    project(area=1.5)
    git = ["git", "-c", "user.name=n", "-c", "user.email=e@x"]
    for words in (["init", "-q"], ["add", "."], ["commit", "-qm", "x"]):
        subprocess.run([*git, *words], cwd=figures.ROOT, check=True)
    (figures.ROOT / "areas.py").write_text('print(\'{"area": 3, "count": 7}\')')
    with pytest.raises(figures.FigureError, match="commit first: areas.py"):
        check("--write")
    subprocess.run([*git, "commit", "-qam", "y"], cwd=figures.ROOT, check=True)
    assert check("--write") == 1
    area, count = figures.load(figures.FIGURES)
    assert (area.value, count.value) == (3.0, 7.0)
    assert area.commit == count.commit != "1234567"
    assert "| area ↓ | 3 | 0.1 | m² | `" in figures.PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"direction": "up"}, "Invalid enum value 'up'"),
        ({"name": "area"}, "expected GROUP.MEASURE.KEY"),
        ({"name": "app.areas.count"}, "listed twice"),
        ({"date": "2026-01-01"}, "differ in 'date'"),
    ],
)
def test_a_faulty_file_is_refused_with_the_entry(project, change, message):
    project(**change)
    with pytest.raises(figures.FigureError, match=message):
        figures.load(figures.FIGURES)
