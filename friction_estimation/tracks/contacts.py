"""When stones touched each other, as the tracks of one throw tell together."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from curling_env.trajectory import Trajectory
from friction_estimation.tracks.tuning import CONTACT_TIME_MARGIN, TOUCHING_DISTANCE


def contacts_of(tracks: Sequence[Trajectory]) -> list[list[float]]:
    """Times at which each stone touched another, one list for each track [s].

    The track of a struck stone begins with the contact, and the stone next to it at that moment
    struck it. A contact of which only one stone has a track is not seen.
    """
    found: list[list[float]] = [[] for _ in tracks]
    for struck in tracks:
        if len(struck) < 2 or stays_at_rest(struck):
            continue
        for k, other in enumerate(tracks):
            at = float(struck.t[0])
            alone = other.throw != struck.throw or other is struck
            if alone or len(other) < 2 or not other.t[0] < at <= other.t[-1]:
                continue
            there = [np.interp(at, other.t, other.xy[:, axis]) for axis in range(2)]
            if np.hypot(*(struck.xy[0] - there)) < TOUCHING_DISTANCE:
                found[k].append(at)
    return [sorted(times) for times in found]


def stays_at_rest(track: Trajectory) -> bool:
    """Whether a track is that of an untouched stone: two rows of one place."""
    return len(track) == 2 and bool((np.ptp(track.xy, axis=0) < 0.05).all())


def longest_stretch(track: Trajectory, contacts: Sequence[float]) -> tuple[int, int]:
    """First and past-last row of the longest way between contacts.

    The row at a contact and the one before it may lie on either side of it.

    Parameters
    ----------
    track : track of one stone
    contacts : times at which it touched another stone [s]
    """
    edges = [-np.inf, *sorted(contacts), np.inf]
    best, longest = (0, 0), -1.0
    for begin, end in pairwise(edges):
        after = track.t > begin + CONTACT_TIME_MARGIN
        inside = np.flatnonzero(after & (track.t < end - CONTACT_TIME_MARGIN))
        if len(inside) < 2:
            continue
        travel = float(np.hypot(*(track.xy[inside[-1]] - track.xy[inside[0]])))
        if travel > longest:
            best, longest = (int(inside[0]), int(inside[-1]) + 1), travel
    return best
