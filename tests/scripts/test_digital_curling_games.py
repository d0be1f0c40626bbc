"""What is told of games on Digital Curling's server, from the logs of both teams of one."""

from __future__ import annotations

import json
from pathlib import Path

import digital_curling_games
import pytest

from curling_env.errors import InputError

WIRE = Path(__file__).parents[1] / "agents" / "digital_curling" / "wire"


def folder_of(place: Path, log: str) -> Path:
    place.mkdir()
    (place / "wire.jsonl").write_text(log)
    return place


def test_games_are_counted_and_their_moves_played_again(tmp_path):
    logs = [(WIRE / f"extra-end-{team}.jsonl").read_text() for team in ("team0", "team1")]
    broken = "".join(logs[0].splitlines(keepends=True)[:20])
    folders = [folder_of(tmp_path / str(k), log) for k, log in enumerate([*logs, broken])]
    games, clock, moves = digital_curling_games.told(folders).splitlines()
    assert games == (
        "won 1 of 2 (95 %: 9% to 91%), 2 : 2 points; "
        "2 with an extra end, 0 not ended by score, 1 broken off"
    )
    assert clock.startswith("of its clock the team used ")
    assert moves.startswith("0 of 64 moves end otherwise here")


def test_a_move_that_ends_otherwise_is_named(tmp_path):
    lines = (WIRE / "extra-end-team0.jsonl").read_text().splitlines()
    updates = [k for k, line in enumerate(lines) if '"update"' in line]
    late = json.loads(lines[updates[5]][2:])
    late["state"]["stones"]["team1"][7] = {"angle": 0.0, "position": {"x": 2.0, "y": 38.0}}
    lines[updates[5]] = f"< {json.dumps(late)}"
    told = digital_curling_games.told([folder_of(tmp_path / "game", "\n".join(lines))])
    assert "end 0, shot 4: stones in play" in told.splitlines()


def test_a_folder_without_a_log_and_one_without_a_game(tmp_path):
    with pytest.raises(InputError, match="curling join -o"):
        digital_curling_games.told([tmp_path])
    with pytest.raises(InputError, match="played to its end"):
        digital_curling_games.told([folder_of(tmp_path / "game", "")])


@pytest.mark.parametrize("line", ['< {"cmd": ', "< 3"])
def test_a_broken_line_is_told_with_its_place_and_exit_2(tmp_path, monkeypatch, capsys, line):
    folder = folder_of(tmp_path / "game", f"> {{}}\n{line}\n")
    monkeypatch.setattr("sys.argv", ["digital_curling_games.py", str(folder)])
    with pytest.raises(SystemExit) as ended:
        digital_curling_games.main()
    assert ended.value.code == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "wire.jsonl, line 2: expected a message of the server" in told
