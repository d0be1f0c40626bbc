"""Several cameras on one throw, joined into one track: the stone is handed on between them.

Each camera has a clock of its own and is a few millimetres off in its own way. One smooth path is
fitted to what all of them saw, with an offset of time for each clock and an offset of place for
each camera. Where nobody saw the stone the path runs on as a sliding stone does: its acceleration
changes slowly. That bridges the gap, tells how long it took, and says how uncertain both are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import BSpline

from curling_env.errors import InputError, TrackTooShortError
from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.tracks.free_slide import free_slide
from friction_estimation.tracks.smoothing import local_fit

KNOT_STEP = 0.25
"""Distance between the knots of the path [s]."""
RATE = 8.0
"""Rows a second of each camera that are asked: a track's rows are smooth, more tell no more."""
JERKS = (0.008, 0.025, 0.08)
"""Square root of the spectral density of the jerk while the stone slides [m/s³/√Hz].

Ice that differs by 5 % every few metres changes a draw's deceleration by 0.005 m/s² in a second or
two, and friction that grows as the stone slows adds to it; ice is not to be believed any more even.
"""
PUSHED_JERK = 1.0
"""The same while it is pushed, or stopped by something."""
MIN_SIGMA = 0.001
"""No row is trusted better than this [m]."""
UNKNOWN_SIGMA = 0.005
"""Of tracks that do not say how uncertain they are [m]."""
SLOWEST = 0.1
"""A stone slower than this, in mean of both sides, tells no time between two cameras [m/s]."""
GAIN = 0.15
"""By how much a sliding stone may seem to gain speed from one camera to the next [m/s]."""
END_WINDOW = 1.0
"""Stretch of track from which the speed at its end is taken [s]."""
CONTRADICTION = 6.0
"""Standard errors by which cameras may differ."""
BLUNDER = 0.1
"""And how far in any case [m]: a throw of its own would be farther."""
ROUNDS = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class Joined:
    """One throw as several cameras saw it.

    Parameters
    ----------
    trajectory : on the clock of the camera that saw the stone first; the rows that were seen
    bridge : the rows that were not, with the σ of the motion model; None without a gap
    order : (k,) the tracks by the order in which they saw the stone
    offset : (k,) what is added to each track's times, by track [s]
    offset_sigma : (k,) standard error of it; 0 for the first camera
    gaps : (start, stop) times between which no camera saw the stone
    """

    trajectory: Trajectory
    bridge: Trajectory | None
    order: tuple[int, ...]
    offset: Floats
    offset_sigma: Floats
    gaps: tuple[tuple[float, float], ...]

    @property
    def whole(self) -> Trajectory:
        """Seen and bridged rows together, in order of time."""
        if self.bridge is None:
            return self.trajectory
        parts = (self.trajectory, self.bridge)
        order = np.argsort(np.concatenate([part.t for part in parts]))
        names = ("t", "xy", "theta", "swept", "sigma_xy", "sigma_theta")
        columns = {
            name: np.concatenate([getattr(part, name) for part in parts])[order] for name in names
        }
        return replace(self.trajectory, **columns)


def join_cameras(tracks: Sequence[Trajectory]) -> Joined:
    """One track of the throw that several cameras saw, each with a clock of its own.

    Parameters
    ----------
    tracks : one a camera, in any order; times from each film's first frame

    Raises
    ------
    InputError : fewer than two tracks, tracks of different throws, or a stone that rests where it
        passes from one camera to the next
    """
    if len(tracks) < 2:
        raise InputError(f"two cameras or more are joined, got {len(tracks)}")
    way = float(np.sign(sum(track.xy[-1, 1] - track.xy[0, 1] for track in tracks))) or 1.0
    order = tuple(np.argsort([way * np.mean(track.xy[:, 1]) for track in tracks]).tolist())
    chain = [tracks[k] for k in order]
    start = np.zeros(len(chain))
    for k in range(1, len(chain)):
        start[k] = start[k - 1] + _rough_offset(chain[k - 1], chain[k], way, order[k - 1 : k + 1])
    path = _fit(chain, start)
    _check(chain, path, order)
    seen = _seen(chain, path)
    bridge, gaps = _bridged(chain, path, seen)
    offset, sigma = np.zeros(len(chain)), np.zeros(len(chain))
    offset[list(order)], sigma[list(order)] = path.offset, path.offset_sigma
    return Joined(
        trajectory=seen,
        bridge=bridge,
        order=order,
        offset=offset,
        offset_sigma=sigma,
        gaps=gaps,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Path:
    """The fitted path: a cubic spline in time for each coordinate, clocks, and cameras' places."""

    knots: Floats
    coefficients: Floats  # (m, 2)
    covariance: Floats  # of all unknowns: x, y, places, clocks
    offset: Floats
    offset_sigma: Floats
    place: Floats  # (cameras, 2)

    def at(self, t: Floats) -> Floats:
        return _basis(self.knots, t) @ self.coefficients

    def sigma(self, t: Floats) -> Floats:
        basis = _basis(self.knots, t)
        m = basis.shape[1]
        variance = sum(
            np.einsum("ni,ij,nj->n", basis, self.covariance[s : s + m, s : s + m], basis)
            for s in (0, m)
        )
        return np.sqrt(np.asarray(variance) / 2)


def _rough_offset(a: Trajectory, b: Trajectory, way: float, which: tuple[int, ...]) -> float:
    """What brings the clock of a track to that of the one before, by where the stone passes [s]."""
    along_a, along_b = way * a.xy[:, 1], way * b.xy[:, 1]
    speed_a, speed_b = _end_speed(a, way, last=True), _end_speed(b, way, last=False)
    low, high = along_b[0], along_a[-1]
    names = f"track {which[0] + 1} and track {which[1] + 1}"
    if high > low:  # both saw it pass
        middle = (low + high) / 2
        t_a, t_b = (_passing(track, way, middle) for track in (a, b))
        if high - low < 0.05 and min(speed_a, speed_b) < SLOWEST:
            raise InputError(f"the stone rests where {names} meet; their clocks cannot be told")
        return t_a - t_b
    if speed_b > speed_a + GAIN:
        raise InputError(
            f"{names} are not of one throw: {speed_a:.2f} m/s at the end of one and "
            f"{speed_b:.2f} m/s at the start of the next"
        )
    if speed_a + speed_b < 2 * SLOWEST:
        raise InputError(f"the stone rests between {names}; their clocks cannot be told")
    return float(a.t[-1] + 2 * (low - high) / (speed_a + speed_b) - b.t[0])


def _passing(track: Trajectory, way: float, along: float) -> float:
    """When a stone that goes one way passes a place along the sheet [s]."""
    forward = np.maximum.accumulate(way * track.xy[:, 1])
    rising = np.concatenate([[True], np.diff(forward) > 0])
    return float(np.interp(along, forward[rising], track.t[rising]))


def _end_speed(track: Trajectory, way: float, *, last: bool) -> float:
    near = track.t >= track.t[-1] - END_WINDOW if last else track.t <= track.t[0] + END_WINDOW
    if near.sum() < 5:
        raise InputError(f"a track of {len(track)} rows is too short to be joined")
    _, rate = local_fit(track.t[near], way * track.xy[near, 1], 2 * END_WINDOW)[0][:2]
    return float(max(rate[-1 if last else 0], 0.0))


def _basis(knots: Floats, t: Floats, derivative: int = 0) -> Floats:
    """B-splines (n, m) at times, or a derivative of them; held at the ends beyond them."""
    t = np.clip(t, knots[3], knots[-4])
    if not derivative:
        return BSpline.design_matrix(t, knots, 3).toarray()
    m = len(knots) - 4
    return np.asarray(BSpline(knots, np.eye(m), 3).derivative(derivative)(t))


def _free(chain: Sequence[Trajectory], offset: Floats) -> tuple[float, float]:
    """From release to rest, as far as the tracks tell, on the common clock [s].

    Before the delivery hog line a hand may still be at the stone: that tells nothing of its slide.
    """
    start, stop = -np.inf, np.inf
    first = chain[0]
    way = 1.0 if chain[-1].xy[-1, 1] > first.xy[0, 1] else -1.0
    if way * first.xy[0, 1] < -HOG_LINE_Y < way * first.xy[-1, 1]:
        start = _passing(first, way, -HOG_LINE_Y) + float(offset[0])
    for k, track in enumerate(chain):
        try:
            slide = free_slide(track)
        except TrackTooShortError:
            continue
        if k == 0:
            start = max(start, float(slide.t[0] + offset[k]))
        if k == len(chain) - 1:
            stop = float(slide.t[-1] + offset[k])
    return start, stop


def _fit(chain: Sequence[Trajectory], offset: Floats) -> _Path:
    """Path, clocks and places together, by Gauss-Newton; how smooth the path is, by evidence."""
    best: tuple[float, _Path] | None = None
    for jerk in JERKS:
        evidence, path = _fit_with(chain, offset, jerk)
        if best is None or evidence > best[0]:
            best = evidence, path
    assert best is not None
    return best[1]


def _fit_with(chain: Sequence[Trajectory], offset: Floats, jerk: float) -> tuple[float, _Path]:
    offset = offset.copy()
    rows = [_thinned(track) for track in chain]
    first = min(t[0] + tau for (t, _, _), tau in zip(rows, offset, strict=True))
    last = max(t[-1] + tau for (t, _, _), tau in zip(rows, offset, strict=True))
    count = int(np.ceil((last - first + 2.0) / KNOT_STEP)) + 1
    inner = first - 1.0 + KNOT_STEP * np.arange(count)
    knots = np.r_[inner[0] - KNOT_STEP * np.arange(3, 0, -1), inner, 0, 0, 0]
    knots[-3:] = inner[-1] + KNOT_STEP * np.arange(1, 4)
    m = len(knots) - 4
    cameras = len(chain)
    start, stop = _free(chain, offset)
    between = inner[:-1] + KNOT_STEP / 2
    free = (between > start) & (between < stop)
    # The third derivative of a cubic spline is constant between knots: white jerk of that density.
    roughness = _basis(knots, between, 3) * np.sqrt(KNOT_STEP)
    roughness /= np.where(free, jerk, PUSHED_JERK)[:, None]
    smooth = roughness.T @ roughness
    size = 2 * m + 2 * cameras + cameras
    spread = np.array([float(np.median(sigma)) for _, _, sigma in rows])
    coefficients = np.zeros((m, 2))
    place = np.zeros((cameras, 2))
    weights = [np.ones((len(t), 2)) for t, _, _ in rows]
    normal, chi2, logs = np.eye(size), 0.0, 0.0
    for turn in range(ROUNDS):
        normal, right = np.zeros((size, size)), np.zeros(size)
        chi2 = logs = 0.0
        for k, (t, xy, sigma) in enumerate(rows):
            basis = _basis(knots, t + offset[k])
            rate = _basis(knots, t + offset[k], 1) @ coefficients
            for axis in range(2):
                design = np.zeros((len(t), size))
                design[:, axis * m : (axis + 1) * m] = basis
                design[:, 2 * m + 2 * k + axis] = 1.0
                if k and turn:  # without a path yet, its rate is not known
                    design[:, 2 * m + 2 * cameras + k] = rate[:, axis]
                target = xy[:, axis] + design[:, -cameras:] @ offset
                w = weights[k][:, axis] / sigma**2
                normal += (design * w[:, None]).T @ design
                right += (design * w[:, None]).T @ target
                left = xy[:, axis] - basis @ coefficients[:, axis] - place[k, axis]
                chi2 += float(np.sum(w * left**2))
                logs += float(np.sum(np.log(sigma**2 / weights[k][:, axis])))
                weights[k][:, axis] = 1 / (1 + (left / (4 * sigma)) ** 2) if turn > 2 else 1.0
        for axis in range(2):
            part = slice(axis * m, (axis + 1) * m)
            normal[part, part] += smooth
            chi2 += float(coefficients[:, axis] @ smooth @ coefficients[:, axis])
        for k in range(cameras):
            for axis in range(2):
                normal[2 * m + 2 * k + axis, 2 * m + 2 * k + axis] += spread[k] ** -2
            chi2 += float(np.sum(place[k] ** 2) / spread[k] ** 2)
            # The first clock is the common one; the others are free within seconds.
            weight = 1e12 if k == 0 or not turn else 1e-2
            normal[-cameras + k, -cameras + k] += weight
            right[-cameras + k] += weight * offset[k]
        solved = np.linalg.solve(normal + 1e-12 * np.trace(normal) / size * np.eye(size), right)
        coefficients = np.column_stack([solved[:m], solved[m : 2 * m]])
        place = solved[2 * m : 2 * m + 2 * cameras].reshape(cameras, 2)
        offset = solved[-cameras:]
    covariance = np.linalg.inv(normal)
    _, determinant = np.linalg.slogdet(normal)
    # Only what depends on the jerk matters: each knot interval that is free has its own.
    evidence = -0.5 * (chi2 + logs + determinant) - 2 * float(np.sum(free)) * np.log(jerk)
    sigma = np.sqrt(np.maximum(np.diag(covariance)[-cameras:], 0.0))
    sigma[0] = 0.0
    return evidence, _Path(
        knots=knots,
        coefficients=coefficients,
        covariance=np.asarray(covariance, dtype=np.float64),
        offset=offset,
        offset_sigma=sigma,
        place=place,
    )


def _thinned(track: Trajectory) -> tuple[Floats, Floats, Floats]:
    every = max(1, round(len(track) / max(track.duration * RATE, 1.0)))
    sigma = track.sigma_xy if track.sigma_xy.size else np.full(len(track), UNKNOWN_SIGMA)
    return track.t[::every], track.xy[::every], np.maximum(sigma[::every], MIN_SIGMA)


def _check(chain: Sequence[Trajectory], path: _Path, order: tuple[int, ...]) -> None:
    """Refuse cameras that contradict each other."""
    for k, track in enumerate(chain):
        t, xy, sigma = _thinned(track)
        left = np.linalg.norm(xy - path.at(t + path.offset[k]) - path.place[k], axis=1)
        limit = max(CONTRADICTION * float(np.median(sigma)), BLUNDER)
        shift = float(np.linalg.norm(path.place[k]))
        if float(np.median(left)) > limit or shift > limit:
            raise InputError(
                f"track {order[k] + 1} does not fit to the others: it lies "
                f"{100 * max(float(np.median(left)), shift):.0f} cm off; "
                "are these films of one throw, and the scenes right?"
            )


def _seen(chain: Sequence[Trajectory], path: _Path) -> Trajectory:
    """The cameras' own rows on one clock, moved to where all agree; blended where two saw it."""
    names = ("t", "xy", "theta", "swept", "sigma_xy", "sigma_theta")
    whole: dict[str, Floats] = {}
    for k, track in enumerate(chain):
        t = track.t + path.offset[k]
        sigma = track.sigma_xy if track.sigma_xy.size else np.full(len(t), UNKNOWN_SIGMA)
        # A clock that is wrong puts the stone where it was or will be.
        speed = np.linalg.norm(_basis(path.knots, t, 1) @ path.coefficients, axis=1)
        sigma = np.hypot(sigma, speed * path.offset_sigma[k] / np.sqrt(2))
        turn = track.sigma_theta if track.sigma_theta.size else np.full(len(t), np.nan)
        own: dict[str, Floats] = dict(
            zip(
                names,
                (t, track.xy - path.place[k], track.theta, track.swept, sigma, turn),
                strict=True,
            )
        )
        if not whole:
            whole = own
            continue
        own["theta"] = own["theta"] + _turns(whole["t"], whole["theta"], t, own["theta"])
        start, stop = t[0], whole["t"][-1]
        both = (whole["t"] >= start) & (whole["t"] <= t[-1])
        if stop > start:
            share = np.clip((whole["t"] - start) / (stop - start), 0.0, 1.0)[both]
            for name in ("xy", "sigma_xy"):
                columns = own[name].reshape(len(t), -1)
                other = np.column_stack(
                    [np.interp(whole["t"][both], t, column) for column in columns.T]
                ).reshape(whole[name][both].shape)
                w = share.reshape(-1, *[1] * (other.ndim - 1))
                whole[name][both] = (1 - w) * whole[name][both] + w * other
        # Half a frame apart, so that no two rows are of one moment.
        later = t > stop + 0.5 * float(np.median(np.diff(t)))
        whole = {name: np.concatenate([whole[name], own[name][later]]) for name in names}
    return Trajectory(
        **{name: whole[name] for name in names},  # pyright: ignore[reportArgumentType]
        throw=chain[0].throw,
        stone=chain[0].stone,
        clock=chain[0].clock,
    )


def _turns(t_a: Floats, theta_a: Floats, t_b: Floats, theta_b: Floats) -> float:
    """Whole turns between the headings of two cameras [rad]."""
    a, b = np.isfinite(theta_a), np.isfinite(theta_b)
    if a.sum() < 5 or b.sum() < 5:
        return 0.0
    t_a, theta_a, t_b, theta_b = t_a[a], theta_a[a], t_b[b], theta_b[b]
    near_a, near_b = t_a >= t_a[-1] - 2 * END_WINDOW, t_b <= t_b[0] + 2 * END_WINDOW
    spin = [
        float(np.polyfit(t - t.mean(), theta, 1)[0])
        for t, theta in ((t_a[near_a], theta_a[near_a]), (t_b[near_b], theta_b[near_b]))
    ]
    if t_b[0] <= t_a[-1]:
        expected = float(np.interp(t_b[0], t_a, theta_a))
    else:
        expected = float(theta_a[-1] + (t_b[0] - t_a[-1]) * np.mean(spin))
    return float(2 * np.pi * np.round((expected - theta_b[0]) / (2 * np.pi)))


def _bridged(
    chain: Sequence[Trajectory], path: _Path, seen: Trajectory
) -> tuple[Trajectory | None, tuple[tuple[float, float], ...]]:
    """Rows where no camera saw the stone, one a frame, and from when to when that was."""
    gaps: list[tuple[float, float]] = []
    reach = -np.inf
    for k, track in enumerate(chain):
        start = float(track.t[0] + path.offset[k])
        if np.isfinite(reach) and start > reach:
            gaps.append((reach, start))
        reach = max(reach, float(track.t[-1] + path.offset[k]))
    step = float(np.median(np.diff(seen.t)))
    times = [np.arange(start + step, stop - step / 2, step) for start, stop in gaps]
    t = np.concatenate(times) if times else np.empty(0)
    if len(t) == 0:
        return None, tuple(gaps)
    theta = np.full(len(t), np.nan)
    known = np.isfinite(seen.theta)
    if known.sum() >= 2:
        theta = np.interp(t, seen.t[known], seen.theta[known])
    return (
        Trajectory(
            t=t,
            xy=path.at(t),
            theta=theta,
            sigma_xy=path.sigma(t),
            sigma_theta=np.full(len(t), np.nan),
            throw=seen.throw,
            stone=seen.stone,
            clock=seen.clock,
        ),
        tuple(gaps),
    )
