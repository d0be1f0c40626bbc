"""Games that are played to see how their ends are scored, one record for each game."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from agents.playing.ends.grades import grade, shot_type
from agents.playing.match import Match, PlayedDelivery
from agents.playing.search import BY_THE_ODDS, CallingStyle, SearchPlayer
from agents.playing.search.positions import SCORES, EndSimulator, position_of
from agents.playing.search.value_network import ValueNetwork, skill_feature
from agents.playing.search.win_probability import WinProbability
from curling_env.game import Call, GameSimulator, GameState, PlayerView
from curling_env.game.ice_evolution import TYPICAL_EVOLUTION, IceEvolution
from curling_env.game.rules import Team, rule_set
from curling_env.game.team_judgement import NEVER_WRONG, TeamJudgement
from curling_env.infrastructure.executor import executor
from curling_env.throw import Skill, Throw, skill_named
from curling_env.typing import Progress, no_progress, with_progress

HIT_SPEED = 2.3
"""A faster throw over the hog line is a hit [m/s]; a draw through the house is slower."""


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """Who plays, on what, and what they know of it.

    Parameters
    ----------
    ice, rules : the ice and the rules, by name
    ends : scheduled ends of a game
    free_guard_until, no_tick : the free guard zone, see `curling_env.game.rules.rulesets.RuleSet`
    skill : execution error of both teams' throwers
    budget : simulated throws before each delivery
    judgement : how far off teams are when they read the ice and sweep
    calls : what teams call for, beside the odds
    evolution : how the ice changes, and how far stones differ
    sweeping : whether stones are swept
    hit_factor, turn_factor : by how much all errors are larger for a throw of hit weight, and for a
        counter-clockwise turn, than `skill` says; players do not know of it
    """

    ice: str = "standard"
    rules: str = "world_curling_2024"
    ends: int = 10
    free_guard_until: int = 5
    no_tick: bool = True
    skill: str | Skill = "champion"
    budget: int = 300
    judgement: TeamJudgement = NEVER_WRONG
    calls: CallingStyle = BY_THE_ODDS
    evolution: IceEvolution = TYPICAL_EVOLUTION
    sweeping: bool = True
    hit_factor: float = 1.0
    turn_factor: float = 1.0

    def simulator(self) -> GameSimulator:
        """The simulator of such games."""
        return _UnevenHands(
            self.hit_factor,
            self.turn_factor,
            self.ice,
            rules=rule_set(
                self.rules,
                ends=self.ends,
                free_guard_until=self.free_guard_until,
                no_tick=self.no_tick,
            ),
            skills=skill_named(self.skill),
            ice_evolution=self.evolution,
            sweeping=self.sweeping,
            judgement=self.judgement,
        )


@dataclass(frozen=True, kw_only=True)
class EndRecord:
    """One end, seen from the team with the hammer.

    Parameters
    ----------
    lead : its lead before the end
    ends_left : scheduled ends to come, with this one; 0 for an extra end
    score : its points, negative for its opponent's
    won : whether it won the game
    """

    lead: int
    ends_left: int
    score: int
    won: bool


@dataclass(frozen=True, kw_only=True)
class ShotRecord:
    """One delivery.

    Parameters
    ----------
    type : see `grades.SHOT_TYPES`; empty for a stone that is thrown away
    grade : 0 to 4; None for that
    left : stones to come in the end, with this one
    hammer : whether the team has the hammer
    expected, blank : points of the team with the hammer less its opponent's, and the chance of a
        blank, that the value network of `search` expects of the end before it
    predicted : chance to win the game that the player saw in its call
    won : whether its team won the game
    """

    type: str
    grade: int | None
    left: int
    hammer: bool
    expected: float
    blank: float
    predicted: float
    won: bool


@dataclass(frozen=True, kw_only=True)
class GameRecord:
    """What is kept of a game.

    Parameters
    ----------
    seed : its seed
    ends, shots : its complete ends and its deliveries, in order
    """

    seed: int
    ends: tuple[EndRecord, ...]
    shots: tuple[ShotRecord, ...] = field(repr=False)

    def as_dict(self) -> dict[str, Any]:
        """For JSON, in short lists."""
        return {
            "seed": self.seed,
            "ends": [[e.lead, e.ends_left, e.score, int(e.won)] for e in self.ends],
            "shots": [
                [
                    *(s.type, s.grade, s.left, int(s.hammer)),
                    *(round(chance, 4) for chance in (s.expected, s.blank, s.predicted)),
                    int(s.won),
                ]
                for s in self.shots
            ],
        }

    @classmethod
    def from_line(cls, line: str) -> GameRecord:
        """The game of what `as_dict` gave, as a line of JSON."""
        document = json.loads(line)
        return cls(
            seed=document["seed"],
            ends=tuple(
                EndRecord(lead=lead, ends_left=left, score=score, won=bool(won))
                for lead, left, score, won in document["ends"]
            ),
            shots=tuple(
                ShotRecord(
                    type=kind,
                    grade=points,
                    left=left,
                    hammer=bool(hammer),
                    expected=expected,
                    blank=blank,
                    predicted=predicted,
                    won=bool(won),
                )
                for kind, points, left, hammer, expected, blank, predicted, won in document["shots"]
            ),
        )


def play_games(
    conditions: Conditions,
    seeds: Sequence[int],
    *,
    workers: int | str = 1,
    progress: Progress = no_progress,
) -> Iterator[GameRecord]:
    """Play games of `search` against itself, one for each seed.

    Parameters
    ----------
    conditions : who plays on what
    seeds : seeds of the games; the same seed gives the same game on any number of workers
    workers : who plays them, see `curling_env.infrastructure.executor`
    progress : called after each game
    """
    with executor(workers) as crew:
        played = crew.map(_play, [(conditions, seed) for seed in seeds])
        for _, record in zip(with_progress(seeds, "games", progress), played, strict=True):
            yield record


class _UnevenHands(GameSimulator):
    """Games of throwers whose errors depend on the weight and the turn of a throw."""

    def __init__(self, hit_factor: float, turn_factor: float, *given: Any, **options: Any) -> None:
        super().__init__(*given, **options)
        self._hit_factor, self._turn_factor = hit_factor, turn_factor

    def with_execution_error(self, meant: Throw, skill: Skill, state: GameState) -> Throw:
        factor = self._hit_factor if meant.speed > HIT_SPEED else 1.0
        factor *= self._turn_factor if meant.spin > 0 else 1.0
        if factor != 1.0:
            skill = replace(
                skill,
                sigma_speed=factor * skill.sigma_speed,
                sigma_angle=factor * skill.sigma_angle,
                sigma_spin=factor * skill.sigma_spin,
            )
        return super().with_execution_error(meant, skill, state)


class _Caller(SearchPlayer):
    """`search` that keeps what it expected of its last call."""

    expected = 0.5
    """The chance to win that it saw in its last call."""

    def call(self, view: PlayerView) -> Call:
        best = self.ranked_shots(view)[0]
        self.expected = best.win_probability
        return Call(throw=best.throw, shot=best.shot)


def _play(item: tuple[Conditions, int]) -> GameRecord:
    conditions, seed = item
    simulator = conditions.simulator()
    callers = [_Caller(conditions.budget, calls=conditions.calls) for _ in Team]
    match = Match(simulator, (callers[0], callers[1]), seed=seed)
    expected: list[float] = []
    deliveries: list[PlayedDelivery] = []
    for delivery in match:
        deliveries.append(delivery)
        expected.append(callers[delivery.shot.team].expected)
    game = match.game
    network = callers[0].network(simulator.rules, simulator.ice)
    return GameRecord(
        seed=seed,
        ends=tuple(
            EndRecord(
                lead=sum(end[hammer] - end[hammer.other] for end in game.line_score[:number]),
                ends_left=max(game.rules.ends - number, 0),
                score=game.line_score[number][hammer] - game.line_score[number][hammer.other],
                won=game.winner is hammer,
            )
            for number, hammer in enumerate(game.hammers)
        ),
        shots=tuple(
            _shot_record(simulator, network, delivery, predicted, game.winner)
            for delivery, predicted in zip(deliveries, expected, strict=True)
        ),
    )


def _shot_record(
    simulator: GameSimulator,
    network: ValueNetwork,
    delivery: PlayedDelivery,
    predicted: float,
    winner: Team | None,
) -> ShotRecord:
    before, shot = delivery.before, delivery.shot
    end = before.game.end
    assert end is not None
    own = EndSimulator(
        ice=simulator.ice_as_read(before.seed, shot.team, end.number),
        direction=shot.direction,
        rules=simulator.rules,
        lines=simulator.lines,
        delivery=simulator.delivery,
    )
    throw, position = shot.call.throw, position_of(end)
    intended = np.array([[throw.speed, throw.angle, throw.spin]])
    called = own.play(position[None], end.delivered, intended)[0]
    made = position_of(replace(end, stones=shot.stones_after))
    slot = own.slot(end.delivered)
    shares = network.score_probabilities(
        simulator.lines,
        position[None],
        simulator.rules.deliveries - end.delivered,
        WinProbability(simulator.rules).by_score(
            before.game.lead(end.hammer), before.game.ends_left
        ),
        skill_feature(simulator.skills[shot.team].sigma_angle),
    )[0]
    return ShotRecord(
        type=shot_type(shot.call.shot, position, called, slot) or "",
        grade=grade(shot.call.shot, position, called, made, slot),
        left=simulator.rules.deliveries - end.delivered,
        hammer=shot.team is end.hammer,
        expected=float(shares @ SCORES),
        blank=float(shares[SCORES == 0].sum()),
        predicted=predicted,
        won=winner is shot.team,
    )
