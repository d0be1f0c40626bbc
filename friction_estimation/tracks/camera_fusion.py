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
    passing_times,
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
        seen = self.trajectory
        return seen if self.bridge is None else seen.joined(self.bridge)


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
        t_a, t_b = (float(passing_times(track, direction, middle)) for track in (a, b))
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


def on_common_clock(track: Trajectory, offset: float, sigma: float) -> Trajectory:
    """Return a track on another clock, with the error of the clock along its path in its errors.

    Parameters
    ----------
    offset, sigma : offset added to its times, and its standard error [s]
    """
    own = track.sigma_xy if track.sigma_xy.size else np.full(len(track), UNKNOWN_ROW_SIGMA)
    speed = np.linalg.norm(track.velocity, axis=1) if len(track) > 2 else np.zeros(len(track))
    turn = track.sigma_theta if track.sigma_theta.size else np.full(len(track), np.nan)
    return replace(
        track,
        t=track.t + offset,
        sigma_xy=np.hypot(own, speed * sigma / np.sqrt(2)),
        sigma_theta=turn,
    )


def _merged_rows(chain: Sequence[Trajectory], path: JointPath) -> Trajectory:
    """Return the cameras' rows on one clock, without displacements, blended where two cameras saw
    the stone.
    """
    placed = [
        on_common_clock(replace(track, xy=track.xy - away), float(offset), float(sigma))
        for track, away, offset, sigma in zip(
            chain, path.displacement, path.offset, path.offset_sigma, strict=True
        )
    ]
    whole = placed[0]
    for own in placed[1:]:
        own = replace(own, theta=own.theta + _turns(whole, own))
        start, stop = own.t[0], whole.t[-1]
        both = (whole.t >= start) & (whole.t <= own.t[-1])
        if stop > start:
            share = np.clip((whole.t[both] - start) / (stop - start), 0.0, 1.0)
            xy, sigma = whole.xy.copy(), whole.sigma_xy.copy()
            xy[both] += share[:, None] * (own.at(whole.t[both]) - xy[both])
            sigma[both] += share * (np.interp(whole.t[both], own.t, own.sigma_xy) - sigma[both])
            whole = replace(whole, xy=xy, sigma_xy=sigma)
        # At least half a frame later, so that no two rows have the same time.
        whole = whole.joined(own.only(own.t > stop + 0.5 * float(np.median(np.diff(own.t)))))
    return whole


def _turns(one: Trajectory, other: Trajectory) -> float:
    """Return the whole turns between the headings of two cameras [rad]."""
    one, other = (track.only(np.isfinite(track.theta)) for track in (one, other))
    if len(one) < 5 or len(other) < 5:
        return 0.0
    start, stop = other.t[0], one.t[-1]
    near = (
        one.only(one.t >= stop - 2 * END_WINDOW),
        other.only(other.t <= start + 2 * END_WINDOW),
    )
    if start <= stop:
        expected = float(np.interp(start, one.t, one.theta))
    else:
        spin = [np.polyfit(part.t - part.t.mean(), part.theta, 1)[0] for part in near]
        expected = float(one.theta[-1] + (start - stop) * np.mean(spin))
    return float(2 * np.pi * np.round((expected - other.theta[0]) / (2 * np.pi)))


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
    unknown = np.full(len(t), np.nan)
    known = np.isfinite(seen.theta)
    bridge = replace(
        seen,
        t=t,
        xy=path.at(t),
        theta=np.interp(t, seen.t[known], seen.theta[known]) if known.sum() >= 2 else unknown,
        swept=np.zeros(len(t)),
        sigma_xy=path.sigma(t),
        sigma_theta=unknown,
    )
    return bridge, tuple(gaps)
