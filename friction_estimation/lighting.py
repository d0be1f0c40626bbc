"""Lights that flicker or are switched: every frame brought to the brightness of the first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]

EVERY_PX = 16
"""Brightness is compared in every so many rows and columns; a median needs no more."""
STEADY = 0.05
"""Lights whose brightness stays within this share need no correction."""
DARK = 24
"""Pixels below this grey level tell nothing of the light."""
SATURATED = 250


@dataclass(frozen=True, kw_only=True, eq=False)
class Lighting:
    """The brightness of a film's first frame.

    Parameters
    ----------
    sparse : (rows, columns) of the first frame's green, thinned out
    """

    sparse: Image

    @classmethod
    def of(cls, frame: Image) -> Lighting:
        """From the first frame, BGR."""
        return cls(sparse=_sparse(frame))

    def gain(self, frame: Image) -> float:
        """How much brighter a frame is than the first one; what moves is outvoted."""
        now = _sparse(frame)
        if now.shape != self.sparse.shape:
            return 1.0
        lit = (self.sparse > DARK) & (self.sparse < SATURATED) & (now < SATURATED) & (now > 0)
        if np.count_nonzero(lit) < 100:
            return 1.0
        return float(np.median(now[lit] / self.sparse[lit].astype(np.float64)))

    def evened(self, frame: Image) -> Image:
        """The frame at the first frame's brightness."""
        gain = self.gain(frame)
        return np.asarray(cv2.convertScaleAbs(frame, alpha=1 / gain), dtype=np.uint8)


def flickering(sample: Sequence[tuple[float, Image]]) -> Lighting | None:
    """What evens the light of a film out; None where it is steady.

    Parameters
    ----------
    sample : times [s] and frames, BGR, spread over the film
    """
    if not sample:
        return None
    first = Lighting.of(sample[0][1])
    gains = [first.gain(frame) for _, frame in sample]
    return first if max(gains) / min(gains) - 1 > STEADY else None


def _sparse(frame: Image) -> Image:
    half = EVERY_PX // 2
    return np.ascontiguousarray(frame[half::EVERY_PX, half::EVERY_PX, 1])
