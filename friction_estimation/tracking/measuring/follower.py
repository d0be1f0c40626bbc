"""Measurement of stones in every frame: each fit starts at the prediction of the motion model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from friction_estimation.appearance import Appearance, PosedStone, StoneFit, measure_occluded
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame
from friction_estimation.tracking import tuning
from friction_estimation.tracking.association.coarse import CoarsePath
from friction_estimation.tracking.association.motion import Motion
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.films.film_track import TrackingOptions
from friction_estimation.tracking.measuring.heading import HeadingCurve
from friction_estimation.tracking.measuring.measurements import Measurements
from friction_estimation.tracking.measuring.others import OtherStone


@dataclass(eq=False)
class Follower:
    """Stone that is measured frame by frame.

    Parameters
    ----------
    path : where the sampled frames show it
    appearance : its look
    heading : its heading, where it is known
    people : whether someone may be in the way
    since : when it is looked for first [s]
    turned : its heading then, where the curve is not known [rad]
    """

    path: CoarsePath
    appearance: Appearance
    heading: HeadingCurve | None
    people: bool
    since: float = -np.inf
    turned: float = 0.0
    measured: Measurements = field(default_factory=Measurements)
    _motion: Motion = field(default_factory=Motion)
    _seen: float = -np.inf
    _theta: float = 0.0

    def __post_init__(self) -> None:
        self._theta = self.turned

    def measure(
        self,
        t: float,
        frame: Frame,
        background: Background,
        camera: Camera,
        options: TrackingOptions,
        others: Sequence[PosedStone] = (),
    ) -> StoneFit | None:
        """Measure the stone in a frame; None if it is not seen."""
        place, _, spread = self.path.at(t)
        theta = self._heading(t)
        pixel = 1.0 / np.linalg.norm(camera.px_per_metre(place), -2)
        least = tuning.DETECTION_M + tuning.DETECTION_PX * pixel
        if any(abs(t - contact) < tuning.DENSE_STEP for contact in self.path.contacts):
            self._seen = -np.inf  # its motion before is no information on that after
        if any(abs(t - contact) < tuning.CONTACT_WITHIN for contact in self.path.contacts):
            least += tuning.SAME_PLACE
        known = spread.max() < tuning.LOST
        tries = [(place, spread)] if known else []
        if self._predict(t):
            expected = self._motion.place
            if known and (np.abs(expected - place) > tuning.LOST + tuning.GATE * spread).any():
                self._seen = -np.inf  # the measured object is not the one on the path
            else:
                tries.insert(0, (expected, np.sqrt(self._motion.variance)))
        strays: list[StoneFit] = []
        for at, spread in tries:
            if not np.isfinite(at).all():
                continue
            fit = measure_occluded(
                frame,
                background.channels,
                background.origin_px,
                camera,
                self.appearance,
                np.array([*at, theta]),
                others,
                people=self.people,
            )
            if fit is None or fit.visible < options.min_visible or fit.inside < options.min_inside:
                continue
            error = np.hypot(spread, np.sqrt(np.diag(fit.covariance)[:2]))
            away = np.abs(fit.xy - at)
            if (away < np.maximum(tuning.GATE * error, least)).all():
                self._update(t, fit)
                return fit
            near = np.hypot(*away) < options.gate + 2 * pixel
            if near and not self.people and t - self._seen < tuning.LONG:
                strays.append(fit)
        if not strays:
            return None
        # No person is near: the stone itself moves in a way that no free stone does.
        self._seen = -np.inf
        self._update(t, strays[0])
        return strays[0]

    def correct_path(
        self,
        sample: Mapping[float, Frame],
        ice: Background,
        camera: Camera,
        options: TrackingOptions,
        others: Sequence[OtherStone],
    ) -> None:
        """Correct the path by fits in the sampled frames that show the stone before any contact.

        Detections may be several centimetres off, and before the first one the path is
        extrapolated: there a fit could start nearer to a wrong minimum than to the stone.

        Parameters
        ----------
        sample : frames by their times [s]
        others : the stones that rest at first
        """
        places = np.full_like(self.path.xy, np.nan)
        before = self.path.t < min(self.path.contacts, default=np.inf)
        for k, t in enumerate(self.path.t[before].tolist()):
            self._seen = -np.inf
            frame = sample.get(t)
            fit = None
            if frame is not None:
                fit = self.measure(t, frame, ice, camera, options, resting_at(t, others))
            if fit is not None:
                places[k] = fit.xy
        self._seen, self._theta = -np.inf, self.turned
        self.path = self.path.through(places)

    @property
    def measured_on_its_way(self) -> bool:
        """Return whether the stone was measured on at least half the way on which it was found.

        The path of a person may lead to a stone; no stone of this look is measured on the way.
        """
        places = [fit.xy for fit in self.measured.fits if fit is not None]
        found = np.hypot(*(self.path.xy[-1] - self.path.xy[0]))
        return not places or bool(2 * np.hypot(*(places[-1] - places[0])) >= found)

    def posed(self, t: float) -> PosedStone:
        """Expected pose in a frame, for its neighbours."""
        place = self.path.at(t)[0]
        if t - self._seen < tuning.LONG:
            place = self._motion.place
        return PosedStone(look=self.appearance, pose=np.array([*place, self._heading(t)]))

    def _heading(self, t: float) -> float:
        return self._theta if self.heading is None else float(self.heading.at(t))

    def _predict(self, t: float) -> bool:
        """Predict the state at a time [s]; returns whether it is known."""
        known = t - self._seen <= tuning.LONG
        if known:
            self._motion.move_to(t, held=t <= self.path.released)
        return known

    def _update(self, t: float, fit: StoneFit) -> None:
        if t - self._seen > tuning.LONG:
            self._motion.put(t, fit.xy, self.path.at(t)[1], 1.0, 0.3)
        self._motion.correct(fit.xy, np.diag(fit.covariance)[:2] + 1e-6)
        self._seen = t
        if np.isfinite(fit.theta):
            self._theta = fit.theta


def resting_at(t: float, others: Sequence[OtherStone]) -> list[PosedStone]:
    """Return the stones that still rest at a time [s]."""
    return [
        PosedStone(look=one.look, pose=one.pose, in_background=np.isinf(one.rests.until))
        for one in others
        if t < one.rests.until
    ]


def follower_of(stone: OtherStone, people: bool) -> Follower:
    """Make the follower of a stone from the moment at which it was hit.

    Parameters
    ----------
    stone : as it rests; it has a path
    people : whether someone may be in the way
    """
    assert stone.rests.path is not None
    heading = None if np.isnan(stone.heading) else stone.heading
    return Follower(
        path=stone.rests.path,
        appearance=stone.look,
        heading=None,
        people=people,
        since=stone.rests.until,
        turned=0.0 if heading is None else heading,
    )


def follow(
    frames: Iterable[tuple[float, Frame]],
    thrown: Follower,
    hit: Sequence[Follower],
    others: Sequence[OtherStone],
    ice: Background,
    camera: Camera,
    options: TrackingOptions,
) -> None:
    """Measure the thrown stone and those that are hit in every frame.

    Parameters
    ----------
    frames : times [s] and frames
    thrown, hit : what follows them; their measurements are added
    others : the stones that rest at first
    ice : the ice without the stones that leave their places
    """
    for t, frame in frames:
        beside = resting_at(t, others)
        moving = [one for one in (thrown, *hit) if t >= one.since]
        posed = [one.posed(t) for one in moving] if len(moving) > 1 else []
        for k, one in enumerate(moving):
            around = [*beside, *posed[:k], *posed[k + 1 :]]
            fit = one.measure(t, frame, ice, camera, options, around)
            if posed:
                posed[k] = one.posed(t)
            one.measured.add(t, fit, frame, ice, camera, one.appearance, around)
        for one in (thrown, *hit):
            if t < one.since:
                one.measured.t.append(t)
                one.measured.fits.append(None)
