"""Lucas-Kanade optical flow, plain and pyramidal, as the paper tracks stones.

The errors of all frames add up to a drift of decimetres (docs/validation.md). The built-in tracker
fits the stone's picture in every frame instead.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats, Image
from friction_estimation.tracking import tuning

FlowMethod = Literal["plain", "pyramidal"]
"""Optical flow at one scale, or from coarse to fine."""
FLOW_METHODS: tuple[FlowMethod, ...] = ("plain", "pyramidal")
LEVELS = 3
"""Halvings of the picture in pyramidal optical flow: motions of up to some 40 px a frame."""
WINDOW_PX = 9
"""Width of the window that is compared [px]."""


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
        "winSize": (WINDOW_PX, WINDOW_PX),
        "maxLevel": LEVELS if method == "pyramidal" else 0,
        "criteria": (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.01),
    }
    start = points_px.astype(np.float32).reshape(-1, 1, 2)
    there, found, _ = cv2.calcOpticalFlowPyrLK(before, after, start, None, **settings)
    back, returned, _ = cv2.calcOpticalFlowPyrLK(after, before, there, None, **settings)
    apart = np.linalg.norm((back - start).reshape(-1, 2), axis=1)
    good = (found.ravel() == 1) & (returned.ravel() == 1) & (apart < tuning.DETECTION_PX)
    return there.reshape(-1, 2).astype(np.float64), good


def points_to_follow(grey: Image, outline_px: Floats, count: int = 12) -> Floats:
    """Return points inside an outline with enough texture for optical flow, (n, 2) [px]."""
    mask = np.zeros(grey.shape, dtype=np.uint8)
    cv2.fillConvexPoly(mask, np.round(outline_px).astype(np.int32), 255)
    found = cv2.goodFeaturesToTrack(grey, count, 0.02, 2, mask=mask, blockSize=3)
    return np.empty((0, 2)) if found is None else found.reshape(-1, 2).astype(np.float64)
