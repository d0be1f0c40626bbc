"""How much detail the compression of a film has lost.

The noise of a camera differs in every frame. Where a codec copies most pixels from frame to frame,
it has lost small changes in the picture of a stone as well: a slow stone then lags behind its true
place, and its handle behind its true heading.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from curling_env.typing import Image
from friction_estimation.film.frame import Frame
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.background import Background


class CompressionMonitor:
    """Measures what share of the pixels on the ice is merely copied from frame to frame.

    Parameters
    ----------
    background : its part of the picture is watched
    """

    def __init__(self, background: Background) -> None:
        rows, columns = background.slices
        self._patches = [
            (_patch(rows, down), _patch(columns, across))
            for down, across in tuning.COMPRESSION_PATCHES
        ]
        self._shares: list[float] = []

    def watch(self, frames: Iterable[tuple[float, Frame]]) -> Iterator[tuple[float, Frame]]:
        """The same frames, some of which are compared as they pass."""
        before: list[Image] = []
        every = tuning.COMPRESSION_INTERVAL
        for k, (t, frame) in enumerate(frames):
            if k % every >= every - 2:
                now = [np.asarray(frame[patch]) for patch in self._patches]
                if k % every == every - 1 and before:
                    self._compare(before, now)
                before = now
            yield t, frame

    def _compare(self, before: list[Image], now: list[Image]) -> None:
        darkest, brightest = tuning.COMPRESSION_GREYS
        for one, other in zip(before, now, strict=True):
            green, after = one[..., 1], other[..., 1]
            lit = (green > darkest) & (green < brightest)
            if np.count_nonzero(lit) > lit.size // 4:
                self._shares.append(float(np.mean(green[lit] == after[lit])))

    @property
    def lag_px(self) -> float:
        """Error of a stone's place that compression causes, as a standard error [px]."""
        if not self._shares:
            return 0.0
        share = float(np.median(self._shares))
        harmless = tuning.HARMLESS_COPIED_SHARE
        return tuning.COPIED_LAG_PX * max(share - harmless, 0.0) ** 2 / (1 - harmless) ** 2


def _patch(side: slice, share: float) -> slice:
    """The rows or columns of a patch around a share of a side."""
    first = int(side.start + share * (side.stop - side.start)) - tuning.COMPRESSION_PATCH_PX // 2
    return slice(max(first, side.start), min(first + tuning.COMPRESSION_PATCH_PX, side.stop))
