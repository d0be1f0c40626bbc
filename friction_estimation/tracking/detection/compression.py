"""How much a film's compression has eaten: what hardly changed is copied from frame to frame.

A sensor's noise differs in every frame. Where a codec has left next to nothing of it, it has left
out small changes of a stone's picture as well: a slow stone then lags behind where it is, and its
handle shows what it was.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from curling_env.typing import Image
from friction_estimation.film.frame import Frame
from friction_estimation.tracking.detection.background import Background

EVERY = 16
"""One in so many frames is held beside the one before it."""
PATCH_PX = 48
PATCHES = ((0.5, 0.25), (0.5, 0.5), (0.5, 0.75), (0.25, 0.5), (0.75, 0.5))
"""Where in the region of the sheet, as shares of its height and width."""
LIT = (24, 240)
"""Darker and brighter pixels may be alike for other reasons."""
FINE = 0.95
"""Up to this share of copied pixels nothing is lost that would be seen in a track."""
LAG_PX = 0.5
"""How far a stone's picture is off where all pixels are copied. Set on one throw, filmed by
`friction_estimation.synthetic` from the gantry at 540 lines and encoded as H.264 and H.265 in
seven qualities: off by 0.03 to 0.1 px up to a share of 0.95, by 0.14 px at 0.98, by 0.5 px at 1."""


class Copying:
    """Watches frames go by for what is only copied in them.

    Parameters
    ----------
    background : whose region is looked at
    """

    def __init__(self, background: Background) -> None:
        rows, columns = background.slices
        self._patches = [
            (_middle(rows, down), _middle(columns, across)) for down, across in PATCHES
        ]
        self._shares: list[float] = []

    def watched(self, frames: Iterable[tuple[float, Frame]]) -> Iterator[tuple[float, Frame]]:
        """The same frames."""
        before: list[Image] = []
        for k, (t, frame) in enumerate(frames):
            if k % EVERY >= EVERY - 2:
                now = [np.asarray(frame[patch]) for patch in self._patches]
                if k % EVERY == EVERY - 1 and before:
                    self._compare(before, now)
                before = now
            yield t, frame

    def _compare(self, before: list[Image], now: list[Image]) -> None:
        for one, other in zip(before, now, strict=True):
            green, after = one[..., 1], other[..., 1]
            lit = (green > LIT[0]) & (green < LIT[1])
            if np.count_nonzero(lit) > lit.size // 4:
                self._shares.append(float(np.mean(green[lit] == after[lit])))

    @property
    def lag_px(self) -> float:
        """Standard error of a stone's place that frames share for it [px]."""
        if not self._shares:
            return 0.0
        share = float(np.median(self._shares))
        return LAG_PX * max(share - FINE, 0.0) ** 2 / (1 - FINE) ** 2


def _middle(side: slice, share: float) -> slice:
    first = int(side.start + share * (side.stop - side.start)) - PATCH_PX // 2
    return slice(max(first, side.start), min(first + PATCH_PX, side.stop))
