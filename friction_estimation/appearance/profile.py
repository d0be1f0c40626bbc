"""Fit of a stone's profile, blur and colours to all crops, with the poses eliminated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance.crops import Crop, total_misfit
from friction_estimation.appearance.derivatives import picture_derivatives
from friction_estimation.appearance.fit import Appearance, ShapeUncertainty
from friction_estimation.appearance.kernels.fit_kernels import normal_equations
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
    shared, right : (m, m) and (m,) what the crops tell of shape and colours, for fixed poses
    own, own_right : (n, p, p) and (n, p) of each crop's pose, for fixed shape and colours
    cross : (n, m, p) of both together
    prior, prior_right : (m, m) and (m,) what stones are like
    """

    shared: Floats
    right: Floats
    own: Floats
    own_right: Floats
    cross: Floats
    prior: Floats
    prior_right: Floats

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
        size = self.own.shape[1]
        own = self.own * (1.0 + damping * np.eye(size)) + 1e-9 * np.eye(size)
        both = np.concatenate([np.swapaxes(self.cross, 1, 2), self.own_right[..., None]], axis=2)
        both = np.asarray(np.linalg.solve(own, both), dtype=np.float64)
        solved, alone = both[..., :-1], both[..., -1]
        matrix = self.shared - np.einsum("nap,npb->ab", self.cross, solved)
        right = self.right - np.einsum("nap,np->a", self.cross, alone)
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

    @property
    def objective(self) -> float:
        """Objective of a fit [squared standard errors]."""
        return FIT_WEIGHT * self.misfit + self.oddity

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
    shape, count = look.model.shape(), len(free.index)
    matrix, right, alone, along = equations.eliminated(damping)
    step = _step_within(
        FIT_WEIGHT * matrix + equations.prior,
        FIT_WEIGHT * right + equations.prior_right,
        damping,
        free.low - shape[free.index],
        free.high - shape[free.index],
    )
    moved = shape.copy()
    moved[free.index] += np.clip(step[:count], -free.spread, free.spread)
    moved[free.index] = np.clip(moved[free.index], free.low, free.high)
    colours = look.colours.copy()
    colours[: free.parts] += step[count:].reshape(free.parts, 3)
    foot, side = PARTS.index("foot"), PARTS.index("side")
    colours[foot, 0] = min(colours[foot, 0], MAX_FOOT_BRIGHTNESS * colours[side, 0])
    taken = np.r_[(moved - shape)[free.index], (colours - look.colours)[: free.parts].ravel()]
    for crop, turn in zip(crops, np.clip(alone - along @ taken, -0.2, 0.2), strict=True):
        pose = crop.pose.copy()
        pose[: len(turn)] += turn
        crop.pose = pose
    return replace(look, model=look.model.with_shape(moved), colours=colours)


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
    poses, shared = 0 if placed else 3 if look.has_handle else 2, free.shared
    normal = np.empty((len(crops), shared + poses, shared + poses))
    pulled = np.empty((len(crops), shared + poses))
    for k, crop in enumerate(crops):
        jacobian, residual, weight = picture_derivatives(crop, look, free.index, free.parts, poses)
        normal_equations(jacobian, residual, weight, normal[k], pulled[k])
        if poses == 3 and crop.expected is not None:
            normal[k, -1, -1] += HEADING_WEIGHT
            pulled[k, -1] += HEADING_WEIGHT * crop.off_expected
    prior, prior_right = free.equations(look)
    prior[np.diag_indices(shared)] += 1e-6
    return Equations(
        shared=normal[:, :shared, :shared].sum(axis=0),
        right=pulled[:, :shared].sum(axis=0),
        own=normal[:, shared:, shared:],
        own_right=pulled[:, shared:],
        cross=normal[:, :shared, shared:],
        prior=prior,
        prior_right=prior_right,
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
