"""One friction for the sheet: every throw's own ln μ, and what they have in common."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.typing import Floats, Progress
from friction_estimation.inversion.friction.information import StoredInformation
from friction_estimation.inversion.noise import Noise, estimate_noise
from friction_estimation.inversion.throw.fitted import (
    FittedThrow,
    kept_residuals,
    move_release,
    update_residual,
)
from friction_estimation.inversion.throw.forward import LawOnMap
from friction_estimation.inversion.throw.linearised import LinearThrow, linearise
from friction_estimation.inversion.tuning import (
    MAX_LOG_STEP,
    UNIFORM_ROUNDS,
    USUAL_SCATTER,
)


@dataclass(frozen=True, kw_only=True)
class UniformFit:
    """One μ for the sheet.

    Parameters
    ----------
    throws : throws of this session as fitted
    law : law on ice of the fitted friction
    noise : noise of a measured distance
    level, sigma : ln μ and its standard error
    scatter : standard deviation of ln μ from throw to throw
    information, vector : (throws,) information on each throw's own ln μ, and the same times its
        estimate; throws of earlier sessions come first
    """

    throws: list[FittedThrow]
    law: LawOnMap
    noise: Noise
    level: float
    sigma: float
    scatter: float
    information: Floats
    vector: Floats


def fit_uniform(
    throws: list[FittedThrow],
    law: LawOnMap,
    level: float,
    scatter: bool,
    earlier: StoredInformation | None,
    progress: Progress,
) -> UniformFit:
    """Fit one μ for the sheet, together with the throws that were fitted before.

    Parameters
    ----------
    throws : throws with first values
    law : force law
    level : first guess of ln μ
    scatter : whether each throw may have a μ of its own about the ice's
    earlier : information of throws that were fitted before
    progress : called after every round
    """
    throws = list(throws)
    # While the fit may be off by metres, its residuals say nothing about the noise.
    noise = Noise(white=float(np.median([throw.slide.noise for throw in throws])))
    gate = Noise(white=noise.white, slow=1.0, time=5.0)
    old = 0 if earlier is None else earlier.throws
    information, vector = np.empty(old + len(throws)), np.empty(old + len(throws))
    if earlier is not None:
        information[:old], vector[:old] = np.diag(earlier.matrix), earlier.vector
    sigma, spread = 1.0, 0.0
    for number in range(UNIFORM_ROUNDS):
        law = law.with_level(level)
        linear: list[LinearThrow] = []
        for k, throw in enumerate(throws):
            throws[k], motion = update_residual(throw, law, gate)
            linear.append(linearise(throws[k], motion, law, noise))
            own = linear[k].friction.sum(axis=1)
            information[old + k] = own @ own
            vector[old + k] = own @ linear[k].residual + own @ own * (level + throw.offset)
        found, sigma, spread = uniform_posterior(information, vector, scatter=scatter)
        step = float(np.clip(found - level, -MAX_LOG_STEP, MAX_LOG_STEP))
        level += step
        largest = 0.0
        for k, throw in enumerate(throws):
            of_throw = information[old + k]
            shrink = spread**2 / (spread**2 + 1.0 / of_throw)
            offset = shrink * (vector[old + k] / of_throw - found)
            offset = float(np.clip(offset, -MAX_LOG_STEP, MAX_LOG_STEP))
            change = np.full(len(linear[k].crossed), step + offset - throw.offset)
            largest = max(largest, abs(change[0]))
            throws[k] = move_release(throws[k], linear[k].release_step(change), offset)
        progress("one friction for the sheet", (number + 1) / UNIFORM_ROUNDS)
        if abs(step) > 0.05:
            continue
        law = law.with_level(level)
        throws = [update_residual(throw, law, gate)[0] for throw in throws]
        last = noise
        noise = gate = estimate_noise(kept_residuals(throws), longest=5.0)
        settled = abs(np.log(noise.total / last.total)) < 0.02
        if settled and largest < 2e-4 and abs(step) < max(0.05 * sigma, 1e-6):
            break
    return UniformFit(
        throws=throws,
        law=law,
        noise=noise,
        level=level,
        sigma=sigma,
        scatter=spread,
        information=information,
        vector=vector,
    )


def uniform_posterior(
    information: Floats, vector: Floats, *, scatter: bool
) -> tuple[float, float, float]:
    """One ln μ for all throws, with the scatter between throws integrated out.

    Parameters
    ----------
    information, vector : (throws,) information on each throw's own ln μ, and the same times its
        estimate, release projected out
    scatter : whether throws may differ; it takes three of them to see that

    Returns
    -------
    ln μ, its standard error, and the expected scatter
    """
    own = vector / information
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
