"""`curling throw`: one throw on an ice, in numbers."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from curling_env.commands.cli import IceOption, print_json


class End(StrEnum):
    """The end played to."""

    AWAY = "away"
    HOME = "home"


def throw(
    ice: IceOption,
    speed: Annotated[float, typer.Option(help="At the hog line [m/s], above 0 and up to 6.")],
    angle: Annotated[
        float, typer.Option(help="Line, counter-clockwise from the direction of play [rad].")
    ] = 0.0,
    spin: Annotated[float, typer.Option(help="Counter-clockwise positive [rad/s].")] = 0.0,
    x: Annotated[
        float, typer.Option(help="Where it crosses the hog line, right of the centre line [m].")
    ] = 0.0,
    direction: Annotated[End, typer.Option(help="The end played to.")] = End.AWAY,
) -> None:
    """Throw one stone on an empty sheet and say where it comes to rest.

    The stone is released with its centre on the hog line. JSON on stdout: `x`, `y` where it ended
    (sheet frame: origin mid-sheet, y towards the away end) [m], `time` [s], `turns` made, and
    `status`: rest, out_side (touched a side line), out_back (passed the back line) or hogged
    (short of the far hog line). Also the times to the far hog line and to the tee line, and
    `curl_m`, how far it ended to the left of the line it was thrown on. A time is null where the
    stone never got there.

    \b
    Example:
        curling throw --ice standard --speed 2.1 --angle -0.05 --spin 1
    """
    from curling_env.ice import load_ice
    from curling_env.physics.shot_times import shoot
    from curling_env.sheet import Direction
    from curling_env.throw import Throw

    end = Direction.AWAY if direction is End.AWAY else Direction.HOME
    print_json(shoot(load_ice(ice), Throw(speed=speed, angle=angle, spin=spin, x=x), end).as_dict())
