"""The sheet seen from above."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.sheet import Sheet
from curling_env.typing import Floats, Image
from friction_estimation.camera.camera import Camera


@dataclass(frozen=True, kw_only=True, eq=False)
class TopView:
    """The ice as an image: home end at the bottom, one scale throughout.

    Parameters
    ----------
    sheet : the ice that it shows
    px_per_m : scale [px/m]
    size : width and height [px]
    """

    sheet: Sheet
    px_per_m: float
    size: tuple[int, int]

    @classmethod
    def of(cls, sheet: Sheet, px_per_m: float) -> TopView:
        """Make the top view of a sheet at a scale [px/m]."""
        return cls(
            sheet=sheet,
            px_per_m=px_per_m,
            size=(round(sheet.width * px_per_m), round(sheet.length * px_per_m)),
        )

    def to_view(self, xy: Floats) -> Floats:
        """Points (n, 2) of the sheet frame [m] to the view [px]."""
        xy = np.asarray(xy, dtype=np.float64)
        return np.column_stack(
            [
                (xy[:, 0] + self.sheet.width / 2) * self.px_per_m - 0.5,
                (self.sheet.length / 2 - xy[:, 1]) * self.px_per_m - 0.5,
            ]
        )

    def to_sheet(self, px: Floats) -> Floats:
        """Points (n, 2) of the view [px] to the sheet frame [m]."""
        px = np.asarray(px, dtype=np.float64)
        return np.column_stack(
            [
                (px[:, 0] + 0.5) / self.px_per_m - self.sheet.width / 2,
                self.sheet.length / 2 - (px[:, 1] + 0.5) / self.px_per_m,
            ]
        )

    def maps(self, camera: Camera) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return for every pixel of the view its place in the raw image, for `cv2.remap`."""
        width, height = self.size
        u, v = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
        xy = self.to_sheet(np.column_stack([u.ravel(), v.ravel()]))
        raw = camera.project(np.column_stack([xy, np.zeros(len(xy))])).astype(np.float32)
        return raw[:, 0].reshape(height, width), raw[:, 1].reshape(height, width)

    def of_frame(self, frame: Image, camera: Camera) -> Image:
        """Return a frame as seen from above, limited to the sheet."""
        return cv2.remap(frame, *self.maps(camera), cv2.INTER_LINEAR, borderValue=0)
