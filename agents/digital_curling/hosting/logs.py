"""Logs of a host in Digital Curling's form, for its users' viewers.

A folder has ``game.dcl2``, one JSON object a line with tag, number, time and event, and
``shot_e000s00.json`` and so on, each shot with its path.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

import msgspec

from agents.digital_curling.hosting.hosted_game import HostedGame
from agents.digital_curling.messages import TEAMS
from curling_env.infrastructure.files.storage import write_text


def local_time() -> str:
    """Return date and time of day in the form of the logs."""
    return datetime.now().astimezone().isoformat(timespec="seconds")


class DcLog:
    """Lines of ``game.dcl2``.

    Parameters
    ----------
    now : function that returns the time of day
    """

    def __init__(self, now: Callable[[], str] = local_time) -> None:
        self.lines: list[str] = []
        self._now = now

    def game(self, message: dict[str, Any]) -> None:
        """Log a message of the game."""
        self._add("gam", message)

    def error(self, problem: str) -> None:
        """Log the reason why a game broke off."""
        self._add("err", problem)

    def entry(self, tag: str, log: Any, number: int) -> dict[str, Any]:
        """Return an entry with its tag, number and time."""
        return {
            "tag": tag,
            "id": number,
            "date_time": self._now(),
            "thread": "0",
            "log": msgspec.to_builtins(log),
        }

    def write(self, folder: Path, game: HostedGame | None, game_id: str, date_time: str) -> None:
        """Write the lines, and a file for each shot."""
        write_text(folder / "game.dcl2", "".join(line + "\n" for line in self.lines))
        for number, shot in enumerate([] if game is None else game.shots, len(self.lines)):
            if shot["trajectory"] is None:
                continue
            log = {"game_id": game_id, "game_date_time": date_time}
            log |= {name: value for name, value in shot.items() if name != "team"}
            name = f"shot_e{shot['end']:03}s{shot['shot']:02}.json"
            text = json.dumps(self.entry("sht", log, number), indent=2)
            write_text(folder / name, text + "\n")

    def beginning(
        self,
        greeting: dict[str, Any],
        game: dict[str, Any],
        names: tuple[str, str],
        orders: tuple[tuple[int, ...], tuple[int, ...]],
    ) -> None:
        """Log everything before the first position.

        Parameters
        ----------
        greeting : the message `dc`
        game : the `game` of `is_ready`
        names, orders : names and players of both teams
        """
        self.game(greeting)
        self.game({"cmd": "meta", "meta": "config", "config": {"version": 1, "game": game}})
        for team, name in zip(TEAMS, names, strict=True):
            self.game({"cmd": "dc_ok", "name": name, "team": team})
        self.game({"cmd": "is_ready", "game": game, "team": None})
        for team, order in zip(TEAMS, orders, strict=True):
            self.game({"cmd": "ready_ok", "team": team, "player_order": list(order)})
        self.game({"cmd": "new_game", "name": dict(zip(TEAMS, names, strict=True))})

    def _add(self, tag: str, log: Any) -> None:
        self.lines.append(json.dumps(self.entry(tag, log, len(self.lines)), separators=(",", ":")))
