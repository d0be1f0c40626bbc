"""Throws in a curler's words: weight as a time, line as metres of broom, handle by hand."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from curling_env.ice import Ice
from curling_env.physics.slides import slide
from curling_env.sheet import HOG_LINE_Y, HOUSE_RADIUS, Direction, to_delivery
from curling_env.throw import FROM_HOG_LINE, Delivery, Throw, handles
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from curling_env.units import Units, length


@dataclass(frozen=True, kw_only=True)
class Description:
    """Skip's call of a throw.

    Parameters
    ----------
    hog_to_hog_s : time of the stone's centre from hog line to hog line; None if it stops short
    broom_m : position of the broom on the far tee line, to the right of the centre line from the
        thrower's view
    ice_m : ice to give: distance along the tee line from the target to the broom
    turns : turns of the stone until rest
    right_hander, left_hander : the handle, ``in-turn``, ``out-turn`` or ``no turn``
    ice_on_the_right : true if the broom is to the right of the target
    """

    hog_to_hog_s: float | None
    broom_m: float
    ice_m: float
    turns: float
    right_hander: str
    left_hander: str
    ice_on_the_right: bool

    @property
    def call(self) -> str:
        """Complete call in one sentence, in metres."""
        return self.call_in(Units.METRES)

    def call_in(self, units: Units | None = None) -> str:
        """Return the complete call in one sentence."""
        weight = "a stone that stops before the hog line"
        if self.hog_to_hog_s is not None:
            weight = f"{self.hog_to_hog_s:.1f} s hog to hog"
        given = "no ice"
        if self.ice_m >= 0.01:
            which = "right" if self.ice_on_the_right else "left"
            given = f"{length(self.ice_m, units)} of ice on the {which}"
        return f"{weight}; {given}: the broom {self.broom_in(units)}; {self.handle}"

    def broom_in(self, units: Units | None = None) -> str:
        """Return the position of the broom."""
        if abs(self.broom_m) < 0.01:
            return "on the centre line"
        which = "right" if self.broom_m > 0 else "left"
        outside = ", outside the house" if abs(self.broom_m) > HOUSE_RADIUS else ""
        return f"{length(self.broom_m, units)} {which} of the centre line{outside}"

    @property
    def handle(self) -> str:
        """Handle for either hand, and the turns."""
        if self.right_hander == "no turn":
            return "no turn"
        return (
            f"{self.right_hander} for a right-hander, {self.left_hander} for a left-hander, "
            f"{self.turns:.1f} turns"
        )

    def as_dict(self) -> dict[str, object]:
        """Return the fields, with numbers rounded for people."""
        rounded = {
            key: round(value, 3) if isinstance(value, float) else value
            for key, value in asdict(self).items()
        }
        return {**rounded, "call": self.call}


def seconds_per_speed(
    ice: Ice, throw: Throw, direction: Direction, delivery: Delivery = FROM_HOG_LINE
) -> float | None:
    """Return the change of hog-to-hog time per unit of speed of a throw [s per m/s].

    Parameters
    ----------
    direction : the end played to
    delivery : start of the throws

    Returns
    -------
    None if a slightly slower throw stops before the hog line
    """
    step = 0.02
    slower, faster = (
        _hog_to_hog(_path(ice, replace(throw, speed=throw.speed + change), direction, delivery))
        for change in (-step, step)
    )
    return None if slower is None or faster is None else (faster - slower) / (2 * step)


def _path(ice: Ice, throw: Throw, direction: Direction, delivery: Delivery) -> Trajectory:
    """Return the path of a throw on the empty sheet, in its direction of play."""
    path = slide(ice, throw.release(direction, delivery=delivery), fps=50.0).trajectory
    assert path is not None  # a rate was requested
    return replace(path, xy=direction * path.xy)


def _hog_to_hog(path: Trajectory) -> float | None:
    """Return the time from hog line to hog line; None for a stone that stops before [s]."""
    travelled = path.xy[:, 1]
    if travelled[-1] <= HOG_LINE_Y:
        return None
    near, far = np.interp([-HOG_LINE_Y, HOG_LINE_Y], travelled, path.t)
    return float(far - near)


def describe(
    ice: Ice,
    throw: Throw,
    target: Floats,
    direction: Direction,
    delivery: Delivery = FROM_HOG_LINE,
) -> Description:
    """Describe a throw as it runs on an ice without error and without other stones.

    Parameters
    ----------
    target : (2,) target of the throw, sheet frame [m]
    direction : the end played to
    delivery : start of the throws
    """
    path = _path(ice, throw, direction, delivery)
    broom = throw.x + delivery.start_y * float(np.tan(throw.angle))
    aim = float(to_delivery(target, direction)[0])
    turns = abs(float(path.theta[-1] - path.theta[0])) / (2 * np.pi)
    right, left = handles(throw.spin)
    return Description(
        hog_to_hog_s=_hog_to_hog(path),
        broom_m=broom,
        ice_m=abs(broom - aim),
        turns=turns,
        right_hander=right,
        left_hander=left,
        ice_on_the_right=broom > aim,
    )
