"""How much stronger `search` has become: games against the player of an earlier commit.

    python scripts/strength.py search:1000 search:1000@8c67995 --games 60

Each name is a player, and after @ the commit whose code it is to play with; without one it is this
checkout's. That code is unpacked into runs/checkouts and plays in a process of its own: it is shown
every position and asked for its call. Two games each have the same seed, luck and hammer, with the
sides swapped. Told are games won with their 95 % interval, and processor time for each call.

Games are kept one by one in `--keep`, and what was stopped goes on from there. The setting is
Digital Curling's (its rules, `fcv1`, from the hack, its errors, ice that stays as it is), or with
`--setting world_curling` that of `curling tournament`.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import subprocess
import sys
import tarfile
import time
from io import BytesIO
from pathlib import Path
from typing import Any

from tqdm import tqdm

from agents.playing.match import play_game
from agents.playing.tournament import wilson
from curling_env.errors import InputError
from curling_env.game import (
    NO_EVOLUTION,
    TYPICAL_EVOLUTION,
    Call,
    GameSimulator,
    Player,
    PlayerView,
)
from curling_env.game.players import player_named
from curling_env.game.rules import Ruling, Team, rule_set
from curling_env.infrastructure.threads import one_thread
from curling_env.throw import FROM_HACK

CHECKOUTS = Path("runs/checkouts")
_SERVE = """
import pickle, sys, time
from curling_env.game.players import player_named
answers, sys.stdout = sys.stdout.buffer, sys.stderr
player = player_named(sys.argv[1])
while True:
    try:
        method, arguments = pickle.load(sys.stdin.buffer)
    except EOFError:
        break
    begun = time.process_time()
    answer = getattr(player, method)(*arguments)
    pickle.dump((answer, time.process_time() - begun), answers)
    answers.flush()
"""


class Timed(Player):
    """A player of this checkout, whose time is taken."""

    def __init__(self, player: str) -> None:
        self.name, self.seconds, self.calls = player, 0.0, 0
        self._player = player_named(player)

    def ask(self, method: str, *arguments: Any) -> Any:
        """The answer of one of the player's methods."""
        begun = time.process_time()
        answer = getattr(self._player, method)(*arguments)
        self._count(method, time.process_time() - begun)
        return answer

    def _count(self, method: str, seconds: float) -> None:
        if method == "call":
            self.seconds += seconds
            self.calls += 1

    def call(self, view: PlayerView) -> Call:
        return self.ask("call", view)

    def concedes(self, view: PlayerView) -> bool:
        return self.ask("concedes", view)

    def puts_back(self, view: PlayerView, ruling: Ruling) -> bool:
        return self.ask("puts_back", view, ruling)


class OfCommit(Timed):
    """A player with the code of a commit, in a process of its own."""

    def __init__(self, player: str, commit: str) -> None:
        self.name, self.seconds, self.calls = f"{player}@{commit}", 0.0, 0
        folder = unpacked(commit)
        self._process = subprocess.Popen(
            [sys.executable, "-c", _SERVE, player],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(folder)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )

    def ask(self, method: str, *arguments: Any) -> Any:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        pickle.dump((method, arguments), self._process.stdin)
        self._process.stdin.flush()
        answer, seconds = pickle.load(self._process.stdout)
        self._count(method, seconds)
        return answer


def unpacked(commit: str) -> Path:
    """The folder with the code of a commit.

    Raises
    ------
    InputError : git knows no such commit here
    """
    folder = (CHECKOUTS / commit).resolve()
    if not folder.exists():
        archive = subprocess.run(["git", "archive", commit], capture_output=True, check=False)
        if archive.returncode:
            raise InputError(f"git has no commit {commit!r} here: {archive.stderr.decode()[:100]}")
        with tarfile.open(fileobj=BytesIO(archive.stdout)) as files:
            files.extractall(folder, filter="data")
    return folder


def player_of(name: str) -> Timed:
    """The player that a name stands for, with ``@commit`` of that commit."""
    player, _, commit = name.partition("@")
    return OfCommit(player, commit) if commit else Timed(player)


def simulator_of(setting: str, ends: int) -> GameSimulator:
    """The games of a setting."""
    if setting == "world_curling":
        rules = rule_set("world_curling_2024", ends=ends)
        return GameSimulator(
            rules=rules, skills="elite", ice_evolution=TYPICAL_EVOLUTION, sweeping=True
        )
    return GameSimulator(
        "fcv1",
        rules=rule_set("digital_curling", ends=ends),
        skills="digital-curling",
        ice_evolution=NO_EVOLUTION,
        delivery=FROM_HACK,
    )


def told(rows: list[dict[str, Any]], names: tuple[str, str]) -> str:
    """How often the first player won, and what time each took."""

    def mean(of: str, by: str, player: int) -> float:
        total = sum(row[by] if by == "ends" else row[by][player] for row in rows)
        return sum(row[of][player] for row in rows) / max(total, 1)

    won = sum(row["won"] for row in rows)
    low, high = wilson(won, len(rows))
    points = " : ".join(f"{mean('points', 'ends', k):.2f}" for k in (0, 1))
    spent = " and ".join(f"{1e3 * mean('seconds', 'calls', k):.1f}" for k in (0, 1))
    return (
        f"{names[0]} won {won:g} of {len(rows)} against {names[1]} "
        f"(95 %: {low:.0%} to {high:.0%}); points an end {points}; "
        f"processor time for a call {spent} ms"
    )


def play(
    names: tuple[str, str], simulator: GameSimulator, games: int, seed: int, path: Path
) -> list[dict[str, Any]]:
    """Play games between two players, with sides swapped, from those in a file on.

    Parameters
    ----------
    names : the players, each perhaps with ``@commit``
    simulator : ice, rules and skills
    games, seed : number of games, and seed of the first two
    path : file with a line for each game

    Returns
    -------
    for each game whether the first player won, points, ends, and time and number of calls
    """
    rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    one_thread()
    players = [player_of(name) for name in names]
    for number in tqdm(range(len(rows), games), unit="game", disable=None):
        first = number % 2  # the player at home
        before = [(player.seconds, player.calls) for player in players]
        game = play_game(
            simulator,
            (players[first], players[1 - first]),
            seed=seed + 1000 * (number // 2),
            last_stone=Team((number // 2) % 2),
        ).game
        own, other = Team(first), Team(1 - first)
        row = {
            "won": 0.5 if game.winner is None else float(game.winner is own),
            "points": [game.score[own], game.score[other]],
            "ends": len(game.line_score),
            "seconds": [p.seconds - b[0] for p, b in zip(players, before, strict=True)],
            "calls": [p.calls - b[1] for p, b in zip(players, before, strict=True)],
        }
        rows.append(row)
        with path.open("a") as kept:
            kept.write(json.dumps(row) + "\n")
    return rows[:games]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("player", help="such as search:1000")
    parser.add_argument("opponent", help="such as search:1000@8c67995")
    parser.add_argument("--games", type=int, default=60)
    parser.add_argument("--ends", type=int, default=4)
    parser.add_argument(
        "--setting", choices=["digital_curling", "world_curling"], default="digital_curling"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="by default a file in runs/strength")
    chosen = parser.parse_args()
    names = (chosen.player, chosen.opponent)
    file = f"{'-'.join(names)}-{chosen.setting}-{chosen.ends}-{chosen.seed}.jsonl".replace(":", "_")
    path: Path = chosen.keep or Path("runs/strength") / file.replace("/", "_")
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = play(names, simulator_of(chosen.setting, chosen.ends), chosen.games, chosen.seed, path)
    print(told(rows, names))


if __name__ == "__main__":
    main()
