"""Comparison of measured throws with their simulation on an estimated ice, the paper's last step.

The release is fitted to the first seconds of the free slide only. The rest of the path, up to the
place of rest, is a prediction and is compared with the measurement.

For the uncertainty of a predicted rest, a throw is repeated on ices drawn from the standard errors
of the ice. On each of them the release is fitted again to the first seconds, to positions with new
noise of the measured size. Errors of ice and release that compensate each other are therefore not
counted twice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from curling_env.analysis.ice_uncertainty import plausible_ices
from curling_env.analysis.tuning import MIN_RESTED_SHARE
from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.infrastructure.files.storage import write_table
from curling_env.physics.batch import release_table, throw_batch
from curling_env.physics.slides import NO_BOUNDS, SlideEnd, slide
from curling_env.physics.wear import IceInUse
from curling_env.throw import MAX_SPEED, MAX_SPIN, Release
from curling_env.trajectory import Trajectory
from curling_env.typing import Flags, Floats
from curling_env.units import Units, length
from friction_estimation.discovery.model.noise import CoordinateNoise, Series, most_likely_noise
from friction_estimation.tracks.free_slide import FreeSlide, free_slides
from friction_estimation.tracks.outliers import robust_deviation
from friction_estimation.tracks.spin import fit_spin, has_heading
from friction_estimation.tracks.tuning import USUAL_SPIN

NOTHING_NOTED: Mapping[int, Mapping[str, str]] = MappingProxyType({})
NOT_YOUR_ICE = 5.0
"""Mean error of the places of rest above which the tracks are of another ice [m]."""
RELEASE_WINDOW = 2.5
"""Stretch of a free slide to which its release is fitted [s]. With 5 mm of noise the speed is then
known to about a millimetre a second, which moves a draw by 2 cm."""
SPREAD_ICES = 128
"""Ices on which a throw is repeated; σ is then known to 9 %."""
NOISE_THROWS = 12
"""Number of throws from which the noise of the positions is estimated."""
BEND_TIME = 8.0
"""Longest period of residuals that count as noise of positions; slower ones come from the ice
[s]."""
MEMORY = (0.05, 4.0)
"""Shortest and longest correlation time of the noise [s]."""
LEAST_NOISE = 1e-5
"""Smallest noise that is considered [m], so that exact tracks do not divide by zero."""
EARLY_ROWS = 20.0
"""Rows a second at which the first seconds on two ices are compared [1/s]."""


@dataclass(frozen=True, kw_only=True)
class Rethrow:
    """One measured throw and its prediction.

    Parameters
    ----------
    throw, stone : numbers of the throw and of its stone in the tracks
    release : release fitted to the first seconds
    t : (n,) time since the release [s]
    measured, predicted : (n, 2) paths in the sheet frame [m]
    tested : (n,) rows after the release window, which test the prediction
    rest : (2,) measured place of rest [m]; None if the track ends before
    predicted_rest : (2,) predicted place of rest [m]
    rest_time : time from the release until the stone was 5 cm from its rest [s], which noise blurs
        less than the very end; None if the track ends before
    predicted_time : the same time as predicted [s]
    rest_sigma : standard deviations of the predicted less the measured place of rest, across and
        along the sheet [m], that follow from those of the ice and from the noise of the positions;
        None where it is not known
    """

    throw: int
    stone: int
    release: Release
    t: Floats
    measured: Floats
    predicted: Floats
    tested: Flags
    rest: Floats | None
    predicted_rest: Floats
    rest_time: float | None
    predicted_time: float
    rest_sigma: tuple[float, float] | None = None

    @property
    def rest_error(self) -> float | None:
        """Distance between predicted and measured place of rest [m]."""
        return None if self.rest is None else float(np.hypot(*(self.predicted_rest - self.rest)))

    @property
    def miss(self) -> tuple[float, float] | None:
        """Predicted less measured place of rest, to the thrower's left and along the play [m]."""
        if self.rest is None:
            return None
        x, y = (self.release.direction * (self.predicted_rest - self.rest)).tolist()
        return -x, y

    @property
    def sigmas(self) -> tuple[float, float] | None:
        """`miss` in standard deviations; None where one is unknown."""
        if self.miss is None or self.rest_sigma is None or not all(self.rest_sigma):
            return None
        return self.miss[0] / self.rest_sigma[0], self.miss[1] / self.rest_sigma[1]

    def summary(self) -> dict[str, Any]:
        """Return the throw in numbers, for JSON and CSV."""
        none = (None, None)
        rest = none if self.rest is None else self.rest.tolist()
        left, long = self.miss or none
        apart = (self.predicted - self.measured)[self.tested]
        return {
            "throw": self.throw,
            "stone": self.stone,
            "speed": self.release.speed,
            "spin": self.release.omega,
            "rest_x": rest[0],
            "rest_y": rest[1],
            "predicted_x": float(self.predicted_rest[0]),
            "predicted_y": float(self.predicted_rest[1]),
            "rest_sigma_x_m": (self.rest_sigma or none)[0],
            "rest_sigma_y_m": (self.rest_sigma or none)[1],
            "rest_error_m": self.rest_error,
            "too_long_m": long,
            "too_far_left_m": left,
            "sigmas_too_long": (self.sigmas or none)[1],
            "sigmas_too_far_left": (self.sigmas or none)[0],
            "path_rms_m": _rms(np.hypot(*apart.T)),
            "rest_time_s": self.rest_time,
            "predicted_time_s": self.predicted_time,
        }


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
        apart = [(k.predicted - k.measured)[k.tested] for k in self.rethrows]
        return {
            "throws": len(self.rethrows),
            "path_rms_m": _rms(np.hypot(*np.concatenate(apart).T)),
            "rested": len(errors),
            "rest_error_m": _rms(errors),
            "rest_error_median_m": float(np.median(errors)) if errors else None,
            "rest_error_worst_m": max(errors) if errors else None,
            "too_long_mean_m": float(misses[:, 1].mean()) if errors else None,
            "too_far_left_mean_m": float(misses[:, 0].mean()) if errors else None,
            "rest_error_sigmas": _rms(sigmas),
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


def _rms(values: ArrayLike) -> float | None:
    """Root mean square; None without values."""
    return float(np.sqrt(np.mean(np.square(values)))) if np.size(values) else None


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
    write_table(folder / "throws.csv", {name: [row[name] for row in rows] for name in rows[0]})
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


# --- uncertainty of a predicted rest --------------------------------------------------------------


def position_noise(throws: Sequence[Rethrow]) -> CoordinateNoise | None:
    """Noise of one coordinate of the measured positions; None if there are too few rows to estimate
    it.

    Parameters
    ----------
    throws : of one session
    """
    series: list[Series] = []
    jitter: list[float] = []
    for throw in throws[:NOISE_THROWS]:
        # Around the stop, paths that end at different times diverge.
        moving = throw.t <= 0.8 * min(throw.t[-1], throw.predicted_time)
        t = throw.t[moving]
        degree = 2 + int(t[-1] / BEND_TIME) if len(t) else 0
        if len(t) < 4 * (degree + 1):
            continue
        curve = np.polynomial.legendre.legvander(2.0 * t / t[-1] - 1.0, degree)
        for residual in (throw.measured - throw.predicted)[moving].T:
            series.append(Series(t, np.ones(len(t)), np.column_stack([curve, residual])))
            bend = np.linalg.lstsq(curve, residual, rcond=None)[0]
            jitter.append(robust_deviation(residual - curve @ bend))
    if not series:
        return None
    size = max(float(np.median(jitter)), LEAST_NOISE)
    white, slow, time = most_likely_noise(series, size, memory=MEMORY)
    return CoordinateNoise(white=white, slow=slow, time=time if slow else 0.0)


def rest_spread(
    throw: Rethrow, ice: Ice, noise: CoordinateNoise | None, *, heading_seen: bool
) -> tuple[float, float] | None:
    """Standard deviations of a predicted rest less the measured one.

    Parameters
    ----------
    throw : throw and its prediction
    ice : the ice on which it was predicted
    noise : noise of the positions to which its release was fitted
    heading_seen : whether the spin was measured; otherwise it may be any usual one

    Returns
    -------
    across and along the sheet [m]; None if the stone may well not rest on the ice
    """
    rng = np.random.default_rng(throw.release.order)
    ices = plausible_ices(ice, SPREAD_ICES, rng)
    which = np.arange(SPREAD_ICES) % len(ices)
    table = np.repeat(release_table([throw.release]), SPREAD_ICES)
    at = throw.t[~throw.tested]
    if len(ices) > 1:
        seconds = max(float(at[-1]), 1.0)
        early = throw_batch(ices, table, which=which, fps=EARLY_ROWS, longest=seconds)
        alone = throw_batch(ice, table[:1], fps=EARLY_ROWS, longest=seconds)
        assert early.paths is not None  # a rate was given
        assert alone.paths is not None
        apart = early.paths[:, :, :2] - alone.paths[:, :, :2]
        t = np.arange(apart.shape[1]) / EARLY_ROWS
        seen = np.isfinite(apart).all(axis=(0, 2))
        for names, column in ((("x", "vx"), 0), (("y", "vy"), 1)):
            start, speed = np.polynomial.polynomial.polyfit(t[seen], apart[:, seen, column].T, 1)
            table[names[0]] -= start
            table[names[1]] -= speed
    if noise is not None:
        root = np.linalg.cholesky(_line_covariance(at, noise))
        for names in (("x", "vx"), ("y", "vy")):
            start, speed = root @ _pairs(rng, 2)
            table[names[0]] += start
            table[names[1]] += speed
    if not heading_seen:
        table["omega"] += USUAL_SPIN * _pairs(rng, 1)[0]
    table["omega"] = np.clip(table["omega"], -MAX_SPIN, MAX_SPIN)
    excess = np.maximum(np.hypot(table["vx"], table["vy"]) / (0.999 * MAX_SPEED), 1.0)
    table["vx"] /= excess
    table["vy"] /= excess
    rests = throw_batch(ices, table, which=which)
    rested = rests.end == SlideEnd.REST
    if rested.mean() < MIN_RESTED_SHARE:
        return None
    # The measured rest is the median of the last tenth of a second, some three rows.
    measured = 0.0 if noise is None else np.hypot(noise.white / np.sqrt(2.0), noise.slow)
    across, along = rests.x[rested].std(), rests.y[rested].std()
    return float(np.hypot(across, measured)), float(np.hypot(along, measured))


def _pairs(rng: np.random.Generator, rows: int) -> Floats:
    """Independent Gaussian numbers of variance 1 whose mean is zero, (rows, SPREAD_ICES).

    Ices come in pairs of opposite sign, neighbours in their list; these numbers are paired
    differently.
    """
    half = rng.standard_normal((rows, SPREAD_ICES // 2))
    return np.concatenate([half, -half], axis=1)


def _line_covariance(t: Floats, noise: CoordinateNoise) -> Floats:
    """Covariance of start [m] and speed [m/s] of a line fitted to noisy positions, (2, 2)."""
    fit = np.linalg.pinv(np.column_stack([np.ones_like(t), t]))
    apart = np.abs(t[:, None] - t[None, :])
    alike = np.exp(-apart / noise.time) if noise.slow else np.zeros_like(apart)
    of_rows = noise.white**2 * np.eye(len(t)) + noise.slow**2 * alike
    return fit @ of_rows @ fit.T
