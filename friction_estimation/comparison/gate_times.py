"""Gate-timed throws compared with their simulation at equal time from hog line to hog line.

The release of such a throw is unknown. It is simulated with the speed that takes the measured time
from hog line to hog line. The comparison is then between its loss of speed from the first hog line
to the second, from the times for which it breaks both beams, and its time at the tee line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import root_scalar

from curling_env.errors import TrackTooShortError
from curling_env.ice import Ice
from curling_env.infrastructure.files.storage import write_table
from curling_env.physics.slides import NO_BOUNDS, slide
from curling_env.physics.wear import IceInUse
from curling_env.sheet import HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import MAX_SPEED, Release
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Indices
from friction_estimation.tracks.joint_path import passing_times
from friction_estimation.tracks.tuning import NEAR_LINE, USUAL_SPIN


@dataclass(frozen=True, kw_only=True)
class GateRethrow:
    """A timed throw and its prediction at equal time from hog line to hog line.

    Parameters
    ----------
    throw : number of the throw
    direction : end played to
    hog_to_hog_s : time from hog line to hog line [s]
    speed : speed at the first hog line with which it takes that long on the ice [m/s]
    kept, predicted_kept : speed at the second hog line over that at the first; None where it does
        not break both beams measurably
    kept_sigma : standard error of the measured one by its times
    hog_to_tee_s, predicted_hog_to_tee_s : time from the second hog line to the tee line [s]; None
        where it is not timed there, or not predicted to get there
    """

    throw: int
    direction: str
    hog_to_hog_s: float
    speed: float
    kept: float | None = None
    kept_sigma: float | None = None
    predicted_kept: float | None = None
    hog_to_tee_s: float | None = None
    predicted_hog_to_tee_s: float | None = None


class GateComparison(NamedTuple):
    """All timed throws beside their predictions.

    Parameters
    ----------
    rethrows : throws in order of play
    skipped : reasons why other throws were not thrown again
    """

    rethrows: tuple[GateRethrow, ...]
    skipped: tuple[str, ...]

    def summary(self) -> dict[str, Any]:
        """Means by direction and each throw in numbers, for JSON.

        Beams of different height change `kept` in opposite ways in both directions of play.
        """
        found: dict[str, Any] = {"throws": len(self.rethrows), "directions": {}}
        for direction in ("away", "home"):
            own = [throw for throw in self.rethrows if throw.direction == direction]
            if own:
                found["directions"][direction] = _means(own)
        found["each"] = [asdict(throw) for throw in self.rethrows]
        if self.skipped:
            found["skipped"] = list(self.skipped)
        return found

    def in_words(self) -> str:
        """Describe in a sentence how well the ice predicts; both directions count alike."""
        one = len(self.rethrows) == 1
        count, whose = ("one throw", "its") if one else (f"{len(self.rethrows)} throws", "their")
        ways = [w for w in self.summary()["directions"].values() if w["kept"] is not None]
        if not ways:
            return f"{count}: no beam was broken at both hog lines measurably"
        kept = np.mean([way["kept"] for way in ways])
        predicted = np.mean([way["predicted_kept"] for way in ways])
        return (
            f"{count} kept {kept:.2f} of {whose} speed from hog line to hog line, and would keep "
            f"{predicted:.2f} on this ice"
        )


def _means(throws: Sequence[GateRethrow]) -> dict[str, Any]:
    """Means over throws in one direction."""
    kept = np.array([(one.kept, one.predicted_kept) for one in throws], dtype=float)
    tee = np.array([(one.hog_to_tee_s, one.predicted_hog_to_tee_s) for one in throws], dtype=float)
    kept, tee = (both[np.isfinite(both).all(axis=1)] for both in (kept, tee))
    off = kept[:, 0] - kept[:, 1]
    return {
        "throws": len(throws),
        "kept": _mean(kept[:, 0]),
        "predicted_kept": _mean(kept[:, 1]),
        "kept_less_predicted": _mean(off),
        "kept_less_predicted_sd": float(off.std(ddof=1)) if len(off) > 1 else None,
        "hog_to_tee_less_predicted_s": _mean(tee[:, 0] - tee[:, 1]),
    }


def _mean(values: Floats) -> float | None:
    return float(values.mean()) if len(values) else None


def compare_gate_times(tracks: Sequence[Trajectory], ice: Ice) -> GateComparison:
    """Simulate every timed throw with its measured time from hog line to hog line.

    Parameters
    ----------
    tracks : throws that light gates timed, in order of play
    ice : ice on which they are thrown again

    Raises
    ------
    TrackTooShortError : no throw was timed at both hog lines
    """
    found: list[GateRethrow] = []
    skipped: list[str] = []
    in_use = IceInUse(ice)
    for order, track in enumerate(tracks):
        try:
            rethrow, path = _again(track, in_use.now, order)
        except TrackTooShortError as error:
            skipped.append(error.problem)
            continue
        found.append(rethrow)
        in_use.ran(path)
    if not found:
        raise TrackTooShortError(f"no throw can be thrown again: {skipped[0]}")
    return GateComparison(tuple(found), tuple(skipped))


def write_gate_comparison(comparison: GateComparison, folder: Path) -> None:
    """Write `throws.csv` with a row per throw."""
    rows = [asdict(throw) for throw in comparison.rethrows]
    write_table(folder / "throws.csv", {name: [row[name] for row in rows] for name in rows[0]})


def _again(track: Trajectory, ice: Ice, order: int) -> tuple[GateRethrow, Floats]:
    """Simulate a timed throw, and return its predicted path (n, 2) [m]."""
    direction = Direction.AWAY if track.xy[-1, 1] >= track.xy[0, 1] else Direction.HOME
    along = direction * track.xy[:, 1]
    first, second, tee = (
        np.flatnonzero(np.abs(along - line) < NEAR_LINE)
        for line in (-HOG_LINE_Y, HOG_LINE_Y, TEE_Y)
    )
    if not len(first) or not len(second):
        raise TrackTooShortError(f"throw {track.throw} was not timed at both hog lines")

    def between(times: Floats, begin: Indices, end: Indices) -> float:
        return float(times[end].mean() - times[begin].mean())

    def sooner(speed: float) -> float:
        path = _path(ice, track, direction, speed, order, until=TEE_Y + 1.0)
        predicted = passing_times(path, direction, along, beyond=np.nan)
        late = between(predicted, first, second) - seconds
        return -late if np.isfinite(late) else -1e3

    seconds = between(track.t, first, second)
    speed = MAX_SPEED
    if sooner(MAX_SPEED) > 0:
        speed = root_scalar(sooner, bracket=(0.1, MAX_SPEED), xtol=1e-10).root
    path = _path(ice, track, direction, speed, order)
    times = passing_times(path, direction, along, beyond=np.nan)
    kept = predicted = sigma = None
    if len(first) == len(second) == 2:
        broken = np.array([np.ptp(track.t[rows]) for rows in (first, second)])
        kept = float(broken[0] / broken[1])
        predicted = float(np.ptp(times[first]) / np.ptp(times[second]))
        errors = [float(np.hypot(*track.sigma_t[rows])) for rows in (first, second)]
        sigma = kept * float(np.hypot(*(errors / broken)))
    reached = between(times, second, tee) if len(tee) else np.nan
    rethrow = GateRethrow(
        throw=track.throw,
        direction=direction.name.lower(),
        hog_to_hog_s=seconds,
        speed=speed,
        kept=kept,
        kept_sigma=sigma,
        predicted_kept=predicted,
        hog_to_tee_s=between(track.t, second, tee) if len(tee) else None,
        predicted_hog_to_tee_s=reached if np.isfinite(reached) else None,
    )
    return rethrow, path.xy


def _path(
    ice: Ice,
    track: Trajectory,
    direction: Direction,
    speed: float,
    order: int,
    until: float = np.inf,
) -> Trajectory:
    """Path of a throw down the centre line, to a position along the play or to rest."""
    bounds = NO_BOUNDS.copy()
    if np.isfinite(until):
        bounds[3 if direction > 0 else 2] = direction * until
    release = Release(
        x=0.0,
        y=-direction * (HOG_LINE_Y + NEAR_LINE),
        vx=0.0,
        vy=direction * speed,
        theta=0.0,
        omega=USUAL_SPIN,
        stone=track.stone,
        clock=track.clock,
        order=order,
    )
    trajectory = slide(ice, release, bounds=bounds, fps=60.0).trajectory
    assert trajectory is not None  # a rate was given
    return trajectory
