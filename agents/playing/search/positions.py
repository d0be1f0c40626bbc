"""Very many positions at once: throws played into them, and the rules' word on each.

A position is an array of sixteen places in the delivery frame, NaN where no stone lies: the first
eight are of the team with the hammer, the others of its opponent, each in order of delivery. All
positions of a batch are at the same delivery of an end, so the same team throws in each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.game.rules import End, RestingStone, RuleSet, scoring
from curling_env.game.rules.lines import CENTRE_LINE_HALF, HOG_LINE, Lines
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.ice import Ice
from curling_env.physics.batch import RELEASE_DTYPE, play_batch
from curling_env.physics.one_stone.slide import play_bounds
from curling_env.sheet import HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import MAX_SPEED, MAX_SPIN, velocity_of
from curling_env.typing import Flags, Floats, Integers

SLOTS = 2 * STONES_PER_TEAM
SLOWEST = 1e-3
"""No throw is slower, however badly it slips [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """What throws are played on and ruled by.

    Parameters
    ----------
    ice : as it is known
    direction : the end played to
    rules, lines : of the game
    """

    ice: Ice
    direction: Direction
    rules: RuleSet
    lines: Lines

    def mover(self, delivered: int) -> int:
        """Whose delivery comes after so many: 0 with the hammer, 1 without."""
        return 1 - delivered % 2

    def slot(self, delivered: int) -> int:
        """Where the stone of that delivery stands in a position."""
        return STONES_PER_TEAM * self.mover(delivered) + delivered // 2

    def play(self, before: Floats, delivered: int, throws: Floats) -> Floats:
        """Play a throw into each of n positions, by the rules.

        After a tick all stones are put back: what the opponent chooses nearly always.

        Parameters
        ----------
        before : (n, 16, 2) delivery frame [m]
        delivered : stones of the end delivered before
        throws : (n, 3) speed, angle and spin as they left the hand

        Returns
        -------
        (n, 16, 2) positions afterwards
        """
        after, struck = self.slide(before, delivered, throws)
        return self.rule(before, delivered, after, struck)

    def slide(self, before: Floats, delivered: int, throws: Floats) -> tuple[Floats, Flags]:
        """What physics makes of it: positions (n, 16, 2), and whether a stone was struck (n,)."""
        d = int(self.direction)
        releases = np.zeros(len(throws), dtype=RELEASE_DTYPE)
        releases["y"] = -d * HOG_LINE_Y
        speed = np.clip(throws[:, 0], SLOWEST, MAX_SPEED)
        releases["vx"], releases["vy"] = velocity_of(speed, throws[:, 1], d)
        releases["omega"] = np.clip(throws[:, 2], -MAX_SPIN, MAX_SPIN)
        present = np.flatnonzero(np.isfinite(before[:, :, 0]).any(axis=0))
        places = d * (before[:, present] + [0.0, TEE_Y])
        run = play_batch(self.ice, places, releases, bounds=play_bounds(self.ice, self.direction))
        there = d * run.xy - [0.0, TEE_Y]
        # A throw that would not come to rest is no throw: nothing has happened.
        lost = run.collisions < 0
        there[lost, :-1], there[lost, -1] = before[lost][:, present], np.nan
        after = np.full_like(before, np.nan)
        after[:, present] = there[:, :-1]
        # Stones that nothing moved lie where they lay, to the last bit.
        still = np.abs(after - before) < 1e-9
        after[still] = before[still]
        after[:, self.slot(delivered)] = there[:, -1]
        return after, run.collisions > 0

    def rule(self, before: Floats, delivered: int, after: Floats, struck: Flags) -> Floats:
        """The positions that stand, (n, 16, 2), by the rules of `curling_env.game.rules`."""
        rules, slot = self.rules, self.slot(delivered)
        after = after.copy()
        short = ~(after[:, :, 1] - self.lines.stone_radius > HOG_LINE)
        if rules.hog_line_exception:
            after[short[:, slot] & ~struck, slot] = np.nan
        else:
            after[short] = np.nan
        early = delivered < rules.no_takeout_until
        if not early and delivered >= rules.free_guard_until:
            return after
        protected = np.isfinite(before[:, :, 0])
        if not early:
            protected &= self.free_guards(before)
            own = STONES_PER_TEAM * self.mover(delivered)
            protected[:, own : own + STONES_PER_TEAM] = False
        gone = protected & np.isnan(after[:, :, 0])
        put_back = gone.any(axis=1)
        if rules.no_tick:
            reach = self.lines.stone_radius + CENTRE_LINE_HALF
            off = ~gone & (np.abs(before[:, :, 0]) <= reach) & ~(np.abs(after[:, :, 0]) <= reach)
            put_back |= (protected & off).any(axis=1)
        after[put_back] = before[put_back]
        return after

    def free_guards(self, stones: Floats) -> Flags:
        """Stones in the free guard zone, (n, 16)."""
        x, y = stones[:, :, 0], stones[:, :, 1]
        in_house = x * x + y * y <= self.lines.reach**2
        return (y + self.lines.stone_radius < 0) & ~in_house


def position_of(end: End) -> Floats:
    """The stones of an end as one position, (16, 2)."""
    position = np.full((SLOTS, 2), np.nan)
    for stone in end.stones:
        position[_slot_of(stone, end)] = stone.x, stone.y
    return position


def _slot_of(stone: RestingStone, end: End) -> int:
    return STONES_PER_TEAM * (stone.team is not end.hammer) + stone.number


def points_of(lines: Lines, stones: Floats) -> Integers:
    """Points that count for the hammer team, negative for its opponent: (n,)."""
    return scoring.points_of(stones, np.arange(SLOTS) < STONES_PER_TEAM, lines.reach)
