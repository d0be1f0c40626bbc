"""Times and lengths of one throw on an empty sheet, as players measure them."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from curling_env.ice import Ice
from curling_env.physics.engine import Engine
from curling_env.physics.slides import SlideEnd, play_bounds, slide
from curling_env.sheet import HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import FROM_HOG_LINE, Delivery, Throw
from curling_env.units import Units, side


@dataclass(frozen=True, kw_only=True)
class Shot:
    """Course of a lone throw.

    Parameters
    ----------
    x, y : place where it came to rest or left play, sheet frame [m]
    time : time from release until then [s]
    turns : full rotations of the stone, without sign
    status : rest, out_side, out_back or hogged
    theta : change of its heading, counter-clockwise positive [rad]
    hog_to_hog, hog_to_tee : times from the near hog line, or from a release beyond it, to the far
        hog line and to the tee line played to [s]; None if it did not reach the line
    curl_m : distance of its end to the left of the line of delivery [m]
    from_tee_m : distance of its centre from the tee [m]
    """

    x: float
    y: float
    time: float
    turns: float
    status: str
    theta: float
    hog_to_hog: float | None
    hog_to_tee: float | None
    curl_m: float
    from_tee_m: float

    def as_dict(self) -> dict[str, float | str | None]:
        """Return the numbers by name."""
        return asdict(self)

    def in_words(self, direction: Direction, units: Units = Units.METRES) -> str:
        """Describe the outcome in a sentence, from the thrower's view."""
        weight = "" if self.hog_to_hog is None else f"{self.hog_to_hog:.1f} s hog to hog; "
        if self.status == "out_side":
            return f"{weight}it touches the side line"
        if self.status == "out_back":
            return f"{weight}it runs through the house"
        along = side(direction * self.y - TEE_Y, units, right="past")
        across = side(direction * self.x, units).replace("on the line", "on the centre line")
        tee = "" if "tee" in along else " the tee" if " past" in along else " of the tee"
        hogged = "hogged, it stops" if self.status == "hogged" else "it comes to rest"
        return f"{weight}{hogged} {along}{tee}, {across}"


def shoot(
    ice: Ice,
    throw: Throw,
    direction: Direction = Direction.AWAY,
    *,
    delivery: Delivery = FROM_HOG_LINE,
) -> Shot:
    """Throw one stone on an empty sheet, towards one end.

    Raises
    ------
    InputError : a release outside the side lines, or ice on which the stone never stops
    """
    release = throw.release(direction, delivery=delivery)
    outcome = Engine(ice).play(release)
    stone = outcome.delivered
    across = -(stone.x - release.x) * release.vy + (stone.y - release.y) * release.vx

    def time_to(line: float) -> float | None:
        bounds = play_bounds(ice, direction)
        bounds[3 if direction > 0 else 2] = direction * line
        run = slide(ice, release, bounds=bounds)
        arrived = run.end is SlideEnd.LEFT_BOUNDS and abs(run.y - direction * line) < 1e-3
        return run.time if arrived else None

    # From behind the hog line, both times count from the stone's crossing of it.
    begin = time_to(-HOG_LINE_Y) if delivery.line_y > HOG_LINE_Y else 0.0

    def from_hog_line(line: float) -> float | None:
        end = time_to(line)
        return None if begin is None or end is None else end - begin

    return Shot(
        x=stone.x,
        y=stone.y,
        time=outcome.time,
        turns=abs(stone.theta) / (2 * np.pi),
        status=outcome.delivered_status.value,
        theta=stone.theta,
        hog_to_hog=from_hog_line(HOG_LINE_Y),
        hog_to_tee=from_hog_line(TEE_Y),
        curl_m=across / throw.speed + 0.0,  # never minus zero
        from_tee_m=float(np.hypot(stone.x, stone.y - direction * TEE_Y)),
    )
