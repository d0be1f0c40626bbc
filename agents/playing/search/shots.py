"""The shots that a position offers, for many positions at once, planned on the ice as known."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from agents.playing.players.aiming import SPIN
from agents.playing.search.aiming_table import HITS, Atlas
from agents.playing.search.positions import Flags, Floats, Sheet
from curling_env.game.rules.teams import STONES_PER_TEAM

HANDLES = (SPIN, -SPIN)
IN_HOUSE = tuple(
    product((-1.2, -0.8, -0.4, 0.0, 0.4, 0.8, 1.2), (-1.1, -0.6, -0.15, 0.2, 0.7, 1.2))
)
"""Places to draw to [m]."""
IN_FRONT = tuple(product((-1.2, -0.6, 0.0, 0.6, 1.2), (-3.4, -2.6)))
"""Places for a guard [m]."""
AROUND = ((0.0, 1.0), (0.0, 2.2), (0.15, 1.6), (-0.15, 1.6))
"""From a guard to a place behind it [m]."""
THICKNESS = (0.0, 0.07, -0.07, 0.14, -0.14, 0.21, -0.21)
"""How far beside its centre a stone is hit [m]; it is missed beyond twice its radius, 0.29 m."""
BEHIND = ((0.0, 0.6), (0.0, 1.3), (0.12, 0.8), (-0.12, 0.8))
"""From a stone to where a draw would end that taps it back [m]."""
GUARDING = ((0.0, -1.6), (0.0, -2.6))
"""From an own stone to a guard before it [m]."""
AWAY = (1.75, -1.75)
"""Where a stone is thrown through the house [m]."""
FREEZE = 0.01
"""Room left before a stone that is frozen to [m]."""

KINDS = (
    *("draw", "guard", "come-around", "freeze", "tap", "cover"),
    *("control-weight hit", "hit", "firm hit", "peel", "through the house"),
)
_KIND = {name: k for k, name in enumerate(KINDS)}
_DRAW = 0.0
"""Weight that stands for: as far as it is to the place."""


@dataclass(frozen=True, kw_only=True)
class Shots:
    """Shots for some positions.

    Parameters
    ----------
    position : (n,) index of the position each is for
    throws : (n, 3) speed, angle and spin as meant
    kind : (n,) index into `KINDS`
    """

    position: NDArray[np.intp]
    throws: Floats
    kind: NDArray[np.intp]

    def __len__(self) -> int:
        return len(self.throws)

    def __getitem__(self, part: NDArray[np.intp] | Flags) -> Shots:
        return Shots(position=self.position[part], throws=self.throws[part], kind=self.kind[part])


def shots_for(atlas: Atlas, sheet: Sheet, stones: Floats, delivered: int) -> Shots:
    """Shots for the team that throws next.

    Parameters
    ----------
    atlas : of the ice that is played on
    stones : (n, 16, 2) positions, see `positions`
    delivered : stones of the end delivered so far
    """
    makers = _Makers(atlas, 2 * sheet.lines.stone_radius)
    everywhere = np.arange(len(stones))
    for x, y in IN_HOUSE:
        makers.draws("draw", everywhere, np.full(len(stones), x), np.full(len(stones), y))
    if delivered < sheet.rules.deliveries - 1:
        for x, y in IN_FRONT:
            makers.draws("guard", everywhere, np.full(len(stones), x), np.full(len(stones), y))
    for x in AWAY:
        nowhere = np.zeros(len(stones))
        makers.hits("through the house", everywhere, nowhere + x, nowhere, HITS[1])
    position, slot = np.nonzero(np.isfinite(stones[:, :, 0]))
    x, y = stones[position, slot].T
    own = slot // STONES_PER_TEAM == sheet.mover(delivered)
    last = delivered == sheet.rules.deliveries - 1
    guard = y < -1.0
    for dx, dy in AROUND:
        makers.draws("come-around", position[guard], x[guard] + dx, y[guard] + dy)
    near = np.hypot(x, y) < sheet.lines.reach + 0.3
    makers.draws("freeze", position[near], x[near], y[near] - makers.touch - FREEZE)
    for dx, dy in BEHIND:
        makers.draws("tap", position, x + dx, y + dy)
    covered = own & near & ~np.bool_(last)
    for dx, dy in GUARDING:
        makers.draws("cover", position[covered], x[covered] + dx, y[covered] + dy)
    for weight, name in zip(HITS, KINDS[6:10], strict=True):
        for off in THICKNESS:
            makers.hits(name, position, x + off, y, weight)
    return makers.all()


class _Makers:
    """Collects places; makes the throws that reach them all at once, both handles of each."""

    def __init__(self, atlas: Atlas, touch: float) -> None:
        self.atlas, self.touch = atlas, touch
        self._places: dict[float, list[tuple[int, NDArray[np.intp], Floats, Floats]]] = {}

    def draws(self, kind: str, position: NDArray[np.intp], x: Floats, y: Floats) -> None:
        self.hits(kind, position, x, y, _DRAW)

    def hits(
        self, kind: str, position: NDArray[np.intp], x: Floats, y: Floats, weight: float
    ) -> None:
        self._places.setdefault(weight, []).append((_KIND[kind], position, x, y))

    def all(self) -> Shots:
        positions: list[NDArray[np.intp]] = []
        throws: list[Floats] = []
        kinds: list[NDArray[np.intp]] = []
        for weight, places in self._places.items():
            position = np.concatenate([place[1] for place in places])
            x = np.concatenate([place[2] for place in places])
            y = np.concatenate([place[3] for place in places])
            kind = np.repeat([place[0] for place in places], [len(place[1]) for place in places])
            for spin in HANDLES:
                made = (
                    self.atlas.draws(x, y, spin)
                    if weight == _DRAW
                    else self.atlas.hits(x, y, weight, spin)
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
