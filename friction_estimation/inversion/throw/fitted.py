"""One throw as it is fitted: its path, its start and speed so far, and its residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.ice import FrictionMap, Ice
from curling_env.physics.law import acceleration
from curling_env.typing import Flags, Floats
from friction_estimation.inversion.noise import Noise, Residuals
from friction_estimation.inversion.throw.forward import LawOnMap, PathMotion, ThrowInput
from friction_estimation.inversion.throw.path import fit_path
from friction_estimation.inversion.throw.spin import fit_spin, has_heading
from friction_estimation.inversion.tuning import USUAL_SPIN
from friction_estimation.tracks.free_slide import FreeSlide
from friction_estimation.tracks.smoothing import smooth_motion


@dataclass(frozen=True, kw_only=True)
class FittedThrow:
    """One throw as it is fitted.

    Parameters
    ----------
    slide : free slide of its track
    inputs : path, spin and the rest that its motion depends on
    measured : (k,) measured distance of each row along the path [m]
    scale : (k,) noise of each row relative to the common noise
    start, speed : fitted distance and speed at the first row [m, m/s]
    offset : departure of its ln μ from that of the ice
    heading_seen : whether the heading was measured; otherwise the spin is a usual one
    shift : (k,) displacement of each row along the path by the bias of the camera [m]
    keep : (k,) whether a row agrees with the noise
    residual : (k,) measured distance less shift and fitted distance [m]
    """

    slide: FreeSlide
    inputs: ThrowInput
    measured: Floats
    scale: Floats
    start: float
    speed: float
    offset: float = 0.0
    heading_seen: bool = True
    shift: Floats
    keep: Flags
    residual: Floats

    @property
    def t(self) -> Floats:
        """Times of the rows since the first [s]."""
        return self.slide.t - self.slide.t[0]


def initialise_throw(slide: FreeSlide, order: int) -> FittedThrow:
    """A throw with its path fitted, and first values of its start, speed and spin.

    Parameters
    ----------
    slide : free slide of its track
    order : number of throws played before
    """
    path, measured = fit_path(slide)
    t = slide.t - slide.t[0]
    early = max(int(np.searchsorted(t, 3.0)), 8)
    fit = np.polynomial.polynomial.polyfit(t[:early], measured[:early], 2)
    spin, power, speed, heading = fit_spin(slide)
    heading_seen = has_heading(slide)
    if not heading_seen:
        spin = USUAL_SPIN
    inputs = ThrowInput(
        path=path,
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
    return FittedThrow(
        slide=slide,
        inputs=inputs,
        measured=measured,
        scale=relative_noise(slide),
        start=float(fit[0]),
        speed=float(fit[1]),
        shift=np.zeros(len(t)),
        heading_seen=heading_seen,
        keep=np.ones(len(t), dtype=np.bool_),
        residual=np.zeros(len(t)),
    )


def relative_noise(slide: FreeSlide) -> Floats:
    """Noise of each row of a slide relative to its usual one, (k,).

    The `sigma_xy` of a track contains the rows' own noise and errors that all frames share (pose,
    lens, outline). The shared part is no reason to weigh rows differently. So a row that is stated
    to be twice as uncertain counts half as much as it would if all of the difference were noise.
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


def initial_level(throw: FittedThrow, ice: Ice) -> float:
    """Ln μ of one throw from its smoothed deceleration, under the law of the ice."""
    slide = throw.slide
    motion = smooth_motion(slide.t, slide.xy, window=3.0)
    rows = np.flatnonzero(motion.speed > 0.4 * motion.speed.max())[::5]
    heading = throw.inputs.path.heading_at(throw.measured[rows])
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


def update_residual(
    throw: FittedThrow, law: LawOnMap, gate: Noise
) -> tuple[FittedThrow, PathMotion]:
    """The throw with new residuals and kept rows under a law, and its motion under it.

    Parameters
    ----------
    gate : noise with which a row must agree to be kept
    """
    motion = law.integrate(throw.inputs, throw.start, throw.speed, throw.offset)
    residual = throw.measured - throw.shift - motion.distance_at(throw.t)
    keep = gate.keep(throw.t, residual, throw.scale)
    if keep.sum() < 0.5 * len(keep):  # the fit is still far off: no row can be called wild yet
        keep = np.ones(len(keep), dtype=np.bool_)
    return replace(throw, residual=residual, keep=keep), motion


def kept_residuals(throws: Sequence[FittedThrow]) -> list[Residuals]:
    """Times, residuals and relative noise of the kept rows of every throw."""
    return [(k.t[k.keep], k.residual[k.keep], k.scale[k.keep]) for k in throws]


def move_release(throw: FittedThrow, step: Floats, offset: float) -> FittedThrow:
    """The throw with a new offset, and its start and speed changed by a step (2,)."""
    limit = min(1.0, 0.3 * throw.speed / max(abs(float(step[1])), 1e-12))
    return replace(
        throw,
        start=throw.start + limit * float(step[0]),
        speed=throw.speed + limit * float(step[1]),
        offset=offset,
    )


def crossed_cells(throws: Sequence[FittedThrow], ice: Ice) -> Flags:
    """Cells that a stone's centre crossed while it was measured, (rows, columns)."""
    observed = np.zeros(ice.sheet.shape, dtype=np.bool_)
    for throw in throws:
        reached = throw.measured[throw.keep]
        on_path = np.arange(reached.min(), reached.max(), 0.02)
        observed[ice.sheet.cell_of(throw.inputs.path.at(on_path))] = True
    return observed
