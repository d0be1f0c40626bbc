"""Rows on sweeping, on ice that is not level, and on pebble that wears."""

from __future__ import annotations

from functools import partial

import numpy as np

from curling_env.physics.effects import catalogue
from curling_env.validation import sources
from curling_env.validation.row import Row
from curling_env.validation.shots import Shots

MARMO_SPEED, MARMO_UNSWEPT = 1.0, 5.84
"""Release speed and distance of the stones that were swept [m/s, m]."""
LAST_THIRD = 2.0 / 3.0
SLOPE = 0.43e-3 / 4.75
"""0.43 mm across a sheet of 4.75 m, as a gradient."""
ONE_PASS = 0.005
"""A micrometre of a pebble 0.2 mm high."""


def brooms(shots: Shots) -> Shots:
    """The same ice with what it says of sweeping; the published factor where it says nothing."""
    if shots.ice.effect("sweeping") is not None:
        return shots
    card = catalogue()["sweeping"]
    defaults = {p.name: p.default for p in card.parameters if p.default is not None}
    return shots.with_effect("sweeping", **defaults)


def _swept_gain(shots: Shots, begin: float, what: str) -> float | None:
    """What sweeping from a share of the way on adds to a draw, metres or seconds until rest."""
    swept, speed = brooms(shots), shots.draw_speed
    path = None if speed is None else shots.followed(speed, 50.0)
    if path is None or speed is None:
        return None
    way = path.xy[:, 1] - path.xy[0, 1]
    run = swept.run(speed, swept_from=float(np.interp(begin * float(way[-1]), way, path.t)))
    if run is None:
        return None
    return {"metres": run.y - float(path.xy[-1, 1]), "seconds": run.time - float(path.t[-1])}[what]


def _marmo_carry(shots: Shots) -> float:
    return shots.carry(MARMO_SPEED)


def _marmo(shots: Shots) -> float | None:
    """Distance of the swept stone on ice scaled to the unswept one's."""
    scaled = shots.scaled_until(_marmo_carry, MARMO_UNSWEPT)
    run = None if scaled is None else brooms(scaled).run(MARMO_SPEED, swept_from=0.0)
    start = None if scaled is None else scaled.run(MARMO_SPEED)
    if run is None or start is None:
        return None
    return MARMO_UNSWEPT + run.y - start.y


def _drift_of_slope(shots: Shots) -> float | None:
    """How far ice that falls to one side moves a draw to that side [m]."""
    slope = shots.ice.effect("slope")
    already = {"x": 0.0, "y": 0.0} if slope is None else dict(slope.parameters)
    tilted = shots.with_effect("slope", x=already["x"] + SLOPE, y=already["y"])
    speed, level = shots.draw_speed, shots.draw
    run = None if speed is None else tilted.run(speed)
    return None if run is None or level is None else run.x - level.x


def _one_pass(shots: Shots) -> float | None:
    """How much further a draw carries on friction lower by a pass's share of the pebble [m]."""
    speed, draw = shots.draw_speed, shots.draw
    run = None if speed is None else shots.scaled(1.0 - ONE_PASS).run(speed)
    return None if run is None or draw is None else run.y - draw.y


SWEEPING = "sweeping"
LEVEL = "level and wear"
ONE_FACTOR = (
    "one factor cannot be Marmo's and the best sweepers': 0.912 is a measured pair, and the last "
    "third by Jenkyn's best asks for 0.83"
)
PAPER_ICE = "the paper's μ of 0.0019 lets a stone run for a minute; no rink has such ice"

ROWS = (
    Row(
        name="unswept stone at 1.0 m/s",
        part=SWEEPING,
        said="5.84 m",
        low=5.79,
        high=5.89,
        unit="m",
        source=sources.MARMO,
        value=_marmo_carry,
        about="Taken to 5 cm.",
        why={
            "standard": "their ice was 6 % keener at this speed than the standard ice",
            "fcv1": "their ice was 6 % keener at this speed than this law",
            "any": "other ice; the row below scales it to this distance",
        },
    ),
    Row(
        name="the same swept, on ice scaled to 5.84 m",
        part=SWEEPING,
        said="6.40 m",
        low=6.35,
        high=6.45,
        unit="m",
        source=sources.MARMO,
        value=_marmo,
        about="The effect's default factor of 0.912 is 5.84/6.40: that it comes out shows the "
        "brooms at work, not a discovery.",
    ),
    Row(
        name="further, a draw swept over its last third",
        part=SWEEPING,
        said="1.8–2.1 m",
        low=1.8,
        high=2.1,
        unit="m",
        source=sources.JENKYN,
        value=partial(_swept_gain, begin=LAST_THIRD, what="metres"),
        about="The best, with the fabrics of that time. Ordinary sweeping was not published.",
        why={"any": ONE_FACTOR},
    ),
    Row(
        name="further, a draw swept all the way",
        part=SWEEPING,
        said="10 ft (3 m)",
        low=2.75,
        high=3.35,
        unit="m",
        source=sources.BRUSHERS + ": two good brushers, about 10 feet",
        value=partial(_swept_gain, begin=0.0, what="metres"),
        about="A foot either way. Others tell of 3.7 to 4.6 m.",
        why={
            "any": "0.912 is Marmo's measured pair of sweepers; the rule's pair has 0.90, and a "
            "rule of thumb knows feet, not inches",
        },
    ),
    Row(
        name="longer, a draw swept all the way",
        part=SWEEPING,
        said="about 1 s",
        low=0.75,
        high=1.25,
        unit="s",
        source=sources.BRUSHERS,
        value=partial(_swept_gain, begin=0.0, what="seconds"),
        why={
            "any": "friction lower by a share lengthens distance and time by the same share at "
            "any law: 3 m of 28 m are 2.6 s of 25 s, not one; the rule's 10 feet a second agree "
            "with no law of friction"
        },
    ),
    Row(
        name="drift of a draw by 0.43 mm over the width",
        part=LEVEL,
        said="is felt",
        low=None,
        high=None,
        unit="m",
        source=sources.LEVEL,
        value=_drift_of_slope,
        about="No displacement is published. Half a stone is 0.145 m.",
    ),
    Row(
        name="further, a draw after one pass by its share of the pebble",
        part=LEVEL,
        said="1 µm a shot",
        low=None,
        high=None,
        unit="m",
        source=sources.KAMEDA,
        value=_one_pass,
        about="As if friction fell with the height of a pebble of 0.2 mm, by 0.5 %. Nobody has "
        "published friction against wear: rinks say that worn ice gets keener before it gets "
        "heavy; Loughborough's laboratory (ISEA 2024) says that growing tops raise friction.",
    ),
)
