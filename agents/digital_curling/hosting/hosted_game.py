"""Hosted game without any network: moves in, positions out, clocks and the record."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from agents.digital_curling.conversion import FIRST_HAMMER, move_of, state_of, throw_of
from agents.digital_curling.game_record import substitute_throw
from agents.digital_curling.hosting.setting import HostSetting, Order
from agents.digital_curling.hosting.trajectory import trajectory_of, turned
from agents.digital_curling.messages import TEAMS, ShotMessage
from agents.playing.match import PlayedDelivery
from agents.playing.record import delivery_line, head_line, result_of
from curling_env.errors import InputError
from curling_env.game import Call, PlayedShot, PlayerView
from curling_env.game.rules import Fault, Game, Team
from curling_env.game.rules.rulesets import Side
from curling_env.throw import Throw

Document = dict[str, Any]


class HostedGame:
    """Game between two teams.

    Parameters
    ----------
    setting : settings of the game
    names : names of team 0 and team 1
    orders : lead, second, third and fourth among each team's players
    """

    def __init__(
        self, setting: HostSetting, names: tuple[str, str], orders: tuple[Order, Order]
    ) -> None:
        self.setting, self.names = setting, names
        self.simulator = setting.simulator(orders)
        first = self.simulator.new_game(setting.seed, last_stone=FIRST_HAMMER)
        self.state = first if setting.is_doubles else self.simulator.begin_end(first)
        self.clock = [setting.thinking_time, setting.thinking_time]
        self.last_thrown: Throw | None = None
        """Throw before, as executed."""
        self._game_clock = self.clock
        self.result: Document | None = None
        self.update: Document = {}
        """Position as sent to clients."""
        self.shots: list[Document] = []
        """Each shot with its path, as in Digital Curling's logs."""
        self._head = head_line(
            names, first.game, self.simulator, ice=setting.ice_name, seed=setting.seed
        )
        self.power_plays: dict[Team, int] = {}
        """End of each team's power play."""
        self._lines: list[Document] = []
        self._headings: dict[int, float] = {}
        self._make_update(None)

    @property
    def game(self) -> Game:
        """Current game; no end is in play once it is over."""
        return self.state.game

    @property
    def is_over(self) -> bool:
        """Return whether the game has ended."""
        return self.result is not None

    @property
    def awaits_placement(self) -> bool:
        """Return whether a team has to decide on the placement of the next end of mixed doubles."""
        return not self.is_over and self.game.end is None

    @property
    def decides(self) -> Team:
        """Team that decides on the placement, or has decided."""
        return self.game.last_stone

    @property
    def to_throw(self) -> Team:
        """Team whose turn it is."""
        if self.game.end is None:
            raise InputError("the game is over")
        return self.game.end.to_throw

    @property
    def view(self) -> PlayerView:
        """Return the view of the team that throws, or that decides on the placement."""
        return self.simulator.view(self.state)

    @property
    def example(self) -> PlayerView:
        """Return the view of the team to throw in an end, even before it has started."""
        state = self.state
        return self.simulator.view(
            self.simulator.begin_end(state) if self.awaits_placement else state
        )

    @property
    def clocks(self) -> tuple[list[float], list[float]]:
        """Return the time left to both teams for the game, and for an extra end [s]."""
        if self._game_clock is self.clock:
            return self.clock, [self.setting.extra_time] * 2
        return self._game_clock, self.clock

    def lines_after(self, number: int) -> list[Document]:
        """Return the lines of the record from a delivery on, counted from 0."""
        return self._lines[number:]

    def record(self) -> list[Document]:
        """Return the lines of the game up to now, for `curling replay`."""
        result = result_of(self.game)
        if self.result is None:
            result["reason"] = "in play"
        else:
            winner = self.result["winner"]
            result["reason"] = self.result["reason"]
            result["winner"] = None if winner is None else Team(TEAMS.index(winner)).label
        if result["reason"] != "concede":
            result["conceded"] = None
        return [self._head, *self._lines, result]

    # --- moves ------------------------------------------------------------------------------------

    def place(self, side: Side | None, throws_first: bool) -> None:
        """Apply the placement by the team that decides, and start the next end.

        A power play that the rules do not allow becomes the usual placement, as on the
        competition's server.

        Parameters
        ----------
        side : the side of a power play, or None
        throws_first : whether the team throws first, without the hammer
        """
        if side is not None and not self.game.may_power_play:
            side = None
        if side is not None:
            self.power_plays[self.decides] = len(self.game.line_score)
        self.state = self.simulator.begin_end(self.state, power_play=side, throw_first=throws_first)
        self._make_update(None)

    def shoot(self, move: ShotMessage | Call, seconds: float) -> None:
        """Execute a throw of the team to throw; it loses if its time is up.

        Parameters
        ----------
        move : a shot of the protocol, or a call of a player of this project
        seconds : thinking time of the move
        """
        team = self.to_throw
        if self._spend(team, seconds):
            self.give_up(team, "time_limit")
            return
        selected, call = _called(move)
        end, before = self.game.end, self.state
        assert end is not None
        after, shot = self.simulator.play(before, call, paths=True)
        actual, self.last_thrown = move_of(shot.thrown), shot.thrown
        if isinstance(move, ShotMessage) and throw_of(move) is None:
            actual = move  # thrown backwards: the stone is removed
        headings = turned(shot, self._headings)
        trajectory = trajectory_of(shot, end.stones, self._headings, headings)
        self._note(selected, actual, trajectory)
        self._lines.append(delivery_line(PlayedDelivery(before, shot, after)))
        self._headings = headings
        self.state = after
        if self.game.end is None:
            self._next_end()
        self._make_update(
            _last_move(actual, shot, trajectory if self.setting.send_trajectory else None)
        )

    def give_up(self, team: Team, reason: str = "concede") -> None:
        """End the game: a team concedes, has no time left or has disconnected.

        Parameters
        ----------
        team : losing team
        reason : `concede` or `time_limit`
        """
        state = dict(self.update["state"])
        if reason == "time_limit":
            self.clock[team] = 0.0
        self.result = {"winner": TEAMS[team.other], "reason": reason}
        state |= {
            "shot": min(state["shot"] + 1, self.game.rules.deliveries - 1),
            "hammer": None,
            "game_result": self.result,
            "thinking_time_remaining": self._clock_message(),
        }
        last_move = {"actual_move": {"type": "concede"}, "free_guard_zone_foul": False}
        self._note({"type": "concede"}, {"type": "concede"}, None)
        self.state = replace(self.state, game=replace(self.game, end=None, conceded=team))
        self.update = {"cmd": "update", "next_team": None, "last_move": last_move, "state": state}

    # --- what follows from a move -----------------------------------------------------------------

    def _spend(self, team: Team, seconds: float) -> bool:
        """Run a clock down; return whether it is up."""
        self.clock[team] = max(round(self.clock[team] - seconds, 3), 0.0)
        return self.clock[team] <= 0

    def _next_end(self) -> None:
        """Start the next end, or end the game."""
        game = self.game
        self._headings = {}
        if game.is_over:
            winner = None if game.winner is None else TEAMS[game.winner]
            self.result = {"winner": winner, "reason": "score" if winner else "draw"}
            return
        if game.is_extra_end:
            self.clock = [self.setting.extra_time, self.setting.extra_time]
        if not self.setting.is_doubles:
            self.state = self.simulator.begin_end(self.state)

    def _make_update(self, last_move: Document | None) -> None:
        """Make the update for the clients."""
        clock = (self.clock[0], self.clock[1])
        self.update = {
            "cmd": "update",
            "next_team": None if self.game.end is None else TEAMS[self.to_throw],
            "last_move": last_move,
            "state": state_of(self.game, headings=self._headings, clock=clock),
        }

    def _clock_message(self) -> Document:
        return dict(zip(TEAMS, self.clock, strict=True))

    def _note(self, selected: Any, actual: Any, trajectory: Document | None) -> None:
        state = self.update["state"]
        self.shots.append(
            {
                "end": state["end"],
                "shot": state["shot"],
                "team": self.update["next_team"],
                "selected_move": selected,
                "actual_move": actual,
                "trajectory": trajectory,
            }
        )


def _called(move: ShotMessage | Call) -> tuple[ShotMessage, Call]:
    """Return a move as a shot of the protocol and as a call."""
    if isinstance(move, Call):
        return move_of(move.throw), move
    return move, Call(throw=throw_of(move) or substitute_throw(move))


def _last_move(actual: ShotMessage, shot: PlayedShot, trajectory: Document | None) -> Document:
    foul = shot.ruling.fault is Fault.FREE_GUARD_ZONE
    last_move: Document = {"actual_move": actual, "free_guard_zone_foul": foul}
    return last_move if trajectory is None else {**last_move, "trajectory": trajectory}
