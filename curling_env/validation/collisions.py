"""Values of the rows on stones that collide."""

from __future__ import annotations

import math

import numpy as np

from curling_env.physics.contacts import contact_law, find_contacts, new_contacts, solve_contacts
from curling_env.physics.state import State
from curling_env.sheet import Stone
from curling_env.typing import Floats
from curling_env.validation.shots import Shots

SPEED = 2.0
"""Speed of the thrown stone at the hit [m/s]; the shares below do not depend on it."""


def after_hit(stone: Stone, fullness: float) -> Floats:
    """Return the states of the thrown and the struck stone after one contact, (2, 6).

    Parameters
    ----------
    stone : both stones
    fullness : 1 for a full hit, ½ for one of half a stone, 0 for a graze
    """
    reach, sine = contact_law(stone).reach, 1.0 - fullness
    stones = np.zeros((2, 6))
    stones[0, State.VY] = SPEED
    stones[1, State.X] = reach * sine
    stones[1, State.Y] = reach * math.sqrt(1.0 - sine**2)
    return collide(stone, stones)


def collide(stone: Stone, stones: Floats) -> Floats:
    """Change the states (n, 6) of touching stones by their contacts, and return them."""
    law, contacts = contact_law(stone), new_contacts(len(stones))
    count = find_contacts(law, stones, np.zeros(len(stones), dtype=np.int64), contacts)
    solve_contacts(law, stones, contacts, count)
    return stones


def struck(shots: Shots) -> float:
    """Return the speed of a fully hit stone over the thrown stone's."""
    return float(after_hit(shots.ice.stone, 1.0)[1, State.VY]) / SPEED


def energy_kept(shots: Shots) -> float:
    """Return the share of the energy that two stones keep in a full hit."""
    stones = after_hit(shots.ice.stone, 1.0)
    return float((stones[:, State.VX : State.VY + 1] ** 2).sum()) / SPEED**2


def angle_apart(shots: Shots) -> float:
    """Return the angle between the paths of the two stones after a hit of half a stone
    [degrees].
    """
    stones = after_hit(shots.ice.stone, 0.5)
    ways = np.arctan2(stones[:, State.VY], stones[:, State.VX])
    return float(np.degrees(abs(ways[0] - ways[1])))


def stone_number(shots: Shots, name: str) -> float:
    """Return a number of the ice's stones, by its name."""
    return float(getattr(shots.ice.stone, name))
