"""Games on Digital Curling's server, from the logs of both teams of one."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from measures.server_games import Games

from curling_env.errors import InputError

WIRE = Path(__file__).parents[2] / "agents" / "digital_curling" / "wire"


def games_in(place: Path, *logs: str) -> Games:
    found = Games()
    for k, log in enumerate(logs):
        path = place / f"wire-{k}.jsonl"
        path.write_text(log)
        found.add(path)
    return found


def test_games_are_counted_and_their_moves_played_again(tmp_path):
    logs = [(WIRE / f"extra-end-{team}.jsonl").read_text() for team in ("team0", "team1")]
    broken = "".join(logs[0].splitlines(keepends=True)[:20])
    found = games_in(tmp_path, *logs, broken)
    assert (found.won, found.games, found.broken) == (1, 2, 1)
    assert (found.other, found.moves) == (0, 64)


def test_a_move_that_ends_otherwise_is_counted(tmp_path):
    lines = (WIRE / "extra-end-team0.jsonl").read_text().splitlines()
    updates = [k for k, line in enumerate(lines) if '"update"' in line]
    late = json.loads(lines[updates[5]][2:])
    late["state"]["stones"]["team1"][7] = {"angle": 0.0, "position": {"x": 2.0, "y": 38.0}}
    lines[updates[5]] = f"< {json.dumps(late)}"
    assert games_in(tmp_path, "\n".join(lines)).other > 0


@pytest.mark.parametrize("line", ['< {"cmd": ', "< 3"])
def test_a_broken_line_is_reported_with_its_place(tmp_path, line):
    with pytest.raises(InputError, match=r"line 2: expected a message of the server"):
        games_in(tmp_path, f"> {{}}\n{line}\n")
