"""Values of the rows on draws: times by the watch, turns and curl."""

from __future__ import annotations

import math

from curling_env.physics.slides import Slide
from curling_env.sheet import BACK_LINE_Y, HACK_Y, HOG_TO_FAR_TEE, HOUSE_RADIUS, TEE_Y
from curling_env.validation.shots import HOG_TO_HOG, Shots

KEEN = 14.5
"""Hog-to-hog time of a draw on the ice of the coaches' table [s]."""
BACKBOARD = HOG_TO_FAR_TEE + 4.877
SHORT_OF_HOUSE = 0.9
"""Distance of a centre guard from the house, front to front [m]."""
PLACES = {
    "a guard": HOG_TO_FAR_TEE - HOUSE_RADIUS - SHORT_OF_HOUSE,
    "the back line": HOG_TO_FAR_TEE + BACK_LINE_Y - TEE_Y,
    "the hack": HOG_TO_FAR_TEE + HACK_Y - TEE_Y,
    "the backboard": BACKBOARD,
}
"""Place of rest of a stone of that weight, from the hog line of the delivery [m]."""
NYBERG_SPINS = (0.9, 1.3, 1.8, 2.6)


def hog_to_hog(shots: Shots) -> float | None:
    """Return the hog-to-hog time of a draw to the tee [s]."""
    return shots.hog_to_hog(HOG_TO_FAR_TEE)


def hog_to_tee(shots: Shots) -> float | None:
    """Return the time from the hog line of the delivery until a draw rests on the tee line [s]."""
    return None if shots.draw is None else shots.draw.time


def _on_ice_of(shots: Shots, seconds: float) -> Shots | None:
    """Return the ice scaled to a given hog-to-hog time of a draw."""
    return shots.scaled_until(hog_to_hog, seconds)


def hog_to_tee_on(shots: Shots, seconds: float) -> float | None:
    """Return the time from hog line to tee on ice with a given hog-to-hog time of a draw [s]."""
    scaled = _on_ice_of(shots, seconds)
    return None if scaled is None else hog_to_tee(scaled)


def time_of_weight(shots: Shots, place: str) -> float | None:
    """Return the hog-to-hog time of a stone that stops at a place of `PLACES`, on ice of `KEEN`
    [s].
    """
    scaled = _on_ice_of(shots, KEEN)
    return None if scaled is None else scaled.hog_to_hog(PLACES[place])


def speed_of_time(shots: Shots, seconds: float) -> float | None:
    """Return the speed of a stone with a hog-to-hog time, on ice of `KEEN` [m/s]."""
    scaled = _on_ice_of(shots, KEEN)
    return None if scaled is None else scaled.weight_of_time(seconds)


def kept_hog_to_hog(shots: Shots, seconds: float) -> float | None:
    """Return the share of its speed that a stone keeps from hog line to hog line, at that time."""
    speed = shots.weight_of_time(seconds)
    run = None if speed is None else shots.run(speed, until=HOG_TO_HOG)
    return None if speed is None or run is None else run.vy / speed


def metres_per_second(shots: Shots, to_rest: bool) -> float | None:
    """Return the extra distance of a draw that is a second quicker, from its two neighbours
    [m/s].
    """
    speed = shots.draw_speed
    if speed is None:
        return None

    def seconds(v: float) -> float | None:
        run = shots.run(v)
        if to_rest:
            return None if run is None else run.time
        return shots.time_to(HOG_TO_HOG, v)

    step = 1e-3
    after, before = seconds(speed + step), seconds(speed - step)
    if after is None or before is None:
        return None
    return abs((shots.carry(speed + step) - shots.carry(speed - step)) / (after - before))


def of_draw(shots: Shots, what: str, spin: float | None = None) -> float | None:
    """Return the curl [m] or turns of a draw, with a given spin [rad/s]."""
    draw: Slide | None = shots.draw if spin is None else shots.draw_turning(spin)
    if draw is None:
        return None
    return {"curl": abs(draw.x), "turns": abs(draw.theta) / (2 * math.pi)}[what]


def curl_by_spin(shots: Shots) -> float | None:
    """Return the largest over the smallest curl of draws with the spins of play."""
    found = [of_draw(shots, "curl", spin) for spin in NYBERG_SPINS]
    curls = [curl for curl in found if curl]
    return max(curls) / min(curls) if len(curls) == len(found) else None


def late_curl(shots: Shots) -> float | None:
    """Return the share of a draw's curl over the last quarter of its path."""
    path = None if shots.draw_speed is None else shots.followed(shots.draw_speed, 50.0)
    if path is None or path.xy[-1, 0] == 0.0:
        return None
    way = path.xy[:, 1] - path.xy[0, 1]
    place = int((way < 0.75 * way[-1]).sum())
    return float(1.0 - path.xy[place, 0] / path.xy[-1, 0])


def slow_side(shots: Shots) -> float:
    """Return the friction at the slow side of the band over that at the fast side, at 0.5 m/s.

    Both are for the whole stone sliding at that speed, spinning at the usual 1 rad/s.
    """
    rim = shots.ice.stone.band_radius or 0.0625
    return shots.friction_at(0.5 - rim, 0.0) / shots.friction_at(0.5 + rim, 0.0)
