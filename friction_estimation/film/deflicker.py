"""Lights that flicker or are switched: every frame brought to the brightness of the first.

Lamps on alternating current pulse a hundred times a second or more often, and a camera reads its
rows one after the other: so bands of light and shade run over the film, and rows are corrected, not
frames alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from curling_env.typing import Floats, Image

EVERY_PX = 16
"""Brightness is compared in every so many columns; a median needs no more."""
EVERY_ROW = 4
"""Bands are some hundred rows wide."""
STEADY = 0.05
"""Lights whose brightness stays within this share in every row need no correction."""
DARK = 24
"""Pixels below this grey level tell nothing of the light."""
SATURATED = 250
FEWEST = 100
"""Pixels of which the light of a frame is told."""
FEWEST_IN_ROW = 16
SOFT = np.array([0.1, 0.25, 0.3, 0.25, 0.1])
"""Neighbouring rows are read together."""
BANDED = 0.01
"""Rows whose gains spread by less are corrected alike."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Deflicker:
    """The brightness of a film's first frame.

    Parameters
    ----------
    sparse : (rows, columns) of the first frame's green, thinned out
    """

    sparse: Image

    @classmethod
    def of(cls, frame: Image) -> Deflicker:
        """From the first frame, BGR."""
        return cls(sparse=_sparse(frame))

    def gains(self, frame: Image) -> Floats:
        """How much brighter each of the thinned rows is than in the first frame, (rows,).

        What moves is outvoted; a row that tells nothing is as its neighbours are.
        """
        now = _sparse(frame)
        alike = np.ones(len(self.sparse))
        if now.shape != self.sparse.shape:
            return alike
        lit = (self.sparse > DARK) & (self.sparse < SATURATED) & (now < SATURATED) & (now > 0)
        if np.count_nonzero(lit) < FEWEST:
            return alike
        ratio = np.where(lit, now / np.maximum(self.sparse, 1).astype(np.float64), np.inf)
        count = lit.sum(axis=1)
        rows = np.flatnonzero(count >= FEWEST_IN_ROW)
        if len(rows) < len(SOFT):
            return alike * np.median(ratio[lit])
        middle = np.sort(ratio[rows], axis=1)[np.arange(len(rows)), count[rows] // 2]
        everywhere = np.interp(np.arange(len(alike)), rows, middle)
        padded = np.pad(everywhere, len(SOFT) // 2, mode="reflect", reflect_type="odd")
        return np.convolve(padded, SOFT, mode="valid")

    def corrected(self, frame: Image) -> Image:
        """The frame at the first frame's brightness."""
        gains = self.gains(frame)
        if np.ptp(gains) < BANDED:
            alike = 1 / float(np.median(gains))
            return np.asarray(cv2.convertScaleAbs(frame, alpha=alike), dtype=np.uint8)
        at = (np.arange(frame.shape[0]) - EVERY_ROW // 2) / EVERY_ROW
        scale = (1 / np.interp(at, np.arange(len(gains)), gains)).astype(np.float32)
        whole = np.broadcast_to(scale[:, None, None], frame.shape)
        even = cv2.multiply(frame, np.ascontiguousarray(whole), dtype=cv2.CV_8U)
        return np.asarray(even, dtype=np.uint8)


def deflicker_for(sample: Sequence[tuple[float, Image]]) -> Deflicker | None:
    """What evens the light of a film out; None where it is steady.

    Parameters
    ----------
    sample : times [s] and frames, BGR, spread over the film
    """
    if not sample:
        return None
    first = Deflicker.of(sample[0][1])
    gains = np.array([first.gains(frame) for _, frame in sample])
    # A row may be full of people now and then; a band runs over all of them.
    low, high = np.quantile(gains, [0.05, 0.95])
    return first if high / low - 1 > STEADY else None


def _sparse(frame: Image) -> Image:
    return np.ascontiguousarray(frame[EVERY_ROW // 2 :: EVERY_ROW, EVERY_PX // 2 :: EVERY_PX, 1])
