"""`curling throw`: one throw on an ice, in numbers."""

from __future__ import annotations

import sys
from enum import StrEnum
from typing import Annotated

from typer import Option

from curling_env.commands.options import DeliveryOption, IceOption, Measured, grouped
from curling_env.commands.terminal import print_json, warn_about
from curling_env.units import short_length


class PlayedEnd(StrEnum):
    """End that is played to"""

    AWAY = "away"
    HOME = "home"


@grouped
def throw(
    ice: IceOption,
    speed: Annotated[float, Option(help="Speed at the release [m/s], above 0 and at most 6.")],
    angle: Annotated[float, Option(help="Direction, counter-clockwise [rad].")] = 0.0,
    spin: Annotated[float, Option(help="Spin, counter-clockwise positive [rad/s].")] = 0.0,
    x: Annotated[float, Option(help="Offset to the right at the release [m].")] = 0.0,
    delivery: DeliveryOption = "hog-line",
    direction: Annotated[PlayedEnd, Option(help="End to play to.")] = PlayedEnd.AWAY,
    *,
    results: Measured,
) -> None:
    """Throw one stone on an empty sheet and report where it comes to rest.

    \b
    Example:
        curling throw --ice standard --speed 2.1 --angle -0.05 --spin 1

    The stone is released with its centre on the hog line, or elsewhere (--delivery). The JSON has
    its rest (x, y), time, turns, status and hog-to-hog time; if the ice has standard errors, also
    the spread of the rest. docs/planning.md lists all fields.
    """
    from curling_env.analysis.ice_uncertainty import is_uncertain, rest_spread
    from curling_env.analysis.shot_times import shoot
    from curling_env.ice import load_ice
    from curling_env.sheet import Direction
    from curling_env.throw import Throw, delivery_named

    end = Direction[direction.name]
    known, thrown = load_ice(ice), Throw(speed=speed, angle=angle, spin=spin, x=x)
    begins = delivery_named(delivery)
    shot = shoot(known, thrown, end, delivery=begins)
    document: dict[str, object] = {**shot.as_dict()}
    sentences = [shot.in_words(end, results.units)]
    if is_uncertain(known):
        spread = rest_spread(known, thrown.release(end, delivery=begins))
        across, along = spread or (None, None)
        document |= {"rest_sigma_x_m": across, "rest_sigma_y_m": along}
        if spread is not None:
            across, along = (short_length(sigma, results.units) for sigma in spread)
            sentences.append(
                f"uncertainty of the ice moves its rest by {along} along the sheet and {across} "
                "across (one standard deviation)"
            )
    warn_about(known)
    if sys.stdout.isatty() and not results.as_json:
        print("\n".join(sentences))
    else:  # programs call it often and need no sentence on stderr
        print_json(document)
