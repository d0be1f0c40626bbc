"""Whether something moves on the ice, judged by how large a stone would be there."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false

from __future__ import annotations

from collections import deque

import cv2
import numpy as np

from curling_env.typing import Floats, Image
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.scene import Scene
from friction_estimation.tracking.detection.background import sheet_region

THINNED_PX = 2
"""Brightness is averaged over squares of so many pixels."""
CONTRAST = 12.0
"""Least change of brightness (of 255) that counts, beyond what all of the ice shares."""
SURE = 6.0
"""A change must be so many times the camera's noise, too."""
MOVING_SHARE = 0.2
"""Of a stone's picture, what must change."""
FEWEST = 3
"""Squares that must change, however small a stone is there."""
LOOK_EVERY = 0.1
"""Time between two looks [s]."""
MEMORY = 2.0
"""A look is compared with the one so long before [s]: far from the camera a stone on its last
metre has then moved by a pixel."""


class MotionDetector:
    """Looks at a camera's frames for what moves on the sheet.

    Parameters
    ----------
    stones : (rows, columns) how much of a stone's picture each square of the region is; 0 beside
        the sheet
    region : rows and columns of a frame, whole squares
    """

    def __init__(self, stones: Floats, region: tuple[slice, slice]) -> None:
        self._region, self._shape, self._on_sheet = region, stones.shape, stones > 0
        self._stones = stones[self._on_sheet]
        self._looks: deque[tuple[float, Image]] = deque()
        self._looked = -np.inf

    @classmethod
    def for_camera(cls, camera: Camera, scene: Scene) -> MotionDetector:
        """What a camera at a scene has in front of it."""
        rows, columns = (
            slice(side.start, side.stop - (side.stop - side.start) % THINNED_PX)
            for side in sheet_region(camera, scene.sheet)
        )
        v, u = (
            np.arange(side.start, side.stop, THINNED_PX) + (THINNED_PX - 1) / 2
            for side in (rows, columns)
        )
        px = np.stack(np.meshgrid(u, v), axis=-1)
        xy = camera.on_plane(px.reshape(-1, 2)).reshape(px.shape)
        along_v, along_u = np.gradient(xy, axis=(0, 1))
        square = np.abs(along_u[..., 0] * along_v[..., 1] - along_u[..., 1] * along_v[..., 0])
        half = np.array([scene.sheet.width, scene.sheet.length]) / 2
        on_sheet = np.all(np.abs(xy) <= half, axis=-1)
        stone = np.pi * scene.stone_radius**2
        return cls(np.where(on_sheet, square / stone, 0.0), (rows, columns))

    def detects(self, t: float, grey: Image) -> bool:
        """Whether something has moved before t [s]; grey: brightness, (height, width)."""
        if t - self._looked < LOOK_EVERY:
            return False
        self._looked = t
        rows, columns = self._shape
        now = cv2.resize(grey[self._region], (columns, rows), interpolation=cv2.INTER_AREA)
        now = np.asarray(now, dtype=np.int16)
        self._looks.append((t, now))
        while len(self._looks) > 1 and self._looks[1][0] <= t - MEMORY:
            self._looks.popleft()
        change = (now - self._looks[0][1])[self._on_sheet]
        change = np.abs(change - int(np.median(change)))
        changed = change > max(CONTRAST, SURE * 1.48 * float(np.median(change)))
        moved = float(self._stones[changed].sum())
        return moved > MOVING_SHARE and int(np.count_nonzero(changed)) >= FEWEST
