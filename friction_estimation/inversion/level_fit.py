"""One friction for the sheet: every throw's own ln μ, and what they have in common."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from curling_env.typing import Floats
from friction_estimation.inversion.information import Knowledge
from friction_estimation.inversion.noise import Noise, estimate_noise
from friction_estimation.inversion.prior import USUAL_SCATTER
from friction_estimation.inversion.throw.fitted import (
    Ridden,
    move_release,
    residuals_of,
    ride_throw,
)
from friction_estimation.inversion.throw.forward import Track
from friction_estimation.inversion.throw.linearised import LinearThrow, linearise

Progress = Callable[[str, float], None]
"""Called with what is being done and the part of it that is done, 0 to 1."""

ROUNDS = 8
"""Gauss–Newton rounds at most; the path is nearly linear in ln μ."""
LONGEST_STEP = 0.7
"""Largest change of ln μ in one round: a factor 2."""
CONVERGED = 2e-4
"""Change of ln μ, in its standard errors or absolutely, below which a fit is done."""


@dataclass(frozen=True, kw_only=True)
class OneFriction:
    """One μ for the sheet: its logarithm, standard error, the scatter, and what told them."""

    throws: list[Ridden]
    noise: Noise
    level: float
    sigma: float
    scatter: float
    information: Floats
    pull: Floats


def fit_level(
    throws: list[Ridden],
    track: Track,
    level: float,
    scatter: bool,
    before: Knowledge | None,
    progress: Progress,
) -> OneFriction:
    """One μ for the sheet, together with the throws that were fitted before."""
    # Nothing is known of the noise while the path may be off by metres.
    noise = Noise(white=float(np.median([throw.slide.noise for throw in throws])))
    gate = Noise(white=noise.white, slow=1.0, time=5.0)
    old = 0 if before is None else before.throws
    information, pull = np.empty(old + len(throws)), np.empty(old + len(throws))
    if before is not None:
        information[:old], pull[:old] = np.diag(before.information), before.pull
    sigma, spread = 1.0, 0.0
    for number in range(ROUNDS):
        track.set_level(level)
        linear: list[LinearThrow] = []
        for k, throw in enumerate(throws):
            throws[k], ride = ride_throw(throw, track, gate)
            linear.append(linearise(throws[k], ride, track, noise))
            own = linear[k].friction.sum(axis=1)
            information[old + k] = own @ own
            pull[old + k] = own @ linear[k].left + own @ own * (level + throw.offset)
        found, sigma, spread = uniform_posterior(information, pull, scatter=scatter)
        step = float(np.clip(found - level, -LONGEST_STEP, LONGEST_STEP))
        level += step
        worst = 0.0
        for k, throw in enumerate(throws):
            told = information[old + k]
            shrink = spread**2 / (spread**2 + 1.0 / told)
            offset = shrink * (pull[old + k] / told - found)
            offset = float(np.clip(offset, -LONGEST_STEP, LONGEST_STEP))
            change = np.full(len(linear[k].crossed), step + offset - throw.offset)
            worst = max(worst, abs(change[0]))
            throws[k] = move_release(throws[k], linear[k].release_step(change), offset)
        progress("one friction for the sheet", (number + 1) / ROUNDS)
        if abs(step) > 0.05:
            continue
        for k, throw in enumerate(throws):
            throws[k], _ = ride_throw(throw, track.set_level(level), gate)
        last = noise
        noise = gate = estimate_noise(residuals_of(throws), slowest=5.0)
        settled = abs(np.log(noise.total / last.total)) < 0.02
        if settled and worst < CONVERGED and abs(step) < max(0.05 * sigma, 1e-6):
            break
    return OneFriction(
        throws=throws,
        noise=noise,
        level=level,
        sigma=sigma,
        scatter=spread,
        information=information,
        pull=pull,
    )


def uniform_posterior(
    information: Floats, pull: Floats, *, scatter: bool
) -> tuple[float, float, float]:
    """One ln μ for all throws, the scatter between throws integrated out.

    Parameters
    ----------
    information, pull : (throws,) of each throw for its own ln μ, release projected out
    scatter : whether throws may differ; needs three of them to be seen at all

    Returns
    -------
    ln μ, its standard error, and the expected scatter
    """
    own = pull / information
    variance = 1.0 / information
    if not scatter or len(own) < 3:
        weight = 1.0 / variance
        return float((weight @ own) / weight.sum()), float(weight.sum() ** -0.5), 0.0
    grid = np.concatenate([[0.0], np.geomspace(1e-5, 0.2, 80)])
    means, spreads, scores = (np.empty(len(grid)) for _ in range(3))
    for k, spread in enumerate(grid):
        weight = 1.0 / (variance + spread**2)
        means[k] = (weight @ own) / weight.sum()
        spreads[k] = 1.0 / weight.sum()
        scores[k] = (
            0.5 * np.log(weight).sum()
            - 0.5 * np.log(weight.sum())
            - 0.5 * float(weight @ (own - means[k]) ** 2)
            - np.log1p((spread / USUAL_SCATTER) ** 2)
        )
    width = np.gradient(grid)
    share = np.exp(scores - scores.max()) * width
    share /= share.sum()
    mean = float(share @ means)
    total = float(share @ (spreads + (means - mean) ** 2))
    return mean, float(np.sqrt(total)), float(share @ grid)
