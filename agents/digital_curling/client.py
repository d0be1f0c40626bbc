"""Client side of the protocol: the answer to each line of Digital Curling's server."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from agents.digital_curling.conversation import (
    PROTOCOL,
    ClientLine,
    Dc,
    DcOk,
    GameMessage,
    GameOver,
    IsReady,
    MoveLine,
    NewGame,
    ReadyOk,
    ServerLine,
    Update,
)
from agents.digital_curling.conversion import game_of, move_of, rules_of, skill_of
from agents.digital_curling.messages import (
    TEAMS,
    ConcedeMessage,
    Move,
    Point,
    ResultMessage,
    ShotMessage,
)
from agents.digital_curling.time_manager import TimeManager
from agents.digital_curling.transition import fcv1_ice
from curling_env.errors import InputError
from curling_env.game import Call, Player, PlayerView
from curling_env.game.rules import Game, Lines, RestingStone, RuleSet, Team, begin_end, new_game
from curling_env.game.rules.rulesets import Side
from curling_env.game.simulator import direction_of
from curling_env.ice import Ice
from curling_env.throw import FROM_HACK, MAX_SPEED, Delivery, Skill

PLAYER_ORDER = [0, 1, 2, 3]
"""Lead to fourth: each player in the server's order."""
NO_CLOCK = 3600.0
"""Assumed time left if the server sends none [s]."""


@dataclass(frozen=True, kw_only=True)
class SeenMove:
    """Move as reported by an `update`.

    Parameters
    ----------
    before : the game before the move
    move : the move as executed
    call : the called throw, if it was the own team's
    after : the game afterwards; after the last stone of an end, the first state of the next one
    foul : true if the server put the stones back
    """

    before: Game
    move: Move
    call: Call | None
    after: Game
    foul: bool


class Client:
    """Client that plays for a team, line by line, independent of the network.

    Parameters
    ----------
    player : player that decides
    name : name of the team; by default the player's
    seed : seed of the player's random numbers
    ice : ice that the player believes in; by default Digital Curling's law on a sheet of the
        server's width
    remark : called with remarks for the user
    rule_name : name of the server's rules
    """

    def __init__(
        self,
        player: Player,
        *,
        name: str | None = None,
        seed: int = 0,
        ice: Ice | None = None,
        remark: Callable[[str], None] = lambda text: None,
        rule_name: str = "digital_curling",
    ) -> None:
        self.name = (name or player.name)[:200]
        self.player, self.seed, self.remark = player, seed, remark
        self.time_manager = TimeManager(player)
        self.team = Team.HOME
        self.names: tuple[str, str] = ("team0", "team1")
        self.game_id = ""
        self.result: ResultMessage | None = None
        self.seen: list[SeenMove] = []
        self.game: Game | None = None
        self.is_over = False
        self._ice, self._setting = ice, GameMessage().known_setting
        self._rule_name, self._arrangement = rule_name, 0
        self._rules, self._lines = rules_of(self._setting, name=rule_name), Lines()
        self._skills: list[Skill] = []
        self._ice_changes = False
        self._deliveries: list[Delivery] = []
        self._called: Call | None = None
        self._server_ends: int | None = None

    @property
    def ice(self) -> Ice:
        """Ice that the player believes in."""
        return fcv1_ice(self._lines.width) if self._ice is None else self._ice

    @property
    def rules(self) -> RuleSet:
        """Rules of the game."""
        return self._rules

    def answer(self, line: ServerLine) -> ClientLine | None:
        """Return the answer to a line, or None if none is expected.

        Raises
        ------
        InputError : a line that does not fit the state of the protocol
        """
        match line:
            case Dc():
                return self._greet(line)
            case IsReady():
                return self._prepare(line)
            case NewGame():
                home, away = (line.name.get(team, team) for team in TEAMS)
                self.names = (home, away)
            case Update():
                return self._move(line)
            case GameOver():
                self.is_over = True
        return None

    def place(self) -> str:
        """Return the current point of the game, for a message."""
        end = None if self.game is None else self.game.end
        if end is None:
            return "before the first stone" if self.game is None else "between ends"
        return f"end {end.number + 1}, stone {end.delivered + 1}"

    def use_rules(self, name: str, arrangement: int = 0) -> None:
        """Use another set of rules, before the game is announced.

        Parameters
        ----------
        name : its name
        arrangement : arrangement of the placed stones, in mixed doubles
        """
        self._rule_name, self._arrangement = name, arrangement

    def placement(self) -> tuple[Side | None, bool]:
        """Return the team's choice for the coming end of mixed doubles.

        Returns
        -------
        the side of a power play or None, and whether it throws first, without the hammer

        Raises
        ------
        InputError : no end waits for a placement
        """
        game = self.game
        if game is None or game.end is not None or game.is_over:
            raise InputError("no end waits for a placement")
        view = self._view(game)
        side = self.player.power_play(view) if game.may_power_play else None
        return side, side is None and self.player.throws_first(view)

    def thrown_away(self) -> ShotMessage:
        """Return a shot that touches nothing, for servers without concession."""
        return ShotMessage(velocity=Point(0.0, 1.0), rotation="cw")

    # --- its answers ------------------------------------------------------------------------------

    def _greet(self, line: Dc) -> DcOk:
        if line.version.major != PROTOCOL:
            raise InputError(
                f"the server speaks version {line.version.major} of the protocol; "
                f"expected {PROTOCOL}",
                where="version",
            )
        self.game_id = line.game_id
        return DcOk(name=self.name)

    def _prepare(self, line: IsReady) -> ReadyOk:
        """Process the announced game, compile and plan."""
        game = line.game
        if game.rule != "normal":
            raise InputError(f"expected the rule normal, found {game.rule[:40]!r}", where="rule")
        self.team = Team(TEAMS.index(line.team))
        self._setting = game.known_setting
        self._server_ends = self._setting.max_end
        self._set_rules(self._rules_with())
        self._ice_changes = game.simulator_type != "fcv1"
        if self._ice is None and self._ice_changes:
            self.remark(
                f"the server simulates {game.simulator_type[:40]!r}, but plans assume fcv1; give "
                "--ice to plan for another ice"
            )
        players = game.players_of(line.team)
        order = [players[k] if k < len(players) else None for k in PLAYER_ORDER]
        self._skills = [skill_of(player) for player in order]
        self._deliveries = [
            FROM_HACK
            if player is None or player.type == "identical"
            else replace(FROM_HACK, max_speed=min(player.max_speed, MAX_SPEED))
            for player in order
        ]
        self.time_manager.prepare([self._view(example) for example in self._examples()])
        return ReadyOk(player_order=PLAYER_ORDER)

    def see(self, line: Update) -> None:
        """Register a position that needs no answer.

        Raises
        ------
        InputError : an impossible position, or one before the game is announced
        """
        if not self._skills:
            raise InputError("received an update before is_ready")
        state = line.state
        if self._server_ends is None:
            self._server_ends = max(len(state.scores.team0), 1)
            ends = self._server_ends
            self._set_rules(self._rules_with(ends))
        before = self.game
        self.game = _remembering(game_of(state, self._rules, self._lines), before)
        if line.last_move is not None and before is not None and before.end is not None:
            own = before.end.to_throw is self.team
            self.seen.append(
                SeenMove(
                    before=before,
                    move=line.last_move.actual_move,
                    call=self._called if own else None,
                    after=self.game,
                    foul=line.last_move.free_guard_zone_foul,
                )
            )
        self._called = None
        self.result = state.game_result

    def _move(self, line: Update) -> MoveLine | None:
        self.see(line)
        state = line.state
        if self.game is None or state.game_result is not None or line.next_team != TEAMS[self.team]:
            return None
        end = self.game.end
        if end is None or end.to_throw is not self.team:
            raise InputError(f"it is not the turn of {line.next_team}", where="next_team")
        view = self._view(self.game)
        if self.player.concedes(view):
            return MoveLine(move=ConcedeMessage())
        left = state.thinking_time_remaining.get(TEAMS[self.team], NO_CLOCK)
        self._called = self.time_manager.call(view, left)
        return MoveLine(move=move_of(self._called.throw))

    # --- what the player sees ---------------------------------------------------------------------

    def _rules_with(self, ends: int | None = None) -> RuleSet:
        return rules_of(self._setting, ends, name=self._rule_name, arrangement=self._arrangement)

    def _set_rules(self, rules: RuleSet) -> None:
        self._rules, self._lines = rules, rules.lines(width=self._setting.sheet_width)

    def _view(self, game: Game) -> PlayerView:
        """Return the game as the player sees it, with the same random numbers as in `curling
        play`.
        """
        end = game.end
        number = len(game.line_score) if end is None else end.number
        delivered = 0 if end is None else end.delivered
        thrower = min(delivered // 4, len(self._skills) - 1)
        if self._rules.placed_stones:
            thrower = self._rules.throwers[delivered // 2]
        return PlayerView(
            game=game,
            team=self.team,
            ice=self.ice,
            direction=direction_of(number),
            skill=self._skills[thrower],
            entropy=(self.seed, number * self._rules.deliveries + delivered, self.team + 1),
            delivery=self._deliveries[thrower],
            ice_changes=self._ice_changes,
            ice_is_estimated=self._ice is not None,
        )

    def _examples(self) -> list[Game]:
        """Return positions of both ends of the sheet, with stones and without, for each thrower."""
        first = begin_end(new_game(self._rules, self._lines))
        assert first.end is not None
        other = self.team.other
        stones = (
            RestingStone(other, 0, 0.1, -2.8),
            RestingStone(self.team, 0, -0.3, 0.2),
            RestingStone(other, 1, 0.4, 0.5),
        )
        games: list[Game] = []
        for number in range(min(2, self._rules.ends)):
            for thrower in range(len(PLAYER_ORDER)):
                delivered = self._rules.deliveries // 4 * thrower
                delivered += (delivered % 2 == 1) != (self.team is first.end.hammer)
                end = replace(first.end, number=number, delivered=delivered)
                lying = stones if thrower else first.end.stones
                games.append(replace(first, end=replace(end, stones=lying)))
        return games


def _remembering(game: Game, before: Game | None) -> Game:
    """Return the game, with mixed-doubles data from earlier positions."""
    if before is None or not game.rules.placed_stones:
        return game
    known = (*before.hammers, *(() if before.end is None else (before.end.hammer,)))
    game = replace(game, hammers=(*known, *game.hammers[len(known) :])[: len(game.hammers)])
    if game.end is None or before.end is None or game.end.number != before.end.number:
        return game
    return replace(game, end=replace(game.end, power_play=before.end.power_play))
