"""Errors of hits: the hands with which the engine makes the same share of them as the teams did.

For real positions before takeouts, doubles and clearings the throw is searched that makes the shot
most often with the given handle. It is thrown with the errors of `openings` times a factor, and the
factor is the one with which the same share succeeds as in the table. A team that called another
shot than the surest one would have made it less often, so that the factor is an upper bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agents.playing.search.positions import position_of
from agents.playing.search.shots import KINDS, shots_for
from agents.shots.grades import GradedShot
from agents.shots.inversion import Inversion
from agents.shots.openings import Measured
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.ice import Ice
from curling_env.throw import Skill
from curling_env.typing import Flags, Floats, Progress, no_progress

TASKS = {
    "takeout": 1,
    "hit and roll": 1,
    "clearing": 1,
    "promotion takeout": 1,
    "double takeout": 2,
}
"""Tasks, and the number of the opponent's stones that have to leave play."""
FACTORS = np.array([0.25, 0.5, 0.75, 1.0, 1.4, 2.0, 3.0])
"""Factors on the errors of openings that are tried."""
POSITIONS = 60
"""Number of real positions of each task, by default."""
FIRST_TRIALS, TRIALS, FINALISTS = 8, 60, 4
"""Throws of each candidate, then of each of the best at each factor; number of the best."""
_FIRST_HIT = KINDS.index("control-weight hit")
_LAST_HIT = KINDS.index("peel")


@dataclass(frozen=True, kw_only=True)
class HitErrors:
    """Errors of the hits of one task.

    Parameters
    ----------
    task : the task
    shots : number of them in the table
    made : share that put enough stones out
    factor : errors over those of openings, with an interval
    speed, line : the errors that follow [m/s, rad]
    with_openings : share that the errors of openings would make
    """

    task: str
    shots: int
    made: float
    factor: Measured
    speed: float
    line: float
    with_openings: float


def fit_hits(
    shots: Sequence[GradedShot],
    ice: Ice,
    skill: Skill,
    *,
    positions: int = POSITIONS,
    seed: int = 0,
    progress: Progress = no_progress,
) -> list[HitErrors]:
    """Fit the errors of each task of `TASKS` that the shots have.

    Parameters
    ----------
    shots : graded shots of a table
    ice : the ice on which they are thrown
    skill : the errors of openings
    positions : number of real positions of each task
    seed : seed of the choice of positions and of the errors
    progress : called after every task
    """
    inversion = Inversion(ice)
    rng = np.random.default_rng(seed)
    found: list[HitErrors] = []
    for k, (task, needed) in enumerate(TASKS.items()):
        own = [one for one in shots if one.shot.task == task and _opponents(one) >= needed]
        if len(own) < positions:
            continue
        made = float(np.mean([_made(one, needed) for one in own]))
        some = rng.permutation(len(own))[:positions]
        rates = np.array([_rates(own[i], needed, inversion, skill, rng) for i in some.tolist()])
        rate = rates.mean(axis=0)
        chance = np.sqrt(made * (1 - made) / len(own) + rates.var(axis=0).mean() / len(rates))
        factor, low, high = (
            _factor_for(made + step * 1.96 * chance, rate) for step in (0.0, 1.0, -1.0)
        )
        found.append(
            HitErrors(
                task=task,
                shots=len(own),
                made=made,
                factor=Measured(value=factor, low=low, high=high),
                speed=factor * skill.sigma_speed,
                line=factor * skill.sigma_angle,
                with_openings=float(rate[FACTORS == 1.0][0]),
            )
        )
        progress("hits", k + 1, len(TASKS))
    return found


def _opponents(one: GradedShot) -> int:
    return sum(stone.team is not one.shot.team for stone in one.shot.before)


def _made(one: GradedShot, needed: int) -> bool:
    """True where enough of the opponent's stones left play."""
    shot = one.shot
    after = {(stone.team, stone.number) for stone in shot.after}
    gone = [s for s in shot.before if s.team is not shot.team and (s.team, s.number) not in after]
    return len(gone) >= needed


def _rates(
    one: GradedShot,
    needed: int,
    inversion: Inversion,
    skill: Skill,
    rng: np.random.Generator,
) -> Floats:
    """Share of the surest throw that makes the shot, for each of `FACTORS`."""
    simulator, number = inversion.simulator, one.shot.number
    position = position_of(inversion.end_before(one.shot))
    shots = shots_for(inversion.table, simulator, position[None], number)
    handle = shots.throws[:, 2] * one.shot.spin > 0
    hits = shots[(shots.kind >= _FIRST_HIT) & (shots.kind <= _LAST_HIT) & handle]
    if not len(hits):
        return np.zeros(len(FACTORS))

    def made(throws: Floats, errors: Floats) -> Floats:
        executed = (throws[:, None] + errors).reshape(-1, 3)
        before = np.broadcast_to(position, (len(executed), *position.shape))
        after = simulator.play(before, number, executed)
        first = STONES_PER_TEAM * (1 - simulator.mover(number))
        theirs = slice(first, first + STONES_PER_TEAM)
        gone: Flags = np.isfinite(before[:, theirs, 0]) & np.isnan(after[:, theirs, 0])
        return (gone.sum(axis=1) >= needed).reshape(len(throws), -1).mean(axis=1)

    rough = made(hits.throws, 0.7 * skill.errors(FIRST_TRIALS, rng))
    best = hits.throws[np.argsort(-rough, kind="stable")[:FINALISTS]]
    errors = skill.errors(TRIALS, rng)
    # The same errors at every factor; half of them choose the throw, the others count.
    choose, count = np.split(errors, 2)
    out: list[float] = []
    for factor in FACTORS.tolist():
        surest = int(np.argmax(made(best, factor * choose)))
        out.append(float(made(best[surest : surest + 1], factor * count)[0]))
    return np.array(out)


def _factor_for(share: float, rate: Floats) -> float:
    """The factor with which a share is made, between those that are tried."""
    falling = np.minimum.accumulate(rate)
    return float(np.exp(np.interp(-share, -falling, np.log(FACTORS))))
