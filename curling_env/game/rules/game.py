"""End and game, from the first stone to the last: immutable states and pure functions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from curling_env.errors import InputError
from curling_env.game.rules.delivery import Result, Ruling, rule_on
from curling_env.game.rules.lines import Lines
from curling_env.game.rules.rulesets import GuardPlace, RuleSet, Side, placed_stones
from curling_env.game.rules.scoring import hammer_after, score_of
from curling_env.game.rules.teams import Stones, Team


@dataclass(frozen=True, kw_only=True, slots=True)
class End:
    """End in play.

    Parameters
    ----------
    number : number of the end, from 0
    hammer : the team that delivers last
    stones : stones on the sheet
    delivered : number of stones delivered by both teams
    power_play : the side of a power play in this end, or None
    """

    number: int = 0
    hammer: Team = Team.AWAY
    stones: Stones = ()
    delivered: int = 0
    power_play: Side | None = None

    @property
    def to_throw(self) -> Team:
        """The team that delivers next."""
        return self.hammer if self.delivered % 2 else self.hammer.other

    @property
    def number_of_stone(self) -> int:
        """Number, from 0, of the stone that this team delivers next."""
        return self.delivered // 2


@dataclass(frozen=True, kw_only=True, slots=True)
class Game:
    """Game between two teams.

    Parameters
    ----------
    rules : the rules played by
    lines : lines of the sheet
    end : the end in play; None between ends and after the last
    line_score : points of home and away in each complete end
    hammers : the team that had the hammer in each complete end
    last_stone : the team with the hammer in the next end (mixed doubles: with the decision on the
        placement)
    power_plays : teams that had their power play
    conceded : the team that conceded, or None
    """

    rules: RuleSet
    lines: Lines = field(default_factory=Lines)
    end: End | None = None
    line_score: tuple[tuple[int, int], ...] = ()
    hammers: tuple[Team, ...] = ()
    last_stone: Team = Team.AWAY
    power_plays: tuple[Team, ...] = ()
    conceded: Team | None = None

    @property
    def score(self) -> tuple[int, int]:
        """Points of home and away up to now."""
        return sum(home for home, _ in self.line_score), sum(away for _, away in self.line_score)

    def lead(self, team: Team) -> int:
        """Return the points by which a team leads; negative when it is behind."""
        if not self.line_score:
            return 0
        other = team.other
        return sum(end[team] - end[other] for end in self.line_score)

    @property
    def ends_left(self) -> int:
        """Number of scheduled ends not yet complete, including the one in play."""
        return max(self.rules.ends - len(self.line_score), 0)

    @property
    def is_extra_end(self) -> bool:
        """Return whether the end in play, or the next one, is an extra end."""
        return len(self.line_score) >= self.rules.ends

    @property
    def is_over(self) -> bool:
        """Return whether the game has ended: by its score, by concession, or tied after all extra
        ends.
        """
        if self.conceded is not None:
            return True
        played = len(self.line_score)
        if self.end is not None or played < self.rules.ends:
            return False
        limit = self.rules.max_extra_ends
        return self.lead(Team.HOME) != 0 or (
            limit is not None and played >= self.rules.ends + limit
        )

    @property
    def may_power_play(self) -> bool:
        """Return whether the deciding team may have a power play in the next end."""
        free = self.rules.power_play and self.last_stone not in self.power_plays
        return free and self.end is None and not self.is_extra_end

    @property
    def winner(self) -> Team | None:
        """The team that won; None while the game is undecided, and for a tie."""
        if self.conceded is not None:
            return self.conceded.other
        if not self.is_over or self.lead(Team.HOME) == 0:
            return None
        return Team.HOME if self.lead(Team.HOME) > 0 else Team.AWAY


def new_game(rules: RuleSet, lines: Lines | None = None, *, last_stone: Team = Team.AWAY) -> Game:
    """Return a game before its first end.

    Parameters
    ----------
    rules : the rules to play by
    lines : lines of the sheet; by default of a sheet by World Curling's rules
    last_stone : the team with the hammer in the first end (mixed doubles: with the decision on the
        placement)
    """
    return Game(rules=rules, lines=lines or rules.lines(), last_stone=last_stone)


def begin_end(
    game: Game,
    *,
    power_play: Side | None = None,
    throw_first: bool = False,
    guard: GuardPlace = "middle",
) -> Game:
    """Begin the next end.

    Parameters
    ----------
    game : a game between two ends
    power_play : mixed doubles: the side on which the deciding team has its power play, or None
    throw_first : mixed doubles: true if the deciding team takes the guard and throws first
    guard : mixed doubles: the place of the guard

    Raises
    ------
    InputError : the game is over, an end is in play, or a decision that these rules do not allow
    """
    rules = game.rules
    if game.is_over or game.end is not None:
        raise InputError("the game is over" if game.is_over else "an end is already in play")
    decides = game.last_stone
    if throw_first and not rules.placed_stones:
        raise InputError(f"{rules.name} allows no choice of the first throw")
    if power_play is not None:
        if power_play not in ("left", "right"):
            raise InputError(f"power_play must be 'left', 'right' or None, got {power_play!r}")
        if not rules.power_play:
            raise InputError(f"{rules.name} has no power play")
        if decides in game.power_plays:
            raise InputError(f"the {decides.label} team has had its power play")
        if game.is_extra_end:
            raise InputError("there is no power play in an extra end")
        if throw_first:
            raise InputError("the team with the power play has the last stone")
    hammer = decides.other if throw_first else decides
    stones: Stones = ()
    if rules.placed_stones:
        stones = placed_stones(rules, game.lines, hammer, power_play=power_play, guard=guard)
    end = End(number=len(game.line_score), hammer=hammer, stones=stones, power_play=power_play)
    had = (*game.power_plays, decides) if power_play is not None else game.power_plays
    return replace(game, end=end, power_plays=had)


def deliver(
    game: Game, result: Result, *, put_back: Callable[[Ruling], bool] | None = None
) -> tuple[Game, Ruling]:
    """Play one delivery.

    Parameters
    ----------
    game : a game with an end in play
    result : result of the delivered stone
    put_back : the opponent's choice after a tick: true puts the stones back, false leaves them; by
        default they are put back

    Returns
    -------
    the game after the delivery, between ends if this was the last stone of one; and the ruling

    Raises
    ------
    InputError : no end is in play, or a result that does not fit its stones
    """
    end = game.end
    if end is None:
        raise InputError("no end is in play")
    ruling = rule_on(game.rules, game.lines, end.stones, end.to_throw, end.delivered, result)
    stones = ruling.stones
    if ruling.option is not None and (put_back is None or put_back(ruling)):
        stones = ruling.option
    after = End(
        number=end.number,
        hammer=end.hammer,
        stones=stones,
        delivered=end.delivered + 1,
        power_play=end.power_play,
    )
    if after.delivered < game.rules.deliveries and not _is_decided(game, after):
        return _with_end(game, after), ruling
    score = score_of(game.rules, game.lines, stones)
    return (
        replace(
            game,
            end=None,
            line_score=(*game.line_score, score),
            hammers=(*game.hammers, end.hammer),
            last_stone=_decides_next(game, end.hammer, score),
        ),
        ruling,
    )


def _decides_next(game: Game, hammer: Team, score: tuple[int, int]) -> Team:
    """Return the team with the hammer in the next end, or in mixed doubles with the decision on the
    placement.
    """
    if score == (0, 0) and game.rules.blank_passes_decision:
        return game.last_stone.other
    return hammer_after(game.rules, hammer, score)


def _with_end(game: Game, end: End) -> Game:
    """Return the game with another end in play; `replace` would take three times as long."""
    return Game(
        rules=game.rules,
        lines=game.lines,
        end=end,
        line_score=game.line_score,
        hammers=game.hammers,
        last_stone=game.last_stone,
        power_plays=game.power_plays,
        conceded=game.conceded,
    )


def _is_decided(game: Game, end: End) -> bool:
    """Return whether, in the last end or an extra end, a team can no longer catch up.

    Play stops then, and the stones count as they are.
    """
    if not game.rules.stops_when_decided or end.number < game.rules.ends - 1:
        return False
    margin = game.lead(Team.HOME)
    if margin == 0:
        return False
    behind = Team.AWAY if margin > 0 else Team.HOME
    to_come = stones_left(game.rules, end, behind)
    lying = sum(1 for stone in end.stones if stone.team is behind)
    return to_come + lying < abs(margin)


def stones_left(rules: RuleSet, end: End, team: Team) -> int:
    """Return the number of stones that a team still has to deliver in an end."""
    first = team is end.hammer.other
    return rules.stones - (end.delivered + first) // 2


def may_concede(game: Game, team: Team) -> bool:
    """Return whether a team may concede: after enough complete ends, at its turn or between ends.

    Source
    ------
    World Curling rules of competition, C3: when it is the conceding team's turn to deliver, and
    after six complete ends in a round robin.
    """
    if game.is_over or len(game.line_score) < game.rules.ends_before_concession:
        return False
    return game.end is None or game.end.to_throw is team


def concede(game: Game, team: Team) -> Game:
    """Return the game won by the opponent of a conceding team; the end in play does not count.

    Raises
    ------
    InputError : the team may not concede now
    """
    if not may_concede(game, team):
        raise InputError(
            f"the {team.label} team may concede at its turn and after "
            f"{game.rules.ends_before_concession} complete ends"
        )
    return replace(game, end=None, conceded=team)
