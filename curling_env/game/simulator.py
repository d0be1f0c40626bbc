"""Simulator of games: throws are played under the rules, on changing ice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from curling_env.errors import InputError
from curling_env.game.ice_evolution import NO_EVOLUTION, IceEvolution, ice_for_game
from curling_env.game.players import Call, Player, PlayerView, SweepInterval
from curling_env.game.rules.delivery import Result, Ruling
from curling_env.game.rules.game import End, Game, begin_end, deliver, new_game
from curling_env.game.rules.rulesets import RuleSet, Side, rule_set
from curling_env.game.rules.teams import STONES_PER_TEAM, RestingStone, Stones, Team
from curling_env.game.state import GameState, ThrowRng
from curling_env.game.team_judgement import PERFECT_JUDGEMENT, TeamJudgement, sweep_for
from curling_env.ice import Ice, load_ice
from curling_env.physics.engine import Engine, Outcome, Status, StoneState
from curling_env.physics.tuning import FINE_TOLERANCE
from curling_env.physics.wear import PATH_FPS, wear_along_path, wear_of, worn
from curling_env.sheet import TEE_Y, Direction
from curling_env.throw import (
    FROM_HOG_LINE,
    MAX_SPEED,
    MAX_SPIN,
    MIN_SPEED,
    Delivery,
    Skill,
    Throw,
    skill_named,
)
from curling_env.typing import Floats

_GONE = (Status.OUT_SIDE, Status.OUT_BACK)
Place = Sequence[float]
"""Position x and y of a stone [m]."""


def direction_of(end: int) -> Direction:
    """Return the direction of play of an end of the game: the away end first."""
    return Direction.HOME if end % 2 else Direction.AWAY


@dataclass(frozen=True, kw_only=True)
class PlayedShot:
    """Delivery and its consequences.

    Parameters
    ----------
    end, number : number of the end in the game, and of the delivery in the end, from 0
    team : the team that delivered
    stone : identifier of the stone
    call : the player's call
    thrown : executed throw, with its execution error
    sweep : interval of sweeping; equal times if it was not swept
    direction : the end played to
    outcome : outcome of the physics, sheet frame
    ruling : ruling of the rules, delivery frame
    put_back : true if the stones were put back after a tick
    """

    end: int
    number: int
    team: Team
    stone: int
    call: Call
    thrown: Throw
    sweep: SweepInterval
    direction: Direction
    outcome: Outcome
    ruling: Ruling
    put_back: bool = False

    @property
    def stones_after(self) -> Stones:
        """Stones on the sheet afterwards, delivery frame."""
        option = self.ruling.option
        return option if self.put_back and option is not None else self.ruling.stones


def skill_by_stone(rules: RuleSet, players: Sequence[Skill]) -> tuple[Skill, ...]:
    """Return the skill behind each of a team's stones, in order of delivery.

    Parameters
    ----------
    rules : rules of the game, which say who delivers which stone
    players : one skill for the team, or one for each of its players

    Raises
    ------
    InputError : skills for another number of players
    """
    count = max(rules.throwers) + 1
    if len(players) not in (1, count):
        problem = f"expected one skill, or one for each of {count} players"
        raise InputError(f"{problem}, got {len(players)}")
    return tuple(players[number % len(players)] for number in rules.throwers)


class GameSimulator:
    """Simulator of throws of games; it holds no game.

    Parameters
    ----------
    ice : ice at the start of a game: an `Ice`, a file or a preset
    known_ice : ice as the players know it; by default the ice at the start of a game
    rules : a set of rules or its name
    skills : execution errors of the home and the away team, or one for both
    ice_evolution : changes of the ice during a game
    sweeping : allow sweeping; ice without that effect gets the standard one
    delivery : start, spin and maximum speed of throws
    throwers : execution errors of the two teams' throwers, for each stone of a team in order of
        delivery; by default `skills` for all
    tolerance : maximum error of a lone stone's rest on the roughest ice [m]
    judgement : errors of teams in reading the ice and sweeping

    Raises
    ------
    InputError : an unknown ice, set of rules or skill, or a stone without a thrower
    """

    def __init__(
        self,
        ice: str | Path | Ice = "standard",
        *,
        known_ice: str | Path | Ice | None = None,
        rules: str | RuleSet = "world_curling_2024",
        skills: str | Skill | tuple[str | Skill, str | Skill] = "none",
        ice_evolution: IceEvolution = NO_EVOLUTION,
        sweeping: bool = False,
        delivery: Delivery = FROM_HOG_LINE,
        throwers: tuple[Sequence[Skill], Sequence[Skill]] | None = None,
        tolerance: float = FINE_TOLERANCE,
        judgement: TeamJudgement = PERFECT_JUDGEMENT,
    ) -> None:
        self.ice = load_ice(ice)
        self.known_ice = self.ice if known_ice is None else load_ice(known_ice)
        self.rules = rule_set(rules)
        pair = skills if isinstance(skills, tuple) else (skills, skills)
        self.skills = (skill_named(pair[0]), skill_named(pair[1]))
        self.ice_evolution = ice_evolution
        self.sweeping = sweeping
        self.delivery = delivery
        self.throwers = throwers
        if throwers is not None and min(map(len, throwers)) < self.rules.stones:
            raise InputError(f"expected a thrower for each of {self.rules.stones} stones of a team")
        self.lines = self.rules.lines(
            width=self.ice.sheet.width, stone_radius=self.ice.stone.radius
        )
        self._initial_ice = ice_for_game(self.ice, self.ice_evolution, 0, sweeping=sweeping)
        self.ice_wears = wear_along_path(self._initial_ice) != 0.0
        """True if stones change the ice along their paths."""
        self.judgement = judgement
        self._ice_changes = ice_evolution != NO_EVOLUTION or judgement != PERFECT_JUDGEMENT
        self._read: dict[tuple[int, Team, int], Ice] = {}
        self._tolerance = tolerance
        self._rng = ThrowRng()
        self._engine: tuple[int, Engine] | None = None

    # --- the course of a game ---------------------------------------------------------------------

    def new_game(self, seed: int, *, last_stone: Team = Team.AWAY) -> GameState:
        """Return a game before its first end; `last_stone` has the hammer in it."""
        return GameState(game=new_game(self.rules, self.lines, last_stone=last_stone), seed=seed)

    def begin_end(
        self, state: GameState, *, power_play: Side | None = None, throw_first: bool = False
    ) -> GameState:
        """Return the game with its next end started.

        Parameters
        ----------
        state : a game between two ends
        power_play, throw_first : decisions in mixed doubles, as in `game.rules.game.begin_end`

        Raises
        ------
        InputError : a decision that these rules do not allow
        """
        game = begin_end(state.game, power_play=power_play, throw_first=throw_first)
        return replace(state, game=game)

    def begin_end_as(self, state: GameState, decider: Player) -> GameState:
        """Return the game with its next end started by the decisions of the deciding team's
        player.
        """
        game, side, first = state.game, None, False
        view = self.view(state, game.last_stone)
        if game.may_power_play:
            side = decider.power_play(view)
        if game.rules.placed_stones and side is None:
            first = decider.throws_first(view)
        return self.begin_end(state, power_play=side, throw_first=first)

    def view(self, state: GameState, team: Team | None = None) -> PlayerView:
        """Return the view of a team, by default of the team to throw."""
        end = state.game.end
        if team is None:
            team = state.game.last_stone if end is None else end.to_throw
        number = len(state.game.line_score) if end is None else end.number
        return PlayerView(
            game=state.game,
            team=team,
            ice=self.ice_as_read(state.seed, team, number),
            direction=direction_of(number),
            skill=self.skill_of(team, 0 if end is None else end.number_of_stone),
            entropy=(state.seed, state.throws, team + 1),
            delivery=self.delivery,
            clock=state.clock,
            ice_changes=self._ice_changes,
            ice_is_estimated=self.known_ice is not self.ice,
            wear=state.wear,
        )

    def ice_as_read(self, seed: int, team: Team, end: int) -> Ice:
        """Return the ice as a team reads it in an end; the same object during the end."""
        if not self.judgement.misreads:
            return self.known_ice
        key = seed, team, end
        if key not in self._read:
            if len(self._read) >= 2:
                self._read.clear()
            self._read[key] = self.judgement.ice_as_read(self.known_ice, seed, team, end)
        return self._read[key]

    def skill_of(self, team: Team, number: int) -> Skill:
        """Return the execution error of the thrower of that stone of a team, counted from 0."""
        return self.skills[team] if self.throwers is None else self.throwers[team][number]

    def play(
        self,
        state: GameState,
        call: Call,
        *,
        opponent: Player | None = None,
        paths: bool = False,
    ) -> tuple[GameState, PlayedShot]:
        """Play one delivery.

        Parameters
        ----------
        state : a game with an end in play
        call : call of the team to throw
        opponent : the player who decides after a tick; without one the stones are put back
        paths : keep the stones' paths, 30 samples a second

        Returns
        -------
        the game after the delivery, and the delivery

        Raises
        ------
        InputError : no end is in play
        """
        end = state.game.end
        if end is None:
            raise InputError("no end is in play")
        team, number, direction = end.to_throw, end.number_of_stone, direction_of(end.number)
        thrown = self.with_execution_error(call.throw, self.skill_of(team, number), state)
        stone = STONES_PER_TEAM * team + number
        sweep = self.sweep_interval(
            call,
            thrown,
            direction,
            read=self.ice_as_read(state.seed, team, end.number),
            misjudged=self.judgement.sweepers_error(state.seed, state.throws),
        )
        outcome = self._engine_for(state).play(
            thrown.release(
                direction,
                stone=stone,
                clock=state.clock,
                order=state.throws,
                sweep=sweep,
                delivery=self.delivery,
            ),
            [state_on_sheet(lying, direction) for lying in end.stones],
            fps=PATH_FPS if paths or self.ice_wears else None,
            throw=state.throws,
        )
        are_put_back = False

        def put_back(ruling: Ruling) -> bool:
            nonlocal are_put_back
            view = self.view(state, team.other)
            are_put_back = opponent is None or opponent.puts_back(view, ruling)
            return are_put_back

        game, ruling = deliver(state.game, _result(end, outcome, direction), put_back=put_back)
        wear = state.wear
        if self.ice_wears:
            added = wear_of(self._initial_ice, [path.xy for path in outcome.trajectories])
            wear = added if wear is None else wear + added
        return self.after(state, game, wear), PlayedShot(
            end=end.number,
            number=end.delivered,
            team=team,
            stone=stone,
            call=call,
            thrown=thrown,
            sweep=sweep,
            direction=direction,
            outcome=outcome,
            ruling=ruling,
            put_back=are_put_back,
        )

    def after(self, state: GameState, game: Game, wear: Floats | None = None) -> GameState:
        """Return the state after one more delivery."""
        return GameState(
            game=game,
            seed=state.seed,
            throws=state.throws + 1,
            clock=state.clock + self.ice_evolution.pace,
            wear=wear,
        )

    # --- execution error, sweeping, ice -----------------------------------------------------------

    def with_execution_error(self, meant: Throw, skill: Skill, state: GameState) -> Throw:
        """Return the executed throw; its error follows from the state's seed and throw."""
        if skill.is_exact:
            return replace(meant, speed=min(meant.speed, self.delivery.max_speed))
        x, speed, angle, spin = self.with_execution_errors([meant], [skill], [state])[0].tolist()
        return Throw(speed=speed, angle=angle, spin=spin, x=x)

    def with_execution_errors(
        self, meant: Sequence[Throw], skills: Sequence[Skill], states: Sequence[GameState]
    ) -> Floats:
        """Return many executed throws, (n, 4): x [m], speed [m/s], angle, spin [rad/s]."""
        out = np.array([(throw.x, throw.speed, throw.angle, throw.spin) for throw in meant])
        np.minimum(out[:, 1], self.delivery.max_speed, out=out[:, 1])
        at = self._rng.at
        out[:, 1:] += [
            (0.0, 0.0, 0.0) if skill.is_exact else skill.error(at(state.seed, state.throws))
            for skill, state in zip(skills, states, strict=True)
        ]
        out[:, 1] = np.clip(out[:, 1], MIN_SPEED, MAX_SPEED)
        out[:, 3] = np.clip(out[:, 3], -MAX_SPIN, MAX_SPIN)
        return out

    def sweep_interval(
        self,
        call: Call,
        thrown: Throw,
        direction: Direction,
        *,
        read: Ice | None = None,
        misjudged: float = 0.0,
    ) -> SweepInterval:
        """Return the times of sweeping: as called, else as the sweepers judge; equal times if
        never.

        Parameters
        ----------
        call, thrown : the call, and the executed throw
        direction : the end played to
        read : ice for which the team called the throw; by default the known ice
        misjudged : sweepers' error of the unswept stone's distance, positive if too far [m]
        """
        if not self.sweeping:
            return (0.0, 0.0)
        if call.sweep is not None:
            return call.sweep
        return sweep_for(
            self.known_ice,
            call.throw,
            thrown,
            direction,
            delivery=self.delivery,
            read=read,
            misjudged=misjudged,
        )

    def current_ice(self, state: GameState) -> Ice:
        """Return the current ice of a game."""
        ice = ice_for_game(self.ice, self.ice_evolution, state.seed, sweeping=self.sweeping)
        return worn(ice, state.wear)

    def _engine_for(self, state: GameState) -> Engine:
        if state.wear is not None:
            return Engine(self.current_ice(state), tolerance=self._tolerance)
        seed = state.seed if self.ice_evolution.stone_spread else 0
        if self._engine is None or self._engine[0] != seed:
            self._engine = seed, Engine(self.current_ice(state), tolerance=self._tolerance)
        return self._engine[1]


def state_on_sheet(lying: RestingStone, direction: Direction) -> StoneState:
    """Return a resting stone in the sheet frame."""
    return StoneState(x=direction * lying.x, y=direction * (lying.y + TEE_Y), stone=lying.stone)


def result_of_places(
    end: End, moved: Mapping[int, Place | None], thrown: Place | None, struck: bool
) -> Result:
    """Return the result of a delivery for the rules, from the places of rest of the stones.

    Parameters
    ----------
    end : the end before the delivery
    moved : (x, y) of its moved stones, by their index, delivery frame [m]; None or NaN for a stone
        that left play. The others keep their exact place
    thrown : the same for the delivered stone
    struck : true if the delivered stone touched another
    """
    after: list[RestingStone | None] = [*end.stones]
    for k, place in moved.items():
        before = end.stones[k]
        after[k] = _resting_stone(before.team, before.number, place)
    after.append(_resting_stone(end.to_throw, end.number_of_stone, thrown))
    return Result(tuple(after), struck)


def _resting_stone(team: Team, number: int, place: Place | None) -> RestingStone | None:
    if place is None or place[0] != place[0]:
        return None
    return RestingStone(team, number, place[0], place[1])


def _result(end: End, outcome: Outcome, direction: Direction) -> Result:
    last = len(end.stones)
    places = [
        None if status in _GONE else (direction * stone.x, direction * stone.y - TEE_Y)
        for stone, status in zip(outcome.stones, outcome.status, strict=True)
    ]
    moved = {k: places[k] for k in range(last) if outcome.ends[k] != 0.0}
    struck = any(last in (contact.first, contact.second) for contact in outcome.contacts)
    return result_of_places(end, moved, places[last], struck)
