"""Conversion of actions, numbers in [-1, 1], to throws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from curling_env.envs.options import brief, floats_from
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.slides import NO_BOUNDS, SlideEnd, slide
from curling_env.sheet import HACK_Y, HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import FROM_HOG_LINE, MAX_SPEED, MAX_SPIN, Delivery, Throw
from curling_env.typing import Floats, Singles

AN_ACTION = "an action must be three finite numbers in [-1, 1]"

MAX_HIT_WEIGHT = 1.6
"""Maximum speed of throws if there are stones to hit, relative to draw weight."""


@dataclass(frozen=True, kw_only=True)
class ThrowRange:
    """Range of throws for an agent; an action of 0 is the middle of each range.

    Parameters
    ----------
    speed : slowest and fastest [m/s]
    angle : rightmost and leftmost line [rad]
    spin : clockwise and counter-clockwise limit [rad/s]

    Raises
    ------
    InputError : a range that is empty or reversed, or holds throws that no one makes
    """

    speed: tuple[float, float]
    angle: tuple[float, float] = (-0.12, 0.12)
    spin: tuple[float, float] = (-3.0, 3.0)

    def __post_init__(self) -> None:
        limits = {"speed": (0.0, MAX_SPEED), "angle": (-1.5, 1.5), "spin": (-MAX_SPIN, MAX_SPIN)}
        for name, (lowest, highest) in limits.items():
            given: Any = getattr(self, name)
            try:
                low, high = map(float, given)
            except (TypeError, ValueError):
                shown = str(given)[:40]
                raise InputError(f"the range of {name} must be two numbers, got {shown}") from None
            if not (lowest <= low < high <= highest) or (name == "speed" and low <= 0):
                raise InputError(
                    f"the range of {name} must rise within {lowest:g} and {highest:g}, "
                    f"got {low:g} to {high:g}"
                )

    @cached_property
    def middle(self) -> Floats:
        """Speed, angle and spin of the action (0, 0, 0), (3,)."""
        return np.array([sum(self.speed), sum(self.angle), sum(self.spin)]) / 2

    @cached_property
    def half(self) -> Floats:
        """Half the width of the ranges of speed, angle and spin, (3,)."""
        low, high = np.array([self.speed, self.angle, self.spin]).T
        return (high - low) / 2

    def throw_of(self, action: ArrayLike) -> Throw:
        """Return the throw of an action; numbers beyond ±1 are clipped.

        Raises
        ------
        InputError : not three finite numbers
        """
        speed, angle, spin = self.numbers_of([action], count=1)[0].tolist()
        return Throw(speed=speed, angle=angle, spin=spin)

    def numbers_of(self, actions: Any, *, count: int | None = None) -> Floats:
        """Return speed, angle and spin of actions (..., 3); beyond ±1 they are clipped.

        Parameters
        ----------
        actions : the actions, in an array or a sequence
        count : how many they must be; None for an array of any shape

        Raises
        ------
        InputError : not three finite numbers each
        """
        given = floats_from(AN_ACTION, actions)
        is_right = given.shape[-1:] == (3,) if count is None else given.shape == (count, 3)
        if not (is_right and np.isfinite(given).all()):
            raise InputError(f"{AN_ACTION}, got {brief(actions[0] if count == 1 else actions)}")
        return self.middle + self.half * np.minimum(np.maximum(given, -1.0), 1.0)

    def action_of(self, throw: Throw) -> Singles:
        """Return the action of a throw, (3,), clipped to ±1."""
        return self.actions_of(np.array([throw.speed, throw.angle, throw.spin]))

    def actions_of(self, numbers: Floats) -> Singles:
        """Return the actions of speeds, angles and spins (..., 3), clipped to ±1."""
        return np.clip((numbers - self.middle) / self.half, -1.0, 1.0).astype(np.float32)


def weight_to(
    ice: Ice,
    y: float,
    direction: Direction = Direction.AWAY,
    *,
    delivery: Delivery = FROM_HOG_LINE,
) -> float:
    """Return the speed at which a straight throw without spin stops at a distance from mid-sheet
    [m/s].

    Parameters
    ----------
    ice : the ice thrown on
    y : where it should stop, along the direction of play from mid-sheet [m]
    direction : the end played to
    delivery : where throws begin

    Returns
    -------
    the speed, to a millimetre per second; MAX_SPEED on ice so heavy that no throw gets there
    """
    low, high = 0.05, MAX_SPEED

    def stops_short(speed: float) -> bool:
        release = Throw(speed=speed).release(direction, delivery=delivery)
        end = slide(ice, release, bounds=bounds)
        return end.end is SlideEnd.REST

    # A slide ends when the stone passes y, so that a fast throw on ice without friction ends too.
    bounds = NO_BOUNDS.copy()
    bounds[3 if direction > 0 else 2] = direction * y
    if stops_short(high - 1e-9):
        return MAX_SPEED
    while high - low > 1e-3:
        middle = (low + high) / 2
        if stops_short(middle):
            low = middle
        else:
            high = middle
    return (low + high) / 2


def throw_range_for(
    ice: Ice, direction: Direction, *, hits: bool, delivery: Delivery = FROM_HOG_LINE
) -> ThrowRange:
    """Return the useful range of throws on an ice.

    It runs from the weight that stops at the far hog line to the weight that reaches the hack.

    Parameters
    ----------
    ice : the ice, as far as the agent knows it
    direction : the end played to
    hits : whether there are stones to hit; the range then reaches to MAX_HIT_WEIGHT times the
        weight that stops at the tee
    delivery : where throws begin, and the fastest
    """
    slow, tee, fast = (
        weight_to(ice, y, direction, delivery=delivery) for y in (HOG_LINE_Y, TEE_Y, HACK_Y)
    )
    if hits:
        fast = max(fast, MAX_HIT_WEIGHT * tee)
    most = delivery.max_speed
    return ThrowRange(speed=(min(slow, most - 0.1), min(fast, most)))


def widest_range(
    ices: Sequence[Ice], *, hits: bool, delivery: Delivery = FROM_HOG_LINE
) -> ThrowRange:
    """Return the range that includes `throw_range_for` each of the ices."""
    ranges = [throw_range_for(ice, Direction.AWAY, hits=hits, delivery=delivery) for ice in ices]
    slowest, fastest = zip(*(one.speed for one in ranges), strict=True)
    return ThrowRange(speed=(min(slowest), max(fastest)))
