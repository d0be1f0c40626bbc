"""Several stones followed through the same frames, each measured before or behind the others.

The thrown stone is led by its rough path until it hits another stone. From then on it and every
stone that is hit are led by optical flow and, where flow fails, by how they slid so far.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance import Appearance, PosedStone, StoneFit, measure_occluded
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame
from friction_estimation.tracking import tuning
from friction_estimation.tracking.background import Background
from friction_estimation.tracking.detection.resting_stones import FilmedRestingStone
from friction_estimation.tracking.detection.thrown_stone import RoughPath
from friction_estimation.tracking.films.film_track import TrackingOptions
from friction_estimation.tracking.joint.heading import HeadingCurve
from friction_estimation.tracking.path.assembly import Measurements
from friction_estimation.tracking.path.prediction import Predictor
from friction_estimation.tracking.several.expected_path import ExtrapolatedPath, after_contact


@dataclass(eq=False)
class MovingStone:
    """A stone that is followed.

    Parameters
    ----------
    appearance : what it looks like
    path : the path that it is expected to take
    predictor : predicts its pose in the next frame
    measured : what was measured of it
    rested : how it lay before it was hit; None for the thrown stone
    wakes : when it is first looked at [s]
    left : when it was seen to have left its place [s]; None while it lies there
    hits : times at which other stones were seen to have left because of it [s]
    expected : when another stone should have hit it, and which [s]; None where none came near
    """

    appearance: Appearance
    path: ExtrapolatedPath
    predictor: Predictor
    measured: Measurements = field(default_factory=Measurements)
    rested: FilmedRestingStone | None = None
    wakes: float = 0.0
    left: float | None = None
    hits: list[float] = field(default_factory=list)
    expected: tuple[float, MovingStone] | None = None
    _pose: Floats | None = None

    @property
    def moves(self) -> bool:
        """Whether it was thrown, has left its place, or should have."""
        return self.rested is None or self.left is not None or self.expected is not None

    def predicted(self, t: float, frame: Frame) -> Floats | None:
        """Its predicted pose in a frame, (3,); None while it is not followed yet."""
        return None if t < self.wakes else self.predictor.predict(t, frame)

    @property
    def where_it_lay(self) -> Floats | None:
        """Its place (2,) [m], where it should have left it and was not seen to."""
        if self.rested is None or self.expected is None or self.left is not None:
            return None
        return self.rested.xy

    def posed(self) -> PosedStone | None:
        """The stone in its latest known pose; None where none is known."""
        if self._pose is None:
            return None if self.rested is None else self.rested.posed
        return PosedStone(look=self.appearance, pose=self._pose)

    @property
    def turned(self) -> float:
        """Its latest known heading [rad]; NaN where it has no handle or was never seen."""
        if self._pose is None or not self.appearance.has_handle:
            return np.nan
        return float(self._pose[2])

    def update(self, t: float, fit: StoneFit | None, start: Floats | None) -> None:
        """Take in what was measured in a frame from a predicted pose."""
        if start is not None:
            self.predictor.update(t, fit)
        if fit is not None:
            heading = fit.theta if np.isfinite(fit.theta) else (0.0 if start is None else start[2])
            self._pose = np.array([*fit.xy, heading])
            self.path.add(t, fit.xy)


class StoneFollower:
    """Follows the thrown stone and all stones that it sets in motion.

    Parameters
    ----------
    background : the ice without the stones that leave
    camera, options : the film's camera, and how it is tracked
    resting : the other stones; those that leave are followed, those that stay may hide them
    """

    def __init__(
        self,
        background: Background,
        camera: Camera,
        options: TrackingOptions,
        resting: Sequence[FilmedRestingStone],
    ) -> None:
        self._background, self._camera, self._options = background, camera, options
        self._leaving = [stone for stone in resting if stone.leaves]
        self._staying = [
            PosedStone(look=stone.posed.look, pose=stone.posed.pose, in_background=True)
            for stone in resting
            if stone.stays
        ]

    def follow(
        self,
        frames: Iterable[tuple[float, Frame]],
        path: RoughPath,
        appearance: Appearance,
        heading: HeadingCurve | None,
        sample_times: Sequence[float],
    ) -> list[MovingStone]:
        """Follow all stones through all frames.

        Parameters
        ----------
        frames : times [s] and frames
        path, appearance, heading : what is known of the thrown stone up to its first contact
        sample_times : times of the sampled frames in which the other stones were seen [s]

        Returns
        -------
        The thrown stone, then those that leave.
        """
        first = min((sample_times[stone.last_seen] for stone in self._leaving), default=np.inf)
        stones = [self._moving_stone(ExtrapolatedPath(path, first), appearance, heading)]
        for stone in self._leaving:
            wakes = sample_times[max(stone.last_seen - 1, 0)]
            expected = ExtrapolatedPath(stone.xy, wakes)
            moving = self._moving_stone(expected, stone.posed.look, None, stone.heading)
            moving.rested, moving.wakes = stone, wakes
            moving.measured.keeps_pictures = True
            stones.append(moving)
        for t, frame in frames:
            _wake(t, stones)
            _expect_contacts(t, stones)
            self._measure(t, frame, stones)
            self._note_contacts(t, stones)
        return stones

    def _moving_stone(
        self,
        path: ExtrapolatedPath,
        appearance: Appearance,
        heading: HeadingCurve | None,
        turned: float = np.nan,
    ) -> MovingStone:
        predictor = self._predictor(path, appearance, heading, turned)
        return MovingStone(appearance=appearance, path=path, predictor=predictor)

    def _predictor(
        self,
        path: ExtrapolatedPath,
        appearance: Appearance,
        heading: HeadingCurve | None,
        turned: float = np.nan,
    ) -> Predictor:
        return Predictor(
            path=path,
            camera=self._camera,
            appearance=appearance,
            options=self._options,
            heading=heading,
            turned=turned,
        )

    def _measure(self, t: float, frame: Frame, stones: Sequence[MovingStone]) -> None:
        """Measure all stones in a frame, the nearest to the camera first: nothing hides it."""
        background, camera = self._background, self._camera
        starts = [stone.predicted(t, frame) for stone in stones]
        fits: list[StoneFit | None] = [None] * len(stones)
        done: list[int] = []
        order = sorted(
            (k for k, start in enumerate(starts) if start is not None),
            key=lambda k: float(np.linalg.norm(camera.position[:2] - np.asarray(starts[k])[:2])),
        )
        for k in order:
            stone, start = stones[k], np.asarray(starts[k])
            others = self._others(k, stones, starts, fits, done)
            taken = [fit.xy for fit in fits if fit is not None]
            apart = tuning.MIN_SEPARATION_RADII * stone.appearance.model.radius

            def fit_at(
                pose: Floats, stone: MovingStone = stone, others: list[PosedStone] = others
            ) -> StoneFit | None:
                origin = background.origin_px
                return measure_occluded(
                    frame,
                    background.channels,
                    origin,
                    camera,
                    stone.appearance,
                    pose,
                    others,
                    stone.path.leads(t),
                )

            fits[k] = stone.predictor.find(
                t,
                start,
                fit_at,
                lambda fit, taken=taken, apart=apart: all(
                    np.linalg.norm(fit.xy - xy) > apart for xy in taken
                ),
                stone.where_it_lay,
            )
            done.append(k)
        around = [self._others(k, stones, starts, fits, done) for k in range(len(stones))]
        for stone, fit, start, others in zip(stones, fits, starts, around, strict=True):
            stone.update(t, fit, start)
            stone.measured.add(t, fit, frame, background, camera, stone.appearance, others)

    def _others(
        self,
        k: int,
        stones: Sequence[MovingStone],
        starts: Sequence[Floats | None],
        fits: Sequence[StoneFit | None],
        done: Sequence[int],
    ) -> list[PosedStone]:
        """All stones but number k, in the best pose that is known of each in this frame."""
        others = list(self._staying)
        for j, other in enumerate(stones):
            if j == k:
                continue
            fit, known, ahead = fits[j], other.posed(), starts[j]
            if fit is not None and np.isfinite(fit.theta):
                pose = np.array([*fit.xy, fit.theta])
            elif fit is not None and known is not None:
                pose = np.array([*fit.xy, known.pose[2]])
            elif known is not None:
                gone = other.expected is not None or j not in done
                pose = ahead if ahead is not None and gone else known.pose
            else:
                continue
            others.append(PosedStone(look=other.appearance, pose=pose))
        return others

    def _note_contacts(self, t: float, stones: Sequence[MovingStone]) -> None:
        for stone in stones[1:]:
            if stone.left is not None or not _has_left(stone, self._camera):
                continue
            stone.left = t
            stone.measured.view_interval = tuning.LATER_VIEW_INTERVAL
            stone.path.restart(t)
            stone.predictor.note_contact()
            striker = _striker(stone, stones, stones[0].appearance.model.radius)
            if stone.expected is not None:
                striker = stone.expected[1]
            if striker is not None:
                striker.hits.append(t)
                striker.measured.view_interval = tuning.LATER_VIEW_INTERVAL
                striker.path.restart(t)
                striker.predictor = self._predictor(
                    striker.path, striker.appearance, None, striker.turned
                )


def _wake(t: float, stones: Sequence[MovingStone]) -> None:
    """Look at stones from a time on [s] that a moving one comes near."""
    for stone in stones:
        if stone.rested is None or t >= stone.wakes:
            continue
        for other in stones:
            posed = other.posed() if other.moves else None
            apart = np.inf if posed is None else np.linalg.norm(posed.pose[:2] - stone.rested.xy)
            if apart < tuning.WAKES_WITHIN:
                stone.wakes = t


def _expect_contacts(t: float, stones: Sequence[MovingStone]) -> None:
    """Let stones set out that others should have hit by a time [s], the first one first.

    Beside or behind the stone that hits it a stone may not be seen for a while.
    """
    while True:
        near: list[tuple[float, int, int]] = []
        for k, stone in enumerate(stones):
            if stone.rested is None or stone.moves or t < stone.wakes:
                continue
            for j, other in enumerate(stones):
                touching = 2 * other.appearance.model.radius
                when = None
                if other is not stone and other.moves:
                    when = other.path.meets(stone.rested.xy, touching, t)
                if when is not None:
                    near.append((when, j, k))
        if not near:
            return
        when, j, k = min(near)
        striker, stone = stones[j], stones[k]
        motion = striker.path.motion()
        if motion is None or stone.rested is None:
            return
        last, place, velocity = motion
        at = place + (when - last) * velocity
        onward, given = after_contact(at, stone.rested.xy, velocity)
        stone.path.set_out(when, stone.rested.xy, given)
        stone.expected = when, striker
        striker.path.set_out(when, at, onward)


def _rest_tolerance(camera: Camera, xy: Floats) -> float:
    """Distance from where it lay at which a stone has left its place [m]."""
    pixel = 1.0 / np.linalg.norm(camera.px_per_metre(xy), -2)
    return float(tuning.REST_TOLERANCE / 2 + pixel)


def _has_left(stone: MovingStone, camera: Camera) -> bool:
    """Whether the last two measurements show a stone that moves away from where it lay."""
    if stone.rested is None:
        return False
    recent = [fit for fit in stone.measured.fits[-3:] if fit is not None][-2:]
    away = [float(np.linalg.norm(fit.xy - stone.rested.xy)) for fit in recent]
    return len(away) == 2 and _rest_tolerance(camera, stone.rested.xy) < away[0] < away[1]


def _striker(
    stone: MovingStone, stones: Sequence[MovingStone], radius: float
) -> MovingStone | None:
    """The moving stone that is next to where another has just left."""
    near: list[tuple[float, int]] = []
    for k, other in enumerate(stones):
        posed = other.posed()
        if other is stone or posed is None or not other.moves or stone.rested is None:
            continue
        near.append((float(np.linalg.norm(posed.pose[:2] - stone.rested.xy)), k))
    if not near or min(near)[0] > 2 * radius + tuning.MAX_HIT_GAP:
        return None
    return stones[min(near)[1]]
