"""`curling throw`: one throw on an ice, in numbers."""

from __future__ import annotations

import sys
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from curling_env.commands.cli import (
    DeliveryOption,
    IceOption,
    JsonOption,
    UnitsOption,
    print_json,
    say_what_is_lacking,
)
from curling_env.units import Units, short_length, side

if TYPE_CHECKING:
    from curling_env.physics.shot_times import Shot
    from curling_env.sheet import Direction


class PlayedEnd(StrEnum):
    """The end played to."""

    AWAY = "away"
    HOME = "home"


def throw(
    ice: IceOption,
    speed: Annotated[
        float, typer.Option(help="Speed at the release [m/s], above 0 and at most 6.")
    ],
    angle: Annotated[
        float, typer.Option(help="Line of delivery, counter-clockwise from straight ahead [rad].")
    ] = 0.0,
    spin: Annotated[
        float, typer.Option(help="Spin of the stone, counter-clockwise positive [rad/s].")
    ] = 0.0,
    x: Annotated[
        float, typer.Option(help="Offset to the right of the centre line at the release [m].")
    ] = 0.0,
    delivery: DeliveryOption = "hog-line",
    direction: Annotated[
        PlayedEnd, typer.Option(help="The end that is played to.")
    ] = PlayedEnd.AWAY,
    units: UnitsOption = Units.METRES,
    as_json: JsonOption = False,
) -> None:
    """Throw one stone on an empty sheet and say where it comes to rest.

    The stone is released with its centre on the hog line, or at the hack (--delivery). For programs
    (--json, or where stdout is no terminal) the result is JSON:

    \b
        x, y         where it ended [m]; origin mid-sheet, y towards the away end
        time         from release until then [s]
        turns        full rotations
        status       rest, out_side (touched a side line), out_back (passed the back line)
                     or hogged (short of the far hog line)
        theta        change of its heading [rad]
        hog_to_hog   time from hog line to hog line [s], null if it did not get there
        hog_to_tee   time from the hog line to the tee line [s], null if it did not get there
        curl_m       distance of its end to the left of the line of delivery [m]
        from_tee_m   distance from the tee [m]

    If the ice file has standard errors, of its map or its effects, two more numbers say what they
    leave open of the place of rest; null for a stone that leaves the ice:

    \b
        rest_sigma_x_m, rest_sigma_y_m   standard deviations across and along the sheet [m]

    \b
    Example:
        curling throw --ice standard --speed 2.1 --angle -0.05 --spin 1
    """
    from curling_env.ice import load_ice
    from curling_env.physics.ice_uncertainty import is_uncertain, rest_spread
    from curling_env.physics.shot_times import shoot
    from curling_env.sheet import Direction
    from curling_env.throw import Throw, delivery_named

    end = Direction.AWAY if direction is PlayedEnd.AWAY else Direction.HOME
    known, thrown = load_ice(ice), Throw(speed=speed, angle=angle, spin=spin, x=x)
    begins = delivery_named(delivery)
    shot = shoot(known, thrown, end, delivery=begins)
    document: dict[str, object] = {**shot.as_dict()}
    spread = None
    if is_uncertain(known):
        spread = rest_spread(known, thrown.release(end, delivery=begins))
        across, along = spread or (None, None)
        document |= {"rest_sigma_x_m": across, "rest_sigma_y_m": along}
    say_what_is_lacking(known)
    sentences = [_in_words(shot, end, units)]
    if spread is not None:
        along, across = (short_length(sigma, units) for sigma in reversed(spread))
        sentences.append(
            f"what is not known of the ice moves its rest by {along} along the sheet and {across} "
            "across (one standard deviation)"
        )
    if sys.stdout.isatty() and not as_json:
        print("\n".join(sentences))
    else:  # programs call it often, and want nothing else
        print_json(document)


def _in_words(shot: Shot, end: Direction, units: Units) -> str:
    """How the throw went, in a sentence."""
    from curling_env.sheet import TEE_Y

    weight = "" if shot.hog_to_hog is None else f"{shot.hog_to_hog:.1f} s hog to hog; "
    if shot.status == "out_side":
        return f"{weight}it touches the side line"
    if shot.status == "out_back":
        return f"{weight}it runs through the house"
    along = side(end * shot.y - TEE_Y, units, right="past")
    across = side(end * shot.x, units).replace("on the line", "on the centre line")
    tee = "" if "tee" in along else " the tee" if " past" in along else " of the tee"
    hogged = "hogged, it stops" if shot.status == "hogged" else "it comes to rest"
    return f"{weight}{hogged} {along}{tee}, {across}"
