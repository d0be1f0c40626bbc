"""Rows on friction against speed, and on one shot that was measured from end to end."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from curling_env.ice import ActiveEffect, Ice
from curling_env.sheet import Stone
from curling_env.validation import sources
from curling_env.validation.row import Row
from curling_env.validation.shots import Shots

SAMPLES_PER_SECOND = 200.0
JENSEN_SPEED, JENSEN_SPIN = 2.09, 1.01
"""Of the published shot [m/s, rad/s]."""
JENSEN_DISTANCE = 25.6
_POINT_CONTACT = Stone(band_radius=0.0)


def friction_between(shots: Shots, fast: float, slow: float) -> float | None:
    """Mean deceleration over g while a stone slows from one speed to another, as a film shows it.

    The stone is a draw's, with the spin that it then has; above draw weight a faster one's.
    """
    speed = max(shots.draw_speed or 0.0, 1.05 * fast)
    path = shots.followed(speed, SAMPLES_PER_SECOND)
    if path is None:
        return None
    middle = 0.5 * (path.t[1:] + path.t[:-1])
    speeds = np.hypot(*np.diff(path.xy, axis=0).T) / np.diff(path.t)
    falling = slice(None, int(np.argmin(speeds)) + 1)
    begin, end = np.interp([-fast, -slow], -speeds[falling], middle[falling])
    return (fast - slow) / (9.80665 * float(end - begin)) if end > begin else None


def _steepness(shots: Shots) -> float | None:
    slow, fast = friction_between(shots, 0.3, 0.2), friction_between(shots, 2.2, 2.1)
    return None if slow is None or fast is None else math.log(slow / fast) / math.log(2.15 / 0.25)


def _jensen_carry(shots: Shots) -> float:
    return shots.carry(JENSEN_SPEED, JENSEN_SPIN)


def _jensen(shots: Shots, what: str) -> float | None:
    """Time, curl or turns of the published shot on the ice scaled to its distance."""
    scaled = shots.scaled_until(_jensen_carry, JENSEN_DISTANCE)
    run = None if scaled is None else scaled.run(JENSEN_SPEED, JENSEN_SPIN)
    if run is None:
        return None
    return {"time": run.time, "curl": -run.x, "turns": run.theta / (2 * math.pi)}[what]


def _power_law(exponent: float) -> Shots:
    """Ice of a power law alone, on a stone whose contact is a point: no spin, no drag."""
    falls = ActiveEffect(name="speed_dependent_friction", parameters={"exponent": exponent})
    return Shots(Ice.uniform(0.008, effects=(falls,), stone=_POINT_CONTACT))


def _time_of_power_law(_: Shots, exponent: float) -> float | None:
    return _jensen(_power_law(exponent), "time")


PAPER_ICE = "the paper's μ of 0.0019 is a quarter of every measurement of ice"
CLUB_ICE = "club ice is slower than that of championships, on purpose"
FRICTION = "friction and speed"
ONE_SHOT = "one measured shot"

ROWS = (
    Row(
        name="friction at 0.2 to 0.3 m/s",
        part=FRICTION,
        said="0.012",
        low=0.0115,
        high=0.0125,
        unit="1",
        source=sources.YANG,
        value=partial(friction_between, fast=0.3, slow=0.2),
        about="Printed to one digit; the deviations within a bin are drawn and not printed. "
        "Penner's 0.008·v^(-1/2) gives 0.016 here, Li et al. up to 0.016.",
        why={
            "fcv1": "6 % above in the slowest bin: the law is of 1/(v + 0.064), steeper than a "
            "power law below half a metre a second",
            "club": CLUB_ICE,
            "paper": PAPER_ICE,
        },
        fitted=True,
    ),
    Row(
        name="friction at 2.1 to 2.2 m/s",
        part=FRICTION,
        said="0.007",
        low=0.0065,
        high=0.0075,
        unit="1",
        source=sources.YANG,
        value=partial(friction_between, fast=2.2, slow=2.1),
        about="Printed to one digit. Penner's law gives 0.0055, Denny's constant 0.0127.",
        why={"club": CLUB_ICE, "paper": PAPER_ICE},
        fitted=True,
    ),
    Row(
        name="steepness: −d ln μ / d ln v from 0.25 to 2.15 m/s",
        part=FRICTION,
        said="0.25",
        low=math.log(0.0115 / 0.0075) / math.log(2.15 / 0.25),
        high=math.log(0.0125 / 0.0065) / math.log(2.15 / 0.25),
        unit="1",
        source=sources.YANG,
        value=_steepness,
        about="From 0.012 and 0.007, the two rows above. Penner and Maeno: ½; Jensen & "
        "Shegelski's shot: 0.16; the coaches' six feet a second: about nought.",
        why={"paper": "the paper's friction does not follow the speed"},
        fitted=True,
    ),
    Row(
        name="greatest friction, at 0.1 m/s",
        part=FRICTION,
        said="0.006 to 0.016",
        low=0.006,
        high=0.016,
        unit="1",
        source=sources.LI,
        value=partial(friction_between, fast=0.15, slow=0.1),
        why={
            "fcv1": "the law is of 1/(v + 0.064), steeper than a power law at the very end of a "
            "slide",
            "paper": PAPER_ICE,
        },
        fitted=True,
    ),
    Row(
        name="least friction, at 2.2 m/s",
        part=FRICTION,
        said="0.006 to 0.016",
        low=0.006,
        high=0.016,
        unit="1",
        source=sources.LI,
        value=partial(friction_between, fast=2.25, slow=2.15),
        why={"paper": PAPER_ICE},
        fitted=True,
    ),
    Row(
        name="distance of a stone at 2.09 m/s and 1.01 rad/s",
        part=ONE_SHOT,
        said="25.6 m",
        low=25.5,
        high=25.7,
        unit="m",
        source=sources.JENSEN,
        value=_jensen_carry,
        about="The last digit; σ of the speed is not quoted, and 0.01 m/s are 0.27 m.",
        why={
            "any": "another ice on another day: its friction was a tenth above championship ice. "
            "The rows below compare the course on ice scaled to this distance"
        },
    ),
    Row(
        name="its time, on ice scaled to its distance",
        part=ONE_SHOT,
        said="22.8 s",
        low=22.7,
        high=22.9,
        unit="s",
        source=sources.JENSEN,
        value=partial(_jensen, what="time"),
        about="0.005 m/s of the printed speed are 0.06 s.",
        why={
            "any": "a time this long asks for friction that falls with v^(-0.16), or is constant "
            "and grows by air drag; Beijing's friction falls with v^(-1/4). The sources disagree"
        },
        fitted=True,
    ),
    Row(
        name="its curl, on ice scaled to its distance",
        part=ONE_SHOT,
        said="0.78 m",
        low=0.73,
        high=0.83,
        unit="m",
        source=sources.JENSEN,
        value=partial(_jensen, what="curl"),
        about="Taken to 5 cm.",
        why={
            "any": "curl follows the roughness of the running band (Kameda 2020), and stones have "
            "been scratched to curl more since; championship ice curls 1.0 to 1.4 m"
        },
    ),
    Row(
        name="its turns, on ice scaled to its distance",
        part=ONE_SHOT,
        said="2.7",
        low=2.6,
        high=2.8,
        unit="turns",
        source=sources.JENSEN,
        value=partial(_jensen, what="turns"),
        why={
            "standard": "7 % more turns than filmed: the spin fades a little slower than on that "
            "ice. The refit takes it to within the print",
            "any": "the spin fades more slowly, or faster, than on that ice",
        },
        fitted=True,
    ),
    *(
        Row(
            name=f"the same time by a power law v^({written})",
            part=ONE_SHOT,
            said=f"{seconds} s",
            low=seconds - half,
            high=seconds + half,
            unit="s",
            source=sources.CLOSED_FORM + ": T = D·(2 + n)/(v·(1 + n)), by the published numbers",
            value=partial(_time_of_power_law, exponent=exponent),
            depends_on_ice=False,
        )
        for written, exponent, seconds, half in (
            ("-1/4", 0.25, 22.05, 0.01),
            ("-0.16", 0.16, 22.8, 0.05),
            ("-1/2", 0.5, 20.4, 0.05),
        )
    ),
)
