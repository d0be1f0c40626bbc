"""Monte-Carlo evaluation of throws with execution errors and uncertain ice.

A throw is repeated with execution errors on ices sampled within the ice's standard errors, and
every trial is judged by the objective. All trials of all throws go through the batch engine
together.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.planning.objective import Objective
from agents.planning.rollouts import SPEED, SPIN, Rollouts, roll_out_in_play
from curling_env.ice import Ice
from curling_env.physics.slides import SlideEnd
from curling_env.throw import MAX_SPEED, MAX_SPIN, Skill
from curling_env.typing import Flags, Floats, Integers


@dataclass(frozen=True, kw_only=True)
class Trials:
    """Outcomes of n trials of one throw.

    Parameters
    ----------
    ends : (n, 2) end of the thrown stone, sheet frame [m]
    miss : (n,) distance of each end from the target [m]
    why : (n,) reason for the end of each slide, as `SlideEnd` values
    in_play : (n,) true if the thrown stone stayed in play
    value, success : (n,) judgement by the objective
    stones : (n, k, 2) final positions of the other stones, NaN for one that left play [m]
    errors : (n, 3) execution errors of speed [m/s], angle [rad] and spin [rad/s]
    """

    ends: Floats
    miss: Floats
    why: Integers
    in_play: Flags
    value: Floats
    success: Flags
    stones: Floats
    errors: Floats

    @property
    def expected_miss(self) -> float:
        """Mean distance from the target [m]."""
        return float(self.miss.mean())

    @property
    def expected_value(self) -> float:
        """Mean value."""
        return float(self.value.mean())

    def chance(self, end: SlideEnd) -> float:
        """Return the share of the trials that ended in one way."""
        return float((self.why == end).mean())

    @property
    def covariance(self) -> Floats:
        """Return the covariance of the ends that stayed in play, (2, 2) [m²]."""
        rested = self.ends[self.in_play]
        return np.cov(rested.T) if len(rested) > 1 else np.zeros((2, 2))


def run_trials(
    ices: list[Ice], throws: Floats, objective: Objective, skill: Skill, *, n: int, seed: int
) -> list[Trials]:
    """Try each throw n times, with the same errors for all throws.

    Parameters
    ----------
    ices : possible ices; the trials are divided among them
    throws : (m, 4) or (m, 6) throws without error, see `curling_env.physics.batch.releases_of`
    objective : objective of the throws, with the stones on the sheet
    skill : execution error of the player
    n : trials of each throw; a player without error has one on each ice
    seed : seed of the errors
    """
    each = 1 if skill.is_exact else max(-(-n // len(ices)), 1)
    m, columns = throws.shape
    radius = ices[0].stone.radius
    errors = [skill.errors(each, np.random.default_rng((seed, k))) for k in range(len(ices))]
    parts: list[Rollouts] = []
    for ice, error in zip(ices, errors, strict=True):
        trials = np.repeat(throws[:, None, :], each, axis=1)
        trials[:, :, : SPIN + 1] += error
        trials[:, :, SPEED] = np.clip(trials[:, :, SPEED], 1e-3, MAX_SPEED)
        trials[:, :, SPIN] = np.clip(trials[:, :, SPIN], -MAX_SPIN, MAX_SPIN)
        parts.append(
            roll_out_in_play(
                ice,
                trials.reshape(-1, columns),
                objective.direction,
                objective.stones,
                delivery=objective.delivery,
            )
        )
    together = Rollouts(**{f.name: _joined(parts, f.name, m) for f in fields(Rollouts)})
    judged = objective.judge(together, radius)
    count = each * len(ices)
    rows = [slice(i * count, (i + 1) * count) for i in range(m)]
    return [
        Trials(
            ends=together.xy[row],
            miss=judged.miss[row],
            why=together.end[row],
            in_play=together.in_play[row],
            value=judged.value[row],
            success=judged.success[row],
            stones=together.stones[row],
            errors=np.concatenate(errors),
        )
        for row in rows
    ]


def _joined(parts: list[Rollouts], name: str, throws: int) -> NDArray[Any]:
    """Return a field of rollouts made ice by ice, reordered throw by throw."""
    tables = [getattr(part, name) for part in parts]
    by_throw = [table.reshape(throws, len(table) // throws, *table.shape[1:]) for table in tables]
    whole = np.concatenate(by_throw, axis=1)
    return whole.reshape(throws * whole.shape[1], *whole.shape[2:])
