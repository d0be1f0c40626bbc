"""Several stones followed through the same frames, each measured in front of or behind the others.

What is thrown is led by its rough path until it strikes. From then on it, and every stone that is
struck, is led by optical flow and, where flow fails, by how it slid so far.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance import Appearance, PosedStone, StoneFit, measure_occluded
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame
from friction_estimation.tracking.detection.acquisition import RoughPath
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.detection.resting_stones import STILL, Bystander
from friction_estimation.tracking.film_track import TrackingOptions
from friction_estimation.tracking.path.assembly import Record
from friction_estimation.tracking.path.heading import Turn
from friction_estimation.tracking.path.prediction import Pilot

RECENT = 8
"""Measurements from which it is told how a stone slides on."""
SLOWING = 0.12
"""How much ice slows a stone, roughly [m/s²]; it leads a stone only while it is hidden."""
CLEAR_OF = 1.7
"""Two stones' centres are never nearer than two radii; measurements nearer than this are one stone
measured twice."""
REACH = 0.4
"""Gap between two stones of which one has just struck the other, at most [m]."""


class Course:
    """Where a stone should be at any time: on a path known beforehand, then as it slid so far."""

    def __init__(self, before: RoughPath | Floats, until: float) -> None:
        self._before, self._until = before, until
        self._notes: list[tuple[float, Floats]] = []

    def note(self, t: float, xy: Floats) -> None:
        """Remember where it was."""
        self._notes = [*self._notes[1 - RECENT :], (t, xy)]

    def turn_off(self, t: float) -> None:
        """It was struck or has struck: what it did before says nothing more."""
        self._until = t
        self._notes = self._notes[-1:]

    def at(self, t: float) -> Floats:
        """Place at a time [s], (2,) [m]."""
        known = self._before
        if not isinstance(known, RoughPath):
            if t < self._until or not self._notes:
                return known
        elif t < min(self._until, known.sightings[-1].t) or not self._notes:
            return known.at(t)
        last, place = self._notes[-1]
        if len(self._notes) < 3:
            return place
        times = np.array([moment for moment, _ in self._notes]) - last
        places = np.array([xy for _, xy in self._notes])
        speed_x, speed_y = np.polynomial.polynomial.polyfit(times, places, 1)[1]
        pace = float(np.hypot(speed_x, speed_y))
        ahead = min(t - last, pace / SLOWING)
        way = ahead - 0.5 * SLOWING * ahead**2 / max(pace, 1e-6)
        return place + way * np.array([speed_x, speed_y])


@dataclass(eq=False)
class Mover:
    """A stone that is followed.

    Parameters
    ----------
    look : how it looks
    course, pilot : where it should be, and where to look for it
    record : what was measured
    lay : where it lay before it was struck; None for the thrown one
    wakes : when it is first looked at [s]
    struck : the moment at which it was seen to have left its place [s]
    strikes : moments at which others were seen to have left because of it [s]
    """

    look: Appearance
    course: Course
    pilot: Pilot
    record: Record
    lay: Bystander | None = None
    wakes: float = 0.0
    struck: float | None = None
    strikes: list[float] = field(default_factory=list)
    _pose: Floats | None = None

    def expected(self, t: float, frame: Frame) -> Floats | None:
        """Where it should be in a frame; None while it is not followed yet."""
        if t < self.wakes:
            return None
        return self.pilot.predict(t, frame)

    def posed(self) -> PosedStone | None:
        """Where it is, as far as known."""
        if self._pose is None:
            return None if self.lay is None else self.lay.posed
        return PosedStone(look=self.look, pose=self._pose)

    def note(self, t: float, fit: StoneFit | None, start: Floats | None) -> None:
        """Remember a frame."""
        if start is not None:
            self.pilot.note(t, fit)
        if fit is not None:
            heading = fit.theta if np.isfinite(fit.theta) else (0.0 if start is None else start[2])
            self._pose = np.array([*fit.xy, heading])
            self.course.note(t, fit.xy)
        self.record.t.append(t)
        self.record.fits.append(fit)


def follow_together(
    frames: Iterable[tuple[float, Frame]],
    rough: RoughPath,
    look: Appearance,
    turn: Turn | None,
    lying: Sequence[Bystander],
    moments: Sequence[float],
    ice: Floats,
    background: Background,
    camera: Camera,
    options: TrackingOptions,
) -> list[Mover]:
    """The thrown stone and all that it sets in motion, through all frames.

    Parameters
    ----------
    rough, look, turn : of the thrown stone, up to its first strike
    lying : the other stones; those that leave are followed, the rest may hide them
    moments : of the sparse frames in which `lying` were seen [s]
    ice : (rows, columns, 3) channels of the ice without the stones that leave

    Returns
    -------
    the thrown stone, then those that left, in the order of `lying`
    """
    leaving = [stone for stone in lying if stone.leaves]
    staying = [
        PosedStone(look=stone.posed.look, pose=stone.posed.pose, in_background=True)
        for stone in lying
        if stone.stays
    ]

    def pilot_for(course: Course, look: Appearance, turn: Turn | None) -> Pilot:
        return Pilot(
            rough=course, camera=camera, look=look, options=options,
            turn=turn,
        )  # fmt: skip

    first = min((moments[stone.last_seen] for stone in leaving), default=np.inf)
    course = Course(rough, first)
    movers = [Mover(look=look, course=course, pilot=pilot_for(course, look, turn), record=Record())]
    for stone in leaving:
        wakes = moments[max(stone.last_seen - 1, 0)]
        course = Course(stone.xy, wakes)
        movers.append(
            Mover(
                look=stone.posed.look,
                course=course,
                pilot=pilot_for(course, stone.posed.look, None),
                record=Record(),
                lay=stone,
                wakes=wakes,
            )
        )
    for t, frame in frames:
        starts = [mover.expected(t, frame) for mover in movers]
        fits: list[StoneFit | None] = [None] * len(movers)
        done: list[int] = []
        # The nearest first: nothing hides it.
        order = sorted(
            (k for k, start in enumerate(starts) if start is not None),
            key=lambda k: float(np.linalg.norm(camera.position[:2] - np.asarray(starts[k])[:2])),
        )
        for k in order:
            start = np.asarray(starts[k])
            others = list(staying)
            for j, other in enumerate(movers):
                if j == k:
                    continue
                fit = fits[j]
                known = other.posed()
                if fit is not None and np.isfinite(fit.theta):
                    others.append(PosedStone(look=other.look, pose=np.array([*fit.xy, fit.theta])))
                elif fit is not None and known is not None:
                    others.append(
                        PosedStone(look=other.look, pose=np.array([*fit.xy, known.pose[2]]))
                    )
                elif known is not None:
                    ahead = starts[j]
                    there = known.pose if ahead is None or j in done else ahead
                    others.append(PosedStone(look=other.look, pose=there))
            taken = [fits[j].xy for j in done if fits[j] is not None]  # pyright: ignore[reportOptionalMemberAccess]
            fits[k] = _measured(frame, t, movers[k], start, others, taken, ice, background, camera)
            done.append(k)
        for mover, fit, start in zip(movers, fits, starts, strict=True):
            mover.note(t, fit, start)
            mover.record.glimpse(frame, ice, background, camera, mover.look)
        for mover in movers[1:]:
            if mover.struck is None and _has_left(mover, camera):
                mover.struck = t
                mover.course.turn_off(t)
                striker = _striker(mover, movers, look.model.radius)
                if striker is not None:
                    striker.strikes.append(t)
                    striker.course.turn_off(t)
                    striker.pilot = pilot_for(striker.course, striker.look, None)
    return movers


def _measured(
    frame: Frame,
    t: float,
    mover: Mover,
    start: Floats,
    others: Sequence[PosedStone],
    taken: Sequence[Floats],
    ice: Floats,
    background: Background,
    camera: Camera,
) -> StoneFit | None:
    apart = CLEAR_OF * mover.look.model.radius

    def found_at(pose: Floats) -> StoneFit | None:
        return measure_occluded(frame, ice, background.origin_px, camera, mover.look, pose, others)

    def acceptable(fit: StoneFit | None, pose: Floats) -> bool:
        return (
            fit is not None
            and mover.pilot.accepts(fit, pose)
            and all(np.linalg.norm(fit.xy - xy) > apart for xy in taken)
        )

    turns = mover.pilot.headings_to_try
    tried = [found_at(start + np.array([0.0, 0.0, turn])) for turn in turns]
    fit = min(
        (found for found in tried if found is not None),
        key=lambda found: found.misfit / max(found.visible, 1e-3),
        default=None,
    )
    if acceptable(fit, start):
        return fit
    again = mover.pilot.fallback(t)
    if np.linalg.norm(again[:2] - start[:2]) > 0.02:
        fit = found_at(again)
        if acceptable(fit, again):
            return fit
    return None


def play_at(camera: Camera, xy: Floats) -> float:
    """How far from where it lay a stone must be seen before it has left its place [m]."""
    return float(STILL / 2 + 1.0 / np.linalg.norm(camera.px_per_metre(xy), -2))


def _has_left(mover: Mover, camera: Camera) -> bool:
    """Whether the last two measurements show a stone that is no longer where it lay."""
    if mover.lay is None:
        return False
    recent = [fit for fit in mover.record.fits[-3:] if fit is not None][-2:]
    play = play_at(camera, mover.lay.xy)
    away = [float(np.linalg.norm(fit.xy - mover.lay.xy)) for fit in recent]
    return len(away) == 2 and play < away[0] < away[1]


def _striker(mover: Mover, movers: Sequence[Mover], radius: float) -> Mover | None:
    """The moving stone that is next to where another has just left."""
    near: list[tuple[float, int]] = []
    for k, other in enumerate(movers):
        posed = other.posed()
        moves = other.lay is None or other.struck is not None
        if other is mover or posed is None or not moves or mover.lay is None:
            continue
        near.append((float(np.linalg.norm(posed.pose[:2] - mover.lay.xy)), k))
    if not near or min(near)[0] > 2 * radius + REACH:
        return None
    return movers[min(near)[1]]
