"""Comparison of measured throws with their simulation on an estimated ice, the paper's last step.

The release is fitted to the first seconds of the free slide only. The rest of the path, up to the
place of rest, is a prediction and is compared with the measurement.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.infrastructure.files.storage import write_table
from curling_env.physics.slides import NO_BOUNDS, slide
from curling_env.physics.wear import IceInUse
from curling_env.throw import MAX_SPEED, MAX_SPIN, Release
from curling_env.trajectory import Trajectory
from curling_env.typing import Flags, Floats
from curling_env.units import Units, length
from friction_estimation.comparison.rethrow_result import Rethrow
from friction_estimation.comparison.rethrow_spread import position_noise, rest_spread
from friction_estimation.tracks.free_slide import FreeSlide, free_slides
from friction_estimation.tracks.outliers import robust_deviation
from friction_estimation.tracks.spin import fit_spin, has_heading

NOTHING_NOTED: Mapping[int, Mapping[str, str]] = MappingProxyType({})
NOT_YOUR_ICE = 5.0
"""Mean error of the places of rest above which the tracks are of another ice [m]."""
RELEASE_WINDOW = 2.5
"""Stretch of a free slide to which its release is fitted [s]. With 5 mm of noise the speed is then
known to about a millimetre a second, which moves a draw by 2 cm."""


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """All measured throws with their predictions.

    Parameters
    ----------
    rethrows : throws in order of play
    skipped : reasons why other throws were not thrown again
    window : stretch of each free slide to which its release was fitted [s]
    """

    rethrows: tuple[Rethrow, ...]
    skipped: tuple[str, ...]
    window: float

    def summary(self) -> dict[str, Any]:
        """Totals and each throw in numbers, for JSON."""
        errors = [k.rest_error for k in self.rethrows if k.rest_error is not None]
        misses = np.array([k.miss for k in self.rethrows if k.miss is not None])
        sigmas = [sigma for k in self.rethrows if k.sigmas is not None for sigma in k.sigmas]
        squares = np.concatenate(
            [((k.predicted - k.measured)[k.tested] ** 2).sum(axis=1) for k in self.rethrows]
        )

        def rms(values: list[float]) -> float | None:
            return float(np.sqrt(np.mean(np.square(values)))) if values else None

        return {
            "throws": len(self.rethrows),
            "path_rms_m": float(np.sqrt(squares.mean())) if squares.size else None,
            "rested": len(errors),
            "rest_error_m": rms(errors),
            "rest_error_median_m": float(np.median(errors)) if errors else None,
            "rest_error_worst_m": max(errors) if errors else None,
            "too_long_mean_m": float(misses[:, 1].mean()) if errors else None,
            "too_far_left_mean_m": float(misses[:, 0].mean()) if errors else None,
            "rest_error_sigmas": rms(sigmas),
            "release_window_s": self.window,
            "each": [rethrow.summary() for rethrow in self.rethrows],
            **({"skipped": list(self.skipped)} if self.skipped else {}),
        }

    def in_words(self, units: Units = Units.METRES) -> str:
        """Describe in a sentence how well the ice predicts."""
        found = self.summary()
        error, path, mean = found["rest_error_m"], found["path_rms_m"], found["too_long_mean_m"]
        count = "one throw" if found["throws"] == 1 else f"{found['throws']} throws"
        if error is None:
            if path is None:
                return f"{count}: too little is seen beyond the release to compare"
            return f"{count}: the predicted paths are {length(path, units)} off (root mean square)"
        words = f"{count}: stones came to rest {length(error, units)} from where this ice says"
        if mean is not None and abs(mean) > 0.5 * error:
            words += f", {length(mean, units)} {'short of' if mean > 0 else 'past'} it on average"
        if error > NOT_YOUR_ICE:
            words += ": this is not the ice that these stones ran on"
        return words


def compare_tracks(
    tracks: Sequence[Trajectory], ice: Ice, *, window: float = RELEASE_WINDOW
) -> Comparison:
    """Simulate every measured throw on an ice, from its measured release.

    Parameters
    ----------
    tracks : tracks of one session, in order of play
    ice : ice on which they are thrown again
    window : stretch of each free slide to which its release is fitted [s]

    Raises
    ------
    TrackTooShortError : no throw has a free slide
    InputError : a window that is not positive, or ice on which a stone never stops
    """
    if not window > 0:
        raise InputError(f"the release window must be positive, got {window} s")
    slides, skipped = free_slides(tracks)
    times = [part.track.t[part.rows] for part in slides]
    longest = max((float(t[-1] - t[0]) for t in times), default=0.0)
    if slides and window >= longest:
        raise InputError(
            f"a release window of {window:g} s leaves nothing to predict: the longest throw slides "
            f"freely for {longest:.1f} s"
        )
    again: list[Rethrow] = []
    ices: list[Ice] = []
    in_use = IceInUse(ice)
    for order, part in enumerate(slides):
        ices.append(in_use.now)
        again.append(rethrow(part, ices[-1], order, window))
        in_use.ran(again[-1].predicted)
    noise = position_noise(again)
    rethrows = tuple(
        replace(throw, rest_sigma=rest_spread(throw, known, noise, heading_seen=has_heading(part)))
        for throw, known, part in zip(again, ices, slides, strict=True)
    )
    return Comparison(rethrows=rethrows, skipped=tuple(skipped), window=window)


def rethrow(part: FreeSlide, ice: Ice, order: int, window: float = RELEASE_WINDOW) -> Rethrow:
    """Simulate one measured throw.

    Parameters
    ----------
    part : free slide of the throw
    ice : ice on which it is thrown again
    order : number of throws played before
    window : stretch of the free slide to which the release is fitted [s]
    """
    t = part.t - part.t[0]
    early = t <= max(window, t[min(len(t), 12) - 1])
    release = _fit_release(part, t, early, ice, order)
    path = _path(ice, release)
    if part.rests:
        end = part.stretch[1]
        last = part.track.t[:end] > part.t[-1] - 0.1
        rest = np.median(part.track.xy[:end][last], axis=0)
        rest_time = _arrival(t, part.xy, rest)
    else:
        rest, rest_time = None, None
    return Rethrow(
        throw=part.track.throw,
        stone=part.track.stone,
        release=release,
        t=t,
        measured=part.xy,
        predicted=path.at(t),
        tested=~early,
        rest=rest,
        predicted_rest=path.xy[-1],
        rest_time=rest_time,
        predicted_time=_arrival(path.t, path.xy, path.xy[-1]),
    )


def write_comparison(
    comparison: Comparison, folder: Path, noted: Mapping[int, Mapping[str, str]] = NOTHING_NOTED
) -> None:
    """Write `throws.csv` with a row per throw, and `paths.csv` with both paths of every throw.

    Parameters
    ----------
    noted : further columns of throws, by their numbers
    """
    names = dict.fromkeys(name for columns in noted.values() for name in columns)
    rows = [
        {**rethrow.summary(), **dict.fromkeys(names, ""), **noted.get(rethrow.throw, {})}
        for rethrow in comparison.rethrows
    ]
    write_table(
        folder / "throws.csv",
        {name: ["" if row[name] is None else row[name] for row in rows] for name in rows[0]},
    )
    paths = [
        np.column_stack([np.full(len(k.t), k.throw), k.t, k.measured, k.predicted])
        for k in comparison.rethrows
    ]
    titles = ("throw", "t", "x", "y", "predicted_x", "predicted_y")
    columns = dict(zip(titles, np.round(np.concatenate(paths), 5).T, strict=True))
    write_table(folder / "paths.csv", {**columns, "throw": columns["throw"].astype(int)})


def _fit_release(part: FreeSlide, t: Floats, early: Flags, ice: Ice, order: int) -> Release:
    """Return the release whose path under the law fits the first seconds, robustly."""
    at, xy = t[early], part.xy[early]
    spin, _, _, heading = fit_spin(part)
    sweeps = _swept_intervals(t, part.track.swept[part.rows])
    basis = np.column_stack([np.ones_like(at), at])
    curve = np.linalg.lstsq(np.column_stack([basis, at**2]), xy, rcond=None)[0]
    state = np.asarray(curve[:2], dtype=np.float64)
    release = _release(state, heading, spin, part, order, sweeps)
    for _ in range(4):
        residual = xy - _path(ice, release).at(at)
        size = np.hypot(*residual.T)
        limit = 2.5 * max(robust_deviation(residual.ravel() - np.median(residual)), 1e-6)
        weights = np.sqrt(np.minimum(1.0, limit / np.maximum(size, 1e-12)))[:, None]
        change = np.linalg.lstsq(basis * weights, residual * weights, rcond=None)[0]
        state = np.asarray(state + change, dtype=np.float64)
        release = _release(state, heading, spin, part, order, sweeps)
    return release


def _swept_intervals(t: Floats, swept: Floats) -> Floats:
    """Beginnings and ends of sweeping, (k, 2) [s], from flags per row."""
    edges = np.diff(np.concatenate([[0], (swept > 0.5).astype(int), [0]]))
    first, last = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    ends = np.append(t, t[-1] + 1.0)
    return np.column_stack([t[first], ends[last]]) if len(first) else np.empty((0, 2))


def _release(
    state: Floats, heading: float, spin: float, part: FreeSlide, order: int, sweeps: Floats
) -> Release:
    (x, y), (vx, vy) = state
    excess = max(1.0, float(np.hypot(vx, vy)) / (0.999 * MAX_SPEED))
    return Release(
        x=float(x),
        y=float(y),
        vx=float(vx) / excess,
        vy=float(vy) / excess,
        theta=heading,
        omega=float(np.clip(spin, -MAX_SPIN, MAX_SPIN)),
        stone=part.track.stone,
        clock=part.track.clock + float(part.t[0]),
        order=order,
        sweep_start=float(sweeps[0, 0]) if len(sweeps) else 0.0,
        sweep_end=float(sweeps[-1, 1]) if len(sweeps) else 0.0,
    )


def _path(ice: Ice, release: Release) -> Trajectory:
    trajectory = slide(ice, release, bounds=NO_BOUNDS, fps=60.0).trajectory
    assert trajectory is not None  # a rate was given
    return trajectory


def _arrival(t: Floats, xy: Floats, rest: Floats) -> float:
    """First time at which a path is within 5 cm of its place of rest [s]."""
    near = np.hypot(*(xy - rest).T) <= 0.05
    return float(t[np.argmax(near)]) if near.any() else float(t[-1])
