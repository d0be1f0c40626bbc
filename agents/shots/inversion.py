"""The throw of this engine that explains the stones of a real shot best.

A stone that came to rest untouched has one throw, with its handle. For any other shot the candidate
throws of `search` with that handle are simulated from the real position, then neighbours of the
best. The misfit is the mean distance of all stones from their real places; a stone that is in play
in one case and out in the other counts a metre.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from agents.playing.board.recorded import playable
from agents.playing.drawn_record import moved_stones, places_of
from agents.playing.search.aiming_table import AimingTable
from agents.playing.search.positions import EndSimulator, position_of
from agents.playing.search.shots import shots_for
from agents.shots.table import LINES, RULES, Shot
from curling_env.game.rules import End, RestingStone
from curling_env.game.rules.teams import Stones
from curling_env.ice import Ice
from curling_env.sheet import Direction
from curling_env.throw import Throw
from curling_env.typing import Floats

MOVED = 0.02
"""Minimum movement of a struck stone [m]."""
FAR = 1.0
"""Maximum distance that counts for one stone [m]."""
STEPS = ((0.02, 0.004), (0.006, 0.0012))
"""Steps of speed (as a share) and line [rad] around the best throw, in each round."""
GRID = np.array([(i, j) for i in (-2, -1, 0, 1, 2) for j in (-2, -1, 0, 1, 2)], dtype=np.float64)


class Inverted(NamedTuple):
    """Throw that explains a shot.

    Parameters
    ----------
    throw : the throw
    misfit : how far stones lie from their real places on average [m]
    """

    throw: Throw
    misfit: float


class Inversion:
    """Search for throws on one ice.

    Parameters
    ----------
    ice : the ice
    """

    def __init__(self, ice: Ice) -> None:
        self.table = AimingTable(ice, Direction.AWAY)
        self.simulator = EndSimulator(ice=ice, direction=Direction.AWAY, rules=RULES, lines=LINES)

    def end_before(self, shot: Shot) -> End:
        """Return the end before a shot, with stones moved apart if they overlap."""
        hammer = shot.team if shot.number % 2 else shot.team.other
        return End(hammer=hammer, stones=self._playable(shot.before), delivered=shot.number)

    def end_after(self, shot: Shot) -> End:
        """Return the end after a shot, in the same way."""
        before = self.end_before(shot)
        stones = self._playable(shot.after)
        return End(hammer=before.hammer, stones=stones, delivered=shot.number + 1)

    def throw_of(self, shot: Shot) -> Inverted | None:
        """Return the throw that explains a shot; None if no throw on this ice does."""
        spin = shot.spin * self.table.delivery.spin
        rest = places_of(shot.after).get(shot.stone)
        if rest is not None and not is_struck(shot):
            throw = self.table.draws(np.array([rest.x]), np.array([rest.y]), spin)[0]
            return _inverted(throw, 0.0)
        before, real = position_of(self.end_before(shot)), position_of(self.end_after(shot))
        shots = shots_for(self.table, self.simulator, before[None], shot.number)
        throws = shots.throws[shots.throws[:, 2] * spin > 0]
        if not len(throws):
            return None
        misfit = self._misfits(before, real, shot.number, throws)
        best, least = throws[np.argmin(misfit)], float(misfit.min())
        for speed, line in STEPS:
            near = best + np.column_stack(
                [speed * best[0] * GRID[:, 0], line * GRID[:, 1], np.zeros(len(GRID))]
            )
            misfit = self._misfits(before, real, shot.number, near)
            if misfit.min() < least:
                best, least = near[np.argmin(misfit)], float(misfit.min())
        return _inverted(best, least)

    def _playable(self, stones: Stones) -> Stones:
        places = np.array([(stone.x, stone.y) for stone in stones]).reshape(-1, 2)
        return tuple(
            RestingStone(stone.team, stone.number, x, y)
            for stone, (x, y) in zip(stones, playable(places, self.table.ice).tolist(), strict=True)
        )

    def _misfits(self, before: Floats, real: Floats, number: int, throws: Floats) -> Floats:
        many = np.broadcast_to(before, (len(throws), *before.shape))
        after, _ = self.simulator.slide(many, number, throws)
        counted = np.isfinite(before[:, 0])
        counted[self.simulator.slot(number)] = True
        return distances(after, real)[:, counted].mean(axis=1)


def distances(after: Floats, real: Floats) -> Floats:
    """Return the distance of each stone from its real place, (n, 16) [m].

    Parameters
    ----------
    after : (n, 16, 2) positions
    real : (16, 2) the real one; a stone that lies in one of them only counts `FAR`
    """
    there, here = np.isfinite(real[:, 0]), np.isfinite(after[:, :, 0])
    apart = np.hypot(*(after - real).transpose(2, 0, 1))
    return np.where(here & there, np.minimum(apart, FAR), np.where(here != there, FAR, 0.0))


def is_struck(shot: Shot) -> bool:
    """Return whether a delivery moved a stone."""
    return bool(moved_stones(shot.before, shot.after, MOVED))


def _inverted(throw: Floats, misfit: float) -> Inverted | None:
    if not np.isfinite(throw).all():
        return None
    speed, angle, spin = throw.tolist()
    return Inverted(Throw(speed=speed, angle=angle, spin=spin), misfit)
