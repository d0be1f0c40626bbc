"""Estimation of a stone's appearance from a film: its profile, its colours and the camera's blur.

During a throw the camera sees the stone from many distances and sides, and only the correct profile
fits all of them. Poses are projected out, so that they cannot absorb an error of the profile.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import expit

from friction_estimation.appearance.ambiguity import sight_uncertainty
from friction_estimation.appearance.colours import body_colour, colours_of
from friction_estimation.appearance.crops import (
    Crop,
    fit_pose,
    residual_noise,
    total_misfit,
    trim,
)
from friction_estimation.appearance.fit import Appearance
from friction_estimation.appearance.handle import find_handle, fit_headings
from friction_estimation.appearance.model import StoneModel
from friction_estimation.appearance.prior import (
    HANDLE_PREFIXES,
    SHAPE_PRIOR,
    TURNED_ALIKE,
    UPRIGHT,
    ShapePrior,
)
from friction_estimation.appearance.profile import fit_profile
from friction_estimation.appearance.shape import PARTS
from friction_estimation.appearance.tuning import (
    ADAPTING_ROUNDS,
    ALIKE_AT_HEIGHTS,
    ENOUGH_CROPS,
    ENOUGH_PIXELS,
    MIN_NOISE,
    OTHER_HANDLE,
    REFINED_AGAIN,
    REFINED_WITH,
    REFINEMENTS,
    TRIAL_SHADOW,
    UNLIKELY_SHAPE,
)


def learn_appearance(
    crops: Sequence[Crop],
    model: StoneModel,
    noise: float,
    *,
    trimmed: bool = True,
    try_others: bool = True,
) -> Appearance:
    """Estimate the appearance that explains all crops together.

    Parameters
    ----------
    crops : crops of one stone; their poses are refined in place
    model : the scene's radius and height, and typical values for the rest
    noise : standard deviation of a pixel [grey levels]
    trimmed : whether pixels that the stone does not reach are dropped from the crops
    try_others : also fit other appearances, for their error of the place
    """
    sigma = np.maximum([3 * noise, 2 * noise, 2 * noise], MIN_NOISE)
    body = body_colour(crops, model)
    look = Appearance(
        model=model, colours=np.tile(body, (len(PARTS), 1)), noise=4 * sigma, has_handle=False
    )
    for crop in crops:
        fit_pose(crop, look)
    look = replace(look, colours=colours_of(crops, look))
    for crop in crops:
        fit_pose(crop, look)
    look = find_handle(crops, look)
    for crop in crops if trimmed else ():
        trim(crop, look)
    look = _with_shadow(crops, look)
    ordered = sorted(crops, key=lambda crop: crop.t)
    pixels = sum(len(crop.pixels) for crop in crops)
    spare = max(1, min(pixels // ENOUGH_PIXELS, len(crops) // ENOUGH_CROPS))
    least = max(spare, len(crops) // REFINED_WITH)
    prior = ShapePrior(typical=model)
    for every, rounds in REFINEMENTS:
        look = _refined(ordered, max(every, least), look, prior, rounds)
    if not try_others:
        return look
    again = _with_better_handle(ordered, max(REFINED_AGAIN[0], spare), look, prior)
    if again is not None:
        fit_headings(crops, again)
        every, rounds = REFINEMENTS[-1]
        look = _refined(ordered, max(every, spare), again, prior, rounds)
    look = _reversible_or_general(ordered[::spare], look, prior)
    for crop in crops:  # some were skipped, and some have poses of the other kind
        fit_pose(crop, look)
    return look


def _refined(
    crops: Sequence[Crop], every: int, look: Appearance, prior: ShapePrior, rounds: int
) -> Appearance:
    """Refine an appearance with one of `every` crops; find the poses of all again, in place."""
    some = crops[::every]
    look = fit_profile(some, look, prior, rounds).look
    look = replace(look, noise=residual_noise(some, look))
    if look.has_handle:
        fit_headings(crops, look)
    for crop in crops:
        fit_pose(crop, look)
    return look


def _with_better_handle(
    crops: Sequence[Crop], every: int, look: Appearance, prior: ShapePrior
) -> Appearance | None:
    """Return the appearance with another handle, if that explains the pictures far better.

    The first search for a handle precedes the fit of the shadow, so shade, which does not turn with
    the stone, may be mistaken for it.
    """
    if not look.has_handle:
        return None
    part = vars(prior.typical).items()
    usual = {name: value for name, value in part if name.startswith(HANDLE_PREFIXES)}
    some = [replace(crop, pose=crop.pose.copy()) for crop in crops[::every]]
    now = total_misfit(some, look)
    again = replace(look, has_handle=False, model=replace(look.model, **usual))
    again = fit_profile(some, find_handle(some, again), prior, REFINED_AGAIN[1]).look
    far_better = again.has_handle and total_misfit(some, again) < OTHER_HANDLE * now
    return again if far_better else None


def _reversible_or_general(
    crops: Sequence[Crop], look: Appearance, prior: ShapePrior
) -> Appearance:
    """Return the appearance of a reversible stone, or of any stone, whichever is more likely.

    Both have the same prior probability. The other appearance enters the uncertainty, weighted by
    its likelihood, unless it is far less likely.
    """
    alike = ShapePrior.reversible(prior.typical)
    others = [replace(crop, pose=crop.pose.copy()) for crop in crops]
    fit = fit_profile(crops, look, prior, ADAPTING_ROUNDS)
    rival = fit_profile(others, as_reversible(fit.look), alike, ADAPTING_ROUNDS)
    kinds = [(crops, fit, prior, False), (others, rival, alike, True)]
    ahead = rival.unlikelihood() - fit.unlikelihood()
    best, second = kinds if ahead > 0 else kinds[::-1]
    uncertainty = sight_uncertainty(*best)
    if abs(ahead) < UNLIKELY_SHAPE:
        share = float(expit(-0.5 * abs(ahead)))
        uncertainty = uncertainty.mixed_with(sight_uncertainty(*second), share)
    return replace(best[1].look, uncertainty=uncertainty)


def as_reversible(look: Appearance) -> Appearance:
    """Return the appearance with the mean of foot and bevel for both."""
    model = look.model
    inset = (model.foot_inset + model.bevel_inset) / 2
    depth = (model.foot_height + model.bevel_height) / 2
    power = (model.foot_roundness + model.roundness) / 2
    return replace(
        look,
        model=replace(
            model,
            foot_inset=inset,
            bevel_inset=inset,
            foot_height=depth,
            bevel_height=depth,
            foot_roundness=power,
            roundness=min(power, SHAPE_PRIOR["roundness"][2]),
        ),
    )


def adapt_appearance(
    crops: Sequence[Crop], look: Appearance, model: StoneModel, *, alike: bool = False
) -> tuple[Appearance, float]:
    """Fit an appearance from nearly the same crops to these.

    Parameters
    ----------
    crops : their headings are nearly right; their poses are refined in place
    look : to begin with; its noise stays
    model : as for `learn_appearance`
    alike : whether the stone is turned alike above and below

    Returns
    -------
    the look, and how unlikely the crops are for such a stone, beside those of other heights of the
    camera; see `ProfileFit.unlikelihood`
    """
    prior = ShapePrior(typical=model, ties=TURNED_ALIKE if alike else UPRIGHT)
    for crop in crops:
        fit_pose(crop, look)
    found = fit_profile(crops, look, prior, ADAPTING_ROUNDS)
    return found.look, found.unlikelihood(ALIKE_AT_HEIGHTS)


def _with_shadow(crops: Sequence[Crop], look: Appearance) -> Appearance:
    """Initialise the shadow on the side where the ice beside the stone is darkest."""
    costs: list[tuple[float, Appearance]] = []
    tried = [(0.0, 0.0)]
    tried += [(0.04 * np.cos(a), 0.04 * np.sin(a)) for a in np.arange(8) * np.pi / 4]
    for dx, dy in tried:
        model = replace(
            look.model,
            shadow_x=dx,
            shadow_y=dy,
            shadow_radius=look.model.radius,
            shadow=TRIAL_SHADOW,
            contact=TRIAL_SHADOW,
            mirror=TRIAL_SHADOW,
        )
        shaded = replace(look, model=model)
        costs.append((total_misfit(crops, shaded), shaded))
    return min(costs, key=lambda item: item[0])[1]
