"""Friction in a curler's terms: the draw to the tee on even ice."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from curling_env.ice import FrictionMap, Ice
from curling_env.physics.aim import Aim
from curling_env.physics.slides import NO_BOUNDS, slide
from curling_env.physics.tuning import FINE_TOLERANCE
from curling_env.sheet import HOG_LINE_Y, TEE_Y
from curling_env.throw import Throw
from curling_env.units import Units, length, short_length, speed

DRAW_TURNS = 3.0
"""Turns of a usual draw on its way."""


class DrawWeight(NamedTuple):
    """A draw to the tee.

    Parameters
    ----------
    speed : speed at the hog line [m/s]
    seconds : time from the hog line to rest [s]
    hog_to_hog : time from hog line to hog line [s]
    """

    speed: float
    seconds: float
    hog_to_hog: float


def draw_weight(ice: Ice, mu: float) -> DrawWeight | None:
    """Return the weight of a draw to the tee on even ice.

    Parameters
    ----------
    ice : sheet, stone and effects
    mu : friction of the even ice

    Returns
    -------
    None where no throw comes to rest at the tee
    """
    even = _even(ice, mu)
    needed = Aim(even, tolerance=FINE_TOLERANCE).draw_weight()
    if needed is None:
        return None
    path = slide(even, Throw(speed=needed).release(), bounds=NO_BOUNDS, fps=60.0).trajectory
    assert path is not None
    hog_to_hog = float(np.interp(HOG_LINE_Y, path.xy[:, 1], path.t))
    return DrawWeight(speed=needed, seconds=path.duration, hog_to_hog=hog_to_hog)


def worth_of_a_per_cent(ice: Ice, mu: float) -> tuple[float, float] | None:
    """Return the effect of one per cent less friction on a draw to the tee.

    Parameters
    ----------
    ice : sheet, stone and effects
    mu : friction of the even ice

    Returns
    -------
    how much further the same throw runs [m], and by how much the time from hog line to hog line of
    the throw that then draws to the tee is longer [s]; None where no draw comes to rest there
    """
    usual, keener = draw_weight(ice, mu), draw_weight(ice, 0.99 * mu)
    if usual is None or keener is None:
        return None
    release = Throw(speed=usual.speed).release()
    rest = slide(_even(ice, 0.99 * mu), release, bounds=NO_BOUNDS)
    return rest.y - TEE_Y, keener.hog_to_hog - usual.hog_to_hog


def curl_of_a_draw(ice: Ice, mu: float) -> float | None:
    """Return the curl of a draw to the tee with a usual turn, beside its line of delivery [m].

    Parameters
    ----------
    ice : sheet, stone and effects
    mu : friction of the even ice

    Returns
    -------
    None on ice that does not curl, or where no draw comes to rest at the tee
    """
    usual = draw_weight(ice, mu) if ice.effect("curl") else None
    if usual is None:
        return None
    even = _even(ice, mu)
    spin = 2 * np.pi * DRAW_TURNS / usual.seconds
    across = [
        slide(even, Throw(speed=usual.speed, spin=sign * spin).release(), bounds=NO_BOUNDS).x
        for sign in (1, -1)
    ]
    return abs(across[1] - across[0]) / 2


def draw_facts(ice: Ice, mu: float, units: Units = Units.METRES) -> list[tuple[str, str]]:
    """List facts about a friction for curlers: number and meaning; empty where no draw rests.

    Parameters
    ----------
    ice : sheet, stone and effects
    mu : friction of the even ice
    units : units of displayed lengths
    """
    draw = draw_weight(ice, mu) if mu > 0 else None
    if draw is None:
        return []
    pairs = [
        (f"{draw.hog_to_hog:.1f} s", "hog line to hog line, draw to the tee"),
        (f"{draw.seconds:.1f} s", "hog line to rest at the tee"),
        (speed(draw.speed, units), "draw weight at the hog line"),
    ]
    curl = curl_of_a_draw(ice, mu)
    if curl is not None:
        pairs.append((length(curl, units), f"curl of a draw that turns {DRAW_TURNS:g} times"))
    worth = worth_of_a_per_cent(ice, mu)
    if worth is not None:
        pairs += [
            (short_length(worth[0], units), "further for a draw where it is 1 % keener"),
            (f"{worth[1]:.2f} s", "longer from hog to hog for a draw on ice 1 % keener"),
        ]
    return pairs


def _even(ice: Ice, mu: float) -> Ice:
    """The ice with one friction everywhere."""
    return replace(ice, friction=FrictionMap.uniform(mu, ice.sheet))
