"""Films under flickering or switched lights: every frame is brought to the brightness of the first.

Lamps on alternating current pulse a hundred times a second or more often, and a camera reads its
rows one after the other. Bands of light and shade then run over the film, so that every row is
corrected by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from curling_env.typing import Floats, Image

COLUMN_STEP = 16
"""Brightness is compared in every 16th column; a median needs no more."""
ROW_STEP = 4
"""Brightness is compared in every 4th row; bands are some hundred rows wide."""
STEADY_SHARE = 0.05
"""Light that stays within this share of its brightness in every row needs no correction."""
DARK_LEVEL, SATURATED_LEVEL = 24, 250
"""Grey levels below and above which a pixel does not show how bright the light is."""
MIN_PIXELS, MIN_ROW_PIXELS = 100, 16
"""Least number of usable pixels in a frame, and in a row."""
ROW_WEIGHTS = np.array([0.1, 0.25, 0.3, 0.25, 0.1])
"""Weights of a row's neighbours in its gain."""
BAND_SPREAD = 0.01
"""Rows whose gains spread by less than this are corrected alike."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Deflicker:
    """The brightness of a film's first frame.

    Parameters
    ----------
    sparse : (rows, columns) green channel of the first frame, every few pixels
    """

    sparse: Image

    @classmethod
    def of(cls, frame: Image) -> Deflicker:
        """From the first frame, BGR."""
        return cls(sparse=_sparse(frame))

    def gains(self, frame: Image) -> Floats:
        """How much brighter each row of `sparse` is than in the first frame, (rows,).

        A median leaves out what moves; a row without usable pixels takes its neighbours' gain.
        """
        now = _sparse(frame)
        alike = np.ones(len(self.sparse))
        if now.shape != self.sparse.shape:
            return alike
        lit = (
            (self.sparse > DARK_LEVEL)
            & (self.sparse < SATURATED_LEVEL)
            & (now < SATURATED_LEVEL)
            & (now > 0)
        )
        if np.count_nonzero(lit) < MIN_PIXELS:
            return alike
        ratio = np.where(lit, now / np.maximum(self.sparse, 1).astype(np.float64), np.inf)
        count = lit.sum(axis=1)
        rows = np.flatnonzero(count >= MIN_ROW_PIXELS)
        if len(rows) < len(ROW_WEIGHTS):
            return alike * np.median(ratio[lit])
        middle = np.sort(ratio[rows], axis=1)[np.arange(len(rows)), count[rows] // 2]
        everywhere = np.interp(np.arange(len(alike)), rows, middle)
        padded = np.pad(everywhere, len(ROW_WEIGHTS) // 2, mode="reflect", reflect_type="odd")
        return np.convolve(padded, ROW_WEIGHTS, mode="valid")

    def corrected(self, frame: Image) -> Image:
        """The frame at the first frame's brightness."""
        gains = self.gains(frame)
        if np.ptp(gains) < BAND_SPREAD:
            alike = 1 / float(np.median(gains))
            return np.asarray(cv2.convertScaleAbs(frame, alpha=alike), dtype=np.uint8)
        at = (np.arange(frame.shape[0]) - ROW_STEP // 2) / ROW_STEP
        scale = (1 / np.interp(at, np.arange(len(gains)), gains)).astype(np.float32)
        whole = np.broadcast_to(scale[:, None, None], frame.shape)
        even = cv2.multiply(frame, np.ascontiguousarray(whole), dtype=cv2.CV_8U)
        return np.asarray(even, dtype=np.uint8)


def deflicker_for(sample: Sequence[tuple[float, Image]]) -> Deflicker | None:
    """The correction that a film needs; None where its light is steady.

    Parameters
    ----------
    sample : times [s] and frames, BGR, spread over the film
    """
    if not sample:
        return None
    first = Deflicker.of(sample[0][1])
    gains = np.array([first.gains(frame) for _, frame in sample])
    # People may fill a row now and then, but a band runs over all rows.
    low, high = np.quantile(gains, [0.05, 0.95])
    return first if high / low - 1 > STEADY_SHARE else None


def _sparse(frame: Image) -> Image:
    return np.ascontiguousarray(
        frame[ROW_STEP // 2 :: ROW_STEP, COLUMN_STEP // 2 :: COLUMN_STEP, 1]
    )
