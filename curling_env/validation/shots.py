"""Throws on one ice for the rows of the table, each computed once."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy import optimize  # pyright: ignore[reportMissingTypeStubs]

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.law import acceleration
from curling_env.physics.motion import GRAVITY
from curling_env.physics.slides import NO_BOUNDS, Slide, SlideEnd, slide
from curling_env.sheet import HOG_LINE_Y, HOG_TO_FAR_TEE
from curling_env.throw import MAX_SPEED, Throw
from curling_env.trajectory import Trajectory

DRAW_SPIN = 1.0
"""Spin of the draw at the hog line [rad/s]; published draws turn 0.9 to 1.01 rad/s."""
HOG_TO_HOG = 2 * HOG_LINE_Y
LEAST_SPEED, LEAST_SCALE, MOST_SCALE = 0.05, 0.05, 20.0


class Shots:
    """Throws on one ice that is long enough for every stone.

    Distances are along the centre line from the hog line of the delivery, where the stone's centre
    is released [m]; speeds are those of the release [m/s].

    Parameters
    ----------
    ice : ice of the throws
    """

    def __init__(self, ice: Ice) -> None:
        self.ice = ice
        self._scaled: dict[tuple[Callable[[Shots], float | None], float], Shots | None] = {}

    def run(
        self,
        speed: float,
        spin: float = DRAW_SPIN,
        *,
        until: float | None = None,
        swept_from: float | None = None,
        fps: float | None = None,
    ) -> Slide | None:
        """Simulate one straight throw; return None if the stone never stops.

        Parameters
        ----------
        until : distance at which it is stopped
        swept_from : time from which it is swept, to the end [s]
        fps : samples per second of its path; None for no path
        """
        bounds = NO_BOUNDS.copy()
        if until is not None:
            bounds[3] = until - HOG_LINE_Y
        release = Throw(speed=speed, angle=0.0, spin=spin).release()
        if swept_from is not None:
            release = replace(release, sweep_start=swept_from, sweep_end=1e6)
        try:
            return slide(self.ice, release, bounds=bounds, fps=fps)
        except InputError:
            return None

    def followed(self, speed: float, fps: float, spin: float = DRAW_SPIN) -> Trajectory | None:
        """Return the path of a straight throw at `fps` samples per second; None if it never
        stops.
        """
        run = self.run(speed, spin, fps=fps)
        return None if run is None else run.trajectory

    def carry(self, speed: float, spin: float = DRAW_SPIN) -> float:
        """Return the distance of a throw; infinite if it never stops [m]."""
        run = self.run(speed, spin)
        return math.inf if run is None else run.y + HOG_LINE_Y

    def weight(self, distance: float, spin: float = DRAW_SPIN) -> float | None:
        """Return the speed of a throw that stops at a distance; None if none does [m/s]."""
        return _root(lambda speed: self.carry(speed, spin) - distance, LEAST_SPEED, MAX_SPEED)

    def time_to(self, distance: float, speed: float, spin: float = DRAW_SPIN) -> float | None:
        """Return the time from the release to a distance; None if the stone does not reach it
        [s].
        """
        run = self.run(speed, spin, until=distance)
        return run.time if run is not None and run.end is SlideEnd.LEFT_BOUNDS else None

    def hog_to_hog(self, distance: float) -> float | None:
        """Return the time from hog line to hog line of a stone that stops at a distance [s]."""
        speed = self.weight(distance)
        return None if speed is None else self.time_to(HOG_TO_HOG, speed)

    def weight_of_time(self, seconds: float) -> float | None:
        """Return the speed of a throw with a hog-to-hog time; None if absent."""

        def later(speed: float) -> float:
            time = self.time_to(HOG_TO_HOG, speed)
            return math.inf if time is None else time - seconds

        return _root(lambda speed: -later(speed), LEAST_SPEED, MAX_SPEED)

    @cached_property
    def draw_speed(self) -> float | None:
        """Speed of a draw to the tee [m/s]."""
        return self.weight(HOG_TO_FAR_TEE)

    @cached_property
    def draw(self) -> Slide | None:
        """Draw to the tee."""
        return None if self.draw_speed is None else self.run(self.draw_speed)

    def draw_turning(self, spin: float) -> Slide | None:
        """Return a draw to the tee with another spin [rad/s]."""
        speed = self.weight(HOG_TO_FAR_TEE, spin)
        return None if speed is None else self.run(speed, spin)

    def friction_at(self, speed: float, spin: float = DRAW_SPIN) -> float:
        """Return the total deceleration along the path over g, mid-sheet."""
        state = np.array([[0.0, 0.0, 0.0, speed, spin]])
        return float(-acceleration(self.ice, state)[0, 1] / GRAVITY)

    def scaled(self, factor: float) -> Shots:
        """Return the same on ice with the friction multiplied by a factor."""
        friction = replace(
            self.ice.friction,
            mu=np.clip(self.ice.friction.mu * factor, 1e-9, 1.0),
            sigma=self.ice.friction.sigma * factor,
        )
        return Shots(replace(self.ice, friction=friction))

    def scaled_until(self, measure: Callable[[Shots], float | None], wanted: float) -> Shots | None:
        """Return the same on ice with the friction scaled to a wanted measure; None if impossible.

        Parameters
        ----------
        measure : measure of the scaled ice, monotonic in the friction
        """
        key = (measure, wanted)
        if key not in self._scaled:
            self._scaled[key] = self._scale_until(measure, wanted)
        return self._scaled[key]

    def _scale_until(self, measure: Callable[[Shots], float | None], wanted: float) -> Shots | None:

        def off(log_scale: float) -> float:
            found = measure(self.scaled(math.exp(log_scale)))
            return math.nan if found is None else found - wanted

        scales = np.linspace(math.log(LEAST_SCALE), math.log(MOST_SCALE), 25)
        found = [(s, o) for s in scales if math.isfinite(o := off(float(s)))]
        for (s0, o0), (s1, o1) in itertools.pairwise(found):
            if o0 * o1 <= 0:
                return self.scaled(math.exp(_brent(off, float(s0), float(s1))))
        return None

    def with_effect(self, name: str, **parameters: float) -> Shots:
        """Return the same on ice with this effect as the only one of its name."""
        others = tuple(effect for effect in self.ice.effects if effect.name != name)
        effect = ActiveEffect(name=name, parameters=parameters)
        return Shots(replace(self.ice, effects=(*others, effect)))


def _brent(function: Callable[[float], float], low: float, high: float) -> float:
    brentq: Any = optimize.brentq  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    return float(brentq(function, low, high, xtol=1e-11))


def _root(rises: Callable[[float], float], low: float, high: float) -> float | None:
    """Find the zero of an increasing function by bisection; None if absent in the interval.

    The function may be infinite in places, where a stone never stops or never reaches a line.
    """
    if not rises(low) < 0 < rises(high):
        return None
    for _ in range(200):
        if rises(high) < math.inf and rises(low) > -math.inf:
            return _brent(rises, low, high)
        middle = 0.5 * (low + high)
        if rises(middle) < 0:
            low = middle
        else:
            high = middle
        if high - low < 1e-12:
            return None
    return None
