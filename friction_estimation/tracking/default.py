"""The trackers of this package, and the one place that says which of them is the default."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

from friction_estimation.tracking.cutting import pace, throws
from friction_estimation.tracking.found_stone import find_stone, focal_from_stones
from friction_estimation.tracking.joint import recording, tracker
from friction_estimation.tracking.joint.looks import with_focal
from friction_estimation.tracking.pipeline import track_film as track_step_by_step


@dataclass(frozen=True, kw_only=True)
class OwnTracker:
    """A tracker that takes parts of films and solved cameras, and what belongs to it.

    Parameters
    ----------
    track : tracks the stones of one throw
    find_throws : finds the throws of a recording
    find_stone : finds the thrown stone of a film, to solve its camera
    with_focal : a camera with the focal length by the pictures of such stones
    moved : why a track in a part of a recording is not that of a throw, in words; empty if it is
    judged_of : makes what refuses early what was not thrown in a film; None: it takes none
    """

    track: Any
    find_throws: Any
    find_stone: Any
    with_focal: Any
    moved: Any
    judged_of: Any = None


STEP_BY_STEP = OwnTracker(
    track=track_step_by_step,
    find_throws=throws.find_throws,
    find_stone=find_stone,
    with_focal=focal_from_stones,
    moved=pace.moved,
    judged_of=pace.judged_of,
)
JOINT = OwnTracker(
    track=tracker.track,
    find_throws=recording.find_throws,
    find_stone=tracker.find_thrown,
    with_focal=with_focal,
    moved=recording.moved,
)
DEFAULT = JOINT
"""The tracker that is used where no other is chosen."""

track_film = DEFAULT.track


def own_tracker(function: Any) -> OwnTracker | None:
    """The tracker of this package that a function is, with options or without; else None."""
    plain = function.func if isinstance(function, partial) else function
    return next((one for one in (STEP_BY_STEP, JOINT) if one.track is plain), None)
