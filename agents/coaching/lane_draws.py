"""Draws to each lane of an ice: weight as a time, and the ice to give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agents.planning.description import Description, describe
from curling_env.analysis.ice_uncertainty import plausible_ices
from curling_env.ice import Ice
from curling_env.physics.aim import Aim
from curling_env.physics.slides import NO_BOUNDS, slide
from curling_env.sheet import RING_RADII, Direction, to_sheet
from curling_env.throw import FROM_HOG_LINE, Delivery, Throw
from curling_env.typing import Floats

LANES = (-RING_RADII[1], -RING_RADII[2], 0.0, RING_RADII[2], RING_RADII[1])
"""Lanes of draws on the tee line, left to right from the thrower's view: the edges of the 8-foot,
of the 4-foot, and the tee [m].
"""
PLAUSIBLE_ICES = 16
"""Number of sampled ices on which every draw is solved for its standard error, known to 18 %
then.
"""


@dataclass(frozen=True, kw_only=True)
class LaneDraw:
    """Draw to the tee line with one handle.

    Parameters
    ----------
    direction : the end played to
    lane : place of rest, to the right of the centre line from the thrower's view [m]
    throw : the throw
    description : the throw in a curler's words
    path : (n, 2) its path, sheet frame [m]
    seconds_sigma : standard error of its time from hog line to hog line [s]; None for ice without
        standard errors
    ice_sigma : standard error of the ice to give [m]; None for ice without standard errors
    seen : share of its path over ice on which stones were measured
    """

    direction: Direction
    lane: float
    throw: Throw
    description: Description
    path: Floats
    seconds_sigma: float | None
    ice_sigma: float | None
    seen: float


def lane_draws(
    ice: Ice,
    direction: Direction = Direction.AWAY,
    *,
    lanes: Sequence[float] = LANES,
    delivery: Delivery = FROM_HOG_LINE,
    seed: int = 0,
) -> list[LaneDraw]:
    """Plan draws to the tee line on every lane, with both handles.

    Parameters
    ----------
    ice : known or estimated ice
    direction : the end played to
    lanes : places of rest, to the right of the centre line from the thrower's view [m]
    delivery : start of the throws, and their usual spin
    seed : seed of the sampled ices for the standard errors

    Returns
    -------
    lane by lane, the clockwise handle first; draws that do not come to rest there are missing
    """
    others = plausible_ices(ice, PLAUSIBLE_ICES, np.random.default_rng((seed, 3)))
    aims = [Aim(one, direction, delivery=delivery) for one in (others if len(others) > 1 else [])]
    own = Aim(ice, direction, delivery=delivery)
    found: list[LaneDraw] = []
    for lane in lanes:
        target = np.asarray(to_sheet([lane, 0.0], direction))
        for spin in (-delivery.spin, delivery.spin):
            throw = own.draw(lane, 0.0, spin)
            if throw is None:
                continue
            path = slide(
                ice, throw.release(direction, delivery=delivery), bounds=NO_BOUNDS, fps=10.0
            ).trajectory
            assert path is not None  # a rate was requested
            made = [_described(aim, lane, spin, target) for aim in aims]
            spread = np.array([pair for pair in made if pair is not None])
            sigma = spread.std(axis=0, ddof=1) if len(spread) > 1 else None
            found.append(
                LaneDraw(
                    direction=direction,
                    lane=lane,
                    throw=throw,
                    description=describe(ice, throw, target, direction, delivery),
                    path=path.xy,
                    seconds_sigma=None if sigma is None else float(sigma[0]),
                    ice_sigma=None if sigma is None else float(sigma[1]),
                    seen=float(ice.friction.observed[ice.sheet.cell_of(path.xy)].mean()),
                )
            )
    return found


def _described(aim: Aim, lane: float, spin: float, target: Floats) -> tuple[float, float] | None:
    """Return the hog-to-hog time [s] and the ice to the right [m] of a draw on another ice."""
    throw = aim.draw(lane, 0.0, spin)
    if throw is None:
        return None
    description = describe(aim.ice, throw, target, aim.direction, aim.delivery)
    return (
        None
        if description.hog_to_hog_s is None
        else (description.hog_to_hog_s, description.broom_m - lane)
    )
