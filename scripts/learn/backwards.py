"""Values of positions learned backwards through an end, from its last stone to its first.

The score of an end is a noisy value of one of its positions: it includes the luck of all later
stones. The result of one more good stone is less noisy. Before the last stone no network is needed:
a good shot is simulated a few times, and the points are counted. A network is fitted to such
positions; it then values the positions after a good second-to-last stone, and so on (fitted value
iteration, Gordon 1995).

Positions after other shots are added to those of played ends, because a search compares both kinds
and played ends contain hardly any of the others.
"""

from __future__ import annotations

import numpy as np

from agents.playing.league.fit import Lesson
from agents.playing.league.self_play import (
    Decision,
    Effort,
    PlayedEnds,
    best_by_simulation,
    errors_of,
    sigmas_of,
    some_of_each,
)
from agents.playing.search.aiming_table import AimingTable
from agents.playing.search.positions import EndSimulator
from agents.playing.search.shots import best_of_each, shots_for
from agents.playing.search.value_network import ValueNetwork, skill_feature
from curling_env.throw import Skill
from curling_env.typing import Floats, Indices

REPLIES_ONCE, REPLIES_AGAIN, REPLY_REPEATS = 40, 6, 3
"""Number of shots simulated once from a position, of best shots simulated again, and of repeats."""
OUTCOMES = 6
"""Number of outcomes of the best shot whose mean is the value of the position."""
PROMISING, ANY = 2, 1
"""Numbers of further positions learned per position of an end: after one of the best shots, and
after any."""
STAGE_EPOCHS, STAGE_RATE = 6, 2e-3
"""Passes through the positions of one stage, and the highest learning rate."""
_EFFORT = Effort(REPLIES_ONCE, REPLIES_AGAIN, REPLY_REPEATS)


def lesson_before(
    simulator: EndSimulator,
    network: ValueNetwork,
    ends: PlayedEnds,
    left: int,
    usual: Skill,
    rng: np.random.Generator,
) -> Lesson:
    """Return positions with a number of stones to come, and score chances after the next stone.

    Parameters
    ----------
    simulator : ice, rules and lines
    network : values positions with one stone less to come; unused where none is to come
    ends : played ends, whose positions and variants of them are used
    left : stones to come, 1 or more
    usual : skill of usual players; the errors of others are multiples of its errors
    rng : random generator
    """
    delivered = len(ends.stones) - left
    n = len(ends.score)
    skill = np.broadcast_to(ends.skill, n)
    sigma = _sigma_of(usual, skill)
    stones, end = ends.stones[delivered - 1].astype(np.float64), np.arange(n)
    table = AimingTable(simulator.ice, simulator.direction, simulator.delivery)
    if delivered > 1:
        before = ends.stones[delivered - 2].astype(np.float64)
        asked = Decision(simulator, network, before, delivered - 1, ends.score_values, skill)
        others, their_end = _other_positions(asked, table, sigma, rng)
        stones, end = np.concatenate([stones, others]), np.concatenate([end, their_end])
    values, skill, sigma = ends.score_values[end], skill[end], sigma[end]
    decision = Decision(simulator, network, stones, delivered, values, skill)
    shots = shots_for(table, simulator, stones, delivered)
    best = best_by_simulation(decision, shots, sigma, _EFFORT, rng)
    # Thrown again, because the choice favours shots with lucky simulations.
    thrown = best[np.repeat(np.arange(len(stones)), OUTCOMES)]
    after = decision.after(thrown, errors_of(thrown, sigma, rng))
    shares = decision.score_shares(after, thrown.position)
    mean = shares.reshape(len(stones), OUTCOMES, -1).mean(axis=1)
    return Lesson(left, stones.astype(np.float32), values, skill, mean.astype(np.float32))


def _other_positions(
    decision: Decision, table: AimingTable, sigma: Floats, rng: np.random.Generator
) -> tuple[Floats, Indices]:
    """Return positions after other shots, (m, 16, 2), and the end (m,) of each."""
    shots = shots_for(table, decision.simulator, decision.stones, decision.delivered)
    shots = some_of_each(shots, _EFFORT.shots, rng)
    values = decision.values(shots, errors_of(shots, sigma, rng))
    best = shots[best_of_each(shots.position, values, _EFFORT.best)]
    found: list[Floats] = []
    ends: list[Indices] = []
    for some, most in ((best, PROMISING), (shots, ANY)):
        thrown = some_of_each(some, most, rng)
        found.append(decision.after(thrown, errors_of(thrown, sigma, rng)))
        ends.append(thrown.position)
    return np.concatenate(found), np.concatenate(ends)


def _sigma_of(usual: Skill, skill: Floats) -> Floats:
    """Return standard deviations of the errors of players with these skills, (n, 3)."""
    times = np.exp(skill - skill_feature(usual))
    return sigmas_of(usual) * times[:, None]
