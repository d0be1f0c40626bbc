"""Split of a miss into errors of the release and of reading the ice.

Two throws are compared on two ices. The intended throw reaches its call on the ice that the team
believed in. The actual throw runs on the ice that the session's tracks show. Between the two, the
weight, the line, the rotation and the ice change. The effect of each on the place of rest depends
on the order of the changes; the parts are the means over all orders (Shapley's value), so that they
add up. The difference between the actual throw, simulated on the session's ice, and the measured
rest remains unexplained.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from agents.coaching.misses.causes import SessionCauses, ThrowCauses, pattern_of
from agents.coaching.misses.ices import Parts, agree
from agents.coaching.misses.intended import habits_of
from agents.coaching.misses.seen_throws import see_throws
from agents.coaching.misses.throw_parts import ThrowParts
from agents.coaching.throw_sheet import ALL_RIGHT, Hands, hands_beside
from curling_env.analysis.ice_remarks import missing_effect_remarks
from curling_env.errors import InputError
from curling_env.ice import Ice, load_ice
from curling_env.trajectory import Trajectory
from curling_env.typing import Progress, no_progress
from friction_estimation.tracks.throw_list import (
    NO_NOTES,
    THROW_LIST,
    ThrowNote,
    load_tracks,
    throws_beside,
)

NOT_GIVEN = (
    "the ice that the team believed in was not given: the hand is compared with the session's "
    "ice, and only a called broom or time shows misread ice"
)


def hand_or_ice(
    tracks: Sequence[Trajectory],
    ice: Ice,
    notes: Mapping[int, ThrowNote] = NO_NOTES,
    *,
    believed: Ice | None = None,
    hands: Hands = ALL_RIGHT,
    seed: int = 0,
    progress: Progress = no_progress,
) -> SessionCauses:
    """Find the causes of the miss of each throw with a called target.

    Parameters
    ----------
    tracks : tracks of one session, in order of play
    ice : ice estimated from the session's tracks, with its standard errors
    notes : athlete, stone and call of each throw (`throws_beside`)
    believed : ice that the team planned with; None if unknown
    hands : hands of the athletes
    seed : seed of the sampled errors
    progress : called with the number of throws done

    Raises
    ------
    InputError : an ice with an effect that is not in the catalogue
    """
    rng = np.random.default_rng(seed)
    read, left_out = see_throws(tracks, ice, notes, hands, rng, progress)
    habits = habits_of([(one.sheet, one.released) for one in read])
    explained: list[ThrowParts] = []
    parts: list[Parts] = []
    for one in read:
        try:
            causes = ThrowParts(one, believed, habits, rng)
            parts.append(causes.parts())
            explained.append(causes)
        except InputError as error:
            left_out[one.sheet.throw] = error.problem
    together = agree(parts, rng)
    found = [causes.result(one) for causes, one in zip(explained, together.parts, strict=True)]
    return SessionCauses(
        throws=tuple(found),
        left_out=dict(sorted(left_out.items())),
        pattern=pattern_of(found),
        athletes=tuple(
            pattern
            for name in dict.fromkeys(one.athlete for one in found)
            if name and (pattern := pattern_of(found, name)) is not None
        ),
        believed=believed is not None,
        remarks=_remarks(ice, believed, found, together.remark),
    )


def causes_beside(
    tracks: Path,
    ice: str,
    *,
    believed: str | None = None,
    seed: int = 0,
    progress: Progress = no_progress,
) -> SessionCauses:
    """Find the causes of the misses of one session from its files.

    Parameters
    ----------
    tracks : its tracks, with throws.csv and athletes.csv in the same folder
    ice, believed : a file or a preset each; otherwise as in `hand_or_ice`
    seed, progress : as in `hand_or_ice`

    Raises
    ------
    InputError : a file that cannot be read, or a session without calls
    """
    notes = throws_beside(tracks)
    if not any(note.called for note in notes.values()):
        problem = (
            f"no table {THROW_LIST} with calls next to these tracks; expected the columns "
            'throw, athlete and called, such as "draw 0.3,-1.2 in"'
        )
        raise InputError(problem, source=tracks)
    return hand_or_ice(
        load_tracks(tracks),
        load_ice(ice),
        notes,
        believed=None if believed is None else load_ice(believed),
        hands=hands_beside(tracks),
        seed=seed,
        progress=progress,
    )


def _remarks(
    ice: Ice, believed: Ice | None, found: Sequence[ThrowCauses], shared: str | None
) -> tuple[str, ...]:
    """Return remarks for the reader."""
    remarks = [*([NOT_GIVEN] if believed is None else []), *missing_effect_remarks(ice)]
    if shared is not None:
        remarks.append(shared)
    if not found:
        remarks.append("no throw with a called target was seen from the hog line to rest")
    return tuple(remarks)
