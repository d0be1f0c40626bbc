"""Release at the hog line: speed, line and rotation, read from a track.

The path of the law on the session's ice is fitted to the averaged rows of the first seconds. The
throw's own friction and curl are fitted too, within the usual variation between throws, so that a
stone on ice that differs from the file is not taken for an error of the hand. Stated errors of the
track are assumed to last a second and a half.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from agents.coaching.runs import Place, run
from agents.coaching.tuning import (
    BIN,
    LASTING,
    LATEST_START,
    MAX_OWN_CURL,
    MAX_OWN_FRICTION,
    MIN_BINS,
    OWN_CURL,
    OWN_FRICTION,
    RELEASE_WINDOW,
    UNSEEN_SPIN,
    WIDE_BIN,
    WIDE_CURL,
    WIDE_FRICTION,
)
from curling_env.errors import TrackTooShortError
from curling_env.ice import ActiveEffect, Ice
from curling_env.sheet import HOG_TO_FAR_TEE, Direction, to_delivery
from curling_env.throw import MAX_SPEED, MAX_SPIN
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Indices
from friction_estimation.tracks.free_slide import FreeSlide, free_slide
from friction_estimation.tracks.measured import Measured
from friction_estimation.tracks.outliers import robust_deviation
from friction_estimation.tracks.spin import has_heading
from friction_estimation.tracks.throw_table import rows_until
from friction_estimation.tracks.tuning import USUAL_SPIN

_RIGHT, _PAST, _SPEED, _ANGLE, _SPIN, _HEADING, _FRICTION, _CURL = range(8)
_STEPS = np.array([0.01, 0.01, 0.01, 0.002, 0.05, 0.05, 0.01, 0.05])
"""Steps of the numerical derivatives."""
_FPS = 20.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Released:
    """Throw as it crossed the hog line.

    Parameters
    ----------
    place : its place in the session
    throw : (4,) speed [m/s], angle [rad], spin [rad/s], and x [m]
    covariance : (4, 4) of their errors
    friction : ln of its friction over that of the ice, and its standard error
    curl : ln of its curl over that of the ice, and its standard error
    covariance_own : covariance of the errors of friction and curl
    spin_seen : true if its heading was seen
    sweep : start and end of sweeping after the release [s]; equal if it was not swept
    """

    place: Place
    throw: Floats
    covariance: Floats
    friction: Measured
    curl: Measured
    covariance_own: float = 0.0
    spin_seen: bool = True
    sweep: tuple[float, float] = (0.0, 0.0)


def read_release(
    track: Trajectory,
    ice: Ice,
    *,
    contacts: Sequence[float] = (),
    order: int = 0,
    others: Sequence[Ice] = (),
    whole: bool = False,
) -> Released:
    """Read the release of a throw from its track.

    Parameters
    ----------
    track : track of the thrown stone
    ice : ice of the session before the throw
    contacts : times of its contacts with other stones [s]; only rows before the first are used
    order : number of throws before it in the session
    others : ices sampled within the standard errors of the ice
    whole : use the whole free slide with free friction and curl, to measure the stone; otherwise
        only its first seconds, to measure the hand

    Raises
    ------
    TrackTooShortError : too little was seen of the first metres beyond the hog line
    """
    first = rows_until(track, min((t for t in contacts if t > track.t[0]), default=np.inf))
    slide = free_slide(first, ())
    return _Fit(slide, ice, order, others, whole).result()


@dataclass(frozen=True, kw_only=True, eq=False)
class _Series:
    """Averaged rows of some coordinates that share their errors.

    Parameters
    ----------
    t : (n,) time since the first row [s]
    values : (n, k)
    covariance : (n, n) of the errors of one coordinate
    """

    t: Floats
    values: Floats
    covariance: Floats


def _averaged(
    t: Floats, values: Floats, white: float, stated: Floats | None, width: float
) -> _Series:
    """Average rows over time, with their shared errors.

    Parameters
    ----------
    t : (n,) times since the first row [s]
    values : (n, k)
    white : standard deviation of the independent part of a row's error
    stated : (n,) standard errors that persist; None for none
    width : averaging time [s]
    """
    _, number, count = np.unique(np.floor(t / width), return_inverse=True, return_counts=True)

    def mean(column: Floats) -> Floats:
        return np.bincount(number, column) / count

    when = mean(t)
    covariance = np.diag(np.maximum(white**2 / count, 1e-10))
    if stated is not None:
        lasting = mean(np.nan_to_num(stated))
        alike = np.exp(-np.abs(np.subtract.outer(when, when)) / LASTING)
        covariance = covariance + alike * np.outer(lasting, lasting)
    return _Series(
        t=when, values=np.column_stack([mean(column) for column in values.T]), covariance=covariance
    )


class _Fit:
    """Fit of a path of the law to a throw."""

    def __init__(
        self, slide: FreeSlide, ice: Ice, order: int, others: Sequence[Ice], whole: bool
    ) -> None:
        track = slide.track
        self._slide, self._whole = slide, whole
        self._width = WIDE_BIN if whole else BIN
        ahead = slide.xy[-1, 1] >= slide.xy[0, 1]
        direction = Direction.AWAY if ahead else Direction.HOME
        xy, t = to_delivery(slide.xy, direction), slide.t
        beyond = np.flatnonzero(xy[:, 1] >= -HOG_TO_FAR_TEE)
        name = f"throw {track.throw}"
        if not beyond.size or xy[beyond[0], 1] > -HOG_TO_FAR_TEE + LATEST_START:
            raise TrackTooShortError(f"{name}: the first metres beyond the hog line were not seen")
        self._begin = float(t[beyond[0]])
        used = t >= self._begin
        if not whole:
            used &= t <= self._begin + RELEASE_WINDOW
        rows = slide.rows[used]
        since = t[used] - self._begin
        stated = track.sigma_xy[rows] if track.sigma_xy.size else None
        self._xy = _averaged(since, xy[used], slide.noise, stated, self._width)
        if len(self._xy.t) < MIN_BINS:
            raise TrackTooShortError(f"{name}: only {since[-1]:.1f} s seen beyond the hog line")
        self._heading = self._headings(rows, since)
        self.place = Place(
            direction=direction,
            clock=track.clock + self._begin - float(track.t[0]),
            order=order,
            stone=track.stone,
        )
        self._ice, self._others = ice, others
        swept = np.flatnonzero(track.swept[slide.rows] > 0.5)
        self._sweep = (
            (max(float(t[swept[0]]) - self._begin, 0.0), float(t[swept[-1]]) - self._begin)
            if len(swept)
            else (0.0, 0.0)
        )

    def _headings(self, rows: Indices, since: Floats) -> _Series | None:
        track = self._slide.track
        theta = track.theta[rows]
        known = np.isfinite(theta)
        if not has_heading(self._slide) or known.sum() < 2 * MIN_BINS:
            return None
        theta, since, rows = theta[known], since[known], rows[known]
        # Second differences of a smooth turn are the noise of single rows.
        white = robust_deviation(np.diff(theta, 2)) / 6**0.5
        stated = track.sigma_theta[rows] if track.sigma_theta.size else None
        return _averaged(since, theta[:, None], white, stated, self._width)

    def _begin_from(self) -> tuple[Floats, Floats]:
        """Return the first guess of the parameters (8,), and its prior standard deviations (8,)."""
        t, xy = self._xy.t, self._xy.values
        early = t <= max(3.0, t[MIN_BINS - 1])
        curve = np.polynomial.polynomial.polyfit(t[early], xy[early], 2)
        (right, past), (vx, vy) = curve[0], curve[1]
        spin, heading = 0.0, 0.0
        if self._heading is not None:
            heading, spin = np.polynomial.polynomial.polyfit(
                self._heading.t[:16], self._heading.values[:16, 0], 1
            )
        else:
            bend = -float(curve[2][0])  # a stone curls to the side to which its front turns
            spin = USUAL_SPIN if bend >= 0 else -USUAL_SPIN
        start = np.array(
            [right, past, np.hypot(vx, vy), np.arctan2(-vx, vy), spin, heading, 0.0, 0.0]
        )
        start[_SPIN] = np.clip(start[_SPIN], -0.5 * MAX_SPIN, 0.5 * MAX_SPIN)
        start[_SPEED] = min(start[_SPEED], 0.95 * MAX_SPEED)
        known = np.full(8, np.inf)
        known[_FRICTION] = WIDE_FRICTION if self._whole else OWN_FRICTION
        known[_CURL] = WIDE_CURL if self._whole else OWN_CURL
        if self._heading is None:
            known[_SPIN], known[_HEADING] = UNSEEN_SPIN, 1.0
        return start, known

    def _paths(self, parameters: Floats) -> Floats:
        """Return paths of rows of parameters (n, 8), (n, m, 3): right, past, heading every 1/`_FPS`
        s.
        """
        own, which = np.unique(parameters[:, [_FRICTION, _CURL]], axis=0, return_inverse=True)
        stone = self.place.stone
        ices = [with_own(self._ice, stone, friction, curl) for friction, curl in own.tolist()]
        return self._run(parameters, ices, which.ravel())

    def _run(self, parameters: Floats, ices: Sequence[Ice], which: Indices) -> Floats:
        throws = np.column_stack([parameters[:, k] for k in (_SPEED, _ANGLE, _SPIN, _RIGHT)])
        last = max(float(self._xy.t[-1]), 0.0 if self._heading is None else self._heading.t[-1])
        sweeps = np.tile(self._sweep, (len(throws), 1))
        ran = run(
            ices,
            throws,
            self.place,
            which=which,
            sweeps=sweeps,
            fps=_FPS,
            longest=last + 1.0,
            ahead=parameters[:, _PAST] + HOG_TO_FAR_TEE,
        )
        assert ran.paths is not None  # a rate was requested
        xy = to_delivery(ran.paths[..., :2], self.place.direction)
        turned = ran.paths[..., 2] + parameters[:, _HEADING, None]
        ends = to_delivery(np.column_stack([ran.x, ran.y]), self.place.direction)
        full = np.concatenate([xy, turned[..., None]], axis=2)
        final = np.column_stack([ends, ran.theta + parameters[:, _HEADING]])
        return np.where(np.isnan(full), final[:, None, :], full)

    def _residuals(self, parameters: Floats) -> list[Floats]:
        """Return the residuals of paths (n, 8): all x, all y, then the heading, (n, m)."""
        paths = self._paths(parameters)
        left = [self._xy.values.T.ravel() - _places(paths, self._xy.t)]
        if self._heading is not None:
            left.append(self._heading.values[:, 0] - _at(paths, self._heading.t, 2))
        return left

    def _covariances(self, parameters: Floats) -> Sequence[Floats]:
        """Return the covariances of the residuals, including those of the ice."""
        places = np.asarray(np.kron(np.eye(2), self._xy.covariance), dtype=np.float64)
        if len(self._others) > 1:
            same = np.tile(parameters, (len(self._others), 1))
            which = np.arange(len(self._others))
            off = _places(self._run(same, self._others, which), self._xy.t)
            off = off - _places(self._paths(parameters[None]), self._xy.t)
            places += off.T @ off / len(off)
        return [places] if self._heading is None else [places, self._heading.covariance]

    def result(self) -> Released:
        """Fit by Gauss-Newton, with the prior."""
        now, known = self._begin_from()
        begin = now.copy()
        factors = [cho_factor(covariance) for covariance in self._covariances(now)]
        prior = np.diag(known**-2.0)
        covariance = np.eye(8)
        for _ in range(5):
            left = self._residuals(np.vstack([now, now + np.diag(_STEPS)]))
            normal, right = prior.copy(), prior @ (begin - now)
            for residual, factor in zip(left, factors, strict=True):
                slopes = (residual[0] - residual[1:]).T / _STEPS
                weighted = cho_solve(factor, np.column_stack([slopes, residual[0]]))
                normal += slopes.T @ weighted[:, :-1]
                right += slopes.T @ weighted[:, -1]
            covariance = np.linalg.pinv(normal)
            change = covariance @ right
            now = now + change
            now[_FRICTION] = np.clip(now[_FRICTION], -MAX_OWN_FRICTION, MAX_OWN_FRICTION)
            now[_CURL] = np.clip(now[_CURL], -MAX_OWN_CURL, MAX_OWN_CURL)
            now[_SPEED] = np.clip(now[_SPEED], 0.05, 0.98 * MAX_SPEED)
            now[_SPIN] = np.clip(now[_SPIN], -0.9 * MAX_SPIN, 0.9 * MAX_SPIN)
            if (np.abs(change) < 1e-4 * _STEPS).all():
                break
        left = self._residuals(now[None])
        chi2 = sum(float(r[0] @ cho_solve(f, r[0])) for r, f in zip(left, factors, strict=True))
        free = sum(r.shape[1] for r in left) - 8
        covariance = covariance * max(1.0, chi2 / max(free, 1))
        to_line = self._to_hog_line(now)
        slopes = np.column_stack(
            [
                (self._to_hog_line(now + step) - to_line) / size
                for step, size in zip(np.diag(_STEPS), _STEPS, strict=True)
            ]
        )
        own = np.sqrt(np.diag(covariance)[[_FRICTION, _CURL]])
        return Released(
            place=self.place,
            throw=to_line,
            covariance=np.asarray(slopes @ covariance @ slopes.T, dtype=np.float64),
            friction=Measured(float(now[_FRICTION]), float(own[0])),
            curl=Measured(float(now[_CURL]), float(own[1])),
            covariance_own=float(covariance[_FRICTION, _CURL]),
            spin_seen=self._heading is not None,
            sweep=self._sweep,
        )

    def _to_hog_line(self, parameters: Floats) -> Floats:
        """Return the throw (4,) at the hog line of a stone that is slightly beyond it."""
        if not hasattr(self, "_push"):
            # Deceleration and curl in the first moments, along and across the path.
            path = self._paths(parameters[None])[0]
            later = path[int(0.5 * _FPS), :2] - path[0, :2]
            speed, angle = parameters[_SPEED], parameters[_ANGLE]
            ahead = np.array([-np.sin(angle), np.cos(angle)])
            self._push = 2 * (later - 0.5 * speed * ahead) / 0.5**2
        speed, angle = parameters[_SPEED], parameters[_ANGLE]
        velocity = speed * np.array([-np.sin(angle), np.cos(angle)])
        back = (parameters[_PAST] + HOG_TO_FAR_TEE) / velocity[1]
        then = velocity - back * self._push
        right = parameters[_RIGHT] - back * velocity[0] + 0.5 * back**2 * self._push[0]
        return np.array([np.hypot(*then), np.arctan2(-then[0], then[1]), parameters[_SPIN], right])


def _at(paths: Floats, t: Floats, column: int) -> Floats:
    """Interpolate a column of paths (n, m, 3) at times (k,), (n, k)."""
    grid = np.arange(paths.shape[1]) / _FPS
    return np.stack([np.interp(t, grid, path[:, column]) for path in paths])


def _places(paths: Floats, t: Floats) -> Floats:
    """Return all x and then all y of paths at times (k,), (n, 2·k)."""
    return np.concatenate([_at(paths, t, 0), _at(paths, t, 1)], axis=1)


def with_own(ice: Ice, stone: int, friction: float, curl: float) -> Ice:
    """Return the ice with one stone's friction and curl multiplied by the exponentials of two
    numbers.
    """
    if friction == curl == 0.0:
        return ice
    own = {
        "stone": float(stone),
        "factor": float(np.exp(friction)),
        "curl_factor": float(np.exp(curl)),
    }
    return ice.with_effect(ActiveEffect(name="stone_bias", parameters=own))
