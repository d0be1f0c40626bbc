"""One throw as it is fitted: its course, its ride so far, and what the ride leaves unexplained."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from curling_env.ice import FrictionMap, Ice
from curling_env.physics.law import acceleration
from curling_env.typing import Floats
from friction_estimation.inversion.noise import Noise, Residual
from friction_estimation.inversion.throw.forward import Passenger, Ride, Track
from friction_estimation.inversion.throw.path import lay_course
from friction_estimation.inversion.throw.spin import USUAL_SPIN, fit_spin, shows_heading
from friction_estimation.tracks.kinematics import FreeSlide, smooth_motion


@dataclass(frozen=True, kw_only=True)
class Ridden:
    """One throw as it was fitted.

    Parameters
    ----------
    slide : the rows of its track
    passenger : course, spin and the rest that its ride needs
    measured : (k,) distance of each row along the course [m]
    scale : (k,) noise of each row relative to the common noise
    start, speed : fitted distance and speed at the first row [m, m/s]
    offset : its own departure in ln μ
    turn_seen : whether its heading told its spin; else the usual one is taken
    shift : (k,) by which the camera's ripple displaces each row along the course [m]
    keep : (k,) rows that agree with the noise
    left : (k,) measured minus ridden and displaced distance [m]
    """

    slide: FreeSlide
    passenger: Passenger
    measured: Floats
    scale: Floats
    start: float
    speed: float
    offset: float = 0.0
    turn_seen: bool = True
    shift: Floats
    keep: NDArray[np.bool_]
    left: Floats

    @property
    def t(self) -> Floats:
        """Times of the rows since the first [s]."""
        return self.slide.t - self.slide.t[0]


def board_throw(slide: FreeSlide, order: int) -> Ridden:
    """A throw with its course laid, and first values of its start, speed and spin."""
    course, measured = lay_course(slide)
    t = slide.t - slide.t[0]
    early = max(int(np.searchsorted(t, 3.0)), 8)
    fit = np.polynomial.polynomial.polyfit(t[:early], measured[:early], 2)
    spin, power, speed, heading = fit_spin(slide)
    turn_seen = shows_heading(slide)
    if not turn_seen:
        spin = USUAL_SPIN
    passenger = Passenger(
        course=course,
        duration=float(t[-1]),
        spin=spin,
        spin_power=power,
        spin_speed=speed,
        heading=heading,
        clock=slide.track.clock + float(slide.t[0]),
        order=order,
        stone=slide.track.stone,
        sweeps=swept_intervals(t, slide.track.swept[slide.rows]),
    )
    return Ridden(
        slide=slide,
        passenger=passenger,
        measured=measured,
        scale=relative_noise(slide),
        start=float(fit[0]),
        speed=float(fit[1]),
        shift=np.zeros(len(t)),
        turn_seen=turn_seen,
        keep=np.ones(len(t), dtype=np.bool_),
        left=np.zeros(len(t)),
    )


def relative_noise(slide: FreeSlide) -> Floats:
    """Noise of each row of a slide relative to its usual one, (k,).

    What a track states in `sigma_xy` is its rows' own noise and what all frames share (pose, lens,
    outline), which is no weight between frames. So rows that are said to be twice as uncertain
    count as half as much as they would if all of that were their own. Of tracks from the end of
    the sheet, where the far rows err several times as much as the near ones, the maps of even ice
    err by 0.5 % instead of 0.9 with it, and by 0.7 where they take all of it.
    """
    stated = slide.track.sigma_xy
    usual = float(np.nanmedian(stated[slide.rows])) if np.isfinite(stated).any() else 0.0
    if not usual > 0.0:
        return np.ones(len(slide.rows))
    known = np.where(np.isfinite(stated[slide.rows]), stated[slide.rows], usual)
    return np.sqrt(np.clip(known / usual, 0.1, 10.0))


def swept_intervals(t: Floats, swept: Floats) -> Floats:
    """Beginnings and ends of sweeping, (k, 2) [s], from flags per row."""
    flags = np.concatenate([[0], (swept > 0.5).astype(int), [0]])
    edges = np.diff(flags)
    first, last = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    ends = np.append(t, t[-1] + 1.0)
    return np.column_stack([t[first], ends[last]]) if len(first) else np.empty((0, 2))


def first_level(throw: Ridden, ice: Ice) -> float:
    """Logarithm of μ of one throw from its smoothed deceleration, under the law of the ice."""
    slide = throw.slide
    motion = smooth_motion(slide.t, slide.xy, window=3.0)
    rows = np.flatnonzero(motion.speed > 0.4 * motion.speed.max())[::5]
    heading = throw.passenger.course.heading_at(throw.measured[rows])
    states = np.column_stack(
        [slide.xy[rows], motion.speed[rows, None] * heading, np.full(len(rows), 0.0)]
    )
    one, two = (
        (acceleration(_flat(ice, mu), states)[:, :2] * heading).sum(axis=1) for mu in (0.01, 0.02)
    )
    mu = 0.01 * (1.0 + (motion.acceleration[rows] - one) / (two - one))
    return float(np.log(np.clip(np.median(mu), 5e-4, 0.2)))


def _flat(ice: Ice, mu: float) -> Ice:
    return replace(ice, friction=FrictionMap.uniform(mu, ice.sheet))


def ride_throw(throw: Ridden, track: Track, gate: Noise) -> tuple[Ridden, Ride]:
    """The throw ridden once more, its residuals and good rows up to date."""
    ride = track.ride(throw.passenger, throw.start, throw.speed, throw.offset)
    left = throw.measured - throw.shift - ride.distance_at(throw.t)
    keep = gate.keep(throw.t, left, throw.scale)
    if keep.sum() < 0.5 * len(keep):  # the path is still far off: nothing can be called wild yet
        keep = np.ones(len(keep), dtype=np.bool_)
    return replace(throw, left=left, keep=keep), ride


def residuals_of(throws: Sequence[Ridden]) -> list[Residual]:
    return [(k.t[k.keep], k.left[k.keep], k.scale[k.keep]) for k in throws]


def move_release(throw: Ridden, step: Floats, offset: float) -> Ridden:
    """The throw with its start, speed and offset changed by what a fit found."""
    limit = min(1.0, 0.3 * throw.speed / max(abs(float(step[1])), 1e-12))
    return replace(
        throw,
        start=throw.start + limit * float(step[0]),
        speed=throw.speed + limit * float(step[1]),
        offset=offset,
    )


def crossed_cells(throws: Sequence[Ridden], ice: Ice) -> NDArray[np.bool_]:
    """Cells that a stone's centre crossed while it was measured, (rows, columns)."""
    observed = np.zeros(ice.sheet.shape, dtype=np.bool_)
    for throw in throws:
        reached = throw.measured[throw.keep]
        on_way = np.arange(reached.min(), reached.max(), 0.02)
        observed[ice.sheet.cell_of(throw.passenger.course.at(on_way))] = True
    return observed
