"""Image stabilisation: motion of the camera, and frames moved back where it swayed.

Corners that stand out in the first frame (paint, posts, boards) are found again in later ones. The
similarity that most of them follow is the camera's motion; moving objects do not follow it. A sway
of some pixels is corrected. A camera that pans, zooms or is knocked over is refused, because the
points of its scene no longer hold.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.typing import Floats, Image

FEATURES = 160
FEATURE_QUALITY = 0.02
FEATURE_DISTANCE_PX = 16
MIN_FIRST_CORNERS = 20
"""Minimum number of corners in the first frame, to separate the camera's motion from that of
people.
"""
MIN_MOTION_CORNERS = 6
"""Minimum number of corners that move together in a motion of the camera."""
IN_PLACE_PX = 0.5
IN_PLACE_SHARE = 0.4
"""Ratio of fixed corners to corners that move together above which the camera held still.
People crossing a bare sheet may carry more corners than the sheet has.
"""
TOLERANCE_PX = 1.0
"""Maximum deviation of a corner from the common motion."""
MIN_SHARE = 0.35
"""Share of the first frame's corners that must move together."""
STILL_PX = 0.3
"""Maximum motion anywhere in the picture of a camera that holds still."""
SWAY_SHARE = 0.02
"""Maximum sway that is corrected, as a share of the picture's width."""
ZOOM_SHARE = 0.01
"""Maximum change of scale that is corrected."""
TILES = (6, 8)
"""Number of rows and columns of tiles in which two pictures are compared."""
DETAIL_PX = 4.0
"""Maximum size of compared detail: lines and edges, which even a small move displaces."""
MIN_TILE_CONTRAST = 4.0
"""Minimum standard deviation of a tile that is compared [grey levels]."""
MIN_CORRELATION = 0.7
"""Minimum correlation of tiles with the same content; between different views it is near 0."""
MIN_EQUAL_SHARE = 0.4
"""Minimum share of the tiles with the same content; people stand before the others."""
CHECKED_FRAMES = 12
"""Number of frames in which the camera's motion is measured."""


class CameraMovesError(InputError):
    """Film of a camera that pans, zooms or cuts."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Stabiliser:
    """Stabiliser that moves frames back to the camera's first position.

    Parameters
    ----------
    grey : (rows, columns) the first frame
    corners_px : (n, 1, 2) its tracked corners
    """

    grey: Image
    corners_px: NDArray[np.float32]

    @classmethod
    def of(cls, frame: Image) -> Stabiliser:
        """Make the stabiliser from the first frame of a film, BGR."""
        grey = np.asarray(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
        corners = cv2.goodFeaturesToTrack(grey, FEATURES, FEATURE_QUALITY, FEATURE_DISTANCE_PX)
        if corners is None:
            corners = np.empty((0, 1, 2), dtype=np.float32)
        else:
            cv2.cornerSubPix(
                grey,
                corners,
                (5, 5),
                (-1, -1),
                (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.01),
            )
        return cls(grey=grey, corners_px=np.asarray(corners, dtype=np.float32))

    def motion(self, frame: Image) -> Floats | None:
        """Return the similarity (2, 3) from the first frame's pixels to this frame's.

        None if too few corners move together: another view, or hardly any corners at all.
        """
        grey = np.asarray(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
        if len(self.corners_px) < MIN_MOTION_CORNERS or grey.shape != self.grey.shape:
            return None
        there, found, _ = cv2.calcOpticalFlowPyrLK(
            self.grey, grey, self.corners_px, None, winSize=(21, 21), maxLevel=4
        )
        good = found.ravel() == 1
        apart = np.linalg.norm((there - self.corners_px)[good, 0], axis=1)
        in_place = np.count_nonzero(apart < IN_PLACE_PX)
        matrix, together = None, 0
        if np.count_nonzero(good) >= MIN_MOTION_CORNERS:
            matrix, inside = cv2.estimateAffinePartial2D(
                self.corners_px[good],
                there[good],
                method=cv2.RANSAC,
                ransacReprojThreshold=TOLERANCE_PX,
                maxIters=500,
            )
            together = 0 if inside is None else np.count_nonzero(inside)
        if in_place >= MIN_MOTION_CORNERS and in_place >= IN_PLACE_SHARE * together:
            return np.eye(2, 3)
        if matrix is None or together < max(MIN_MOTION_CORNERS, MIN_SHARE * len(self.corners_px)):
            return None
        return np.asarray(matrix, dtype=np.float64)

    def same_view(self, frame: Image) -> bool:
        """Return whether a frame shows the same view as the first one, apart from people.

        On bare ice most corners are on people, and they all walk away.
        """
        grey = np.asarray(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
        if grey.shape != self.grey.shape:
            return False
        first, other = _detail(self.grey), _detail(grey)
        rows = np.array_split(np.arange(grey.shape[0]), TILES[0])
        columns = np.array_split(np.arange(grey.shape[1]), TILES[1])
        likeness: list[float] = []
        for down in rows:
            for across in columns:
                part = slice(down[0], down[-1] + 1), slice(across[0], across[-1] + 1)
                before, now = first[part], other[part]
                spread = float(before.std())
                if spread > MIN_TILE_CONTRAST:
                    both = spread * max(float(now.std()), 1.0)
                    likeness.append(float(np.mean(before * now)) / both)
        alike = sum(one > MIN_CORRELATION for one in likeness)
        return alike >= MIN_MOTION_CORNERS and alike >= MIN_EQUAL_SHARE * len(likeness)

    def stabilised(self, frame: Image) -> Image:
        """Return the frame as seen from the camera's first position."""
        motion = self.motion(frame)
        if motion is None:
            return frame
        return np.asarray(
            cv2.warpAffine(
                frame,
                motion,
                (frame.shape[1], frame.shape[0]),
                flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP,
                borderMode=cv2.BORDER_REPLICATE,
            ),
            dtype=np.uint8,
        )


def _detail(grey: Image) -> NDArray[np.float32]:
    """Return a picture without its broad light and shade."""
    fine = np.asarray(grey, dtype=np.float32)
    return np.asarray(fine - cv2.GaussianBlur(fine, (0, 0), DETAIL_PX), dtype=np.float32)


def sway_px(motion: Floats, corners_px: NDArray[np.float32]) -> float:
    """Return the largest displacement of corners (n, 1, 2) by a similarity [px]."""
    corners = corners_px.reshape(-1, 2)
    moved = corners @ motion[:, :2].T + motion[:, 2]
    return float(np.linalg.norm(moved - corners, axis=1).max())


def stabiliser_for(sample: Sequence[tuple[float, Image]], source: str | Path) -> Stabiliser | None:
    """Return the stabiliser of a film; None if its camera held still, or if that is unknown.

    Parameters
    ----------
    sample : times [s] and frames, BGR, spread over the film, the first one first
    source : the film, for messages

    Raises
    ------
    CameraMovesError : the camera moves or zooms by more than can be corrected
    """
    if len(sample) < 2:
        return None
    stabiliser = Stabiliser.of(sample[0][1])
    if len(stabiliser.corners_px) < MIN_FIRST_CORNERS:
        return None
    width = sample[0][1].shape[1]
    every = max(1, (len(sample) - 1) // CHECKED_FRAMES)
    swayed = 0.0
    for t, frame in sample[every::every]:
        motion = stabiliser.motion(frame)
        if motion is None and stabiliser.same_view(frame):
            continue
        if motion is None:
            raise CameraMovesError(
                "this camera moves: the view differs from the first frame; expected a film of a "
                "fixed camera",
                source=source,
                where=f"at {t:.1f} s",
            )
        zoom = float(np.hypot(*motion[:, 0])) - 1
        moved = sway_px(motion, stabiliser.corners_px)
        if abs(zoom) > ZOOM_SHARE:
            raise CameraMovesError(
                f"this camera moves: it has zoomed by {100 * zoom:+.1f} % since the first frame; "
                "expected a film of a fixed camera",
                source=source,
                where=f"at {t:.1f} s",
            )
        if moved > SWAY_SHARE * width:
            raise CameraMovesError(
                f"this camera moves: by {moved:.0f} px since the first frame; expected a film of "
                f"a fixed camera (sway below {SWAY_SHARE * width:.0f} px is corrected)",
                source=source,
                where=f"at {t:.1f} s",
            )
        swayed = max(swayed, moved)
    return stabiliser if swayed > STILL_PX else None
