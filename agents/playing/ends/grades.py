"""The grade of a shot, 0 to 4, from what was called and what came of it.

Statisticians at championships give four points for a shot that does what the skip called for, none
for one that misses, and some for what it did half (CURLIT, How to score, 2008; Curling Canada's
guidelines are the same). Only the outcome is judged, not whose fault it was, and in doubt to the
player's benefit. Here the call is what the throw does without any error on the ice as the team
reads it. A takeout whose stone stays in play is perfect wherever it stays, unless a roll was
called; how near is near enough is left to the eye, so the distances are ours.
"""

from __future__ import annotations

import numpy as np

from agents.playing.search.positions import SLOTS
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.typing import Flags, Floats

BEST = 4
"""The grade of a shot that was made."""
FRONT_REACH = (0.6, 1.0, 1.5, 2.2)
"""How far from its call a stone before an empty house may rest for 4, 3, 2 and 1 points [m]."""
DRAW_REACH = (0.45, 0.8, 1.3, 2.0)
"""The same for draws and guards of a stone: half of them are perfect, as in championships."""
FINE_REACH = (0.3, 0.6, 1.0, 1.5)
"""The same for freezes, taps and hits that are to take nothing out."""
ROLL = 0.9
"""A stone that is called to stop farther from the stone it hits was called to roll [m]."""
ROLL_REACH = 1.0
"""How far from the called place it may roll for 4 points [m]; 3 beyond."""
MOVED = 0.1
"""A stone that was meant to move by more is part of the call [m]."""
NOT_GRADED = "through the house"

_QUIET = {"guard": "front", "cover": "guard", "freeze": "freeze", "tap": "tap"}
"""Types of the shots without hit weight that are no draws, by the names `search` gives them."""
_HITS = ("control-weight hit", "hit", "firm hit", "peel")

HIT_TYPES = ("takeout", "hit and roll", "peel", "double", "run-back", "other hit")
"""What hits are called for: one stone out, with a roll, or both out; more; a stone by another."""
SHOT_TYPES = ("draw", "front", "guard", "freeze", "tap", *HIT_TYPES)
"""The types by which grades are told, those of statisticians."""


def shot_type(shot: str, before: Floats, called: Floats, slot: int) -> str | None:
    """Which of `SHOT_TYPES` a shot is; None for a stone that is thrown away.

    Parameters
    ----------
    shot : its name
    before, called : (16, 2) positions before it and as called; see
        `agents.playing.search.positions`
    slot : place of the delivered stone in a position
    """
    if shot == NOT_GRADED:
        return None
    if shot not in _HITS:
        return _QUIET.get(shot, "draw")
    removed = _removed(before, called)
    out = removed & _opponents(slot)
    if not out.any():
        return "other hit"
    if out.sum() > 1:
        return "double"
    moved = removed | (np.hypot(*(called - before).T) > MOVED)
    if moved.sum() > 1:
        return "run-back"
    if np.isnan(called[slot, 0]):
        return "peel"
    far = np.hypot(*(called[slot] - before[out][0])) > ROLL
    return "hit and roll" if far else "takeout"


def grade(shot: str, before: Floats, called: Floats, made: Floats, slot: int) -> int | None:
    """Points for a shot, 0 to 4; None for a stone that is thrown away.

    Parameters
    ----------
    shot, before, called, slot : see `shot_type`
    made : (16, 2) positions afterwards
    """
    kind = shot_type(shot, before, called, slot)
    if kind is None:
        return None
    if kind in HIT_TYPES and kind != "other hit":
        return _hit(kind, before, called, made, slot)
    reach = {"front": FRONT_REACH, "draw": DRAW_REACH, "guard": DRAW_REACH}.get(kind, FINE_REACH)
    moved = np.hypot(*(called - before).T) > MOVED
    moved[slot] = True
    return _placed(called[moved], made[moved], reach)


def _placed(called: Floats, made: Floats, reach: tuple[float, ...]) -> int:
    """Points for stones that were to come to rest somewhere: those of the worst of them."""
    gone, meant_gone = np.isnan(made[:, 0]), np.isnan(called[:, 0])
    off = np.where(gone & meant_gone, 0.0, np.hypot(*(made - called).T))
    if np.isnan(off).any():
        return 0
    return int((off.max() <= np.array(reach)).sum())


def _hit(kind: str, before: Floats, called: Floats, made: Floats, slot: int) -> int:
    """Points for what a hit took out, and, where one stone was called, for where the shooter is."""
    removed = _removed(before, called)
    wanted = removed & _opponents(slot)
    out = wanted & np.isnan(made[:, 0])
    if not out.any():
        struck = np.hypot(*(made - before).T)[wanted] > MOVED
        return int(bool(struck.any()))
    lost = _removed(before, made) & ~removed & ~_opponents(slot)
    if not out[wanted].all() or lost.any():
        return 2
    if kind not in ("takeout", "hit and roll"):
        return BEST
    if np.isnan(made[slot, 0]):
        return 2
    rolled = kind == "hit and roll" and np.hypot(*(made - called)[slot]) > ROLL_REACH
    return BEST - 1 if rolled else BEST


def _removed(before: Floats, after: Floats) -> Flags:
    """Places of the stones that are no longer in play, (16,)."""
    return np.isfinite(before[:, 0]) & np.isnan(after[:, 0])


def _opponents(slot: int) -> Flags:
    """Places of the other team's stones in a position, (16,)."""
    return np.arange(SLOTS) // STONES_PER_TEAM != slot // STONES_PER_TEAM
