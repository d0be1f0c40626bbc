"""Lucas-Kanade optical flow, plain and pyramidal.

Flow predicts where the stone is in the next frame, and the fit of the stone's picture measures it
there: flow alone, as in the paper, drifts, because the errors of all frames add up.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats, Image
from friction_estimation.film.frame import Frame
from friction_estimation.tracking import tuning
from friction_estimation.tracking.films.film_track import FlowMethod

FLOW_METHODS: tuple[FlowMethod, ...] = ("plain", "pyramidal")

_CIRCLE = np.array([(np.cos(a), np.sin(a)) for a in np.linspace(0, 2 * np.pi, 20, endpoint=False)])


def lucas_kanade(
    before: Image, after: Image, points_px: Floats, method: FlowMethod = "pyramidal"
) -> tuple[Floats, NDArray[np.bool_]]:
    """Find where points of one grey picture are in the next.

    Parameters
    ----------
    before, after : (height, width) grey
    points_px : (n, 2)
    method : ``plain`` looks at one scale, ``pyramidal`` from coarse to fine

    Returns
    -------
    (n, 2) points in `after`; (n,) whether a point was found and leads back to its start

    Source
    ------
    Lucas and Kanade 1981; Bouguet, Pyramidal implementation of the Lucas Kanade tracker (2001).
    """
    if len(points_px) == 0:
        return np.empty((0, 2)), np.empty(0, dtype=bool)
    settings = {
        "winSize": (tuning.FLOW_WINDOW_PX, tuning.FLOW_WINDOW_PX),
        "maxLevel": tuning.FLOW_LEVELS if method == "pyramidal" else 0,
        "criteria": (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.01),
    }
    start = points_px.astype(np.float32).reshape(-1, 1, 2)
    there, found, _ = cv2.calcOpticalFlowPyrLK(before, after, start, None, **settings)
    back, returned, _ = cv2.calcOpticalFlowPyrLK(after, before, there, None, **settings)
    apart = np.linalg.norm((back - start).reshape(-1, 2), axis=1)
    good = (found.ravel() == 1) & (returned.ravel() == 1) & (apart < tuning.FLOW_RETURN_PX)
    return there.reshape(-1, 2).astype(np.float64), good


def points_to_follow(grey: Image, outline_px: Floats, count: int = 12) -> Floats:
    """Points inside an outline that flow can hold on to, (n, 2) [px]."""
    mask = np.zeros(grey.shape, dtype=np.uint8)
    cv2.fillConvexPoly(mask, np.round(outline_px).astype(np.int32), 255)
    found = cv2.goodFeaturesToTrack(grey, count, 0.02, 2, mask=mask, blockSize=3)
    return np.empty((0, 2)) if found is None else found.reshape(-1, 2).astype(np.float64)


class LocalFlow:
    """The motion of a small part of the picture, from frame to frame.

    The same points are followed as long as they can be. New ones are looked for now and then, and
    where few are left.
    """

    def __init__(self, method: FlowMethod) -> None:
        self._method: FlowMethod = method
        self._points = np.empty((0, 2))
        self._age = 0

    def forget(self) -> None:
        """Look for new points next time: those of the last frame are not followed on."""
        self._points = np.empty((0, 2))

    def shift(self, before: Frame, after: Frame, corners_px: Floats) -> Floats | None:
        """Motion of what a rectangle of one BGR frame shows to the next frame, (2,) [px].

        It is the median over points; None where fewer than three points can be followed.

        Parameters
        ----------
        corners_px : (2, 2) upper left and lower right corner of the rectangle in `before`
        """
        (u0, v0), (u1, v1) = corners_px.tolist()
        margin = tuning.FLOW_MARGIN_PX
        left, top = max(math.floor(u0) - margin, 0), max(math.floor(v0) - margin, 0)
        part = slice(top, math.ceil(v1) + margin), slice(left, math.ceil(u1) + margin)
        if before[part].size == 0:
            return None
        first, second = _grey(before[part]), _grey(after[part])
        origin = np.array([left, top], dtype=np.float64)
        self._age += 1
        if len(self._points) < tuning.MIN_FLOW_POINTS or self._age > tuning.FLOW_RENEWAL:
            half = (corners_px[1] - corners_px[0]) / 2
            within = corners_px[0] + half - origin + half * _CIRCLE
            self._points, self._age = points_to_follow(first, within) + origin, 0
        points = self._points - origin
        there, good = lucas_kanade(first, second, points, self._method)
        self._points = there[good] + origin
        moved = np.sort((there - points)[good], axis=0)
        if len(moved) < 3:
            return None
        return (moved[(len(moved) - 1) // 2] + moved[len(moved) // 2]) / 2


def _grey(part: Image) -> Image:
    return cv2.cvtColor(np.ascontiguousarray(part), cv2.COLOR_BGR2GRAY)
