"""Throws played into many positions at once, with rulings by the rules of the game.

A position is an array of sixteen places in the delivery frame, NaN if empty. The first eight belong
to the team with the hammer, the others to its opponent, each in order of delivery. All positions of
a batch are at the same delivery of an end, so the same team throws in each.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from curling_env.game.rules import End, RestingStone, RuleSet, scoring
from curling_env.game.rules.lines import HOG_LINE, Lines
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.ice import Ice
from curling_env.physics.batch import BatchEngine, releases_of
from curling_env.physics.slides import play_bounds
from curling_env.sheet import TEE_Y, Direction
from curling_env.throw import FROM_HOG_LINE, MAX_SPEED, MAX_SPIN, Delivery
from curling_env.typing import Flags, Floats, Integers

SLOTS = 2 * STONES_PER_TEAM
"""Number of places in a position."""
MAX_POINTS = 6
"""Maximum score of an end; larger ones count as this one."""
SCORES = np.arange(-MAX_POINTS, MAX_POINTS + 1)
"""Scores of an end for the team with the hammer."""


@dataclass(frozen=True, kw_only=True)
class EndSimulator:
    """Simulator of throws of one end on the known ice, by the rules.

    Parameters
    ----------
    ice : known ice
    direction : the end played to
    rules, lines : rules and lines of the game
    delivery : start of the throws
    """

    ice: Ice
    direction: Direction
    rules: RuleSet
    lines: Lines
    delivery: Delivery = FROM_HOG_LINE

    @cached_property
    def _engine(self) -> BatchEngine:
        return BatchEngine(self.ice, tabulated=True)

    @cached_property
    def _bounds(self) -> Floats:
        return play_bounds(self.ice, self.direction)

    def mover(self, delivered: int) -> int:
        """Return the team that throws after a number of deliveries: 0 with the hammer, 1
        without.
        """
        return 1 - delivered % 2

    def slot(self, delivered: int) -> int:
        """Return the index in a position of the stone thrown after a number of deliveries."""
        return STONES_PER_TEAM * self.mover(delivered) + delivered // 2

    def play(self, before: Floats, delivered: int, throws: Floats) -> Floats:
        """Play a throw into each of n positions, by the rules.

        After a tick all stones are put back, which the opponent nearly always chooses.

        Parameters
        ----------
        before : (n, 16, 2) positions, delivery frame [m]
        delivered : number of stones delivered before
        throws : (n, 3) executed speed [m/s], angle [rad] and spin [rad/s]

        Returns
        -------
        (n, 16, 2) positions afterwards
        """
        after, struck = self.slide(before, delivered, throws)
        return self.rule(before, delivered, after, struck)

    def slide(self, before: Floats, delivered: int, throws: Floats) -> tuple[Floats, Flags]:
        """Return positions after the physics (n, 16, 2), and whether a stone was struck (n,)."""
        d = int(self.direction)
        highest = [MAX_SPEED, np.inf, MAX_SPIN]
        possible = np.clip(throws, [1e-3, -np.inf, -MAX_SPIN], highest)
        releases = releases_of(possible, d, self.delivery)
        present = np.flatnonzero(np.isfinite(before[:, :, 0]).any(axis=0))
        places = d * (before[:, present] + [0.0, TEE_Y])
        run = self._engine.play(places, releases, bounds=self._bounds)
        there = d * run.xy - [0.0, TEE_Y]
        # A throw that would never come to rest changes nothing.
        lost = run.collisions < 0
        there[lost, :-1], there[lost, -1] = before[lost][:, present], np.nan
        after = np.full_like(before, np.nan)
        after[:, present] = there[:, :-1]
        # Stones that did not move keep their places bit for bit.
        still = np.abs(after - before) < 1e-9
        after[still] = before[still]
        after[:, self.slot(delivered)] = there[:, -1]
        return after, run.collisions > 0

    def rule(self, before: Floats, delivered: int, after: Floats, struck: Flags) -> Floats:
        """Return positions after the ruling, (n, 16, 2), as in `curling_env.game.rules`.

        Parameters
        ----------
        before, after : (n, 16, 2) positions before and after the throw
        delivered : number of stones delivered before
        struck : (n,) true if a stone was struck
        """
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
            if rules.centre_guards_only:
                protected &= np.abs(before[:, :, 0]) <= self.lines.centre_reach
        gone = protected & np.isnan(after[:, :, 0])
        put_back = gone.any(axis=1)
        if rules.guards_stay and not early:
            put_back |= (protected & ~gone & ~self.free_guards(after)).any(axis=1)
        if rules.no_tick:
            reach = self.lines.centre_reach
            off = ~gone & (np.abs(before[:, :, 0]) <= reach) & ~(np.abs(after[:, :, 0]) <= reach)
            put_back |= (protected & off).any(axis=1)
        after[put_back] = before[put_back]
        return after

    def free_guards(self, stones: Floats) -> Flags:
        """Return which stones are in the free guard zone, (n, 16)."""
        x, y = stones[:, :, 0], stones[:, :, 1]
        in_house = np.hypot(x, y) <= self.lines.reach
        return (y < self.lines.guard_line) & ~in_house


def position_of(end: End) -> Floats:
    """Return the stones of an end as one position, (16, 2)."""
    position = np.full((SLOTS, 2), np.nan)
    for stone in end.stones:
        position[_slot_of(stone, end)] = stone.x, stone.y
    return position


def _slot_of(stone: RestingStone, end: End) -> int:
    return STONES_PER_TEAM * (stone.team is not end.hammer) + stone.number


def points_of(lines: Lines, stones: Floats) -> Integers:
    """Return the points of the hammer team, negative if its opponent scores, (n,)."""
    return scoring.points_of(stones, np.arange(SLOTS) < STONES_PER_TEAM, lines.reach)
