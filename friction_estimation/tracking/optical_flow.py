"""Lucas-Kanade optical flow, plain and pyramidal: predicts where the stone went, and gates.

On its own it drifts, because each frame's error is added to the last; so it predicts here and the
fit of the stone measures. `follow` is the tracker as the paper had it, flow alone.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats, Image
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame

Flow = Literal["plain", "pyramidal"]

FLOWS: tuple[Flow, ...] = ("plain", "pyramidal")
PYRAMID_LEVELS = 3
"""Halvings of the image in the pyramidal form: motions of up to some 40 px a frame."""
WINDOW_PX = 9
BACK_AND_FORTH_PX = 0.5
"""A point must come back to within this of where it began when the flow is reversed."""
AROUND_PX = 32
"""Flow looks so far around a stone."""
FEW_POINTS = 6
SEEK_EVERY = 8
"""New points are looked for where fewer are left, and every so many frames."""
ELLIPSE = np.array([(np.cos(a), np.sin(a)) for a in np.linspace(0, 2 * np.pi, 20, endpoint=False)])


def lucas_kanade(
    before: Image, after: Image, points_px: Floats, flow: Flow = "pyramidal"
) -> tuple[Floats, NDArray[np.bool_]]:
    """Where points of one grey image are in the next.

    Parameters
    ----------
    before, after : (height, width) grey
    points_px : (n, 2)
    flow : ``plain`` looks at one scale, ``pyramidal`` from coarse to fine

    Returns
    -------
    (n, 2) places in `after`; (n,) whether a point was found and leads back to where it began

    Source
    ------
    Lucas and Kanade 1981; Bouguet, Pyramidal implementation of the Lucas Kanade tracker (2001).
    """
    if len(points_px) == 0:
        return np.empty((0, 2)), np.empty(0, dtype=bool)
    settings = {
        "winSize": (WINDOW_PX, WINDOW_PX),
        "maxLevel": PYRAMID_LEVELS if flow == "pyramidal" else 0,
        "criteria": (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.01),
    }
    start = points_px.astype(np.float32).reshape(-1, 1, 2)
    there, found, _ = cv2.calcOpticalFlowPyrLK(before, after, start, None, **settings)
    back, returned, _ = cv2.calcOpticalFlowPyrLK(after, before, there, None, **settings)
    apart = np.linalg.norm((back - start).reshape(-1, 2), axis=1)
    good = (found.ravel() == 1) & (returned.ravel() == 1) & (apart < BACK_AND_FORTH_PX)
    return there.reshape(-1, 2).astype(np.float64), good


def points_to_follow(grey: Image, outline_px: Floats, count: int = 12) -> Floats:
    """Corners of the picture inside an outline that flow can hold on to, (n, 2) [px]."""
    mask = np.zeros(grey.shape, dtype=np.uint8)
    cv2.fillConvexPoly(mask, np.round(outline_px).astype(np.int32), 255)
    found = cv2.goodFeaturesToTrack(grey, count, 0.02, 2, mask=mask, blockSize=3)
    return np.empty((0, 2)) if found is None else found.reshape(-1, 2).astype(np.float64)


class LocalFlow:
    """The motion of what lies at one place of a film, from frame to frame.

    Points that were followed once are followed on; new ones are looked for now and then, and where
    few are left.

    Parameters
    ----------
    flow : Lucas-Kanade in one scale or in a pyramid
    """

    def __init__(self, flow: Flow) -> None:
        self._flow: Flow = flow
        self._points = np.empty((0, 2))
        self._age = 0

    def shift(self, before: Frame, after: Frame, corners_px: Floats) -> Floats | None:
        """Motion of what is in a rectangle of one BGR frame to the next, (2,) [px].

        The median over points; None where fewer than three can be followed. Only what is near the
        rectangle is looked at.

        Parameters
        ----------
        corners_px : (2, 2) of the rectangle in `before`
        """
        (u0, v0), (u1, v1) = corners_px.tolist()
        left, top = max(math.floor(u0) - AROUND_PX, 0), max(math.floor(v0) - AROUND_PX, 0)
        part = slice(top, math.ceil(v1) + AROUND_PX), slice(left, math.ceil(u1) + AROUND_PX)
        if before[part].size == 0:
            return None
        first, second = _grey(before[part]), _grey(after[part])
        origin = np.array([left, top], dtype=np.float64)
        self._age += 1
        if len(self._points) < FEW_POINTS or self._age > SEEK_EVERY:
            half = (corners_px[1] - corners_px[0]) / 2
            within = corners_px[0] + half - origin + half * ELLIPSE
            self._points, self._age = points_to_follow(first, within) + origin, 0
        points = self._points - origin
        there, good = lucas_kanade(first, second, points, self._flow)
        self._points = there[good] + origin
        moved = np.sort((there - points)[good], axis=0)
        if len(moved) < 3:
            return None
        return (moved[(len(moved) - 1) // 2] + moved[len(moved) // 2]) / 2


def _grey(part: Image) -> Image:
    return cv2.cvtColor(np.ascontiguousarray(part), cv2.COLOR_BGR2GRAY)


def follow(
    frames: Iterable[Image], camera: Camera, start_px: Floats, height: float, flow: Flow
) -> Floats:
    """The paper's tracker: points on the stone followed by flow alone, and averaged.

    Parameters
    ----------
    frames : BGR frames, the first of which shows the stone inside `start_px`
    start_px : (n, 2) outline of the stone in the first frame [px]
    height : of the followed points above the ice [m]

    Returns
    -------
    (n, 2) mean of the followed points on their plane [m], up to where all of them are lost
    """
    places: list[Floats] = []
    before: Image | None = None
    points = np.empty((0, 2))
    for frame in frames:
        grey = cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)
        if before is None:
            points = points_to_follow(grey, start_px)
        else:
            there, good = lucas_kanade(before, grey, points, flow)
            points = there[good]
        if len(points) == 0:
            break
        places.append(camera.on_plane(points, height).mean(axis=0))
        before = grey
    return np.array(places).reshape(-1, 2)
