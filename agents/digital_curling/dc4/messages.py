"""States and shots of Digital Curling 4, and their conversion to version 3.

A stone that is out of play is at (0, 0). Scores have an entry for each scheduled end and one for an
extra end, 0 if it was not played. A positive angular velocity is cw; the angle of a shot is from
the x axis, so that π/2 is straight.

In mixed doubles a team's placed stone has the first slot. Before an end, and after its last shot,
a state has neither a number of shots nor a team to throw; the one before an end has no last move
either.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import msgspec

from agents.digital_curling.conversation import LastMove, PlayerMessage, Update
from agents.digital_curling.conversion import STONES_OF_DOUBLES
from agents.digital_curling.messages import (
    TEAMS,
    ConcedeMessage,
    DoublesMessage,
    ExtraEndMessage,
    PerTeam,
    Point,
    ResultMessage,
    ScoresMessage,
    ShotMessage,
    StateMessage,
    StoneMessage,
    TeamName,
)
from curling_env.errors import InputError
from curling_env.game.rules.rulesets import ARRANGEMENTS, Side
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.infrastructure.files.schema import Short, within

SPINS = (math.pi / 6, math.pi / 2)
"""Smallest and largest spin on its servers [rad/s]."""
DELIVERIES = 2 * STONES_PER_TEAM
DELIVERIES_OF_DOUBLES = 2 * STONES_OF_DOUBLES
RULES = ("fgz_rule", "no_tick_rule", "modified_fgz_rule")
"""Its rules by number; the last one is that of mixed doubles."""
MODES = ("mixed_doubles", "mix_doubles")
"""Names of mixed doubles, current and former."""
Request4 = Literal["center_house", "center_guard", "pp_left", "pp_right"]
"""Requests of the team that decides on the placement."""
REQUEST_NAMES: tuple[Request4, ...] = ("center_house", "center_guard", "pp_left", "pp_right")


class Shot4(msgspec.Struct):
    """Shot, as sent and as reported in the last move."""

    translational_velocity: Annotated[float, within(0.0, 100.0)]
    shot_angle: Annotated[float, within(-100.0, 100.0)]
    angular_velocity: Annotated[float, within(-100.0, 100.0)] | None = None


class Player4(msgspec.Struct):
    """Accuracy of a player."""

    max_velocity: Annotated[float, within(0.1, 100.0)] = 4.0
    shot_std_dev: Annotated[float, within(0.0, 10.0)] = 0.0076
    angle_std_dev: Annotated[float, within(0.0, 10.0)] = 0.0018
    player_name: Short = ""


class Team4(msgspec.Struct):
    """Client's data on its team."""

    team_name: Short
    use_default_config: bool = False
    player1: Player4 = msgspec.field(default_factory=Player4)
    player2: Player4 = msgspec.field(default_factory=Player4)
    player3: Player4 | None = None
    player4: Player4 | None = None

    @property
    def players(self) -> list[Player4]:
        """Return its four players, lead first."""
        return [self.player1, self.player2, self.player3 or Player4(), self.player4 or Player4()]


class PowerPlays4(msgspec.Struct):
    """End of each team's power play, null before it."""

    team0: Annotated[int, within(0, 255)] | None = None
    team1: Annotated[int, within(0, 255)] | None = None


class Doubles4(msgspec.Struct):
    """Additional state of mixed doubles."""

    end_setup_team: TeamName
    positioned_stones_pattern: Annotated[int, within(0, ARRANGEMENTS - 1)] = 0
    power_play_end: PowerPlays4 = msgspec.field(default_factory=PowerPlays4)


class Coordinates4(msgspec.Struct):
    """Positions of the stones."""

    data: dict[TeamName, Annotated[list[Point], msgspec.Meta(max_length=STONES_PER_TEAM)]]


class Score4(msgspec.Struct):
    """Points of both teams in each end."""

    team0: Annotated[list[Annotated[int, within(0, 255)]], msgspec.Meta(max_length=256)]
    team1: Annotated[list[Annotated[int, within(0, 255)]], msgspec.Meta(max_length=256)]


class State4(msgspec.Struct):
    """State, as in the stream."""

    end_number: Annotated[int, within(0, 255)]
    score: Score4
    stone_coordinate: Coordinates4
    total_shot_number: Annotated[int, within(0, DELIVERIES)] | None = None
    next_shot_team: TeamName | None = None
    winner_team: TeamName | None = None
    last_move: Shot4 | None = None
    first_team_name: Short | None = None
    second_team_name: Short | None = None
    first_team_remaining_time: float = 0.0
    second_team_remaining_time: float = 0.0
    first_team_extra_end_remaining_time: float = 0.0
    second_team_extra_end_remaining_time: float = 0.0
    mixed_doubles_settings: Doubles4 | None = None
    mix_doubles_settings: Doubles4 | None = None

    @property
    def doubles(self) -> Doubles4 | None:
        """Return the additional state of mixed doubles, by either of its names."""
        return self.mixed_doubles_settings or self.mix_doubles_settings

    @property
    def deliveries(self) -> int:
        """Return the number of stones that both teams deliver in an end."""
        return DELIVERIES if self.doubles is None else DELIVERIES_OF_DOUBLES

    @property
    def awaits_placement(self) -> bool:
        """Return whether an end of mixed doubles waits for the placement."""
        return (
            self.doubles is not None
            and self.total_shot_number is None
            and self.next_shot_team is None
            and self.winner_team is None
            and self.last_move is None
        )

    @property
    def delivered(self) -> int:
        """Return the number of stones delivered in the end; −1 while it waits for the placement."""
        if self.awaits_placement:
            return -1
        if self.total_shot_number is None and self.next_shot_team is None:
            return self.deliveries
        return self.total_shot_number or 0

    @property
    def ends(self) -> int:
        """Return the number of scheduled ends."""
        return max(len(self.score.team0) - 1, 1)

    @property
    def place(self) -> tuple[int, int, bool]:
        """Return the key of a state: end, shot, and whether it is over."""
        return self.end_number, self.delivered, self.winner_team is not None


# --- into the words of version 3 ------------------------------------------------------------------


def move_from(shot: Shot4) -> ShotMessage:
    """Convert a shot to version 3."""
    speed, angle = shot.translational_velocity, shot.shot_angle
    velocity = Point(speed * math.cos(angle), speed * math.sin(angle))
    return ShotMessage(
        velocity=velocity, rotation="cw" if (shot.angular_velocity or 0) > 0 else "ccw"
    )


def player_from(player: Player4) -> PlayerMessage:
    """Convert a player to version 3."""
    return PlayerMessage(
        max_speed=player.max_velocity,
        stddev_speed=player.shot_std_dev,
        stddev_angle=player.angle_std_dev,
    )


class Reader4:
    """Reader of a game's states one by one, converted to version 3.

    After the last shot of an end, version 4 first sends the final position and then the next end;
    version 3 sends both at once.
    """

    def __init__(self) -> None:
        self._place: tuple[int, int, bool] | None = None
        self._last: Shot4 | None = None

    def read(self, state: State4) -> Update | None:
        """Return the update of a state; None for one that has nothing new.

        Raises
        ------
        InputError : an impossible state
        """
        over = state.winner_team is not None
        if self._place is not None and state.place <= self._place:
            return None
        if state.last_move is not None:
            self._last = state.last_move
        if state.next_shot_team is None and not over and not state.awaits_placement:
            return None  # between two ends
        first = self._place is None
        self._place = state.place
        move, self._last = self._last, None
        last_move = None
        if not first:
            last_move = LastMove(actual_move=ConcedeMessage() if move is None else move_from(move))
        return Update(state=_state_from(state), next_team=state.next_shot_team, last_move=last_move)


def _state_from(state: State4) -> StateMessage:
    """Convert a state to version 3."""
    shot, over = max(state.delivered, 0), state.winner_team is not None
    deliveries = state.deliveries
    hammer = None
    if not over and state.next_shot_team is not None:
        if shot >= deliveries:
            raise InputError(f"no shot follows the {deliveries}th", where="total_shot_number")
        thrower = TEAMS.index(state.next_shot_team)
        hammer = TEAMS[thrower if shot % 2 else 1 - thrower]
    ends, played = state.ends, state.end_number + (over and shot >= deliveries)
    extra = state.score.team0[ends:], state.score.team1[ends:]
    result = None
    if over:
        reason = "score" if shot >= deliveries or shot == 0 else "concede"
        result = ResultMessage(reason=reason, winner=state.winner_team)
    if state.end_number < ends:
        clock = state.first_team_remaining_time, state.second_team_remaining_time
    else:
        clock = (
            state.first_team_extra_end_remaining_time,
            state.second_team_extra_end_remaining_time,
        )
    converted = StateMessage(
        end=played,
        shot=shot % deliveries,
        hammer=hammer,
        stones=_stones_from(state),
        scores=ScoresMessage(
            *(
                [p if k < played else None for k, p in enumerate(team[:ends])]
                for team in (state.score.team0, state.score.team1)
            )
        ),
        extra_end_score=ExtraEndMessage(sum(extra[0]) or None, sum(extra[1]) or None),
        game_result=result,
        thinking_time_remaining=dict(zip(TEAMS, clock, strict=True)),
    )
    return converted if state.doubles is None else _doubles_from(state, state.doubles, converted)


def _doubles_from(state: State4, doubles: Doubles4, converted: StateMessage) -> DoublesMessage:
    """Convert a state of mixed doubles, with its additional fields."""
    ends = doubles.power_play_end
    had = zip(TEAMS, (ends.team0, ends.team1), strict=True)
    decides, side = doubles.end_setup_team, None
    if state.end_number == (ends.team1 if decides == TEAMS[1] else ends.team0):
        # Nothing but a guard moves before the first shot; later the side is not needed.
        places = [at for team in state.stone_coordinate.data.values() for at in team[:1]]
        side = "left" if any(at.x < 0 for at in places) else "right"
    return DoublesMessage(
        **{name: getattr(converted, name) for name in StateMessage.__struct_fields__},
        decides=decides,
        is_placed=not state.awaits_placement,
        side=side,
        power_plays=[team for team, end in had if end is not None],
    )


def _stones_from(state: State4) -> PerTeam:
    slots: list[list[StoneMessage | None]] = []
    for team in TEAMS:
        places = state.stone_coordinate.data.get(team, [])
        found = [StoneMessage(position=at) if at.x or at.y else None for at in places]
        if state.doubles is not None:
            delivered = found[1 : STONES_OF_DOUBLES + 1]
            found = delivered + [None] * (STONES_OF_DOUBLES - len(delivered)) + found[:1]
        slots.append(found + [None] * (STONES_PER_TEAM - len(found)))
    return PerTeam(*slots)


# --- from the words of version 3 ------------------------------------------------------------------


def shot_of(move: ShotMessage, spin: float | None = None) -> Shot4:
    """Convert a shot of version 3 to version 4.

    Parameters
    ----------
    move : the shot
    spin : its spin, ccw positive, if it is not ±π/2 [rad/s]
    """
    x, y = move.velocity.x, move.velocity.y
    side = 1.0 if move.rotation == "cw" else -1.0
    return Shot4(
        translational_velocity=math.hypot(x, y),
        shot_angle=math.atan2(y, x),
        angular_velocity=side * SPINS[1] if spin is None else -spin,
    )


def request_of(side: Side | None, throws_first: bool) -> Request4:
    """Return the request of a team that decides on the placement."""
    if side is not None:
        return "pp_left" if side == "left" else "pp_right"
    return "center_guard" if throws_first else "center_house"


def placement_of(request: Request4) -> tuple[Side | None, bool]:
    """Return the side of a power play, and whether the team throws first, without the hammer."""
    if request in ("pp_left", "pp_right"):
        return ("left" if request == "pp_left" else "right"), False
    return None, request == "center_guard"


def state_of(
    update: dict[str, Any],
    names: tuple[str, str],
    *,
    last_move: Shot4 | None,
    clocks: tuple[Sequence[float], Sequence[float]],
    doubles: Doubles4 | None = None,
) -> dict[str, Any]:
    """Return an update of a hosted game as a state of version 4.

    Parameters
    ----------
    update : update for clients of version 3
    names : names of the teams
    last_move : the shot before, as executed
    clocks : time left to both teams for the game, and for an extra end [s]
    doubles : additional state of mixed doubles
    """
    state = update["state"]
    scores, extra = state["scores"], state["extra_end_score"]
    result = state["game_result"]
    score = {team: [*(p or 0 for p in scores[team]), extra[team] or 0] for team in TEAMS}
    game, extra_end = clocks
    settings = None if doubles is None else msgspec.to_builtins(doubles)
    # Before an end of mixed doubles is set up it has no shot numbers.
    waits = doubles is not None and update["next_team"] is None and result is None
    total = None if waits else state["shot"]
    # The setting has two names, current and former.
    return {
        "winner_team": None if result is None else result["winner"],
        "first_team_name": names[0],
        "second_team_name": names[1],
        "end_number": state["end"],
        "shot_number": None if total is None else total // 2,
        "team_shot_number": None if total is None else total // 2,
        "total_shot_number": total,
        "next_shot_team": update["next_team"],
        "first_team_remaining_time": game[0],
        "second_team_remaining_time": game[1],
        "first_team_extra_end_remaining_time": extra_end[0],
        "second_team_extra_end_remaining_time": extra_end[1],
        "mix_doubles_settings": settings,
        "mixed_doubles_settings": settings,
        "last_move": None if last_move is None else msgspec.to_builtins(last_move),
        "stone_coordinate": {"data": coordinates_of(state["stones"], doubles=doubles is not None)},
        "score": score,
    }


def coordinates_of(
    stones: dict[str, list[Any]], *, doubles: bool = False
) -> dict[str, list[dict[str, float]]]:
    """Return the places of stones by team and slot; (0, 0) for none.

    Parameters
    ----------
    stones : stones by team and slot, null for none
    doubles : true for mixed doubles
    """
    nowhere = {"x": 0.0, "y": 0.0}
    places = {
        team: [nowhere if stone is None else stone["position"] for stone in slots]
        for team, slots in stones.items()
    }
    if not doubles:
        return places
    placed = STONES_OF_DOUBLES
    return {team: [slots[placed], *slots[:placed]] for team, slots in places.items()}
