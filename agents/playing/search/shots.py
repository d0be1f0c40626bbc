"""Candidate shots for many positions at once, planned on the known ice."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.playing.search.aiming_table import AimingTable
from agents.playing.search.positions import EndSimulator
from agents.playing.search.tuning import (
    BEHIND_GUARD,
    COVER,
    FREEZE_GAP,
    HIT_OFFSETS,
    HIT_WEIGHTS,
    IN_FRONT,
    IN_HOUSE,
    TAP_BACK,
    THROUGH_HOUSE,
)
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.typing import Flags, Floats, Indices

KINDS = (
    *("draw", "guard", "come-around", "freeze", "tap", "cover"),
    *("control-weight hit", "hit", "firm hit", "peel", "through the house"),
)
_KIND = {name: k for k, name in enumerate(KINDS)}
_DRAW = 0.0
"""Marker of a draw among the weights of hits."""


@dataclass(frozen=True, kw_only=True)
class Shots:
    """Shots for some positions.

    Parameters
    ----------
    position : (n,) index of the position of each shot
    throws : (n, 3) intended speed [m/s], angle [rad] and spin [rad/s]
    kind : (n,) index into `KINDS`
    """

    position: Indices
    throws: Floats
    kind: Indices

    def __len__(self) -> int:
        return len(self.throws)

    def __getitem__(self, part: Indices | Flags) -> Shots:
        return Shots(position=self.position[part], throws=self.throws[part], kind=self.kind[part])


def shots_for(table: AimingTable, simulator: EndSimulator, stones: Floats, delivered: int) -> Shots:
    """Return shots for the team that throws next.

    Parameters
    ----------
    table : aiming table of the ice
    simulator : rules and lines of the game
    stones : (n, 16, 2) positions, see `positions`
    delivered : number of stones delivered
    """
    maker = _ShotMaker(table, 2 * simulator.lines.stone_radius)
    everywhere = np.arange(len(stones))
    for x, y in IN_HOUSE:
        maker.draws("draw", everywhere, np.full(len(stones), x), np.full(len(stones), y))
    if delivered < simulator.rules.deliveries - 1:
        for x, y in IN_FRONT:
            maker.draws("guard", everywhere, np.full(len(stones), x), np.full(len(stones), y))
    for x in THROUGH_HOUSE:
        nowhere = np.zeros(len(stones))
        maker.hits("through the house", everywhere, nowhere + x, nowhere, HIT_WEIGHTS[1])
    position, slot = np.nonzero(np.isfinite(stones[:, :, 0]))
    x, y = stones[position, slot].T
    own = slot // STONES_PER_TEAM == simulator.mover(delivered)
    last = delivered == simulator.rules.deliveries - 1
    guard = y < -1.0
    for dx, dy in BEHIND_GUARD:
        maker.draws("come-around", position[guard], x[guard] + dx, y[guard] + dy)
    near = np.hypot(x, y) < simulator.lines.reach + 0.3
    maker.draws("freeze", position[near], x[near], y[near] - maker.touch - FREEZE_GAP)
    for dx, dy in TAP_BACK:
        maker.draws("tap", position, x + dx, y + dy)
    covered = own & near & ~np.bool_(last)
    for dx, dy in COVER:
        maker.draws("cover", position[covered], x[covered] + dx, y[covered] + dy)
    for weight, name in zip(HIT_WEIGHTS, KINDS[6:10], strict=True):
        for off in HIT_OFFSETS:
            maker.hits(name, position, x + off, y, weight)
    return maker.all()


class _ShotMaker:
    """Collector of places, which makes the throws to all of them at once, with both handles."""

    def __init__(self, table: AimingTable, touch: float) -> None:
        self.table, self.touch = table, touch
        self._places: dict[float, list[tuple[int, Indices, Floats, Floats]]] = {}

    def draws(self, kind: str, position: Indices, x: Floats, y: Floats) -> None:
        self.hits(kind, position, x, y, _DRAW)

    def hits(self, kind: str, position: Indices, x: Floats, y: Floats, weight: float) -> None:
        self._places.setdefault(weight, []).append((_KIND[kind], position, x, y))

    def all(self) -> Shots:
        positions: list[Indices] = []
        throws: list[Floats] = []
        kinds: list[Indices] = []
        for weight, places in self._places.items():
            position = np.concatenate([place[1] for place in places])
            x = np.concatenate([place[2] for place in places])
            y = np.concatenate([place[3] for place in places])
            kind = np.repeat([place[0] for place in places], [len(place[1]) for place in places])
            for spin in self.table.spins:
                made = (
                    self.table.draws(x, y, spin)
                    if weight == _DRAW
                    else self.table.hits(x, y, weight, spin)
                )
                good = np.isfinite(made[:, 1])
                positions.append(position[good])
                throws.append(made[good])
                kinds.append(kind[good])
        return Shots(
            position=np.concatenate(positions),
            throws=np.concatenate(throws),
            kind=np.concatenate(kinds),
        )


def best_of_each(position: Indices, value: Floats, most: int) -> Indices:
    """Return the indices of the `most` best values of each position."""
    order = np.lexsort((-value, position))
    starts = np.r_[True, np.diff(position[order]) != 0]
    begin = np.maximum.accumulate(np.where(starts, np.arange(len(order)), 0))
    return order[np.arange(len(order)) - begin < most]
