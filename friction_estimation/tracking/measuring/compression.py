"""Time since the pixels of a stone last changed.

The noise of a camera differs in every frame, and so does the rim of a moving stone. A codec that
drops small changes repeats old pixels: the stone then lags behind its true position, and its handle
behind its true heading. Repeated pixels of still ice do no harm; information is lost only if the
stone has moved and its rim has not changed.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from curling_env.physics.compiled import compiled
from curling_env.typing import Floats
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.background import Background

_OF_NOISE = 9.0
"""Squared gradient in one direction due to noise alone [grey levels²]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Ages:
    """Ages of the pictures of a stone.

    Parameters
    ----------
    t : (n,) times of frames in which that is known [s]
    rim : (n,) time since those pixels last changed that change as the stone moves on [s]
    whole : (n,) the same of all pixels that show the stone [s]
    dropped : (n, 2) way that changes the rim by less than a codec may leave out [m]
    repeated : (n,) share of the rim that shows what it did in the frame before
    """

    t: Floats
    rim: Floats
    whole: Floats
    dropped: Floats
    repeated: Floats

    def around(self, t: Floats) -> Ages:
        """Return means over the frames around other times [s]; 0 without data."""
        first = np.searchsorted(self.t, t - tuning.NEIGHBOURS, side="left")
        last = np.searchsorted(self.t, t + tuning.NEIGHBOURS, side="right")

        def mean(values: Floats) -> Floats:
            total = np.concatenate([[0.0], np.cumsum(values)])
            return (total[last] - total[first]) / np.maximum(last - first, 1)

        dropped = np.column_stack([mean(axis) for axis in self.dropped.T])
        return Ages(
            t=t,
            rim=mean(self.rim),
            whole=mean(self.whole),
            dropped=dropped,
            repeated=mean(self.repeated),
        )


@dataclass(eq=False)
class PixelAges:
    """Record, frame by frame, of the changing pixels of a stone."""

    _known: list[tuple[float, ...]] = field(default_factory=list)
    _before: Frame | None = None
    _changed: NDArray[np.float32] | None = None
    _from: Floats | None = None
    _aim: Floats | None = None

    def add(
        self,
        t: float,
        xy: Floats,
        frame: Frame,
        background: Background,
        camera: Camera,
        model: StoneModel,
    ) -> None:
        """Add a frame in which the stone was measured.

        Parameters
        ----------
        t : time of the frame [s]
        xy : (2,) place of the stone [m]
        """
        before, self._before = self._before, frame
        if self._from is None or self._changed is None:
            self._from, self._changed = xy, np.zeros(frame.shape[:2], dtype=np.float32)
        elif np.linalg.norm(xy - self._from) > tuning.GATE * tuning.DETECTION_M:
            self._aim, self._from = xy - self._from, xy
        window = _window(camera, model, xy, background)
        if before is None or window is None or self._aim is None:
            return
        (rows, columns), (left, top) = window, background.origin_px
        behind = background.image[
            rows.start - top : rows.stop - top, columns.start - left : columns.stop - left
        ]
        aim = self._aim / np.linalg.norm(self._aim)
        aim_px = camera.px_per_metre(xy, model.height / 2) @ aim
        px_per_metre = float(np.linalg.norm(aim_px))
        totals = np.zeros(6)
        _add_ages(
            before[rows, columns],
            frame[rows, columns],
            np.asarray(behind, dtype=np.float32),
            self._changed[rows, columns],
            t,
            aim_px / px_per_metre,
            totals,
        )
        if totals[0] > 0 and totals[2] > 0:
            slope = np.sqrt(totals[0] / totals[5])
            repeated = totals[4] / totals[0]
            dropped = tuning.DROPPED_CHANGE * repeated / slope / px_per_metre
            ages = (totals[1] / totals[0], totals[3] / totals[2])
            self._known.append((t, *ages, repeated, *(dropped * aim).tolist()))

    def seen(self) -> Ages:
        """Return the ages known until now."""
        t, rim, whole, repeated, x, y = np.array(self._known).reshape(-1, 6).T
        return Ages(t=t, rim=rim, whole=whole, dropped=np.column_stack([x, y]), repeated=repeated)


def _window(
    camera: Camera, model: StoneModel, xy: Floats, background: Background
) -> tuple[slice, slice] | None:
    """Return rows and columns around a stone that the background covers; None if they are few."""
    corners = model.extent_px(camera, xy)
    if len(corners) == 0:
        return None
    whole = background.slices
    low = np.floor(corners[0]).astype(int) - tuning.AGE_MARGIN_PX
    high = np.ceil(corners[1]).astype(int) + tuning.AGE_MARGIN_PX + 1
    rows = slice(max(low[1], whole[0].start), min(high[1], whole[0].stop))
    columns = slice(max(low[0], whole[1].start), min(high[0], whole[1].stop))
    return (
        None if min(rows.stop - rows.start, columns.stop - columns.start) < 4 else (rows, columns)
    )


@compiled
def _add_ages(before, now, behind, changed, t, aim, totals):
    """Add up the ages of a stone's pixels.

    A pixel is weighted by its information on the stone's position: the square of its gradient,
    minus that of noise.

    Parameters
    ----------
    before, now, behind : (rows, columns, 3) BGR of the frame before, of this one, and of the ice
        without the stone
    changed : (rows, columns) when a pixel last changed [s], brought up to date in place; 0: it was
        not looked at yet
    t : time of this frame [s]
    aim : (2,) direction of travel in the picture
    totals : (6,) filled in: sum of squared slopes along the travel, and of their ages [s]; the same
        for slopes in any direction; of those along the travel, the sum of pixels that have not
        changed, and the number of pixels
    """
    rows, columns = changed.shape
    for i in range(rows):
        for j in range(columns):
            if changed[i, j] == 0 or before[i, j, 1] != now[i, j, 1]:
                changed[i, j] = t
    for i in range(1, rows - 1):
        for j in range(1, columns - 1):
            right = np.float32(now[i, j + 1, 1]) - behind[i, j + 1, 1]
            right = 0.5 * (right - np.float32(now[i, j - 1, 1]) + behind[i, j - 1, 1])
            down = np.float32(now[i + 1, j, 1]) - behind[i + 1, j, 1]
            down = 0.5 * (down - np.float32(now[i - 1, j, 1]) + behind[i - 1, j, 1])
            along = max((right * aim[0] + down * aim[1]) ** 2 - _OF_NOISE, 0.0)
            slope = max(right**2 + down**2 - 2 * _OF_NOISE, 0.0)
            totals[0] += along
            totals[1] += along * (t - changed[i, j])
            totals[2] += slope
            totals[3] += slope * (t - changed[i, j])
            if along > 0:
                totals[5] += 1
                if before[i, j, 1] == now[i, j, 1]:
                    totals[4] += along
