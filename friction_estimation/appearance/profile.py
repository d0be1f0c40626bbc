"""Fit of a stone's profile, blur and colours to all crops, with the poses eliminated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance.crops import Crop, total_misfit
from friction_estimation.appearance.derivatives import picture_derivatives
from friction_estimation.appearance.fit import Appearance, ShapeUncertainty
from friction_estimation.appearance.prior import FreeShape, ShapePrior
from friction_estimation.appearance.shape import PARTS
from friction_estimation.appearance.tuning import (
    ALIKE_IN_FIT,
    ALIKE_PICTURES,
    HEADING_WEIGHT,
    MAX_FOOT_BRIGHTNESS,
    MIN_GAIN,
    PIXEL_CORRELATION,
)

FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-4, 100.0
"""Damping of steps, as shares of the diagonal: initial, minimum and maximum. In a flat valley a
more strongly damped fit stops anywhere."""
DAMPING_STEP = 20.0
"""Factor between the damping of one step and of the next."""
FIT_WEIGHT = 1 / (PIXEL_CORRELATION * ALIKE_IN_FIT)
"""Weight of a misfit to the crops in a fit."""
TRUE_WEIGHT = 1 / (PIXEL_CORRELATION * ALIKE_PICTURES)
"""The same in comparisons of appearances. Model errors are the same in all crops, so that they
count as fewer."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Equations:
    """Normal equations of m shared parameters, shape and colours, and of n crops' poses.

    Parameters
    ----------
    matrix, right : (m + n·p, m + n·p) and (m + n·p,) what the crops tell
    prior, prior_right : (m, m) and (m,) what stones are like
    crops : n
    """

    matrix: Floats
    right: Floats
    prior: Floats
    prior_right: Floats
    crops: int

    def eliminated(self, damping: float = 0.0) -> tuple[Floats, Floats, Floats, Floats]:
        """Return the equations of shape and colours with every crop's pose eliminated.

        Parameters
        ----------
        damping : of the poses, as a share of the diagonal

        Returns
        -------
        (m, m) matrix and (m,) right-hand side of what the crops tell; (n, p) the step of every
        crop's pose for fixed shape and colours; (n, p, m) how much that step decreases per unit of
        each of them
        """
        shared = len(self.prior)
        poses = len(self.right) - shared
        cross = self.matrix[shared:, :shared]
        own = self.matrix[shared:, shared:] * (1.0 + damping * np.eye(poses))
        own[np.diag_indices(poses)] += 1e-9
        both = np.column_stack([cross, self.right[shared:]])
        both = np.asarray(np.linalg.solve(own, both), dtype=np.float64)
        solved, alone = both[:, :-1], both[:, -1]
        matrix = self.matrix[:shared, :shared] - cross.T @ solved
        right = self.right[:shared] - cross.T @ alone
        alone, solved = alone.reshape(self.crops, -1), solved.reshape(self.crops, -1, shared)
        return matrix, right, alone, solved


@dataclass(frozen=True, kw_only=True, eq=False)
class ProfileFit:
    """Appearance fitted to crops of one stone.

    Parameters
    ----------
    look : the most likely look
    equations : normal equations there, or less than `MIN_GAIN` from there
    misfit : of the crops to it [squared standard errors, correlated pixels]
    oddity : how unlike a stone it is, see `FreeShape.misfit`
    """

    look: Appearance
    equations: Equations
    misfit: float
    oddity: float

    def unlikelihood(self, alike: float = ALIKE_PICTURES) -> float:
        """Return -2 log likelihood of the crops for stones of the kind, up to a constant.

        It is the misfit of the most likely appearance, plus a term for the volume of appearances of
        that kind that explain the crops equally well (Laplace's approximation).

        Parameters
        ----------
        alike : number of crops that count as one
        """
        weight = 1 / (PIXEL_CORRELATION * alike)
        result, prior = weight * self.equations.eliminated()[0], self.equations.prior
        left, before = np.linalg.slogdet(result + prior)[1], np.linalg.slogdet(prior)[1]
        return weight * self.misfit + self.oddity + float(left - before)


def fit_profile(
    crops: Sequence[Crop],
    look: Appearance,
    prior: ShapePrior,
    rounds: int,
    *,
    placed: bool = False,
) -> ProfileFit:
    """Fit shape, blur and colours to all crops, and refine the pose of every crop in place.

    A Levenberg-Marquardt fit. Each crop's pose is eliminated from the common equations. It is
    damped as well, because a full step of a distant stone's pose may diverge.

    Parameters
    ----------
    crops : crops of one stone
    look : the appearance at the start
    prior : what stones are like
    rounds : greatest number of rounds; with none, the look stays as it is
    placed : whether the crops' poses stay as they are
    """
    free = prior.of(look)
    damping = FIRST_DAMPING
    value = _objective(crops, look, free)
    for _ in range(rounds):
        equations = _joint_equations(crops, look, free, placed=placed)
        before, last = [crop.pose for crop in crops], value
        while damping < MOST_DAMPING:
            tried = _after_step(crops, look, free, equations, damping)
            found = _objective(crops, tried, free)
            if found < value:
                look, value, damping = tried, found, max(damping / DAMPING_STEP, LEAST_DAMPING)
                break
            damping *= DAMPING_STEP
            for crop, pose in zip(crops, before, strict=True):
                crop.pose = pose

        if last - value < MIN_GAIN:
            break
    else:
        equations = _joint_equations(crops, look, free, placed=placed)
    oddity = free.misfit(look)
    return ProfileFit(
        look=look, equations=equations, misfit=(value - oddity) / FIT_WEIGHT, oddity=oddity
    )


def _after_step(
    crops: Sequence[Crop], look: Appearance, free: FreeShape, equations: Equations, damping: float
) -> Appearance:
    """Return the appearance after a damped step; the poses of the crops are moved with it, in
    place.
    """
    values, count = free.values(look), len(free.names)
    matrix, right, alone, along = equations.eliminated(damping)
    step = _step_within(
        FIT_WEIGHT * matrix + equations.prior,
        FIT_WEIGHT * right + equations.prior_right,
        damping,
        free.low - values[:count],
        free.high - values[:count],
    )
    step[:count] = np.clip(step[:count], -free.spread, free.spread)
    step[:count] = np.clip(values[:count] + step[:count], free.low, free.high) - values[:count]
    foot, side = (count + 3 * PARTS.index(part) for part in ("foot", "side"))
    too_bright = (values + step)[foot] - MAX_FOOT_BRIGHTNESS * (values + step)[side]
    step[foot] -= max(too_bright, 0.0)
    for crop, turn in zip(crops, np.clip(alone - along @ step, -0.2, 0.2), strict=True):
        pose = crop.pose.copy()
        pose[: len(turn)] += turn
        crop.pose = pose
    return free.with_values(look, values + step)


def shape_uncertainty(crops: Sequence[Crop], fit: ProfileFit) -> ShapeUncertainty:
    """Return the displacement of the stone in each crop by the uncertainty of shape and colours.

    Parameters
    ----------
    crops : crops of one stone, with the poses of the fit
    fit : of a look to them
    """
    result, _, _, along = fit.equations.eliminated()
    covariance = np.linalg.inv(TRUE_WEIGHT * result + fit.equations.prior)
    sigma = np.sqrt(np.einsum("nip,pq,niq->ni", along[:, :2], covariance, along[:, :2]))
    places = np.array([crop.pose[:2] for crop in crops])
    return ShapeUncertainty(places=places, sigma=sigma, shift=np.zeros_like(places))


def _objective(crops: Sequence[Crop], look: Appearance, free: FreeShape) -> float:
    """Return the objective of `fit_profile`."""
    off = sum(crop.off_expected**2 for crop in crops) if look.has_handle else 0.0
    return FIT_WEIGHT * (total_misfit(crops, look) + HEADING_WEIGHT * off) + free.misfit(look)


def _joint_equations(
    crops: Sequence[Crop], look: Appearance, free: FreeShape, *, placed: bool = False
) -> Equations:
    poses, shared = 0 if placed else 3 if look.has_handle else 2, free.rows.shape[1]
    size = shared + poses * len(crops)
    matrix, right = np.zeros((size, size)), np.zeros(size)
    for k, crop in enumerate(crops):
        jacobian, residual, weight = picture_derivatives(crop, look, free.names, free.parts, poses)
        jacobian *= np.sqrt(weight)
        residual *= np.sqrt(weight)
        by_all = jacobian.reshape(len(jacobian), -1)
        own = np.r_[:shared, shared + poses * k : shared + poses * (k + 1)]
        matrix[np.ix_(own, own)] += by_all @ by_all.T
        right[own] += by_all @ residual.ravel()
        if poses == 3 and crop.expected is not None:
            matrix[own[-1], own[-1]] += HEADING_WEIGHT
            right[own[-1]] += HEADING_WEIGHT * crop.off_expected
    prior, prior_right = free.equations(look)
    prior[np.diag_indices(shared)] += 1e-6
    return Equations(
        matrix=matrix, right=right, prior=prior, prior_right=prior_right, crops=len(crops)
    )


def _step_within(
    normal: Floats, right: Floats, damping: float, lowest: Floats, highest: Floats
) -> Floats:
    """Return a damped step; its first parameters stay fixed at a bound that they would cross."""
    free = np.ones(len(right), dtype=bool)
    step = np.zeros(len(right))
    damped = normal + damping * np.diag(np.diag(normal))
    n = len(lowest)
    for _ in range(4):
        step[:] = 0.0
        step[free] = np.linalg.solve(damped[np.ix_(free, free)], right[free])
        over = free[:n] & (
            ((lowest > -1e-9) & (step[:n] < 0)) | ((highest < 1e-9) & (step[:n] > 0))
        )
        if not over.any():
            break
        free[:n] &= ~over
    return step
