"""Lines of an overlay about a running throw, in a coach's words."""

from __future__ import annotations

import numpy as np

from curling_env.errors import TrackTooShortError
from curling_env.sheet import to_delivery
from curling_env.throw import handles
from curling_env.units import Units, side
from curling_env.units import speed as speed_in
from friction_estimation.tracking.films.film_track import FilmTrack
from friction_estimation.tracks.seen_throw import FAR_HOG, NEAR_HOG
from friction_estimation.tracks.throw_table import ThrowMeasures, measure_throw
from friction_estimation.tracks.tuning import MIN_MOVING_SPEED, MIN_TURN


class RunningNumbers:
    """Numbers of a throw, each from the moment at which it is known.

    Parameters
    ----------
    track : the thrown stone
    units : units of displayed lengths
    """

    def __init__(self, track: FilmTrack, units: Units = Units.METRES) -> None:
        self._track, self._units = track, units
        self._measures = _measured(track)
        self._ahead = np.empty(0)
        if self._measures is not None:
            self._ahead = to_delivery(track.trajectory.xy, self._measures.direction)[:, 1]
            self._curl = (
                None
                if self._measures.angle is None
                else self._measures.curl_at(track.trajectory.xy)
            )

    def before(self, seen: bool) -> list[str]:
        """Return the lines for a frame without the stone; `seen` if it was in an earlier one."""
        return ["not seen" if seen else "no stone yet"]

    def at(self, row: int) -> list[str]:
        """Return the lines for the stone in a row of the track."""
        track, units = self._track, self._units
        now = float(np.hypot(*track.velocity[row]))
        lines = [speed_in(now, units) if now > MIN_MOVING_SPEED else "at rest"]
        found = self._measures
        if found is not None:
            lines += self._weight(found, row) + self._line(found, row, now)
        x, y = track.trajectory.xy[row]
        if units is Units.METRES:
            lines.append(f"x {x:+.2f}  y {y:+.2f} m")
        else:
            lines.append(f"x {x / 0.3048:+.1f}  y {y / 0.3048:+.1f} ft")
        return lines

    def _weight(self, found: ThrowMeasures, row: int) -> list[str]:
        """Split, speed over the hog line, and time from hog line to hog line."""
        lines: list[str] = []
        if self._ahead[row] < NEAR_HOG:
            return lines
        if found.back_to_hog is not None:
            lines.append(f"split {found.back_to_hog.value:.2f} s")
        if found.hog_to_hog is not None and self._ahead[row] >= FAR_HOG:
            lines.append(f"hog to hog {found.hog_to_hog.value:.2f} s")
        elif found.speed is not None:
            lines.append(f"hog line {speed_in(found.speed.value, self._units)}")
        return lines

    def _line(self, found: ThrowMeasures, row: int, now: float) -> list[str]:
        """Return lines on handle, curl until now, and the stone's final place."""
        lines: list[str] = []
        beyond = self._ahead[row] >= NEAR_HOG
        if beyond and found.spin is not None and 3 * abs(found.spin.value) > MIN_TURN:
            spin = self._track.spin[row]
            turning = (
                f" {abs(spin):.1f} rad/s" if np.isfinite(spin) and now > MIN_MOVING_SPEED else ""
            )
            lines.append(f"{handles(found.spin.value)[0]}{turning}")
        if beyond and self._curl is not None and not (found.touched and now <= MIN_MOVING_SPEED):
            result = side(float(self._curl[row]), self._units, right="left")
            none = "no curl yet" if now > MIN_MOVING_SPEED else "no curl"
            lines.append(none if result == "on the line" else f"curl {result}")
        if now <= MIN_MOVING_SPEED and found.past is not None and found.right is not None:
            along = side(found.past.value, self._units, right="past")
            lines.append(f"stops {along}, {side(found.right.value, self._units)}")
        return lines


def _measured(track: FilmTrack) -> ThrowMeasures | None:
    try:
        return measure_throw(track.trajectory, track.contacts)
    except TrackTooShortError:
        return None
