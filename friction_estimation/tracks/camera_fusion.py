"""Fusion of several cameras' tracks of one throw into one track.

Each camera has a separate clock and its own error of a few millimetres. One smooth path is fitted
to all tracks, with an offset of time and a displacement for each camera. If no camera saw the
stone, the path continues as a sliding stone does: its acceleration changes slowly. That bridges the
gap, and gives its duration and the uncertainty of both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.errors import InputError
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.tracks.joint_path import (
    JointPath,
    fit_joint_path,
    passing_time,
    thinned_rows,
)
from friction_estimation.tracks.smoothing import local_fit
from friction_estimation.tracks.tuning import (
    END_WINDOW,
    MAX_CAMERA_DEVIATIONS,
    MAX_CAMERA_DISTANCE,
    MAX_SPEED_GAIN,
    MIN_HANDOVER_SPEED,
    UNKNOWN_ROW_SIGMA,
)

_COLUMNS = ("t", "xy", "theta", "swept", "sigma_xy", "sigma_theta")


@dataclass(frozen=True, kw_only=True, eq=False)
class JoinedTrack:
    """One throw as seen by several cameras.

    Parameters
    ----------
    trajectory : seen rows, on the clock of the camera that saw the stone first
    bridge : rows that no camera saw, with the σ of the motion model; None without a gap
    order : (k,) numbers of the tracks in the order in which they saw the stone
    offset : (k,) offset added to the times of each track [s]
    offset_sigma : (k,) its standard error; 0 for the first camera
    gaps : (start, stop) times between which no camera saw the stone [s]
    """

    trajectory: Trajectory
    bridge: Trajectory | None
    order: tuple[int, ...]
    offset: Floats
    offset_sigma: Floats
    gaps: tuple[tuple[float, float], ...]

    @property
    def whole(self) -> Trajectory:
        """Return seen and bridged rows together, in order of time."""
        if self.bridge is None:
            return self.trajectory
        parts = (self.trajectory, self.bridge)
        order = np.argsort(np.concatenate([part.t for part in parts]))
        columns = {
            name: np.concatenate([getattr(part, name) for part in parts])[order]
            for name in _COLUMNS
        }
        return replace(self.trajectory, **columns)


def join_cameras(tracks: Sequence[Trajectory]) -> JoinedTrack:
    """Join the tracks of a throw from several cameras, each with a separate clock.

    Parameters
    ----------
    tracks : one track for each camera, in any order; times count from each film's first frame

    Raises
    ------
    InputError : fewer than two tracks, tracks of different throws, or a stone at rest where it
        passes from one camera to the next
    """
    if len(tracks) < 2:
        raise InputError(f"expected tracks of two or more cameras, got {len(tracks)}")
    direction = float(np.sign(sum(track.xy[-1, 1] - track.xy[0, 1] for track in tracks))) or 1.0
    order = tuple(np.argsort([direction * np.mean(track.xy[:, 1]) for track in tracks]).tolist())
    chain = [tracks[k] for k in order]
    start = np.zeros(len(chain))
    for k in range(1, len(chain)):
        start[k] = start[k - 1] + _rough_offset(
            chain[k - 1], chain[k], direction, order[k - 1 : k + 1]
        )
    path = fit_joint_path(chain, start)
    _check_agreement(chain, path, order)
    seen = _merged_rows(chain, path)
    bridge, gaps = _bridge_gaps(chain, path, seen)
    offset, sigma = np.zeros(len(chain)), np.zeros(len(chain))
    offset[list(order)], sigma[list(order)] = path.offset, path.offset_sigma
    return JoinedTrack(
        trajectory=seen,
        bridge=bridge,
        order=order,
        offset=offset,
        offset_sigma=sigma,
        gaps=gaps,
    )


def _rough_offset(a: Trajectory, b: Trajectory, direction: float, which: tuple[int, ...]) -> float:
    """Return the offset from the clock of track b to that of track a, by the passage of the stone
    [s].
    """
    along_a, along_b = direction * a.xy[:, 1], direction * b.xy[:, 1]
    speed_a, speed_b = _end_speed(a, direction, last=True), _end_speed(b, direction, last=False)
    low, high = along_b[0], along_a[-1]
    names = f"track {which[0] + 1} and track {which[1] + 1}"
    if high > low:  # both saw the passage
        middle = (low + high) / 2
        t_a, t_b = (passing_time(track, direction, middle) for track in (a, b))
        if high - low < 0.05 and min(speed_a, speed_b) < MIN_HANDOVER_SPEED:
            raise InputError(
                f"cannot synchronise {names}: the stone is at rest in their common view"
            )
        return t_a - t_b
    if speed_b > speed_a + MAX_SPEED_GAIN:
        raise InputError(
            f"{names} are not of one throw: {speed_a:.2f} m/s at the end of one and "
            f"{speed_b:.2f} m/s at the start of the next"
        )
    if speed_a + speed_b < 2 * MIN_HANDOVER_SPEED:
        raise InputError(f"cannot synchronise {names}: the stone is at rest between them")
    return float(a.t[-1] + 2 * (low - high) / (speed_a + speed_b) - b.t[0])


def _end_speed(track: Trajectory, direction: float, *, last: bool) -> float:
    near = track.t >= track.t[-1] - END_WINDOW if last else track.t <= track.t[0] + END_WINDOW
    if near.sum() < 5:
        raise InputError(f"a track of {len(track)} rows is too short to be joined")
    _, rate = local_fit(track.t[near], direction * track.xy[near, 1], 2 * END_WINDOW)[0][:2]
    return float(max(rate[-1 if last else 0], 0.0))


def _check_agreement(chain: Sequence[Trajectory], path: JointPath, order: tuple[int, ...]) -> None:
    """Refuse cameras that contradict each other."""
    for k, track in enumerate(chain):
        t, xy, sigma = thinned_rows(track)
        residual = np.linalg.norm(xy - path.at(t + path.offset[k]) - path.displacement[k], axis=1)
        limit = max(MAX_CAMERA_DEVIATIONS * float(np.median(sigma)), MAX_CAMERA_DISTANCE)
        shift = float(np.linalg.norm(path.displacement[k]))
        if float(np.median(residual)) > limit or shift > limit:
            raise InputError(
                f"track {order[k] + 1} does not fit the others: it is "
                f"{100 * max(float(np.median(residual)), shift):.0f} cm off; "
                "are these films of one throw, and the scenes correct?"
            )


def _merged_rows(chain: Sequence[Trajectory], path: JointPath) -> Trajectory:
    """Return the cameras' rows on one clock, without displacements, blended where two cameras saw
    the stone.
    """
    whole: dict[str, Floats] = {}
    for k, track in enumerate(chain):
        t = track.t + path.offset[k]
        sigma = track.sigma_xy if track.sigma_xy.size else np.full(len(t), UNKNOWN_ROW_SIGMA)
        # An error of the clock shifts the stone along its path.
        speed = np.linalg.norm(path.velocity(t), axis=1)
        sigma = np.hypot(sigma, speed * path.offset_sigma[k] / np.sqrt(2))
        turn = track.sigma_theta if track.sigma_theta.size else np.full(len(t), np.nan)
        own: dict[str, Floats] = dict(
            zip(
                _COLUMNS,
                (t, track.xy - path.displacement[k], track.theta, track.swept, sigma, turn),
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
        # At least half a frame later, so that no two rows have the same time.
        later = t > stop + 0.5 * float(np.median(np.diff(t)))
        whole = {name: np.concatenate([whole[name], own[name][later]]) for name in _COLUMNS}
    return Trajectory(
        **{name: whole[name] for name in _COLUMNS},  # pyright: ignore[reportArgumentType]
        throw=chain[0].throw,
        stone=chain[0].stone,
        clock=chain[0].clock,
    )


def _turns(t_a: Floats, theta_a: Floats, t_b: Floats, theta_b: Floats) -> float:
    """Return the whole turns between the headings of two cameras [rad]."""
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


def _bridge_gaps(
    chain: Sequence[Trajectory], path: JointPath, seen: Trajectory
) -> tuple[Trajectory | None, tuple[tuple[float, float], ...]]:
    """Return rows at times when no camera saw the stone, one per frame, and the gaps that they fill
    [s].
    """
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
