"""Logs of Digital Curling, versions 2 and 3, as recorded games."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from agents.digital_curling.read_logs import read_log
from agents.playing.record import read_record
from curling_env.errors import InputError

HEAD = "[GameInfo]\nFirst=North\nFirstRemTime=55000\nSecond=South\n"
"""Version 2: the tee lies at (2.375, 4.88), and y grows towards the thrower."""


def section(number: int, stones: list[tuple[float, float]], *more: str) -> str:
    """A numbered section with a position and further lines."""
    places = " ".join(f"{x:.6f} {y:.6f}" for x, y in [*stones, *[(0.0, 0.0)] * 16][:16])
    return "\n".join([f"[{number:04}]", f"POSITION=POSITION {places}", *more, ""])


def log(score: int = -1, second: int = 1) -> str:
    """A log of an end of two shots: a guard by North, a draw behind the tee by South."""
    guard, draw = (2.248, 8.56), (2.875, 4.38)
    shot = "RUNSHOT=RUNSHOT 0.8 -28.0 {}"
    return (
        HEAD
        + section(0, [], "SETSTATE=SETSTATE 0 0 1 0", shot.format(1), "SHOTNAME Guard")
        + section(1, [guard], f"SETSTATE=SETSTATE 1 0 1 {second}", shot.format(0))
        + section(2, [guard, draw], f"SCORE=SCORE {score}", "TOTALSCORE=TOTALSCORE 0 1")
        + "[GameOverInfo]\nWIN=South\n"
    )


def test_a_log_of_version_2_becomes_a_game(tmp_path, curling):
    (tmp_path / "g.dcl").write_text(log())
    done = curling("convert", tmp_path / "g.dcl", "-o", tmp_path / "g.jsonl")
    assert done.json()["faults"] == []
    head, first, second, result = read_record(tmp_path / "g.jsonl")
    assert (head["home"], head["away"], head["last_stone"]) == ("North", "South", "away")
    assert (first["team"], first["shot"], second["team"]) == ("home", "guard", "away")
    assert first["thrown"]["spin"] > 0 > second["thrown"]["spin"]
    # To the right of the tee and behind it is to the right, and farther along play.
    lying = {stone["stone"]: (stone["x"], stone["y"]) for stone in second["lying"]}
    assert lying[0] == pytest.approx((-0.127, 17.3735 - 3.68))
    assert lying[8] == pytest.approx((0.5, 17.3735 + 0.5))
    assert (result["line_score"], result["winner"]) == ([[0, 1]], "away")


def test_a_score_that_the_stones_do_not_have_is_reported(tmp_path, curling):
    (tmp_path / "g.dcl").write_text(log(score=2))
    done = curling("convert", tmp_path / "g.dcl", "-o", tmp_path / "g.jsonl")
    assert done.json()["faults"] == ["line 14: the stones count 0 : 1, SCORE is 2"]


@pytest.mark.parametrize(
    ("name", "text", "problem"),
    [
        ("g.dcl", HEAD, "g.dcl: contains no shot of a game"),
        ("g.dcl", log(second=0), "line 10: stone 2 has the team of the stone before it"),
        ("g.dcl", log().replace("SCORE -1", "SCORE many"), "line 14: SCORE is 'many', expected"),
        ("g.dcl", log().replace(" 2.875000", "", 1), "line 14: POSITION has 31 numbers"),
        ("g.dcl2", '{"tag": "gam", "log": {"cmd": "dc"}}\n', "g.dcl2: contains no shot of a game"),
        ("g.dcl2", '{"cmd": "dc"}\n', "g.dcl2, line 1: expected an entry of a log"),
    ],
)
def test_what_is_no_log_is_refused_with_its_line(tmp_path, name, text, problem):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError) as refused:
        read_log(tmp_path / name)
    assert problem in str(refused.value)


def test_the_hosts_own_log_gives_the_recorded_game_again(tmp_path, curling):
    players = ("--team0", "draw", "--team1", "rulebased")
    options = ("--ends", "1", "--seed", "3", "--port", "0", "-o", tmp_path)
    with ThreadPoolExecutor(1) as pool:  # a browser's event loop may run in this one
        pool.submit(curling, "host", *players, *options).result()
    ours, theirs = read_log(tmp_path / "game.dcl2").lines, read_record(tmp_path / "game.jsonl")
    assert len(ours) == len(theirs)
    assert ours[-1] == theirs[-1]
    for one, other in zip(ours[1:-1], theirs[1:-1], strict=True):
        assert [stone["stone"] for stone in one["lying"]] == [
            stone["stone"] for stone in other["lying"]
        ]
        for a, b in zip(one["lying"], other["lying"], strict=True):
            assert (a["x"], a["y"]) == pytest.approx((b["x"], b["y"]), abs=1e-6)
        assert one["thrown"]["speed"] == pytest.approx(other["thrown"]["speed"], abs=1e-6)
