"""Contact of a stone with lines, house and free guard zone, in the delivery frame.

Every line is taken at the edge that the rule book names: the hog line at its inner edge, 6.401 m
from the tee; the back line at its outer edge, 1.829 m from it; a side line at the edge of the ice.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from curling_env.errors import InputError
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, HOUSE_RADIUS, LINE_WIDTH, TEE_Y

HOG_LINE = HOG_LINE_Y - TEE_Y
"""Inner edge of the far hog line: -6.401 m."""
BACK_LINE = BACK_LINE_Y - TEE_Y
"""Outer edge of the back line: 1.829 m."""


@dataclass(frozen=True, kw_only=True)
class Lines:
    """Geometry of lines, from the sheet's width and the stone's radius.

    Parameters
    ----------
    width : distance between the side lines [m]
    stone_radius : radius of a stone [m]
    touching_counts : count a stone that just touches the house as in it
    whole_guard : require a guard to be wholly before the tee line, not only its centre
    centre_line : width of the centre line [m]

    Raises
    ------
    InputError : a sheet narrower than its house, or a stone without size
    """

    width: float = 4.75
    stone_radius: float = 0.145
    touching_counts: bool = True
    whole_guard: bool = True
    centre_line: float = LINE_WIDTH

    def __post_init__(self) -> None:
        if not self.stone_radius > 0:
            raise InputError(f"stone_radius must be positive, got {self.stone_radius}")
        if not self.width >= 2 * HOUSE_RADIUS:
            raise InputError(f"a sheet must be at least as wide as its house, got {self.width} m")

    @property
    def reach(self) -> float:
        """Maximum distance of a stone's centre from the tee at which it is in the house [m]."""
        touching = HOUSE_RADIUS + self.stone_radius
        return touching if self.touching_counts else math.nextafter(touching, 0.0)

    @property
    def guard_line(self) -> float:
        """Limit of the centre of a guard along play [m]."""
        return -self.stone_radius if self.whole_guard else 0.0

    @property
    def centre_reach(self) -> float:
        """Maximum distance of a stone's centre from the middle at which it touches the centre line
        [m].
        """
        return self.stone_radius + self.centre_line / 2

    def past_hog_line(self, y: float) -> bool:
        """Return whether a stone with its centre at y is wholly past the far hog line's inner
        edge.
        """
        return y - self.stone_radius > HOG_LINE

    def on_sheet(self, x: float, y: float) -> bool:
        """Return whether a stone is clear of the side lines and not wholly past the back line."""
        clear = abs(x) < self.width / 2 - self.stone_radius
        return clear and y - self.stone_radius <= BACK_LINE

    def in_house(self, x: float, y: float) -> bool:
        """Return whether any part of a stone is over the 12-foot ring, seen from above."""
        return math.hypot(x, y) <= self.reach

    def touches_centre_line(self, x: float) -> bool:
        """Return whether any part of a stone is over the centre line."""
        return abs(x) <= self.centre_reach

    def in_free_guard_zone(self, x: float, y: float) -> bool:
        """Return whether a stone in play counts as a guard: before the tee line and not in the
        house.

        A stone on or before the hog line counts too: it is in play there only because it struck
        another. By most rules a stone that touches the tee line is not before it.
        """
        return y < self.guard_line and not self.in_house(x, y)
