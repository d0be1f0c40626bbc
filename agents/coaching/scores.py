"""Points of drills: draws by their distance from the target, and hits that were made."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import hypot, inf

from agents.coaching.throw_sheet import ThrowSheet
from curling_env.sheet import RING_RADII

POINTS = dict(zip((0.30, *sorted(RING_RADII)[1:]), (5, 4, 3, 2), strict=True))
"""Points of a stone that rests within a distance of its target [m]: a foot, and the rings."""
ELSEWHERE = 1
"""Points of a stone that rests farther from its target."""
HIT = 4
"""Points of a hit that a coach entered as made."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """Throws of an athlete in an evening's drills.

    Parameters
    ----------
    points : in all, of `throws` that count
    miss : mean distance from the target [m], and `best` the smallest one; None without draws
    """

    athlete: str
    throws: int
    points: int
    miss: float | None
    best: float | None


def missed_by(sheet: ThrowSheet) -> float | None:
    """Return the distance from the called target [m]; None where it had none, or no rest."""
    return None if sheet.miss is None else hypot(*(one.value for one in sheet.miss))


def points_of(sheet: ThrowSheet, made: bool | None) -> int | None:
    """Return the points of a throw; None where it does not count.

    Parameters
    ----------
    made : what a coach entered, which counts for hits
    """
    if sheet.call is None:
        return None
    if not sheet.call.rests:
        return None if made is None else HIT * made
    off = missed_by(sheet)
    if off is None:
        return None
    return next((points for radius, points in POINTS.items() if off <= radius), ELSEWHERE)


def leaderboard(throws: Iterable[tuple[ThrowSheet, bool | None]]) -> list[Score]:
    """Return the scores of all athletes, the best first.

    Parameters
    ----------
    throws : each with what a coach entered as *made*
    """
    points: dict[str, list[int]] = {}
    misses: dict[str, list[float]] = {}
    for sheet, made in throws:
        found, off = points_of(sheet, made), missed_by(sheet)
        if found is not None and sheet.athlete:
            points.setdefault(sheet.athlete, []).append(found)
            misses.setdefault(sheet.athlete, []).extend([] if off is None else [off])
    scores = [
        Score(
            athlete=name,
            throws=len(own),
            points=sum(own),
            miss=sum(misses[name]) / len(misses[name]) if misses[name] else None,
            best=min(misses[name], default=None),
        )
        for name, own in points.items()
    ]
    return sorted(scores, key=lambda one: (-one.points, inf if one.miss is None else one.miss))
