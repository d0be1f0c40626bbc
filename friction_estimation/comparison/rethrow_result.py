"""One measured throw, its prediction, and their differences."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from curling_env.throw import Release
from curling_env.typing import Flags, Floats


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
    def path_rms(self) -> float:
        """Root-mean-square distance of the paths at equal times, after the release window [m]."""
        apart = (self.predicted - self.measured)[self.tested]
        return float(np.sqrt((apart**2).sum(axis=1).mean())) if len(apart) else float("nan")

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
    def too_long(self) -> float | None:
        """Distance by which the prediction runs beyond the measured rest, along the play [m]."""
        return None if self.miss is None else self.miss[1]

    @property
    def too_far_left(self) -> float | None:
        """Distance by which the prediction ends left of the measured rest, as the thrower sees it
        [m].
        """
        return None if self.miss is None else self.miss[0]

    @property
    def sigmas(self) -> tuple[float, float] | None:
        """`miss` in standard deviations; None where one is unknown."""
        if self.miss is None or self.rest_sigma is None or not all(self.rest_sigma):
            return None
        return self.miss[0] / self.rest_sigma[0], self.miss[1] / self.rest_sigma[1]

    def summary(self) -> dict[str, Any]:
        """Return the throw in numbers, for JSON and CSV."""
        rest = (None, None) if self.rest is None else self.rest.tolist()
        sigma, sigmas = self.rest_sigma or (None, None), self.sigmas or (None, None)
        return {
            "throw": self.throw,
            "stone": self.stone,
            "speed": self.release.speed,
            "spin": self.release.omega,
            "rest_x": rest[0],
            "rest_y": rest[1],
            "predicted_x": float(self.predicted_rest[0]),
            "predicted_y": float(self.predicted_rest[1]),
            "rest_sigma_x_m": sigma[0],
            "rest_sigma_y_m": sigma[1],
            "rest_error_m": self.rest_error,
            "too_long_m": self.too_long,
            "too_far_left_m": self.too_far_left,
            "sigmas_too_long": sigmas[1],
            "sigmas_too_far_left": sigmas[0],
            "path_rms_m": self.path_rms if self.tested.any() else None,
            "rest_time_s": self.rest_time,
            "predicted_time_s": self.predicted_time,
        }
