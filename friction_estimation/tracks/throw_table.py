"""A coach's measures of each throw, from its track.

Times are those of the stone's centre over the lines of the ice. Everything is from the thrower's
view: right is the thrower's right, and past is farther than the tee. A number that the track does
not show is None.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from itertools import groupby

import numpy as np

from curling_env.errors import TrackTooShortError
from curling_env.sheet import HOG_LINE_Y, TEE_Y, Direction, to_delivery
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.tracks.contacts import contacts_of, stays_at_rest, velocity_jumps
from friction_estimation.tracks.free_slide import free_slide
from friction_estimation.tracks.gates import gate_time
from friction_estimation.tracks.measured import Measured, difference, times, together
from friction_estimation.tracks.seen_throw import (
    FAR_HOG,
    FAR_TEE,
    NEAR_BACK,
    NEAR_HOG,
    NEAR_TEE,
    SeenThrow,
)


@dataclass(frozen=True, kw_only=True)
class ThrowMeasures:
    """One throw in a coach's numbers; None for values that were not seen.

    Parameters
    ----------
    throw, stone : numbers in the tracks file
    clock : start time since the session began [s]
    direction : the end played to
    back_to_hog : the split, from the back line to the hog line at the thrower's end [s]
    tee_to_hog : the shorter split, from the tee line to the hog line there [s]
    hog_to_hog : from hog line to hog line [s]
    hog_to_tee : from the first hog line to the tee line played to [s]
    hog_to_rest : from the first hog line until the stone rests [s]
    speed : speed over the first hog line [m/s]
    spin : spin over the first hog line, counter-clockwise positive [rad/s]
    turns : full turns from the first hog line until it rests, without sign
    line : crossing of the line of delivery with the tee line played to, right of the centre line
        [m]
    angle : the line of delivery, counter-clockwise from the direction of play [rad]
    curl : distance of its rest from the line of delivery, to the left [m]
    right : place of its rest, right of the centre line [m]
    past : place of its rest, past the tee line [m]
    from_tee : distance of its rest from the tee [m]
    touched : true if it touched another stone
    origin : (2,) start of the line of delivery at the first hog line, right of the centre line and
        past the tee played to [m]; None without a line
    """

    throw: int
    stone: int
    clock: float
    direction: Direction
    back_to_hog: Measured | None = None
    tee_to_hog: Measured | None = None
    hog_to_hog: Measured | None = None
    hog_to_tee: Measured | None = None
    hog_to_rest: Measured | None = None
    speed: Measured | None = None
    spin: Measured | None = None
    turns: Measured | None = None
    line: Measured | None = None
    angle: Measured | None = None
    curl: Measured | None = None
    right: Measured | None = None
    past: Measured | None = None
    from_tee: Measured | None = None
    touched: bool = False
    origin: Floats | None = None

    @property
    def rests(self) -> bool:
        """Return whether it was seen to come to rest."""
        return self.past is not None

    def curl_at(self, xy: Floats) -> Floats:
        """Return the distance of places (..., 2), sheet frame, to the left of the line of delivery
        [m].

        Raises
        ------
        ValueError : the line of delivery was not seen
        """
        if self.origin is None or self.angle is None:
            raise ValueError("the line of delivery was not seen")
        away = to_delivery(xy, self.direction) - self.origin
        ahead = np.array([-np.sin(self.angle.value), np.cos(self.angle.value)])
        return np.asarray(ahead[0] * away[..., 1] - ahead[1] * away[..., 0])

    def as_dict(self) -> dict[str, object]:
        """Return the numbers by name in SI units, each measured one followed by `NAME_sigma`."""
        document: dict[str, object] = {}
        for name in (field.name for field in fields(self) if field.name != "origin"):
            value = getattr(self, name)
            if name in _MEASURED:
                document[name] = None if value is None else value.value
                document[f"{name}_sigma"] = None if value is None else value.sigma
            else:
                document[name] = value.name.lower() if name == "direction" else value
        return document


_MEASURED = tuple(
    field.name for field in fields(ThrowMeasures) if str(field.type) == "Measured | None"
)


def throw_table(tracks: Sequence[Trajectory]) -> list[ThrowMeasures]:
    """Measure every throw of a session, in the order of the tracks.

    The thrown stone of a throw is the one that moves first. Throws whose stone never slides freely
    are dropped.

    Parameters
    ----------
    tracks : tracks of a session; the stones of one throw share its number and are adjacent
    """
    found: list[ThrowMeasures] = []
    for track, contacts in thrown_stones(tracks):
        with suppress(TrackTooShortError):
            found.append(measure_throw(track, contacts))
    return found


def thrown_stones(tracks: Sequence[Trajectory]) -> Iterator[tuple[Trajectory, list[float]]]:
    """Return the track of the thrown stone of every throw, and its times of contact with others
    [s].

    Parameters
    ----------
    tracks : tracks of a session; the stones of one throw share its number and are adjacent
    """
    touched = contacts_of(tracks)
    for _, group in groupby(range(len(tracks)), key=lambda k: tracks[k].throw):
        moving = [k for k in group if len(tracks[k]) > 1 and not stays_at_rest(tracks[k])]
        if moving:
            thrown = min(moving, key=lambda k: tracks[k].t[0])
            yield tracks[thrown], touched[thrown]


def measure_throw(track: Trajectory, contacts: Sequence[float] = ()) -> ThrowMeasures:
    """Measure one throw.

    Parameters
    ----------
    track : track of the thrown stone
    contacts : times at which it touched another stone [s], in addition to those in its own track;
        its path after the first of them is not measured

    Raises
    ------
    TrackTooShortError : no free slide of a metre and 20 samples
    """
    if track.by_gates:
        return _measure_by_gates(track)
    before = [time for time in (*contacts, *velocity_jumps(track)) if time > track.t[0]]
    first = rows_until(track, min(before, default=np.inf))
    slide = free_slide(first, ())
    seen = SeenThrow(first, slide)
    found: dict[str, Measured | None] = {}
    hog = seen.crossing(NEAR_HOG)
    for name, start, stop in (
        ("back_to_hog", seen.crossing(NEAR_BACK), hog),
        ("tee_to_hog", seen.crossing(NEAR_TEE), hog),
        ("hog_to_hog", hog, seen.crossing(FAR_HOG)),
        ("hog_to_tee", hog, seen.crossing(FAR_TEE)),
        ("hog_to_rest", hog, None if before else seen.time_of_rest()),
    ):
        found[name] = difference(start, stop)
    origin = None
    if hog is not None and (line := seen.line(hog.value)) is not None:
        origin, found["speed"], found["angle"], found["line"] = line
    found["spin"] = None if hog is None else seen.spin(hog.value)
    rest = SeenThrow(track, slide).last_place() if before else seen.place_of_rest()
    if rest is not None:
        place, sigma = rest
        found |= {
            "right": Measured(float(place[0]), sigma),
            "past": Measured(float(place[1]), sigma),
            "from_tee": Measured(float(np.hypot(*place)), sigma),
        }
    if rest is not None and not before:
        found["turns"] = None if hog is None else seen.turns(hog.value)
        if origin is not None and found["angle"] is not None:
            found["curl"] = _curl(origin, found["angle"], *rest)
    return ThrowMeasures(
        throw=track.throw,
        stone=track.stone,
        clock=track.clock,
        direction=seen.direction,
        touched=bool(before),
        origin=origin,
        **found,
    )


def _measure_by_gates(track: Trajectory) -> ThrowMeasures:
    """Return the splits of a throw timed by light gates, which show nothing else of it."""
    away = bool(track.xy[-1, 1] >= track.xy[0, 1])
    near_tee, near_hog, far_hog, far_tee = (
        None if (found := gate_time(track, line)) is None else Measured(*found)
        for line in (-TEE_Y, -HOG_LINE_Y, HOG_LINE_Y, TEE_Y)
    )
    return ThrowMeasures(
        throw=track.throw,
        stone=track.stone,
        clock=track.clock,
        direction=Direction.AWAY if away else Direction.HOME,
        tee_to_hog=difference(near_tee, near_hog),
        hog_to_hog=difference(near_hog, far_hog),
        hog_to_tee=difference(near_hog, far_tee),
    )


def _curl(origin: Floats, angle: Measured, place: Floats, sigma: float | None) -> Measured:
    away = place - origin
    left = -np.sin(angle.value) * away[1] - np.cos(angle.value) * away[0]
    return Measured(float(left), together(sigma, times(angle.sigma, float(np.hypot(*away)))))


def rows_until(track: Trajectory, time: float) -> Trajectory:
    """Return the rows of a track before a time."""
    if time > track.t[-1]:
        return track
    return track.only(track.t < time - 0.02)
