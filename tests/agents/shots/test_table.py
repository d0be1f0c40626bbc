"""Tables of championship shots: read, checked by row, and converted into recorded games."""

import json

import pytest

from agents.playing.record import read_record
from agents.shots.table import Fault, error_needed, read_shots
from curling_env.errors import InputError
from curling_env.game.rules import Team
from tests.agents.shots.small_tables import AWAY, HOME, OUT, RESTS, SmallTable


@pytest.fixture
def small() -> SmallTable:
    """Two ends: away scores two, then home scores one in a power play."""
    table = SmallTable()
    table.end(RESTS, (0, 2))
    table.end(RESTS, (1, 0), hammer=HOME, placed=((411, 1916), (350, 850)), power_play=2)
    return table


def test_a_table_has_the_ends_places_hands_and_grades(small, tmp_path):
    table = read_shots(small.write(tmp_path))
    (game,) = table.games
    assert (game.names, game.teams, game.result) == (("AAA", "BBB"), (HOME, AWAY), (1, 2))
    first, second = game.ends
    assert (first.hammer, first.power_play, first.score) == (Team.AWAY, None, (0, 2))
    assert (second.hammer, second.power_play) == (Team.HOME, "left")
    assert first.agrees
    assert first.counted == -2
    shot = first.shots[1]
    assert (shot.team, shot.player, shot.task, shot.spin, shot.grade) == (
        Team.AWAY,
        1,
        "draw",
        1.0,
        4,
    )
    # 1.10 ft to the right of the tee and 2.00 ft before it; the placed stone is 1.50 ft behind it.
    lying = {(stone.team, stone.number): (stone.x, stone.y) for stone in shot.after}
    assert lying[Team.AWAY, 0] == pytest.approx((0.33528, -0.6096))
    assert lying[Team.AWAY, 5] == pytest.approx((0.0, 0.4572))
    assert shot.before == first.shots[0].after


def test_an_end_that_does_not_count_as_written_has_a_fault_a_kind_and_a_size(tmp_path):
    small = SmallTable()
    row = small.end(RESTS, (1, 0))
    table = read_shots(small.write(tmp_path))
    (end,) = table.ends
    assert not end.agrees
    assert end.kind == "a position or the score is wrong"
    assert end.short_by > 0.1
    faults = [fault for fault in table.faults if fault.file == "Stones.csv"]
    assert [fault.row for fault in faults] == [row + 9]
    assert "the stones count 2 for away, Ends.csv has 1 for home" in faults[0].problem


def test_a_near_measure_is_called_one(tmp_path):
    small = SmallTable()
    rests = (*RESTS[:8], (750, 829), (750, 770))  # 0.29 and 0.30 ft from the tee
    small.end(rests, (0, 1))
    (end,) = read_shots(small.write(tmp_path)).ends
    assert end.kind.startswith("a measure")
    assert end.short_by == pytest.approx(0.005 * 0.3048)


@pytest.mark.parametrize(
    ("distances", "written", "error"),
    [
        ([0.2, 0.6, 1.0], 0, 0.2),  # home 0.2, away 0.6: level at 0.4 each
        ([0.2, 0.6, 1.0], -1, 0.2),
        ([0.2, 0.6, 1.0], 2, 0.2),  # home's second, 1.0, has to pass away's 0.6
    ],
)
def test_the_error_that_explains_a_score_is_the_least(distances, written, error):
    import numpy as np

    position = np.full((12, 2), np.nan)
    position[[0, 6, 1], 0] = distances
    position[[0, 6, 1], 1] = 0.0
    assert error_needed(position, written) == pytest.approx(error)


def test_stones_that_were_not_thrown_count_as_they_lay(tmp_path):
    small = SmallTable()
    small.end(RESTS, (0, 1), thrown=9)
    table = read_shots(small.write(tmp_path))
    (end,) = table.ends
    assert end.stopped
    assert len(end.shots) == 9
    assert end.agrees
    assert table.faults == ()


@pytest.mark.parametrize(
    ("row", "column", "value", "reported", "problem"),
    [
        (4, "Points", 7, 4, "Points is 7, expected 0 to 4, or 9 for none"),
        (4, "Task", 30, 4, "Task is 30, expected -1 to 11"),
        (4, "Handle", 5, 4, "Handle is 5, expected 0 or 1"),
        (4, "stone_1_x", "", 4, "stone_1 has no place"),
        (4, "stone_2_x", 0, 4, "stone_2 lies at (0, 1100), beside every sheet"),
        (4, "stone_12_x", 700, 4, "stone_12 lies at (700, 0), beside every sheet"),
        (3, "stone_8_y", 1110, 3, "home stone 1 and away stone 1 overlap"),
        (4, "stone_8_x", 4095, 4, "a stone leaves play before the fourth delivery"),
        (5, "TeamID", HOME, 11, "the teams do not alternate in end 1"),
    ],
)
def test_a_fault_is_reported_with_its_file_and_row(
    small, tmp_path, row, column, value, reported, problem
):
    path = small.write(tmp_path)
    lines = [line.split(",") for line in path.read_text().splitlines()]
    at = lines[0].index(column)
    lines[row - 1][at] = str(value)
    if column == "stone_8_y":
        lines[row - 1][at - 1] = "710"
    path.write_text("\n".join(",".join(line) for line in lines))
    faults = [str(fault) for fault in read_shots(path).faults]
    assert any(f"row {reported}: {problem}" in fault for fault in faults), faults


def test_a_stone_that_returns_is_reported(tmp_path):
    small = SmallTable()
    row = small.end(RESTS, (0, 1))
    small.stones[5][11 + 2], small.stones[5][11 + 3] = OUT
    table = read_shots(small.write(tmp_path))
    problem = "home stone 1 appears, though it was not delivered"
    assert Fault("Stones.csv", row + 6, problem) in table.faults


def test_tables_that_lack_another_or_hold_no_numbers_are_refused(small, tmp_path):
    path = small.write(tmp_path)
    (tmp_path / "Ends.csv").rename(tmp_path / "kept")
    with pytest.raises(InputError, match=r"Stones\.csv: expected Ends\.csv beside it"):
        read_shots(path)
    (tmp_path / "kept").rename(tmp_path / "Ends.csv")
    path.write_text(path.read_text().replace("700,1100", "left,1100", 1))
    with pytest.raises(InputError, match="row 2, column stone_2_x: expected a number"):
        read_shots(path)


def test_the_command_writes_games_that_can_be_replayed_and_a_report(
    small, tmp_path, curling, must_fit
):
    small.end(RESTS, (0, 1), hammer=HOME)  # the other team's stones count: a fault
    path, games = small.write(tmp_path), tmp_path / "games"
    done = curling("convert", path, "-o", games)
    document = done.json()
    assert (document["games_written"], document["ends"], document["shots"]) == (1, 3, 30)
    assert json.loads((games / "report.json").read_text())["faults"] == document["faults"]
    assert document["ends_not_as_written"][0]["ends"] == 1
    assert "Stones.csv, row 31: the stones count" in done.err
    lines = read_record(games / "7-1-1.jsonl")
    must_fit(games / "7-1-1.jsonl", "game-1")
    assert (lines[0]["home"], lines[0]["rules"]) == ("AAA", "mixed_doubles_2024")
    assert lines[0]["drawn"] is True
    assert [line["score_of_end"] for line in lines if "score_of_end" in line] == [
        [0, 2],
        [1, 0],
        [0, 1],
    ]
    last = lines[10]
    assert (last["grade"], last["player"], last["shot"], last["row"]) == (4, 1, "draw", 11)
    thrown = {path["stone"]: path for path in last["paths"]}
    assert list(thrown) == [12]  # away's fifth stone, and nothing else moved
    assert (thrown[12]["x"][-1], thrown[12]["y"][-1]) == pytest.approx(
        (0.0914, 17.3735 + 0.06096), abs=2e-3
    )
    assert curling("replay", games / "7-1-1.jsonl", "-o", tmp_path / "game.html").status == 0
    again = curling("convert", path, "--game", "7-1-1", "-o", games)
    assert again.json()["games_written"] == 1


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (("--game", "1-2-3", "-o", "games"), "has no game '1-2-3'; expected"),
        (("-o", "games.csv"), "expected -o DIR"),
    ],
)
def test_the_command_refuses_what_it_cannot_do(small, tmp_path, curling, options, problem):
    options = [tmp_path / word if word.startswith("games") else word for word in options]
    assert problem in curling("convert", small.write(tmp_path), *options).complaint
    assert not (tmp_path / "games").exists()


def test_a_hit_moves_what_it_strikes_and_leaves_play(tmp_path, curling):
    small = SmallTable()
    rests = list(RESTS)
    rests[6] = (4095, 0)
    small.end(rests, (0, 1))
    for row in small.stones[6:]:
        row[11 + 14 : 11 + 16] = OUT  # away's first stone goes with it
    path = small.write(tmp_path)
    curling("convert", path, "-o", tmp_path / "games")
    line = read_record(tmp_path / "games" / "7-1-1.jsonl")[7]
    paths = {path["stone"]: path for path in line["paths"]}
    assert set(paths) == {3, 8}
    assert {path["status"] for path in paths.values()} <= {"out_back", "out_side"}
    # It starts where it lay, when the delivered stone arrives.
    assert (paths[8]["x"][0], paths[8]["t"][0]) == pytest.approx(
        (0.33528, paths[3]["t"][-1]), abs=15
    )
    assert paths[8]["x"][0] == pytest.approx(0.335, abs=2e-3)
    assert paths[8]["t"][0] > 5
