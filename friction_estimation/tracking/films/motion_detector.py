"""Detector of motion on the ice, with the size that a stone would have there."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false

from __future__ import annotations

from collections import deque

import cv2
import numpy as np

from curling_env.typing import Floats, Image
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.scene import Scene
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.background import sheet_region


class MotionDetector:
    """Detector of motion on the sheet, from the brightness of a camera's frames.

    Parameters
    ----------
    stones : (rows, columns) share of a stone's picture that each square of the picture covers; 0
        beside the sheet
    region : rows and columns of a frame that these squares fill
    """

    def __init__(self, stones: Floats, region: tuple[slice, slice]) -> None:
        self._region, self._shape, self._on_sheet = region, stones.shape, stones > 0
        self._stones = stones[self._on_sheet]
        self._looks: deque[tuple[float, Image]] = deque()
        self._last_look = -np.inf

    @classmethod
    def for_camera(cls, camera: Camera, scene: Scene) -> MotionDetector:
        """Make the detector for a camera and a sheet."""
        square_px = tuning.SQUARE_PX
        rows, columns = (
            slice(side.start, side.stop - (side.stop - side.start) % square_px)
            for side in sheet_region(camera, scene.sheet)
        )
        v, u = (
            np.arange(side.start, side.stop, square_px) + (square_px - 1) / 2
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
        """Return whether an object has moved shortly before a time.

        Parameters
        ----------
        t : time of the frame [s]
        grey : its brightness, (height, width)
        """
        if t - self._last_look < tuning.LOOK_INTERVAL:
            return False
        self._last_look = t
        rows, columns = self._shape
        now = cv2.resize(grey[self._region], (columns, rows), interpolation=cv2.INTER_AREA)
        now = np.asarray(now, dtype=np.int16)
        self._looks.append((t, now))
        while len(self._looks) > 1 and self._looks[1][0] <= t - tuning.COMPARED_AFTER:
            self._looks.popleft()
        change = (now - self._looks[0][1])[self._on_sheet]
        step = max(1, min(tuning.LEVEL_STEP, change.size // tuning.LEVEL_SQUARES))
        change = np.abs(change - int(np.median(change[::step])))
        noise = 1.48 * float(np.median(change[::step]))
        changed = change > max(tuning.MIN_CONTRAST, tuning.NOISE_TIMES * noise)
        return float(self._stones[changed].sum()) > tuning.MOVING_STONE_SHARE
