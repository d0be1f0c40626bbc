"""The grade of a shot, 0 to 4, from what was called and what came of it.

Statisticians at championships give four points for a shot that does what the skip called for, none
for one that misses, and some for what it did half (CURLIT, How to score, 2008; Curling Canada's
guidelines are the same). Only the outcome is judged, not whose fault it was. Here the call is what
the throw does without any error on the ice as the team reads it. The distances are ours: the
guidelines leave them to the eye.
"""

from __future__ import annotations

import numpy as np

from agents.playing.search.positions import SLOTS
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.typing import Flags, Floats

BEST = 4
"""The grade of a shot that was made."""
DRAW_REACH = (0.6, 1.0, 1.5, 2.2)
"""How far from the called place a draw or a guard may rest for 4, 3, 2 and 1 points [m]."""
FINE_REACH = (0.3, 0.6, 1.0, 1.5)
"""The same for a freeze and a tap."""
MOVED = 0.1
"""A stone that was meant to move by more is part of the call [m]."""
FINE_SHOTS = ("freeze", "tap")
HITS = ("control-weight hit", "hit", "firm hit", "peel")
NOT_GRADED = "through the house"

SHOT_TYPES = ("draw", "guard", "freeze and tap", "takeout", "peel")
"""The types by which grades are told."""

HIT_MEANINGS = ("one stone", "one stone by another", "two stones or more", "none")
"""What hits are meant to take out of play."""


def shot_type(shot: str) -> str | None:
    """The type of a shot that `search` names; None for a stone that is thrown away."""
    if shot == NOT_GRADED:
        return None
    if shot in FINE_SHOTS:
        return "freeze and tap"
    if shot in ("guard", "cover"):
        return "guard"
    if shot == "peel":
        return "peel"
    return "takeout" if shot in HITS else "draw"


def grade(shot: str, before: Floats, called: Floats, made: Floats, slot: int) -> int | None:
    """Points for a shot, 0 to 4; None for a stone that is thrown away.

    Parameters
    ----------
    shot : its name
    before, called, made : (16, 2) positions before it, as called, and afterwards; see
        `agents.playing.search.positions`
    slot : place of the delivered stone in a position
    """
    kind = shot_type(shot)
    if kind is None:
        return None
    removed = np.isfinite(before[:, 0]) & np.isnan(called[:, 0])
    if kind in ("takeout", "peel") and removed[_opponents(slot)].any():
        return _hit(before, called, made, slot, removed, stays=kind == "takeout")
    reach = FINE_REACH if shot in FINE_SHOTS else DRAW_REACH
    moved = np.hypot(*(called - before).T) > MOVED
    moved[slot] = True
    return _placed(called[moved], made[moved], reach)


def hit_meaning(before: Floats, called: Floats, slot: int) -> str:
    """Which of `HIT_MEANINGS` a hit has, from the positions before it and as called; see `grade`.

    One stone is taken out by another where a second stone moves with it, as in a run-back.
    """
    removed = np.isfinite(before[:, 0]) & np.isnan(called[:, 0])
    out = int((removed & _opponents(slot)).sum())
    if out != 1:
        return "two stones or more" if out else "none"
    moved = removed | (np.hypot(*(called - before).T) > MOVED)
    return "one stone" if moved.sum() == 1 else "one stone by another"


def _placed(called: Floats, made: Floats, reach: tuple[float, ...]) -> int:
    """Points for stones that were to come to rest somewhere: those of the worst of them."""
    gone, meant_gone = np.isnan(made[:, 0]), np.isnan(called[:, 0])
    off = np.where(gone & meant_gone, 0.0, np.hypot(*(made - called).T))
    if np.isnan(off).any():
        return 0
    return int((off.max() <= np.array(reach)).sum())


def _hit(
    before: Floats, called: Floats, made: Floats, slot: int, removed: Flags, *, stays: bool
) -> int:
    """Points for a takeout: for what it took out, and, if it `stays`, for where the shooter did."""
    wanted = removed & _opponents(slot)
    out = wanted & np.isnan(made[:, 0])
    if not out.any():
        struck = np.hypot(*(made - before).T)[wanted] > MOVED
        return int(bool(struck.any()))
    lost = np.isfinite(before[:, 0]) & np.isnan(made[:, 0]) & ~removed & ~_opponents(slot)
    if not out[wanted].all() or lost.any():
        return 2
    if not stays or np.isnan(called[slot, 0]):
        return BEST
    if np.isnan(made[slot, 0]):
        return 2
    return BEST if np.hypot(*(made - called)[slot]) <= DRAW_REACH[1] else 3


def _opponents(slot: int) -> Flags:
    """Places of the other team's stones in a position, (16,)."""
    return np.arange(SLOTS) // STONES_PER_TEAM != slot // STONES_PER_TEAM
