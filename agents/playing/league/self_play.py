"""Ends played in parallel by two networks, or by a heuristic in place of one.

Before each delivery candidate shots are simulated, and the one that leads to the highest value is
thrown. A league (`agents.playing.league.run`) and `scripts/train_value_network.py` both play this
way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.playing.league.tuning import (
    HEURISTIC_RADIUS,
    POWER_PLAY_SHARE,
    REPEATED_SHOTS,
    REPEATS,
    SIMULATED_SHOTS,
)
from agents.playing.search.aiming_table import AimingTable
from agents.playing.search.positions import (
    MAX_POINTS,
    SCORES,
    SLOTS,
    EndSimulator,
    points_of,
)
from agents.playing.search.shots import Shots, best_of_each, shots_for
from agents.playing.search.value_network import ValueNetwork
from agents.playing.search.win_probability import WinProbability
from curling_env.game.rules import RuleSet, Team, rule_set
from curling_env.game.rules.rulesets import Side, placed_stones
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.ice import load_ice
from curling_env.sheet import Direction
from curling_env.throw import Skill, delivery_named
from curling_env.typing import Floats, Indices, Integers

Players = tuple[ValueNetwork | None, ValueNetwork | None]
"""Networks of the team with the hammer and of its opponent; None for the heuristic."""


class PlayedEnds(NamedTuple):
    """Ends played in parallel.

    Parameters
    ----------
    stones : (deliveries, n, 16, 2) positions after each delivery, the hammer team's stones first
    score : (n,) score of the team with the hammer
    score_values : (n, 13) value of each score to that team
    skill : skill of the players, for all or (n,); see `value_network.skill_feature`
    greedy_from : first delivery from which both teams choose the best shot, for all or (n,)
    """

    stones: NDArray[np.float32]
    score: Integers
    score_values: Floats
    skill: Floats | float = 0.0
    greedy_from: Integers | int = 0


class Effort(NamedTuple):
    """Number of shots simulated before a delivery.

    Parameters
    ----------
    shots : number of shots simulated once
    best : number of the best of them simulated again
    repeats : number of simulations of those
    """

    shots: int = SIMULATED_SHOTS
    best: int = REPEATED_SHOTS
    repeats: int = REPEATS


class ExploratoryPrefix(NamedTuple):
    """Random throws at the start of ends, so that unusual positions occur too.

    Parameters
    ----------
    until : (n,) first delivery of each end that is not random
    button_share : (2, n) share of draws to the button of each team, the hammer team first
    """

    until: Integers
    button_share: Floats


def end_simulator(ice: str, rules: str, delivery: str = "hog-line") -> EndSimulator:
    """Make the simulator of ends towards the away end.

    Parameters
    ----------
    ice : a file or preset
    rules, delivery : their names
    """
    known = load_ice(ice)
    return EndSimulator(
        ice=known,
        direction=Direction.AWAY,
        rules=rule_set(rules),
        lines=rule_set(rules).lines(width=known.sheet.width, stone_radius=known.stone.radius),
        delivery=delivery_named(delivery),
    )


def score_values(rules: RuleSet, lead: Integers, left: Integers) -> Floats:
    """Return the win probability after each score of an end in n games, (n, 13).

    Parameters
    ----------
    lead : (n,) lead of the hammer team before the end
    left : (n,) ends left, with this one
    """
    odds = WinProbability(rules)
    games = zip(lead.tolist(), left.tolist(), strict=True)
    return np.array([odds.by_score(*game) for game in games])


def sigmas_of(skill: Skill) -> Floats:
    """Return the standard deviations of a player's errors: speed [m/s], angle [rad], spin
    [rad/s].
    """
    return np.array([skill.sigma_speed, skill.sigma_angle, skill.sigma_spin])


def play_ends(
    simulator: EndSimulator,
    players: Players,
    values: Floats,
    sigma: Floats,
    rng: np.random.Generator,
    *,
    effort: Effort = Effort(),
    skill: Floats | float = 0.0,
    prefix: ExploratoryPrefix | None = None,
) -> PlayedEnds:
    """Play ends in parallel.

    Parameters
    ----------
    simulator : ice, rules and lines
    players : networks of the two teams
    values : (n, 13) value of each score to the team with the hammer
    sigma : standard deviations of the execution errors, (3,) or (n, 3)
    rng : source of all randomness
    effort : number of shots simulated before each delivery
    skill : the players' skill as the networks see it, for all or (n,)
    prefix : random throws at the beginning; None for none
    """
    n = len(values)
    table = AimingTable(simulator.ice, simulator.direction, simulator.delivery)
    sigma, skills = np.broadcast_to(sigma, (n, 3)), np.broadcast_to(skill, n)
    greedy_from = np.zeros(n, dtype=np.int64) if prefix is None else prefix.until
    stones = _first_positions(simulator, n, rng)
    seen: list[Floats] = []
    for delivered in range(simulator.rules.deliveries):
        team = simulator.mover(delivered)
        shots = shots_for(table, simulator, stones, delivered)
        intended = np.empty((n, 3))
        if prefix is not None:
            intended = _random_throws(shots, prefix.button_share[team], table, rng)
        greedy = greedy_from <= delivered
        if greedy.any():
            shots = shots[greedy[shots.position]]
            decision = Decision(simulator, players[team], stones, delivered, values, skills)
            best = best_by_simulation(decision, shots, sigma, effort, rng)
            intended[best.position] = best.throws
        executed = intended + rng.standard_normal((n, 3)) * sigma
        stones = simulator.play(stones, delivered, executed)
        seen.append(stones)
    score = points_of(simulator.lines, stones)
    late = 0 if prefix is None else greedy_from
    return PlayedEnds(np.array(seen, dtype=np.float32), score, values, skill, late)


def _first_positions(simulator: EndSimulator, n: int, rng: np.random.Generator) -> Floats:
    """Return positions before the first delivery, (n, 16, 2): empty, or with the placed stones.

    Some of the ends with placed stones are power plays to either side.
    """
    stones = np.full((n, SLOTS, 2), np.nan)
    if not simulator.rules.placed_stones:
        return stones
    sides: tuple[Side | None, ...] = (None, "left", "right")
    share = POWER_PLAY_SHARE / 2 if simulator.rules.power_play else 0.0
    drawn = rng.choice(len(sides), n, p=[1 - 2 * share, share, share])
    for k, side in enumerate(sides):
        placed = placed_stones(simulator.rules, simulator.lines, Team.HOME, power_play=side)
        for stone in placed:
            slot = STONES_PER_TEAM * (stone.team is not Team.HOME) + stone.number
            stones[drawn == k, slot] = stone.x, stone.y
    return stones


class Decision(NamedTuple):
    """Positions of parallel ends, before the same delivery of each.

    Parameters
    ----------
    simulator : ice, rules and lines
    player : network that values the following positions; None for the heuristic
    stones : (n, 16, 2) positions
    delivered : number of stones delivered in them
    score_values : (n, 13) value of each score to the team with the hammer
    skill : (n,) the players' skill as the network sees it
    """

    simulator: EndSimulator
    player: ValueNetwork | None
    stones: Floats
    delivered: int
    score_values: Floats
    skill: Floats

    def after(self, shots: Shots, errors: Floats) -> Floats:
        """Return positions after each shot with its error, (m, 16, 2)."""
        before = self.stones[shots.position]
        return self.simulator.play(before, self.delivered, shots.throws + errors)

    def values(self, shots: Shots, errors: Floats) -> Floats:
        """Return the value of each shot with its error, for the team that throws it, (m,)."""
        after, simulator = self.after(shots, errors), self.simulator
        left = simulator.rules.deliveries - self.delivered - 1
        by_score = self.score_values[shots.position]
        if self.player is None and left > 0:
            points = points_of(simulator.lines, after)
            value = _heuristic_values(simulator, after, points, left, by_score)
        else:
            value = (self.score_shares(after, shots.position) * by_score).sum(axis=1)
        return value if simulator.mover(self.delivered) == 0 else -value

    def score_shares(self, after: Floats, position: Indices) -> Floats:
        """Return the network's probability of each score after the delivery, (m, 13).

        After the last delivery the score is known.

        Parameters
        ----------
        after : (m, 16, 2) positions
        position : (m,) index of the position before each
        """
        simulator = self.simulator
        left = simulator.rules.deliveries - self.delivered - 1
        if left == 0:
            return shares_of(points_of(simulator.lines, after))
        assert self.player is not None
        return self.player.score_probabilities(
            simulator.lines, after, left, self.score_values[position], self.skill[position]
        )


def shares_of(score: Integers) -> Floats:
    """Return scores (n,) as shares of each of `SCORES`, (n, 13): 1 for the actual one, else 0."""
    capped = np.clip(score, -MAX_POINTS, MAX_POINTS)
    return np.eye(len(SCORES))[capped + MAX_POINTS]


def best_by_simulation(
    decision: Decision, shots: Shots, sigma: Floats, effort: Effort, rng: np.random.Generator
) -> Shots:
    """Return the best shot of each position: some are simulated once, the best of them again."""
    shots = some_of_each(shots, effort.shots, rng)
    first = decision.values(shots, errors_of(shots, sigma, rng))
    best = best_of_each(shots.position, first, effort.best)
    again = shots[np.repeat(best, effort.repeats)]
    more = decision.values(again, errors_of(again, sigma, rng))
    mean = (first[best] + more.reshape(-1, effort.repeats).sum(axis=1)) / (effort.repeats + 1)
    return shots[best[best_of_each(shots.position[best], mean, 1)]]


def errors_of(shots: Shots, sigma: Floats, rng: np.random.Generator) -> Floats:
    """Draw execution errors, (m, 3), from the standard deviations (n, 3) of each position."""
    return rng.standard_normal((len(shots), 3)) * sigma[shots.position]


def some_of_each(shots: Shots, most: int, rng: np.random.Generator) -> Shots:
    """Choose a limited number of shots of each position at random."""
    return shots[best_of_each(shots.position, rng.random(len(shots)), most)]


def _random_throws(
    shots: Shots, button_share: Floats, table: AimingTable, rng: np.random.Generator
) -> Floats:
    """Return a random throw for each position, (n, 3): any shot, or a draw to the button."""
    # There are many more hits than draws, so the kind of shot is drawn first.
    rank = rng.random(len(shots)) ** np.bincount(shots.kind)[shots.kind]
    any_shot = shots.throws[best_of_each(shots.position, rank, 1)]
    n = len(button_share)
    button = table.draws(np.zeros(n), np.zeros(n), table.delivery.spin)
    draws = rng.random(n) < np.clip(2 * button_share - 0.6, 0, 1)
    return np.where(draws[:, None], button, any_shot)


def _heuristic_values(
    simulator: EndSimulator, stones: Floats, points: Integers, left: int, by_score: Floats
) -> Floats:
    """Return the value of positions by a heuristic, (n,).

    Points count more the later it is; stones near the tee count too.
    """
    near = np.nan_to_num(np.exp(-np.hypot(stones[:, :, 0], stones[:, :, 1]) / HEURISTIC_RADIUS))
    half = SLOTS // 2
    net = near[:, :half].sum(axis=1) - near[:, half:].sum(axis=1)
    played = 1 - left / simulator.rules.deliveries
    guess = played * points + (1 - 0.5 * played) * net + 0.5 * (1 - played)
    at = np.clip(guess + MAX_POINTS, 0, 2 * MAX_POINTS - 1e-9)
    k, rows = at.astype(int), np.arange(len(stones))
    return by_score[rows, k] * (1 - at + k) + by_score[rows, k + 1] * (at - k)
