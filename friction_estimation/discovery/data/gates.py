"""Measurements of light gates: times at known places, with errors of both.

A gate times the front and the rear of a stone at a position along the sheet. As a row of a track
this is a y whose error is that of the time, multiplied by the speed, and that of the gate's
position, which all throws share. The position across the sheet and the rotation are unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from curling_env.errors import TrackTooShortError
from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.tracks.free_slide import FreeSlide

FEWEST_TIMES = 3
"""Minimum number of times of a throw: one more than the unknowns of its release."""
HALF_A_STONE = 0.2
"""Maximum distance of a stone's centre before the hog line while its front is at the line [m]."""
SAME_PLACE = 0.02
"""Maximum distance along the sheet between rows of one edge at one gate [m]."""


class GateErrors(NamedTuple):
    """Errors of a session timed by light gates.

    Parameters
    ----------
    noise : error of a row along the sheet by that of its time, root mean square [m]
    places : (g,) places along the sheet at which stones were timed [m]
    place_sigma : standard error of these [m]
    """

    noise: float
    places: Floats
    place_sigma: float


def gate_slides(tracks: Sequence[Trajectory]) -> tuple[list[FreeSlide], list[str]]:
    """Return the times of every throw from the near hog line on, and the throws with too few times.

    Raises
    ------
    TrackTooShortError : all throws have too few
    """
    slides: list[FreeSlide] = []
    reasons: list[str] = []
    for track in tracks:
        forward = 1.0 if track.xy[-1, 1] >= track.xy[0, 1] else -1.0
        rows = np.flatnonzero(forward * track.xy[:, 1] >= -HOG_LINE_Y - HALF_A_STONE)
        if len(rows) < FEWEST_TIMES:
            reasons.append(
                f"throw {track.throw} has {len(rows)} gate times from the near hog line on, "
                f"needs {FEWEST_TIMES}"
            )
            continue
        slides.append(
            FreeSlide(
                track=track,
                rows=rows,
                stretch=(0, len(track)),
                rests=False,
                wild=0,
                noise=float(np.sqrt(np.mean(row_noise(track)[rows] ** 2))),
            )
        )
    if not slides:
        raise TrackTooShortError(f"no throw can be used: {reasons[0]}")
    return slides, reasons


def row_noise(track: Trajectory) -> Floats:
    """Error of each row along the sheet by that of its time, (n,) [m]."""
    speed = np.abs(np.gradient(track.xy[:, 1], track.t))
    return np.maximum(track.sigma_t * speed, 1e-4)


def gate_errors(slides: Sequence[FreeSlide]) -> GateErrors:
    """Return the errors of the times of all throws together."""
    noise = np.concatenate([row_noise(slide.track)[slide.rows] for slide in slides])
    y = np.sort(np.concatenate([slide.xy[:, 1] for slide in slides]))
    groups = np.split(y, np.flatnonzero(np.diff(y) > SAME_PLACE) + 1)
    claims = [slide.track.sigma_xy[slide.rows] for slide in slides if slide.track.sigma_xy.size]
    known = np.concatenate(claims) if claims else np.zeros(1)
    return GateErrors(
        noise=float(np.sqrt(np.mean(noise**2))),
        places=np.array([group.mean() for group in groups]),
        place_sigma=max(float(np.nan_to_num(np.nanmedian(known))), 1e-4),
    )
