"""Value of a position after the opponent's best reply.

The network predicts the usual course of an end from a position. Shortly before the end of the end
it can be computed: the opponent's shots are simulated, all of them once, the best of them again.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from agents.playing.search.aiming_table import AimingTable
from agents.playing.search.positions import EndSimulator
from agents.playing.search.shots import Shots, best_of_each, shots_for
from agents.playing.search.tuning import REPLIES_AGAIN, REPLIES_ONCE, REPLY_REPEATS
from curling_env.throw import Skill
from curling_env.typing import Floats


class ValuesOf(Protocol):
    """Win probability of the searching team, (n,), in positions (n, 16, 2) after a delivery."""

    def __call__(self, stones: Floats, delivered: int, /) -> Floats: ...


def values_after_reply(
    simulator: EndSimulator,
    table: AimingTable,
    values_of: ValuesOf,
    stones: Floats,
    delivered: int,
    sigma: Floats,
    skill: Skill,
    rng: np.random.Generator,
) -> tuple[Floats, int]:
    """Return the win probability of the waiting team after the other team's throw.

    Parameters
    ----------
    simulator, table : ice and rules, and the throws on that ice
    values_of : function that values positions for the waiting team
    stones : (n, 16, 2) positions
    delivered : number of stones delivered in them
    sigma, skill : assumed errors of the opponent, and their distribution
    rng : source of all randomness

    Returns
    -------
    (n,) win probabilities, and the number of simulated throws
    """
    shots = shots_for(table, simulator, stones, delivered)
    shots = shots[best_of_each(shots.position, -rng.random(len(shots)), REPLIES_ONCE)]

    def values(some: Shots, errors: Floats) -> Floats:
        before = stones[some.position]
        after = simulator.play(before, delivered, some.throws + errors)
        return values_of(after, delivered + 1)

    once = skill.standard_errors(len(shots), rng) * sigma
    best = shots[best_of_each(shots.position, -values(shots, once), REPLIES_AGAIN)]
    # The same errors for every reply, each with its opposite.
    half = skill.standard_errors(REPLY_REPEATS // 2, rng) * sigma
    errors = np.concatenate([half, -half])
    again = best[np.repeat(np.arange(len(best)), len(errors))]
    mean = values(again, np.tile(errors, (len(best), 1))).reshape(len(best), -1).mean(axis=1)
    least = np.full(len(stones), np.inf)
    np.minimum.at(least, best.position, mean)
    return least, len(shots) + len(again)
