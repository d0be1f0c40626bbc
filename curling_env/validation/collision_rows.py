"""Rows on stones that collide."""

from __future__ import annotations

import math

import numpy as np

from curling_env.physics.contacts import contact_law, find_contacts, new_contacts, solve_contacts
from curling_env.physics.state import State
from curling_env.sheet import Stone
from curling_env.typing import Floats
from curling_env.validation import sources
from curling_env.validation.row import Row
from curling_env.validation.shots import Shots

SPEED = 2.0
"""Of the thrown stone when it hits [m/s]; the shares below do not depend on it."""


def after_hit(stone: Stone, fullness: float) -> Floats:
    """States of the thrown and the struck stone after one contact, (2, 6).

    Parameters
    ----------
    stone : both stones
    fullness : 1 for a full hit, ½ for one of half a stone, 0 for a graze
    """
    law = contact_law(stone)
    sine = 1.0 - fullness
    stones = np.zeros((2, 6))
    stones[0, State.VY] = SPEED
    stones[1, State.X] = law.reach * sine
    stones[1, State.Y] = law.reach * math.sqrt(1.0 - sine**2)
    contacts = new_contacts(2)
    count = find_contacts(law, stones, np.zeros(2, dtype=np.int64), contacts)
    solve_contacts(law, stones, contacts, count)
    return stones


def _struck(shots: Shots) -> float:
    return float(after_hit(shots.ice.stone, 1.0)[1, State.VY]) / SPEED


def _energy_kept(shots: Shots) -> float:
    stones = after_hit(shots.ice.stone, 1.0)
    return float((stones[:, State.VX : State.VY + 1] ** 2).sum()) / SPEED**2


def _angle_apart(shots: Shots) -> float:
    """Angle between the ways of the two stones after a hit of half a stone [degrees]."""
    stones = after_hit(shots.ice.stone, 0.5)
    ways = np.arctan2(stones[:, State.VY], stones[:, State.VX])
    return float(np.degrees(abs(ways[0] - ways[1])))


COLLISIONS = "collisions"
A_CHOICE = (
    "Digital Curling's stones lose nothing, which no rock can; 0.85 is a choice between the codes "
    "until somebody measures it"
)

ROWS = (
    Row(
        name="restitution of two stones",
        part=COLLISIONS,
        said="0.5–1 in codes",
        low=None,
        high=None,
        unit="1",
        source=sources.CODES,
        value=lambda shots: shots.ice.stone.restitution,
        about="Nobody has published a measurement. Filmed from above, one full hit gives it.",
    ),
    Row(
        name="friction between two stones",
        part=COLLISIONS,
        said="0.2, 0.5 in codes",
        low=None,
        high=None,
        unit="1",
        source=sources.CODES,
        value=lambda shots: shots.ice.stone.stone_friction,
        about="Nobody has published a measurement.",
    ),
    Row(
        name="speed of a fully hit stone over the thrown stone's",
        part=COLLISIONS,
        said="1 (Digital Curling)",
        low=0.999,
        high=1.001,
        unit="1",
        source=sources.DIGITAL_CURLING,
        value=_struck,
        about="The law of another program, not a measurement.",
        why={"any": A_CHOICE},
    ),
    Row(
        name="energy kept in a full hit",
        part=COLLISIONS,
        said="1 (Digital Curling)",
        low=0.999,
        high=1.001,
        unit="1",
        source=sources.DIGITAL_CURLING,
        value=_energy_kept,
        about="The law of another program, not a measurement.",
        why={"any": A_CHOICE},
    ),
    Row(
        name="angle between the stones after a half hit",
        part=COLLISIONS,
        said="not published",
        low=None,
        high=None,
        unit="°",
        source=sources.CLOSED_FORM + ": 90° without loss and without friction",
        value=_angle_apart,
        about="Loss closes the angle, friction between the stones too. A film from above shows it.",
    ),
)
