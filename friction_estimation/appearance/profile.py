"""Fits a stone's profile, blur and colours to all crops, with the poses eliminated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance.crops import Crop, total_misfit
from friction_estimation.appearance.derivatives import picture_derivatives
from friction_estimation.appearance.fit import Appearance, ShapeDoubt
from friction_estimation.appearance.kernels.fit_kernels import normal_equations
from friction_estimation.appearance.prior import FreeShape, ShapePrior
from friction_estimation.appearance.shape import PARTS
from friction_estimation.appearance.tuning import (
    ALIKE_IN_FIT,
    ALIKE_PICTURES,
    MAX_FOOT_BRIGHTNESS,
    MIN_GAIN,
    PIXEL_CORRELATION,
)

FIRST_DAMPING, LEAST_DAMPING = 1e-4, 1e-7
"""Damping of steps, as shares of the diagonal: at first, and at least. Where the misfit hardly
changes along a valley, a more strongly damped fit rests anywhere in it."""
DAMPING_STEP = 20.0
"""Factor between the damping of one step and of the next."""
FIT_WEIGHT = 1 / (PIXEL_CORRELATION * ALIKE_IN_FIT)
"""Weight of a misfit to the crops in a fit."""
TRUE_WEIGHT = 1 / (PIXEL_CORRELATION * ALIKE_PICTURES)
"""The same where looks are weighed against each other. What no shape can paint is alike in all
crops, so that they tell less than as many would."""


class Equations(NamedTuple):
    """Normal equations of shape and colours, with every crop's pose eliminated.

    Parameters
    ----------
    crops : matrix of what the crops tell
    prior : matrix of what stones are like
    right : right-hand side of both
    poses : for every crop, the step of its pose for fixed shape and colours, and how much that
        step decreases per unit of each of them
    """

    crops: Floats
    prior: Floats
    right: Floats
    poses: list[tuple[Floats, Floats]]


@dataclass(frozen=True, kw_only=True, eq=False)
class ProfileFit:
    """A look that was fitted to crops of one stone.

    Parameters
    ----------
    look : the likeliest look
    equations : normal equations there, or less than `MIN_GAIN` from there
    misfit : of the crops to it [squared standard errors, correlated pixels]
    oddity : how unlike a stone it is, see `FreeShape.misfit`
    """

    look: Appearance
    equations: Equations
    misfit: float
    oddity: float

    def unlikelihood(self, alike: float = ALIKE_PICTURES) -> float:
        """How unlikely the crops are for stones of the kind: -2 log likelihood, but for a constant.

        The misfit of the likeliest look, and how small a part of all looks of that kind explain the
        crops as well (Laplace's approximation).

        Parameters
        ----------
        alike : so many crops count as one
        """
        weight = 1 / (PIXEL_CORRELATION * alike)
        told, prior = weight / FIT_WEIGHT * self.equations.crops, self.equations.prior
        left, before = np.linalg.slogdet(told + prior)[1], np.linalg.slogdet(prior)[1]
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

    A Levenberg-Marquardt fit; each crop's pose is eliminated from the common equations.

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
        for _ in range(5):
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
    """The look after a damped step; the poses of the crops are moved with it, in place."""
    shape, count = look.model.shape(), len(free.index)
    step = _step_within(
        equations.crops + equations.prior,
        equations.right,
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
    for crop, (alone, along) in zip(crops, equations.poses, strict=True):
        pose = crop.pose.copy()
        pose[: len(alone)] += np.clip(alone - along @ taken, -0.2, 0.2)
        crop.pose = pose
    return replace(look, model=look.model.with_shape(moved), colours=colours)


def shape_doubt(crops: Sequence[Crop], fit: ProfileFit) -> ShapeDoubt:
    """How far what the crops leave open of shape and colours misplaces the stone in each of them.

    Parameters
    ----------
    crops : crops of one stone, with the poses of the fit
    fit : of a look to them
    """
    equations = fit.equations
    covariance = np.linalg.inv(TRUE_WEIGHT / FIT_WEIGHT * equations.crops + equations.prior)
    moved = [along[:2] for _, along in equations.poses]
    sigma = [np.sqrt(np.einsum("ip,pq,iq->i", a, covariance, a)) for a in moved]
    places = np.array([crop.pose[:2] for crop in crops])
    return ShapeDoubt(places=places, sigma=np.array(sigma), shift=np.zeros_like(places))


def _objective(crops: Sequence[Crop], look: Appearance, free: FreeShape) -> float:
    """What `fit_profile` lowers."""
    return FIT_WEIGHT * total_misfit(crops, look) + free.misfit(look)


def _joint_equations(
    crops: Sequence[Crop], look: Appearance, free: FreeShape, *, placed: bool = False
) -> Equations:
    poses, shared = 0 if placed else 3 if look.has_handle else 2, free.shared
    normal, right = np.zeros((shared, shared)), np.zeros(shared)
    steps: list[tuple[Floats, Floats]] = []
    for crop in crops:
        jacobian, residual, weight = picture_derivatives(crop, look, free.index, free.parts, poses)
        full = np.empty((shared + poses, shared + poses))
        pulled = np.empty(shared + poses)
        normal_equations(jacobian, residual, weight, full, pulled)
        own = full[shared:, shared:] + 1e-9 * np.eye(poses)
        cross = full[:shared, shared:]
        solved = np.asarray(
            np.linalg.solve(own, np.column_stack([cross.T, pulled[shared:]])), dtype=np.float64
        )
        normal += full[:shared, :shared] - cross @ solved[:, :-1]
        right += pulled[:shared] - cross @ solved[:, -1]
        steps.append((solved[:, -1], solved[:, :-1]))
    prior, pull = free.equations(look)
    prior[np.diag_indices(shared)] += 1e-6
    return Equations(
        crops=FIT_WEIGHT * normal,
        prior=prior,
        right=FIT_WEIGHT * right + pull,
        poses=steps,
    )


def _step_within(
    normal: Floats, right: Floats, damping: float, lowest: Floats, highest: Floats
) -> Floats:
    """A damped step; its first parameters stay fixed where they are at a bound and would leave."""
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
