"""Focal length from the stone, if the paint on the ice does not determine it.

For a camera that looks straight down, a longer lens farther away shows the same ice. A body of
known height looks different, though: the nearer the camera, the more its top appears shifted
outwards from its foot, especially towards the edge of the picture. Only the correct camera height
fits the stone all along its path. The weak information of the paint on the height is included.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.interpolate import PchipInterpolator

from friction_estimation.appearance import (
    Appearance,
    Crop,
    StoneModel,
    adapt_appearance,
    as_reversible,
    learn_appearance,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.refined import RefinedCamera, log_height_prior
from friction_estimation.camera.tuning import CAMERA_HEIGHT_PRIOR, CAMERA_HEIGHTS
from friction_estimation.tracking import tuning


@dataclass(frozen=True, kw_only=True, eq=False)
class _Trial:
    """Tried height.

    Parameters
    ----------
    lean : 1 / height [1/m]
    cost : misfit to the stones' pictures, to the paint and to what cameras and stones are like
        [squared standard errors]
    seen : pictures and look of every stone
    """

    lean: float
    cost: float
    seen: tuple[tuple[Sequence[Crop], Appearance], ...]


class _Heights:
    """Search over heights in sequence: each appearance starts from that of the previous height.

    Independently fitted appearances are one of several that fit nearly as well, and their misfits
    scatter more than those of different heights.
    """

    def __init__(
        self,
        refined: RefinedCamera,
        refine_at_focal: Callable[[float], RefinedCamera | None],
        crops_of: Callable[[Camera], Sequence[Sequence[Crop]]],
        model: StoneModel,
        *,
        alike: bool = False,
    ) -> None:
        self._alike = alike
        self._refined, self._refine_at_focal = refined, refine_at_focal
        self._crops_of, self._model = crops_of, model

    def change(self, lean: float) -> float:
        """Return the change of the log focal length for a height of the camera."""
        return float(np.log(1 / (lean * self._refined.camera.position[2])))

    def seen_from(self, lean: float) -> tuple[RefinedCamera, Sequence[Sequence[Crop]]] | None:
        """Return the camera at a height, and the stones' pictures; None if the paint contradicts
        it.
        """
        found = self._refine_at_focal(self.change(lean))
        stones = [] if found is None else self._crops_of(found.camera)
        return None if found is None or not stones or not all(stones) else (found, stones)

    def first(self, lean: float, noise: float) -> _Trial | None:
        """Try a height with independently fitted appearances; see `learn_appearance` for
        `noise`.
        """
        seen = self.seen_from(lean)
        if seen is None:
            return None
        looks = [
            learn_appearance(c, self._model, noise, trimmed=False, try_others=False)
            for c in seen[1]
        ]
        pairs = tuple(zip(seen[1], looks, strict=True))
        return self.beside(_Trial(lean=lean, cost=np.inf, seen=pairs), lean)

    def beside(self, known: _Trial, lean: float) -> _Trial | None:
        """Try another height, with appearances that start from those of a known one."""
        seen = self.seen_from(lean)
        if seen is None:
            return None
        found, stones = seen
        cost = log_height_prior(found.camera) + found.misfit - self._refined.misfit
        pairs: list[tuple[Sequence[Crop], Appearance]] = []
        for crops, (before, look) in zip(stones, known.seen, strict=True):
            headings = {crop.t: crop.pose[2] for crop in before}
            for crop in crops:
                crop.pose[2] = headings.get(crop.t, crop.pose[2])
            look, misfit = adapt_appearance(crops, look, self._model, alike=self._alike)
            pairs.append((crops, look))
            cost += misfit
        return _Trial(lean=lean, cost=cost, seen=tuple(pairs))


def focal_from_stone(
    refined: RefinedCamera,
    refine_at_focal: Callable[[float], RefinedCamera | None],
    crops_of: Callable[[Camera], Sequence[Sequence[Crop]]],
    model: StoneModel,
    noise: float,
) -> RefinedCamera:
    """Return the camera whose height fits the stones' pictures all along their paths.

    Parameters
    ----------
    refined : a camera whose focal length the paint leaves open
    refine_at_focal : refits the camera's pose and lens to the paint at a changed log focal length
    crops_of : gives the pictures of every stone as a camera places them; always the same pixels
    model, noise : see `learn_appearance`
    """
    heights = _Heights(refined, refine_at_focal, crops_of, model)
    alike = _Heights(refined, refine_at_focal, crops_of, model, alike=True)
    # The shift of the top is proportional to 1 / height, so heights are tried in even steps of
    # that.
    lowest, highest = 1 / np.array(CAMERA_HEIGHTS)[::-1]
    step = (highest - lowest) / (tuning.COARSE_HEIGHTS - 1)
    start = heights.first(1 / CAMERA_HEIGHT_PRIOR[0], noise)
    if start is None:
        return refined
    trials = {start.lean: start}
    for direction in (1.0, -1.0):
        at: _Trial | None = start
        while at is not None and lowest < at.lean + direction * step < highest:
            at = heights.beside(at, at.lean + direction * step)
            if at is not None:
                trials[at.lean] = at
                least = min(trial.cost for trial in trials.values())
                at = at if at.cost < least + 10 * tuning.UNLIKELY_HEIGHT else None
    _spread_best(trials, heights)
    for _ in range(tuning.HEIGHT_PASSES):
        best = min(trials.values(), key=lambda trial: trial.cost)
        leans = [best.lean + part * step for part in tuning.FINE_HEIGHT_STEPS]
        tried = np.array(list(trials))
        new = [k for k in leans if np.abs(tried - k).min() > tuning.SAME_HEIGHT_STEP * step]
        for lean in new:
            fine = heights.beside(best, lean)
            if fine is not None:
                trials[lean] = fine
        _spread_best(trials, heights)
        if min(trials.values(), key=lambda trial: trial.cost) is best:
            break
    found = [(k.lean, k.cost) for k in trials.values()]
    others = _reversible_costs(trials, alike)
    log_height, sigma = likely_height(
        [(lean, _cost_of_either_kind(c, others.get(lean))) for lean, c in found]
    )
    change = heights.change(float(np.exp(-log_height)))
    solved = refine_at_focal(change)
    if solved is None:
        return refined
    one_sigma = max(sigma, tuning.MIN_LOG_HEIGHT_SIGMA)
    return replace(solved, farther=_camera(refine_at_focal(change + one_sigma)))


def _reversible_costs(trials: dict[float, _Trial], heights: _Heights) -> dict[float, float]:
    """Return the costs of likely heights for reversible stones."""
    best = min(trials.values(), key=lambda trial: trial.cost)
    seen = tuple((crops, as_reversible(look)) for crops, look in best.seen)
    start = heights.beside(replace(best, seen=seen), best.lean)
    if start is None:
        return {}
    order, found = sorted(trials), {start.lean: start}
    first = order.index(best.lean)
    for way in (order[first:], order[first::-1]):
        for known, lean in pairwise(way):
            at = heights.beside(found[known], lean)
            if at is None or at.cost > start.cost + tuning.UNLIKELY_HEIGHT:
                break
            found[lean] = at
    _spread_best(found, heights)
    return {lean: trial.cost for lean, trial in found.items()}


def _cost_of_either_kind(cost: float, other: float | None) -> float:
    """Return the cost of a height for stones of either kind."""
    return cost if other is None else -2 * float(np.logaddexp(-cost / 2, -other / 2))


def _spread_best(trials: dict[float, _Trial], heights: _Heights) -> None:
    """Try heights again, in place, with better appearances of neighbouring heights.

    A fit ends in one of several local minima; that of the best height serves the others.
    """
    order, best = sorted(trials), None
    for _ in range(tuning.HEIGHT_PASSES):
        now = min(trials.values(), key=lambda trial: trial.cost)
        if best is not None and now.cost > best.cost - 1:
            return
        best = now
        first = order.index(best.lean)
        for way in (order[first:], order[first::-1]):
            for known, lean in pairwise(way):
                if trials[known].cost > best.cost + tuning.UNLIKELY_HEIGHT:
                    break
                found = heights.beside(trials[known], lean)
                if found is not None and found.cost < trials[lean].cost:
                    trials[lean] = found


def _camera(found: RefinedCamera | None) -> Camera | None:
    return None if found is None else found.camera


def likely_height(seen: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return the logarithm of the height from the misfits, and its standard error.

    Parameters
    ----------
    seen : 1 / height [1/m], and the misfit there [squared standard errors]
    """
    lean, cost = np.array(sorted(seen)).T
    if len(lean) < 2:
        return float(-np.log(lean[0])), 1.0
    log_height = np.linspace(-np.log(lean[-1]), -np.log(lean[0]), 400)
    misfit = PchipInterpolator(lean, cost)(np.exp(-log_height))
    weight = np.exp(-0.5 * (misfit - misfit.min()))
    weight /= weight.sum()
    mean = float(weight @ log_height)
    return mean, float(np.sqrt(weight @ (log_height - mean) ** 2))
