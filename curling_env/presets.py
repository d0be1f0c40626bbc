"""Ices that have a name: wherever an ice file is asked for, these names serve too."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from curling_env.ice import ActiveEffect, Ice
from curling_env.sheet import PAPER_STONE, RULE_BOOK_STONE


def standard() -> Ice:
    """Recommended championship ice: a draw takes 24-25 s from hog line to tee and curls 1.1-1.5 m.

    Friction 0.0082·s^(-1/4) at the slip s of each contact, air drag 9.5e-4 v², curl 0.0082 v^0.2.
    The band's own friction already turns a stone down; `spin_drag` is the further torque that
    makes up the observed spin decay, 0.02 v^(-0.6) rad/s² in all at draw weight.
    """
    return Ice.uniform(
        0.0082,
        effects=(
            ActiveEffect(name="speed_dependent_friction", parameters={"exponent": 0.25}),
            ActiveEffect(name="air_drag", parameters={"coefficient": 9.5e-4}),
            ActiveEffect(name="curl", parameters={"strength": 0.0082, "speed_exponent": 0.2}),
            ActiveEffect(name="spin_drag", parameters={"rate": 0.0115, "speed_exponent": 0.6}),
        ),
    )


def fcv1() -> Ice:
    """The Digital Curling competition's simulator: a point contact with its own law.

    dv/dt = -g [0.00200985/(v+0.06385782) + 0.00626286], lateral 0.0082 v^0.2,
    dω/dt = -0.025/max(v, 0.001).
    """
    constant, falling, offset = 0.00626286, 0.00200985, 0.06385782
    return Ice.uniform(
        constant + falling,
        stone=replace(RULE_BOOK_STONE, band_radius=0.0),
        effects=(
            ActiveEffect(
                name="speed_dependent_friction",
                parameters={
                    "exponent": 1.0,
                    "speed_offset": offset,
                    "share": falling / (constant + falling),
                },
            ),
            ActiveEffect(name="curl", parameters={"strength": 0.0082, "speed_exponent": 0.2}),
            ActiveEffect(
                name="spin_drag",
                parameters={"rate": 0.025, "speed_exponent": 1.0, "speed_floor": 0.001},
            ),
        ),
    )


def paper() -> Ice:
    """The paper's simulated sheet: uniform Coulomb friction 0.0019 under its own stone."""
    return Ice.uniform(0.0019, stone=PAPER_STONE)


PRESETS: dict[str, Callable[[], Ice]] = {"standard": standard, "fcv1": fcv1, "paper": paper}
