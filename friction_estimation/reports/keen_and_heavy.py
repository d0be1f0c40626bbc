"""Friction map in a curler's words: keen and heavy parts, and parts without throws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.ice import Ice
from curling_env.sheet import HOG_LINE_Y, RING_RADII
from curling_env.typing import Flags, Floats

ALONG = (
    ("the home end", -np.inf, -HOG_LINE_Y),
    ("the home half", -HOG_LINE_Y, 0.0),
    ("the away half", 0.0, HOG_LINE_Y),
    ("the away end", HOG_LINE_Y, np.inf),
)
"""Parts of the sheet along it, from y to y [m]: before each house, and the halves between them."""
ACROSS = (
    ("left", -np.inf, -RING_RADII[2]),
    ("in the middle", -RING_RADII[2], RING_RADII[2]),
    ("right", RING_RADII[2], np.inf),
)
"""Parts across it, from x to x, looking from the home end to the away end [m]."""
NOTABLE = 0.01
"""Minimum relative difference of friction to report: a smaller one moves a draw by less than a
foot."""
SIGMAS = 2.0
"""Minimum number of standard errors of a difference to report."""
KNOWN_SHARE = 0.2
"""Minimum share of a part's cells that stones have crossed, for any report on it."""


@dataclass(frozen=True, kw_only=True)
class Zone:
    """A part of the sheet.

    Parameters
    ----------
    name : in words, such as ``the away half, left``
    x, y : (2,) from and to, sheet frame [m]
    relative : its friction over that of the whole sheet, less 1; None where too few stones ran
    sigma : standard error of that
    seen : share of its cells that stones crossed
    """

    name: str
    x: tuple[float, float]
    y: tuple[float, float]
    relative: float | None
    sigma: float
    seen: float

    @property
    def stands_out(self) -> bool:
        """True if it differs from the sheet significantly, and by enough for a player to notice."""
        if self.relative is None:
            return False
        return abs(self.relative) >= max(NOTABLE, SIGMAS * self.sigma)

    @property
    def kind(self) -> str:
        """``heavy`` or ``keen``."""
        return "heavy" if (self.relative or 0.0) > 0 else "keen"

    @property
    def words(self) -> str:
        """Description of it, such as ``heavy, 2.1 % more friction``."""
        if self.relative is None:
            return "no throw has passed there"
        if not self.stands_out:
            return "like the rest of the sheet"
        more = "more" if self.relative > 0 else "less"
        return f"{self.kind}, {100 * abs(self.relative):.1f} % {more} friction than the sheet"


def level(ice: Ice) -> float:
    """Return the mean friction of the cells that stones crossed, or else of the whole sheet."""
    seen = ice.friction.observed
    return float(ice.friction.mu[seen].mean() if seen.any() else ice.friction.mu.mean())


def relative_map(ice: Ice) -> Floats:
    """Friction of each cell over that of the sheet, less 1, (rows, columns); NaN where no stone
    ran.
    """
    return np.where(ice.friction.observed, ice.friction.mu / level(ice) - 1.0, np.nan)


def zones(ice: Ice) -> list[Zone]:
    """Return the twelve parts of the sheet, from the home end to the away end, left to right."""
    sheet, seen = ice.sheet, ice.friction.observed
    relative = relative_map(ice)
    sigma = ice.friction.sigma / level(ice)
    x, y = np.meshgrid(sheet.x_centres, sheet.y_centres)
    found: list[Zone] = []
    for along, low, high in ALONG:
        for across, left, right in ACROSS:
            inside: Flags = (y >= low) & (y < high) & (x >= left) & (x < right)
            share = float(seen[inside].mean()) if inside.any() else 0.0
            crossed = inside & seen
            known = share >= KNOWN_SHARE and crossed.any()
            found.append(
                Zone(
                    name=f"{along}, {across}",
                    x=(max(left, -sheet.width / 2), min(right, sheet.width / 2)),
                    y=(max(low, -sheet.length / 2), min(high, sheet.length / 2)),
                    relative=float(relative[crossed].mean()) if known else None,
                    # Errors of neighbouring cells are correlated, so their mean has the same error.
                    sigma=float(sigma[crossed].mean()) if known else 0.0,
                    seen=share,
                )
            )
    return found


def in_a_sentence(ice: Ice) -> str:
    """Describe the keenest and heaviest parts of the sheet, and the share without throws."""
    parts = zones(ice)
    result = sorted((z for z in parts if z.stands_out), key=lambda z: z.relative or 0.0)
    keen = [z for z in result if (z.relative or 0.0) < 0][:2]
    heavy = [z for z in result if (z.relative or 0.0) > 0][::-1][:2]
    sentences = [
        f"{word} at {' and at '.join(_placed(z) for z in those)}"
        for word, those in (("Keen", keen), ("heavy" if keen else "Heavy", heavy))
        if those
    ]
    known = [z for z in parts if z.relative is not None]
    if not known:
        return "Nothing is known of the places of this sheet."
    whole = "; ".join(sentences) if sentences else "No part of the sheet stands out"
    unseen = sum(z.relative is None for z in parts)
    if unseen:
        whole += f". No throw has passed {unseen} of its {len(parts)} parts"
    return f"{whole}."


def _placed(zone: Zone) -> str:
    return f"{zone.name} ({100 * (zone.relative or 0.0):+.1f} %)".replace("-", "−")
