"""Agreement of a camera with the paint, curve by curve: an independent check of a fit.

A fit uses only paint within its search radius. Here every ring and line in view is searched for
over a third of a metre and more around its place. A curve that is seen elsewhere contradicts the
camera; one that is hidden or not painted is no evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from curling_env.typing import Singles
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.markings import (
    CURVES,
    Markings,
    group_means,
    measure_markings,
    responses_of,
)
from friction_estimation.camera.tuning import AGREEING_SHARE, MIN_CONTRAST, TOLERANCE_PX

OPTIONAL = ("button", "border")
"""Curves that clubs paint in different sizes, or cover."""
REACH = 0.45
"""Search distance of a curve, if nothing else is painted there [m]."""
STEPS = 6
"""Number of neighbouring points that are compared together: about half a metre of a curve."""
MIN_PARTS = 3
"""Minimum number of such parts in view."""
DISTINCT = 4.0
"""Minimum response of a curve over the mean response of its surroundings."""


@dataclass(frozen=True, kw_only=True)
class SeenCurve:
    """A ring or line in view, compared with its place according to a camera.

    Parameters
    ----------
    name : its name, with its end where both are in view
    miss_px : root mean square distance of its parts from where the camera puts them [px]
    parts : number of its parts
    near, elsewhere : shares of them that are seen there, and that are seen elsewhere
    """

    name: str
    miss_px: float
    parts: int
    near: float
    elsewhere: float

    @property
    def agrees(self) -> bool:
        """Return whether it is seen in its place according to the camera."""
        return self.near >= AGREEING_SHARE

    @property
    def contradicts(self) -> bool:
        """Return whether it is seen elsewhere."""
        # An object may lie there.
        least = max((1 - AGREEING_SHARE) * self.parts, MIN_PARTS)
        return not self.agrees and self.elsewhere * self.parts > least - 0.5


def seen_curves(
    camera: Camera,
    grey: Singles,
    origin_px: tuple[int, int],
    markings: Markings,
) -> list[SeenCurve]:
    """Compare every ring and line in view with its place according to a camera.

    Parameters
    ----------
    camera : the camera to judge
    grey, origin_px, markings : as in `measure_markings`
    """
    inside = camera.sees(markings.seen_from(camera))
    ends = np.sign(markings.xy[:, 1])
    both = len(np.unique(ends[inside & markings.of("12-foot ring")])) > 1
    found: list[SeenCurve] = []
    for k, name in enumerate(CURVES):
        for end in (-1.0, 1.0):
            own = inside & (markings.curve == k) & (ends == end)
            label = f"{'home' if end < 0 else 'away'} {name}" if both else name
            if name not in OPTIONAL and own.any():
                found += _compared(label, camera, grey, origin_px, markings[own])
    return found


def disagreeing(seen: Sequence[SeenCurve]) -> tuple[str, ...]:
    """Return the names of the curves that contradict a camera; empty if it agrees with the paint.

    These are curves that are seen elsewhere, and rings and hog lines that are not seen at all if
    they are too large a share of those in view.
    """
    bold = [curve for curve in seen if curve.name.endswith(("ring", "hog line"))]
    unseen = [curve for curve in bold if not curve.agrees]
    most = (1 - AGREEING_SHARE) * sum(curve.parts for curve in bold)
    missing = unseen if sum(curve.parts for curve in unseen) > most else []
    return tuple(curve.name for curve in seen if curve.contradicts or curve in missing)


def _compared(
    name: str,
    camera: Camera,
    grey: Singles,
    origin_px: tuple[int, int],
    curve: Markings,
) -> Sequence[SeenCurve]:
    """Compare one curve; None if too little of it is in view."""
    reach = min(REACH, float(curve.clear[0]))
    scale = camera.scale(curve.xy)
    search = max(float(np.nanmax(scale)) * reach, 2 * TOLERANCE_PX)
    sides = ((2.0, 0.0), (0.0, 2.0)) if curve.width[0] else ((1.0, 1.0),)
    found = [
        responses_of(grey, origin_px, camera, curve, search, flanks=flanks) for flanks in sides
    ]
    along = found[0].along_px
    part = np.arange(len(found[0].index)) // STEPS
    if len(np.unique(part)) < MIN_PARTS:
        return []
    means = np.array([group_means(one.strength, part) for one in found])
    # A line is darker than the ice on both sides; the edge of another object, on one side only.
    strength = np.maximum(-means.max(axis=0), 0.0) if curve.width[0] else np.abs(means[0])
    own = np.maximum(group_means(found[0].px_per_metre[:, None] * reach, part), 2 * TOLERANCE_PX)
    strength[np.abs(along) > own] = np.nan
    near = np.nanmax(np.where(np.abs(along) <= TOLERANCE_PX, strength, np.nan), axis=1)
    most = np.nanmax(strength, axis=1)
    distinct = np.maximum(DISTINCT * np.nanmedian(strength, axis=1), MIN_CONTRAST)
    alike = near >= 0.5 * np.minimum(most, np.median(most))
    # The flank of a curve that is slightly farther away does not count.
    beside = np.nanmax(np.where(np.abs(along) <= TOLERANCE_PX + 1, strength, np.nan), axis=1)
    agrees = (near > MIN_CONTRAST) & (alike | (near >= distinct)) & (near >= beside)
    measured = measure_markings(grey, origin_px, camera, curve, TOLERANCE_PX)
    return [
        SeenCurve(
            name=name,
            miss_px=float(np.sqrt(np.mean(measured.offset_px**2))) if agrees.any() else np.inf,
            parts=len(agrees),
            near=float(np.mean(agrees)),
            elsewhere=float(np.mean(~agrees & (most >= distinct))),
        )
    ]
