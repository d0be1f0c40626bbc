"""Where a sliding stone should be, by where it was seen: it slows down steadily, hardly curls."""

from __future__ import annotations

import numpy as np

from curling_env.typing import Floats
from friction_estimation.tracking import tuning


class ExpectedMotion:
    """A parabola through the latest places of a stone, forward or backward in time.

    It is fitted with what is known of stones on ice: how fast they slow down along the sheet, and
    that they are hardly pushed across it. The heading goes on as it turned.
    """

    def __init__(self) -> None:
        self._t: list[float] = []
        self._poses: list[Floats] = []
        self._sigma: list[Floats] = []
        self._curve: Floats | None = None
        self._stops = np.inf
        self._spin = 0.0

    def add(self, t: float, pose: Floats, sigma: Floats) -> None:
        """Take in a pose (3,) at a time [s], and the standard errors of its place (2,) [m]."""
        if self._t:
            turn = np.angle(np.exp(1j * (pose[2] - self._poses[-1][2])))
            if abs(turn) < tuning.MAX_HEADING_MISS:
                self._spin += 0.3 * (float(turn) / (t - self._t[-1]) - self._spin)
        self._t.append(t)
        self._poses.append(pose)
        self._sigma.append(sigma)
        self._curve = None

    def unseen(self, t: float) -> float:
        """For how long nothing has been seen at a time [s]."""
        return abs(t - self._t[-1]) if self._t else 0.0

    def doubt(self, t: float) -> float:
        """How far from where it should be the stone may be, besides what a pixel hides [m]."""
        unseen = self.unseen(t)
        return tuning.PLACE_GATE + unseen * (tuning.PACE_SIGMA + tuning.SLOWING_SIGMA * unseen)

    def at(self, t: float) -> Floats | None:
        """Pose at a time [s], (3,); None where fewer than three places are known."""
        if len(self._t) < 3:
            return None
        if self._curve is None:
            self._fit()
        assert self._curve is not None
        since = min(t - self._t[-1], self._stops)
        place = self._curve[0] + since * (self._curve[1] + since * 0.5 * self._curve[2])
        return np.array([*place, self._poses[-1][2] + self._spin * since])

    def _fit(self) -> None:
        """Place, velocity and change (3, 2) at the latest place, and when it stops after that."""
        now = self._t[-1]
        recent = [k for k, t in enumerate(self._t) if abs(t - now) <= tuning.MOTION_SECONDS]
        since = np.array([self._t[k] for k in recent]) - now
        xy = np.array([self._poses[k][:2] for k in recent])
        weight = np.array([self._sigma[k] for k in recent]) ** -2.0
        way = float(xy[np.argmax(since), 1] - xy[np.argmin(since), 1])
        if abs(way) < weight[:, 1].max() ** -0.5:
            way = float(xy[0, 1])  # it rests: it came from the other end
        usual = 0.0, -np.sign(way) * tuning.SLOWING
        spread = tuning.CURVING_SIGMA, tuning.SLOWING_SIGMA
        design = np.column_stack([np.ones_like(since), since, 0.5 * since**2])
        curve = np.empty((3, 2))
        for axis in range(2):
            normal = (design * weight[:, axis, None]).T @ design
            right = (design * weight[:, axis, None]).T @ xy[:, axis]
            normal[1, 1] += tuning.MAX_THROW_SPEED**-2  # one place alone tells no speed
            normal[2, 2] += spread[axis] ** -2
            right[2] += usual[axis] * spread[axis] ** -2
            curve[:, axis] = np.linalg.solve(normal, right)
        slowing = -curve[2, 1] * np.sign(curve[1, 1])
        self._curve = curve
        self._stops = float(abs(curve[1, 1]) / slowing) if slowing > 0 else np.inf
