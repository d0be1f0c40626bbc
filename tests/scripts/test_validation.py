"""The table of published measurements as printed by the script."""

from __future__ import annotations

from pathlib import Path

import pytest
import validation
from typer.testing import CliRunner

from curling_env.ice import load_ice
from curling_env.validation import ICE_ROWS, OTHER_ROWS, compare
from curling_env.validation.row import Verdict
from tests.agents.shots.small_tables import RESTS, SmallTable


@pytest.fixture
def without_films(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out rows that render films or fit tables, which have separate tests."""
    monkeypatch.setattr(validation, "ROWS_OF_NO_ICE", OTHER_ROWS)


def test_rows_are_one_list_with_their_ice(without_films: None) -> None:
    documents = validation.as_documents(validation.tables(["standard", "paper"]))
    assert len(documents) == 2 * len(ICE_ROWS) + len(OTHER_ROWS)
    assert [d["ice"] for d in documents[:1]] == ["standard"]
    assert documents[-1]["ice"] is None
    assert {"part", "name", "published", "value", "verdict", "source"} <= documents[0].keys()


def test_rows_of_the_paper_are_compared_with_the_printed_values(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(validation, "_paper_errors", lambda: {1: 0.1, 5: 0.4})
    misses = {(form, where): 0.1 for form in ("plain", "pyramidal") for where in
              ("before mid-sheet", "after mid-sheet")}  # fmt: skip
    monkeypatch.setattr(validation, "_flow_misses", lambda: misses)
    found = compare(load_ice("standard"), "standard", validation.PAPER_ROWS)
    assert [c.verdict.value for c in found] == ["agrees", "differs", "agrees", "agrees"]


def test_a_figure_is_drawn(tmp_path: Path) -> None:
    from validation_figures import draw_weights

    draw_weights(tmp_path / "weights.png")
    assert (tmp_path / "weights.png").stat().st_size > 20_000


def test_a_name_that_is_no_ice_is_refused() -> None:
    import typer

    app = typer.Typer()
    app.command()(validation.main)
    done = CliRunner().invoke(app, ["--ice", "nothing"])
    assert done.exit_code != 0
    assert "no such ice file" in str(done.exception)


def test_rows_of_mixed_doubles_need_a_table(tmp_path):
    small = SmallTable()
    small.end(RESTS, (0, 2))
    small.end(RESTS, (1, 0), hammer=31)
    rows = validation.doubles_rows(small.write(tmp_path), "club", 9)
    assert [row.part for row in rows] == ["mixed doubles"] * 3
    worst, same = compare(load_ice("standard"), "standard", rows[:2])
    assert worst.value is not None
    assert 0 < worst.value <= 100
    assert same.value is not None
    assert 0 <= same.value <= 1
    assert (worst.verdict is Verdict.AGREES) == (worst.value <= 4)


def test_decisions_are_printed_by_situation(tmp_path, capsys):
    import decisions

    small = SmallTable()
    small.end(RESTS, (0, 2))
    decisions.main(small.write(tmp_path), hands="club", shots=4, search=60, seed=0, as_json=False)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:4] == ["calls", "calls", "others", "agree"]
    assert lines[1].split()[:2] == ["all", "4"]
    power_plays = next(k for k, line in enumerate(lines) if line.startswith("power plays"))
    assert lines[power_plays + 1].startswith("8 to play, level")
    assert "0.0 % (0.0 to 79.3)" in lines[power_plays + 1]
