"""Fits a stone's profile, blur and colours to all crops, with the poses eliminated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from curling_env.typing import Floats
from friction_estimation.appearance.crops import Crop, painted_planes, robust_weights, total_misfit
from friction_estimation.appearance.fit import Appearance, ShapeDoubt
from friction_estimation.appearance.kernels.fit_kernels import normal_equations
from friction_estimation.appearance.kernels.picture_kernels import blur
from friction_estimation.appearance.model import PixelWindow
from friction_estimation.appearance.painting import (
    Planes,
    blurred,
    coloured,
    composite_change,
    painted,
    shade_anew,
    turn_handle,
)
from friction_estimation.appearance.prior import (
    HANDLE_PREFIXES,
    SHAPE_SPREAD,
    FreeShape,
    ShapePrior,
)
from friction_estimation.appearance.shape import (
    BLUR_PX,
    COLOUR_BLUR_PX,
    HANDLE,
    LIT,
    PARTS,
    SHAPE_PARAMETERS,
    SIDE,
)
from friction_estimation.appearance.tuning import (
    ALIKE_IN_FIT,
    ALIKE_PICTURES,
    MAX_FOOT_BRIGHTNESS,
    MIN_GAIN,
    PIXEL_CORRELATION,
)

LENGTHS = tuple(name for name, spread in SHAPE_SPREAD.items() if spread < 0.1)
"""Parameters that are lengths [m], whose derivatives are computed with a smaller step."""
SHADE_PREFIXES = ("shadow", "contact")
"""Parameters with these prefixes change only the shade on the ice."""
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
BLURS = ("blur_px", "colour_blur_px")
"""Parameters that change only the blur."""


def refine_profile(
    crops: Sequence[Crop],
    look: Appearance,
    prior: ShapePrior,
    rounds: int,
    *,
    placed: bool = False,
) -> Appearance:
    """Fit shape, blur and colours to all crops, and refine the pose of every crop in place.

    A Levenberg-Marquardt fit; each crop's pose is eliminated from the common equations.

    Parameters
    ----------
    crops : crops of one stone
    look : the appearance at the start
    prior : what stones are like
    rounds : greatest number of rounds
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
    return look


class _Equations(NamedTuple):
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


def _after_step(
    crops: Sequence[Crop], look: Appearance, free: FreeShape, equations: _Equations, damping: float
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


def shape_doubt(crops: Sequence[Crop], look: Appearance, prior: ShapePrior) -> ShapeDoubt:
    """How far what the crops leave open of shape and colours misplaces the stone in each of them.

    Parameters
    ----------
    crops : crops of one stone with fitted poses
    look : fitted to them
    prior : what stones are like
    """
    equations = _joint_equations(crops, look, prior.of(look))
    covariance = np.linalg.inv(TRUE_WEIGHT / FIT_WEIGHT * equations.crops + equations.prior)
    moved = [along[:2] for _, along in equations.poses]
    sigma = [np.sqrt(np.einsum("ip,pq,iq->i", a, covariance, a)) for a in moved]
    places = np.array([crop.pose[:2] for crop in crops])
    return ShapeDoubt(places=places, sigma=np.array(sigma), shift=np.zeros_like(places))


def unlikelihood(
    crops: Sequence[Crop],
    look: Appearance,
    prior: ShapePrior,
    alike: float = ALIKE_PICTURES,
    *,
    placed: bool = False,
) -> float:
    """How unlikely the crops are for stones of a kind: -2 log likelihood, but for a constant.

    The misfit of the likeliest look, and how small a part of all looks of that kind explain the
    crops as well (Laplace's approximation).

    Parameters
    ----------
    crops : crops of one stone with fitted poses
    look : fitted to them
    prior : what stones of that kind are like
    alike : so many crops count as one
    placed : whether the crops' poses are known
    """
    free = prior.of(look)
    equations = _joint_equations(crops, look, free, placed=placed)
    weight = 1 / (PIXEL_CORRELATION * alike)
    left = np.linalg.slogdet(weight / FIT_WEIGHT * equations.crops + equations.prior)[1]
    before = np.linalg.slogdet(equations.prior)[1]
    return weight * total_misfit(crops, look) + free.misfit(look) + float(left - before)


def _objective(crops: Sequence[Crop], look: Appearance, free: FreeShape) -> float:
    """What `refine_profile` lowers."""
    return FIT_WEIGHT * total_misfit(crops, look) + free.misfit(look)


def _joint_equations(
    crops: Sequence[Crop], look: Appearance, free: FreeShape, *, placed: bool = False
) -> _Equations:
    poses, shared = 0 if placed else 3 if look.has_handle else 2, free.shared
    normal, right = np.zeros((shared, shared)), np.zeros(shared)
    steps: list[tuple[Floats, Floats]] = []
    for crop in crops:
        jacobian, residual, weight = _linearised(crop, look, free.index, free.parts, poses)
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
    return _Equations(
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


def _linearised(
    crop: Crop, look: Appearance, index: list[int], parts: int, poses: int
) -> tuple[Floats, Floats, Floats]:
    """Derivatives of a crop's picture by shape, colours and pose, with residuals and weights.

    Returns
    -------
    derivatives (m, 3·n), residuals (3·n,) and weights (3·n,), one colour channel after the other;
    derivatives and residuals are in standard deviations of the noise
    """
    window, pose = crop.window, crop.pose
    rows, columns = window.shape
    shape, noise = look.model.shape(), look.noise[:, None, None]
    behind = np.asarray(crop.background.T.reshape(3, rows, columns), dtype=np.float32, order="C")
    planes = painted_planes(crop, look)
    light = coloured(planes, look.colours)
    seen = blurred(light, window, shape, sloped=True)
    picture = composite_change(seen, behind)
    residual = (crop.pixels - crop.background).T.reshape(3, rows, columns) - picture
    weight = np.tile(robust_weights(residual.reshape(3, -1).T, look.noise), 3)
    jacobian = np.zeros((len(index) + 3 * parts + poses, 3, rows, columns))
    for p, i in enumerate(index):
        moved = shape.copy()
        step = 2e-3 if SHAPE_PARAMETERS[i] in LENGTHS else 0.05
        moved[i] += step
        changed = light
        if SHAPE_PARAMETERS[i] not in BLURS:
            changed = coloured(_painted_anew(planes, i, window, moved, pose), look.colours)
        other = composite_change(blurred(changed, window, moved), behind)
        np.multiply(other - picture, 1 / (step * noise), out=jacobian[p])
    visible = planes * (1 - planes[HANDLE])
    visible[HANDLE] = planes[HANDLE]
    lit = visible[:parts].copy()
    lit[SIDE] += visible[LIT]  # light changes brightness, not colour
    of_parts = np.empty((parts, 3, rows, columns), dtype=np.float32)
    for channel in range(3):
        if channel < 2:
            sigma = shape[BLUR_PX if channel == 0 else COLOUR_BLUR_PX]
            own = lit if channel == 0 else visible[:parts]
            blur(own, rows, columns, sigma, 0.0, 0.0, False, of_parts)
        at = len(index) + 3 * np.arange(parts) + channel
        jacobian[at, channel] = of_parts[:, 0] / noise[channel]
    if poses == 0:
        return jacobian.reshape(len(jacobian), -1), (residual / noise).ravel(), weight
    # A small movement of the stone only shifts its picture.
    by_shift = np.stack([composite_change(seen[:, [d, 0, 0]], behind) for d in (1, 2)])
    px = np.linalg.inv(window.scale[0] + 0.5 * look.model.height * window.scale[1])
    first = len(index) + 3 * parts
    jacobian[first : first + 2] = np.einsum("sp,s...->p...", px, by_shift) / noise
    if poses == 3:
        step = 1e-2
        turned = planes.copy()
        turn_handle(turned, window, shape, pose + np.array([0.0, 0.0, step]))
        other = composite_change(blurred(coloured(turned, look.colours), window, shape), behind)
        jacobian[first + 2] = (other - picture) / (step * noise)
    return jacobian.reshape(len(jacobian), -1), (residual / noise).ravel(), weight


def _painted_anew(
    planes: Planes, changed: int, window: PixelWindow, shape: Floats, pose: Floats
) -> Planes:
    """The planes after a change of one parameter; only what depends on it is painted again."""
    name = SHAPE_PARAMETERS[changed]
    if name.startswith(HANDLE_PREFIXES):
        again = planes.copy()
        turn_handle(again, window, shape, pose)
    elif name.startswith(SHADE_PREFIXES):
        again = planes.copy()
        shade_anew(again, window, shape, pose)
    else:
        again = painted(window, shape, pose, with_handle=False)
        again[HANDLE] = planes[HANDLE]
    return again
