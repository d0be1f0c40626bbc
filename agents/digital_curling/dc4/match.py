"""Hosted game for clients of version 4: seats, events, and shots."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncGenerator
from typing import Any, Generic, TypeVar

from agents.digital_curling.conversion import move_of, throw_of
from agents.digital_curling.dc4.messages import (
    SPINS,
    Doubles4,
    PowerPlays4,
    Request4,
    Shot4,
    Team4,
    coordinates_of,
    move_from,
    placement_of,
    shot_of,
    state_of,
)
from agents.digital_curling.hosting.hosted_game import HostedGame
from agents.digital_curling.hosting.seats import OutOfTimeError, Placement, Seat, Turn
from agents.digital_curling.hosting.server import Hosting
from agents.digital_curling.messages import TEAMS, ShotMessage
from curling_env.errors import CurlingError
from curling_env.game import Call, PlayerView
from curling_env.game.rules import Team
from curling_env.throw import Skill, Throw

PING_EVERY = 30.0
"""Interval of pings on a stream without events [s]."""
MAX_WAITING = 256
"""Maximum number of waiting events of a stream; a slower one is closed."""
EARLY_SHOT_TICKS = 20
"""Number of twentieths of a second that a shot may come before the host listens for it."""
Event = tuple[str, dict[str, Any]]


class RefusedError(CurlingError):
    """Request that cannot be granted.

    Parameters
    ----------
    status : HTTP status
    problem : the reason
    """

    def __init__(self, status: int, problem: str) -> None:
        super().__init__(problem)
        self.status = status


Answer = TypeVar("Answer")


class Awaited(Generic[Answer]):
    """Answer of a team that the host waits for; `team` is None while it waits for none."""

    def __init__(self) -> None:
        self.team: Team | None = None
        self._answer: asyncio.Future[Answer] | None = None

    async def of(self, team: Team, left: float) -> Answer:
        """Return a team's answer.

        Parameters
        ----------
        team : the team
        left : time left to it [s]

        Raises
        ------
        OutOfTimeError : its time is up
        """
        self.team, self._answer = team, asyncio.get_running_loop().create_future()
        try:
            return await asyncio.wait_for(self._answer, left)
        except TimeoutError as error:
            raise OutOfTimeError from error
        finally:
            self.team = None

    def give(self, answer: Answer) -> None:
        """Take the answer of the team that the host waits for."""
        self.team = None
        if self._answer is not None and not self._answer.done():
            self._answer.set_result(answer)


class Match4:
    """Hosted game with its teams and streams.

    Parameters
    ----------
    hosting : the game
    seats : teams that clients of version 4 take
    """

    def __init__(self, hosting: Hosting, seats: set[Team]) -> None:
        self.hosting, self.seats = hosting, seats
        self.teams: dict[Team, Team4] = {}
        self.users: dict[str, Team] = {}
        self.ready = {team: asyncio.Event() for team in Team}
        self._connected: set[Team] = set()
        self._streams: set[asyncio.Queue[Event | None]] = set()
        self._shown: list[Event] = []
        self._shown_before: list[Event] = []
        self._end = -1
        self.shot: Awaited[Shot4] = Awaited()
        self.placement: Awaited[Request4] = Awaited()

    @property
    def game(self) -> HostedGame | None:
        """Game, once it has started."""
        return self.hosting.game

    # --- what clients do --------------------------------------------------------------------------

    def take_seat(self, user: str, wanted: Team, team: Team4) -> Team:
        """Register a user's team; a returning user keeps the seat.

        Raises
        ------
        RefusedError : no seat is left
        """
        if self.hosting.setting.is_doubles and (team.player3 or team.player4):
            raise RefusedError(400, "Mixed doubles have player1 and player2 only.")
        if user in self.users:
            return self.users[user]
        free = [t for t in (wanted, wanted.other) if t in self.seats - set(self.teams)]
        if not free or self.game is not None:
            raise RefusedError(409, "This match has no seat left.")
        self.users[user] = free[0]
        self.teams[free[0]] = team
        self._note_ready(free[0])
        return free[0]

    async def shoot(self, user: str, shot: Shot4) -> None:
        """Process a user's shot.

        Raises
        ------
        RefusedError : it is not the turn of the user's team, or the game is over
        """
        team = self._team_of(user)
        if self.game is not None and self.game.awaits_placement:
            raise RefusedError(409, "End setup required.")
        # The stream may have reached a quick client a moment before the host listens.
        for _ in range(EARLY_SHOT_TICKS):
            if self.shot.team is team or not self._is_turn_of(team):
                break
            await asyncio.sleep(0.05)
        if self.shot.team is not team:
            raise RefusedError(400, "It is not the turn of this team.")
        self.shot.give(shot)

    async def set_up_end(self, user: str, request: Request4) -> None:
        """Process a user's request before an end of mixed doubles.

        Raises
        ------
        RefusedError : fours are played, the other team decides, the end has started, or the game is
            over
        """
        team = self._team_of(user)
        if not self.hosting.setting.is_doubles:
            raise RefusedError(400, "end-setup is only for mixed doubles.")
        for _ in range(EARLY_SHOT_TICKS):  # see `shoot`
            if self.placement.team is not None or not self._is_to_place(team):
                break
            await asyncio.sleep(0.05)
        if self.game is not None and not self.game.awaits_placement:
            raise RefusedError(409, "The end has started.")
        if self.placement.team is not team:
            raise RefusedError(409, "The other team decides.")
        self.placement.give(request)

    def _is_to_place(self, team: Team) -> bool:
        return self.game is not None and self.game.awaits_placement and self.game.decides is team

    def _team_of(self, user: str) -> Team:
        """Return the team of a user in a match that is not over."""
        if user not in self.users:
            raise RefusedError(401, "This user is in no team of this match.")
        if self.game is not None and self.game.is_over:
            raise RefusedError(409, "The match is over.")
        return self.users[user]

    def _is_turn_of(self, team: Team) -> bool:
        return self.game is not None and self.game.update["next_team"] == TEAMS[team]

    # --- messages to them -------------------------------------------------------------------------

    def publish(self) -> None:
        """Send the position to all streams; after the last shot of an end, first its final
        position.
        """
        game = self.game
        assert game is not None
        end = game.update["state"]["end"]
        begins = game.update["state"]["shot"] == 0 and not game.is_over
        last = game.last_thrown if game.shots and not begins else None
        events: list[Event] = []
        if game.shots and (end != self._end or game.is_over) and _is_last_shot(game):
            events.append(("latest_state_update", self._after_the_end(game)))
        if end != self._end:
            self._shown_before, self._shown = self._shown, []
            self._end = end
        if not (game.is_over and events):
            events.append(("latest_state_update", self._state(game, last)))
        for event in events:
            self._shown.append(event)
            for stream in tuple(self._streams):
                self._put(stream, event)

    async def events(self, team: Team | None) -> AsyncGenerator[Event | None]:
        """Yield the events of a stream, from those of the end before on; None while nothing
        happens.

        A team whose stream was interrupted at the end of an end receives its course.

        Parameters
        ----------
        team : team of the stream; None for a spectator
        """
        queue: asyncio.Queue[Event | None] = asyncio.Queue(MAX_WAITING)
        for _, state in (*self._shown_before, *self._shown[:-1]):
            self._put(queue, ("state_update", state))
        for event in self._shown[-1:]:
            self._put(queue, event)
        self._streams.add(queue)
        if team is not None:
            self._connected.add(team)
            self._note_ready(team)
        try:
            yield None
            while True:
                try:
                    event = await asyncio.wait_for(queue.get(), PING_EVERY)
                except TimeoutError:
                    yield None
                    continue
                if event is None:
                    return
                yield event
        finally:
            self._streams.discard(queue)

    def close(self) -> None:
        """Close all streams after their last events."""
        for stream in tuple(self._streams):
            self._put(stream, None)

    @property
    def latest(self) -> dict[str, Any] | None:
        """Return the latest state, if there is one."""
        return self._shown[-1][1] if self._shown else None

    def _put(self, stream: asyncio.Queue[Event | None], event: Event | None) -> None:
        try:
            stream.put_nowait(event)
        except asyncio.QueueFull:
            self._streams.discard(stream)

    def _note_ready(self, team: Team) -> None:
        if team in self.teams and team in self._connected:
            self.ready[team].set()

    def _state(self, game: HostedGame, thrown: Throw | None) -> dict[str, Any]:
        last_move = None if thrown is None else shot_of(move_of(thrown), thrown.spin)
        return state_of(
            game.update,
            game.names,
            last_move=last_move,
            clocks=game.clocks,
            doubles=doubles_of(game),
        )

    def _after_the_end(self, game: HostedGame) -> dict[str, Any]:
        """Return the final position of an end, before the next one starts."""
        shot, doubles = game.shots[-1], game.setting.is_doubles
        total = None if doubles else game.game.rules.deliveries
        return self._state(game, game.last_thrown) | {
            "end_number": shot["end"],
            "shot_number": None if total is None else total // 2,
            "team_shot_number": None if total is None else total // 2,
            "total_shot_number": total,
            "next_shot_team": None,
            "stone_coordinate": {
                "data": coordinates_of(shot["trajectory"]["finish"], doubles=doubles)
            },
        }


def doubles_of(game: HostedGame) -> Doubles4 | None:
    """Return the additional state of mixed doubles; None for fours."""
    if not game.setting.is_doubles:
        return None
    home, away = (game.power_plays.get(team) for team in Team)
    return Doubles4(
        end_setup_team=TEAMS[game.decides],
        positioned_stones_pattern=game.setting.arrangement,
        power_play_end=PowerPlays4(team0=home, team1=away),
    )


def _is_last_shot(game: HostedGame) -> bool:
    shot = game.shots[-1]
    return shot["shot"] == game.game.rules.deliveries - 1 and shot["trajectory"] is not None


class HttpSeat(Seat):
    """A client of version 4.

    Parameters
    ----------
    match : the game, whose streams carry all messages
    team : the client's team
    brings_errors : use the client's execution errors instead of those of the host's setting
    """

    def __init__(self, match: Match4, team: Team, *, brings_errors: bool = True) -> None:
        self.match, self.team, self._brings_errors = match, team, brings_errors

    async def prepare(self, greeting: dict[str, Any], game: dict[str, Any], team: Team) -> None:
        """Wait until a team has registered and listens."""
        await self.match.ready[self.team].wait()
        taken = self.match.teams[self.team]
        self.name = taken.team_name or TEAMS[self.team]
        if self._brings_errors and not taken.use_default_config:
            self.throwers = tuple(
                Skill(
                    name=player.player_name or "player",
                    sigma_speed=player.shot_std_dev,
                    sigma_angle=player.angle_std_dev,
                )
                for player in taken.players
            )

    async def send(self, message: dict[str, Any]) -> None:
        """Do nothing: the streams carry the message."""

    async def decide(self, update: dict[str, Any], view: PlayerView, left: float) -> Turn:
        begin = time.perf_counter()
        shot = await self.match.shot.of(self.team, left)
        return Turn(called(shot), time.perf_counter() - begin)

    async def place(self, view: PlayerView, left: float) -> Placement:
        return Placement(*placement_of(await self.match.placement.of(self.team, left)))

    async def leave(self) -> None:
        """Close the streams after their last events."""
        self.match.close()


def called(shot: Shot4) -> Call | ShotMessage:
    """Return a shot with its own spin; in the form of version 3 if it goes backwards."""
    move = move_from(shot)
    throw = throw_of(move)
    if throw is None:
        return move
    spin = min(max(abs(shot.angular_velocity or SPINS[1]), SPINS[0]), SPINS[1])
    sided = spin if throw.spin > 0 else -spin
    return Call(throw=Throw(speed=throw.speed, angle=throw.angle, spin=sided))
