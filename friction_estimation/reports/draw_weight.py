"""Friction in a curler's terms: the draw to the tee on even ice."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from math import pi

from curling_env.ice import FrictionMap, Ice
from curling_env.sheet import HOG_TO_FAR_TEE
from curling_env.units import Units, length, short_length, speed
from curling_env.validation.shots import HOG_TO_HOG, Shots

DRAW_TURNS = 3.0
"""Number of turns of a usual draw."""


class DrawWeight:
    """A straight draw to the tee on ice with one friction everywhere.

    Parameters
    ----------
    ice : sheet, stone and effects
    mu : friction of the even ice
    """

    def __init__(self, ice: Ice, mu: float) -> None:
        self._ice, self._mu = ice, mu
        self._shots = Shots(replace(ice, friction=FrictionMap.uniform(mu, ice.sheet)))

    @cached_property
    def speed(self) -> float | None:
        """Speed at the hog line [m/s]; None where no throw comes to rest at the tee."""
        return self._shots.weight(HOG_TO_FAR_TEE, 0.0)

    @cached_property
    def seconds(self) -> float | None:
        """Time from the hog line to rest [s]."""
        run = None if self.speed is None else self._shots.run(self.speed, 0.0)
        return None if run is None else run.time

    @cached_property
    def hog_to_hog(self) -> float | None:
        """Time from hog line to hog line [s]."""
        return None if self.speed is None else self._shots.time_to(HOG_TO_HOG, self.speed, 0.0)

    @property
    def worth_of_a_per_cent(self) -> tuple[float, float] | None:
        """Effect of one per cent less friction on a draw to the tee: the extra distance of the same
        throw [m], and the extra time from hog line to hog line of the throw that then draws to the
        tee [s].

        None if no draw comes to rest there.
        """
        keener = DrawWeight(self._ice, 0.99 * self._mu)
        if self.speed is None or self.hog_to_hog is None or keener.hog_to_hog is None:
            return None
        further = keener._shots.carry(self.speed, 0.0) - HOG_TO_FAR_TEE
        return further, keener.hog_to_hog - self.hog_to_hog

    @property
    def curl(self) -> float | None:
        """Curl with the usual number of turns [m].

        None on ice without curl, or if no draw comes to rest at the tee.
        """
        if self._ice.effect("curl") is None or self.speed is None or self.seconds is None:
            return None
        spin = 2 * pi * DRAW_TURNS / self.seconds
        runs = [self._shots.run(self.speed, sign * spin) for sign in (1, -1)]
        left, right = (None if run is None else run.x for run in runs)
        return None if left is None or right is None else abs(right - left) / 2


def draw_facts(ice: Ice, mu: float, units: Units = Units.METRES) -> list[tuple[str, str]]:
    """List facts about a friction for curlers: number and meaning; empty where no draw rests.

    Parameters
    ----------
    ice : sheet, stone and effects
    mu : friction of the even ice
    units : units of displayed lengths
    """
    draw = DrawWeight(ice, mu) if mu > 0 else None
    if draw is None or draw.speed is None:
        return []
    pairs = [
        (f"{draw.hog_to_hog:.1f} s", "hog line to hog line, draw to the tee"),
        (f"{draw.seconds:.1f} s", "hog line to rest at the tee"),
        (speed(draw.speed, units), "draw weight at the hog line"),
    ]
    if (curl := draw.curl) is not None:
        pairs.append((length(curl, units), f"curl of a draw that turns {DRAW_TURNS:g} times"))
    if (worth := draw.worth_of_a_per_cent) is not None:
        pairs += [
            (short_length(worth[0], units), "further for a draw where it is 1 % keener"),
            (f"{worth[1]:.2f} s", "longer from hog to hog for a draw on ice 1 % keener"),
        ]
    return pairs
