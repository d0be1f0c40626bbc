"""A throw in a curler's words: weight as a time, line as metres of broom, handle by hand."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from curling_env.ice import Ice
from curling_env.physics.one_stone.slide import slide
from curling_env.sheet import HOG_LINE_Y, HOUSE_RADIUS, TEE_Y, Direction, to_delivery
from curling_env.throw import Throw, handles
from curling_env.typing import Floats


@dataclass(frozen=True, kw_only=True)
class Description:
    """What a skip would call.

    Parameters
    ----------
    hog_to_hog_s : time of the stone's centre from hog line to hog line; None if it stops short
    broom_m : where the broom is held on the far tee line, to the right of the centre line as seen
        by the thrower
    ice_m : distance along the tee line from the target to the broom: the ice that is given
    turns : turns of the stone on its way
    right_hander, left_hander : the handle, ``in-turn``, ``out-turn`` or ``no turn``
    call : all of it in a sentence
    """

    hog_to_hog_s: float | None
    broom_m: float
    ice_m: float
    turns: float
    right_hander: str
    left_hander: str
    call: str

    def as_dict(self) -> dict[str, object]:
        """The fields, with numbers rounded to what a person can use."""
        return {
            key: round(value, 3) if isinstance(value, float) else value
            for key, value in asdict(self).items()
        }


def describe(ice: Ice, throw: Throw, target: Floats, direction: Direction) -> Description:
    """Describe a throw as it runs on an ice without error and without other stones.

    Parameters
    ----------
    target : (2,) target of the throw, sheet frame [m]
    direction : the end played to
    """
    path = slide(ice, throw.release(direction), fps=50.0).trajectory
    assert path is not None  # a rate was given
    travelled = direction * path.xy[:, 1]
    crossing = None
    if travelled[-1] > HOG_LINE_Y:
        crossing = float(np.interp(HOG_LINE_Y, travelled, path.t))
    broom = throw.x - (HOG_LINE_Y + TEE_Y) * float(np.tan(throw.angle))
    aim = float(to_delivery(target, direction)[0])
    turns = abs(float(path.theta[-1] - path.theta[0])) / (2 * np.pi)
    right, left = handles(throw.spin)
    return Description(
        hog_to_hog_s=crossing,
        broom_m=broom,
        ice_m=abs(broom - aim),
        turns=turns,
        right_hander=right,
        left_hander=left,
        call=_call(crossing, broom, aim, turns, right, left),
    )


def _call(
    crossing: float | None, broom: float, aim: float, turns: float, right: str, left: str
) -> str:
    weight = (
        f"{crossing:.1f} s hog to hog" if crossing else "a stone that stops before the hog line"
    )
    ice = abs(broom - aim)
    side = "right" if broom > aim else "left"
    given = f"{ice:.2f} m of ice on the {side}" if ice >= 0.01 else "no ice"
    place = f"{abs(broom):.2f} m {'right' if broom > 0 else 'left'} of the centre line"
    if abs(broom) < 0.01:
        place = "on the centre line"
    elif abs(broom) > HOUSE_RADIUS:
        place += ", outside the house"
    handle = (
        "no turn"
        if right == "no turn"
        else f"{right} for a right-hander, {left} for a left-hander, {turns:.1f} turns"
    )
    return f"{weight}; {given}: the broom {place}; {handle}"
