"""Random positions, for the tests of this folder."""

from __future__ import annotations

import numpy as np

from agents.playing import SLOTS


def positions(rng, n, delivered):
    """Return positions with stones anywhere in play, without overlaps."""
    stones = np.full((n, SLOTS, 2), np.nan)
    for position in stones:
        for slot in [8 + k for k in range((delivered + 1) // 2)] + list(range(delivered // 2)):
            if rng.random() < 0.2:
                continue
            for _ in range(50):
                place = rng.uniform([-1.8, -5.5], [1.8, 1.7])
                if rng.random() < 0.3:
                    place[0] *= 0.05
                gaps = np.hypot(*(position - place).T)
                if not (gaps < 0.3).any():
                    position[slot] = place
                    break
    return stones
