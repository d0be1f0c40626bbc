"""Record of a game on a server, for `curling replay`.

A server reports the positions of the stones between two shots, and the velocity of the thrown
stone. The paths are those of this project's engine on the ice that the player believes in; so are
the final positions after the last shot of an end, which the server does not report.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from agents.digital_curling.client import Client, SeenMove
from agents.digital_curling.conversion import throw_of
from agents.digital_curling.join import WireLog
from agents.digital_curling.messages import TEAMS, ShotMessage
from agents.playing.match import PlayedDelivery, PlayedGame
from agents.playing.record import lines_of, write_lines
from agents.playing.replay.page import write_page
from agents.playing.scoreboard import scoreboard
from curling_env.errors import InputError
from curling_env.game import Call, GameSimulator, GameState, Player, PlayerView
from curling_env.game.rules import Fault, Team
from curling_env.game.simulator import MIN_SPEED
from curling_env.infrastructure.files.storage import write_text
from curling_env.infrastructure.files.writing import together
from curling_env.throw import FROM_HACK, MAX_SPEED, Throw
from curling_env.units import Units

FROM_HACK_AT_ANY_SPEED = replace(FROM_HACK, max_speed=MAX_SPEED)
"""Delivery from the hack without a speed limit: an executed throw may be faster than any intended
one.
"""


@dataclass(frozen=True)
class _Named(Player):
    """Placeholder of a team in the record."""

    name: str

    def call(self, view: PlayerView) -> Call:
        raise AssertionError("a recorded game has its own calls")


def write_game(
    folder: Path, client: Client, log: WireLog, *, ice: str, units: Units = Units.METRES
) -> None:
    """Write the messages of a game, its record, and a page with its replay.

    A game that cannot be replayed has its messages only, with a remark from the client.

    Parameters
    ----------
    folder : an existing folder
    client : client after the complete or interrupted game
    log : all messages
    ice : name or file of the ice that its player believes in
    units : units of lengths on the page
    """
    lines = []
    try:
        lines = record_of(client, ice=ice) if client.seen else []
    except InputError as error:
        client.remark(f"this game cannot be replayed: {error}")
    with together():
        write_text(folder / "wire.jsonl", log.text())
        if lines:
            write_lines(folder / "game.jsonl", lines)
            write_page(folder / "game.html", lines, units)


def summary_of(client: Client) -> tuple[dict[str, Any], str, str]:
    """Return the result of a client's game for JSON, its line score, and its winner in a
    sentence.
    """
    game, result = client.game, client.result
    assert game is not None
    assert result is not None
    document = {
        "team": f"team{client.team.value}",
        "team0": client.names[0],
        "team1": client.names[1],
        "game_id": client.game_id,
        "score": list(game.score),
        "line_score": [list(end) for end in game.line_score],
        "winner": result.winner,
        "reason": result.reason,
        "stones": len(client.seen),
    }
    table = scoreboard(game, client.names)
    return document, table, outcome_of(client.names, result.winner, result.reason)


def outcome_of(names: tuple[str, str], winner: str | None, reason: str) -> str:
    """Name the winner and the reason in a sentence."""
    if winner is None:
        return "A tie."
    name = names[int(winner == "team1")]
    loser = names[int(winner == "team0")]
    how = {"concede": f": {loser} concedes", "time_limit": f": {loser} ran out of time"}
    return f"{name} ({winner}) wins{how.get(reason, '')}."


def record_of(client: Client, *, ice: str) -> list[dict[str, Any]]:
    """Return the lines of the game that a client has seen; see `agents.playing.record.lines_of`.

    Parameters
    ----------
    client : client after the complete or interrupted game
    ice : name or file of the ice that its player believes in
    """
    simulator = GameSimulator(
        client.ice, rules=client.rules, delivery=FROM_HACK_AT_ANY_SPEED, skills="none"
    )
    deliveries = tuple(
        _delivery(simulator, seen, number, client.seed)
        for number, seen in enumerate(client.seen)
        if isinstance(seen.move, ShotMessage)
    )
    game = client.game or simulator.new_game(client.seed).game
    names = tuple(_Named(name) for name in client.names)
    played = PlayedGame(players=(names[0], names[1]), deliveries=deliveries, game=game)
    lines = lines_of(played, simulator, ice=ice, seed=client.seed)
    lines[0]["last_stone"] = (game.hammers[0] if game.hammers else game.last_stone).label
    result = client.result
    if result is not None:
        winner = None if result.winner is None else Team(TEAMS.index(result.winner)).label
        lines[-1] |= {"winner": winner, "reason": result.reason}
        if result.reason != "concede":
            lines[-1]["conceded"] = None
    else:
        lines[-1] |= {"reason": "broken off"}
    return lines


def _delivery(simulator: GameSimulator, seen: SeenMove, number: int, seed: int) -> PlayedDelivery:
    """Return one delivery, with the positions from the server and the paths of the engine."""
    assert isinstance(seen.move, ShotMessage)
    state = GameState(game=seen.before, seed=seed, throws=number)
    thrown = throw_of(seen.move) or substitute_throw(seen.move)
    shot_name = "" if seen.call is None else seen.call.shot
    _, shot = simulator.play(state, Call(throw=thrown, shot=shot_name), paths=True)
    ruling = shot.ruling
    end = seen.after.end
    if end is not None and end.delivered:
        ruling = replace(ruling, stones=end.stones)
    ruling = replace(ruling, fault=_fault(seen, ruling.fault))
    meant = thrown if seen.call is None else seen.call.throw
    shot = replace(shot, call=Call(throw=meant, shot=shot_name), ruling=ruling)
    return PlayedDelivery(state, shot, GameState(game=seen.after, seed=seed, throws=number + 1))


def _fault(seen: SeenMove, ours: Fault | None) -> Fault | None:
    """Return the fault; the server has only fouls in the free guard zone."""
    if seen.foul:
        return Fault.FREE_GUARD_ZONE
    return None if ours is Fault.FREE_GUARD_ZONE else ours


def substitute_throw(move: ShotMessage) -> Throw:
    """Return a substitute for a stone that goes backwards and is removed: one that stays at the
    hack.
    """
    spin = -FROM_HACK.spin if move.rotation == "cw" else FROM_HACK.spin
    x, y = move.velocity.x, move.velocity.y
    return Throw(speed=min(max(math.hypot(x, y), MIN_SPEED), 0.05), spin=spin)
