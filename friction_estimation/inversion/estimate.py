"""From measured paths to the ice they ran on.

`estimate_ice` is the way in. Behind it: the course a stone followed (course), its ride along it
under the force law (ride), one throw as fitted and linearised (ridden, linear_throw), noise and
prior (noise, prior), one friction and the map (level_fit, map_fit), effects and a ripple of the
camera fitted with it (refit, ripple_fit, bias_search), what all frames err by together
(shared_error), all of these in order (trajectory_fit), the paper's own way (paper_method), and the
limit of all (bound).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import FrictionMap, Ice
from curling_env.trajectory import Trajectory
from friction_estimation.inversion.information import Knowledge
from friction_estimation.inversion.noise import Noise
from friction_estimation.inversion.paper_method import average_cells
from friction_estimation.inversion.prior import Belief
from friction_estimation.inversion.systematic.bias_search import BiasSearch
from friction_estimation.inversion.trajectory_fit import CameraBiasChoice, Ridden, fit_trajectories
from friction_estimation.tracks.kinematics import FreeSlide, free_slides

Method = Literal["trajectory", "paper"]
METHODS: tuple[Method, ...] = ("trajectory", "paper")

NORMAL_95 = 1.959964
"""Standard errors on either side that hold 95 % of a normal distribution."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """An ice estimated from throws, and how well it is known.

    Parameters
    ----------
    ice : the estimate; friction.sigma and friction.observed per cell
    method : by which it was found
    uniform : whether one μ was asked for
    mu, sigma : level of μ, over the cells that were crossed, and its standard error
    slides : the free slides that were used
    skipped : why other throws were not
    scatter : standard deviation of ln μ from throw to throw
    noise : of a measured distance along the path; None for the paper's way
    throws : as fitted; empty for the paper's way
    resolved : independent numbers that the data determine in the map
    knowledge : what all throws told, with the prior of the map; None for the paper's way
    bias_search : what came of looking for a ripple of the camera along the sheet, and the ripple
        that was fitted with the map; None where nobody looked
    """

    ice: Ice
    method: Method
    uniform: bool
    mu: float
    sigma: float
    slides: tuple[FreeSlide, ...]
    skipped: tuple[str, ...] = ()
    scatter: float = 0.0
    noise: Noise | None = None
    throws: tuple[Ridden, ...] = ()
    resolved: float = 1.0
    knowledge: Knowledge | None = None
    bias_search: BiasSearch | None = None

    @property
    def belief(self) -> Belief | None:
        """Prior of the map, its hyperparameters chosen by the data; None where there is none."""
        return None if self.knowledge is None else self.knowledge.belief

    @property
    def interval(self) -> tuple[float, float]:
        """Interval that holds the level of μ with 95 % probability."""
        if self.method == "paper":
            return self.mu - NORMAL_95 * self.sigma, self.mu + NORMAL_95 * self.sigma
        factor = float(np.exp(NORMAL_95 * self.sigma / self.mu))
        return self.mu / factor, self.mu * factor

    @property
    def resolution(self) -> float:
        """Side of the patch of crossed ice for which one number is determined [m]."""
        crossed = int(self.ice.friction.observed.sum()) * self.ice.sheet.cell_size**2
        return float(np.sqrt(crossed / max(self.resolved, 1.0)))

    def summary(self) -> dict[str, Any]:
        """The estimate in numbers, for JSON."""
        low, high = self.interval
        friction = self.ice.friction
        document: dict[str, Any] = {
            "mu": self.mu,
            "sigma": self.sigma,
            "low": low,
            "high": high,
            "throws": len(self.slides),
            "samples": sum(len(slide.rows) for slide in self.slides),
            "method": self.method,
        }
        if self.knowledge is not None and self.knowledge.throws > len(self.slides):
            document["throws_before"] = self.knowledge.throws - len(self.slides)
        if self.noise is not None:
            document["scatter"] = self.scatter
            document["noise_m"] = {
                "white": self.noise.white,
                "slow": self.noise.slow,
                "slow_time_s": self.noise.time if self.noise.slow > 0 else 0.0,
            }
        if not self.uniform:
            seen = friction.observed
            document["map"] = {
                "observed_cells": int(seen.sum()),
                "cells": int(seen.size),
                "mu_keenest": float(friction.mu[seen].min()),
                "mu_heaviest": float(friction.mu[seen].max()),
                "sigma_median": float(np.median(friction.sigma[seen])),
            }
        if self.belief is not None:
            smoothness = self.belief.smoothness
            document["map"] |= {
                "resolution_m": self.resolution,
                "spread": self.belief.spread,
                "length_m": self.belief.length,
                "smoothness": smoothness if np.isfinite(smoothness) else "gaussian",
            }
        if self.bias_search is not None:
            document["camera_bias"] = self.bias_search.summary()
        if self.ice.effects:
            document["effects"] = [
                {"name": e.name, "parameters": dict(e.parameters), "sigma": dict(e.sigma)}
                for e in self.ice.effects
            ]
        document["each"] = self._each()
        if self.skipped:
            document["skipped"] = list(self.skipped)
        return document

    def _each(self) -> list[dict[str, Any]]:
        each: list[dict[str, Any]] = []
        for k, slide in enumerate(self.slides):
            entry: dict[str, Any] = {
                "throw": slide.track.throw,
                "released_at_s": slide.released_at,
                "seconds": slide.duration,
                "rests": slide.rests,
                "wild_rows": slide.wild,
            }
            if self.throws:
                fitted = self.throws[k]
                entry["wild_rows"] += int((~fitted.keep).sum())
                entry["speed"] = fitted.speed
                entry["mu_factor"] = float(np.exp(fitted.offset))
                entry["rms_m"] = float(np.sqrt((fitted.left[fitted.keep] ** 2).mean()))
            each.append(entry)
        return each


def _silent(_what: str, _part: float) -> None:
    pass


def estimate_ice(
    tracks: Sequence[Trajectory],
    *,
    start: Ice | None = None,
    method: Method = "trajectory",
    uniform: bool = False,
    prior: FrictionMap | None = None,
    update: Knowledge | None = None,
    refit: bool = False,
    camera_bias: CameraBiasChoice = "auto",
    progress: Callable[[str, float], None] = _silent,
) -> Estimate:
    """Estimate the friction of an ice from the tracks of throws on it.

    Parameters
    ----------
    tracks : of one session, in order of play; lead-in, rest and wild rows are found and left out
    start : sheet, stone and effects that stay in the law, and a first guess of the friction; the
        paper's sheet and no effect by default
    method : ``trajectory``, the joint fit, or ``paper``, differentiate and average
    uniform : whether one μ for the sheet is wanted instead of a map
    prior : an earlier map of the sheet, yesterday's: its pattern holds within its sigma and what
        the throws show to have changed since
    update : what the throws told from which `start` was estimated; these are added to them
    refit : whether the strengths of the start's effects that act along the travel (a friction that
        follows the speed, air drag, a fall of the ice along the sheet) are fitted with the map
    camera_bias : whether a ripple of the camera along the sheet is fitted with a map: ``auto``, if
        the throws clearly show one; ``on``, if they could show one; ``off``
    progress : called with what is being done and the part of it that is done

    Raises
    ------
    TrackTooShortError : no throw with a free slide long enough
    InputError : an unknown method, or a prior or an update that does not go with the rest
    """
    if method not in METHODS:
        raise InputError(f"method must be one of {', '.join(METHODS)}, got {method!r}")
    start = Ice.uniform(0.0082) if start is None else start
    if update is not None or prior is not None:
        _check_earlier(start, method, uniform, prior, update)
    if refit:
        _check_refit(start, method, uniform, update)
    if camera_bias == "on" and (method != "trajectory" or uniform):
        raise InputError("a ripple of the camera is fitted with a map, by the trajectory method")
    slides, skipped = free_slides(list(tracks))
    if method == "paper":
        averaged = average_cells(slides, start, uniform=uniform)
        return Estimate(
            ice=averaged.ice,
            method=method,
            uniform=uniform,
            mu=averaged.mu,
            sigma=averaged.sigma,
            slides=tuple(slides),
            skipped=tuple(skipped),
        )
    fit = fit_trajectories(
        slides, start, uniform=uniform, prior=prior, before=update, refit=refit,
        camera_bias=camera_bias, progress=progress,
    )  # fmt: skip
    return Estimate(
        ice=fit.ice,
        method=method,
        uniform=uniform,
        mu=fit.mu,
        sigma=fit.sigma,
        slides=tuple(slides),
        skipped=tuple(skipped),
        scatter=fit.scatter,
        noise=fit.noise,
        throws=fit.throws,
        resolved=fit.resolved,
        knowledge=fit.knowledge,
        bias_search=fit.bias_search,
    )


def _check_refit(start: Ice, method: Method, uniform: bool, update: Knowledge | None) -> None:
    if method != "trajectory" or uniform:
        raise InputError("effects are refitted together with a map, by the trajectory method")
    if update is not None:
        raise InputError("an update keeps the effects of the ice: they cannot be refitted with it")
    if not start.effects:
        raise InputError("there is no effect to refit: give an ice that has some as the start")


def _check_earlier(
    start: Ice, method: Method, uniform: bool, prior: FrictionMap | None, update: Knowledge | None
) -> None:
    if method != "trajectory":
        raise InputError("the paper's way knows neither a prior nor an update")
    if prior is not None:
        if update is not None:
            raise InputError("give an earlier ice as prior or to be updated, not both")
        if uniform:
            raise InputError("a prior is a map: it does not go with one number for the sheet")
        if prior.mu.shape != start.sheet.shape:
            raise InputError(f"the prior has {prior.mu.shape} cells, the sheet "
                             f"{start.sheet.shape}")  # fmt: skip
    if update is not None:
        if update.mu.shape != start.sheet.shape:
            raise InputError(f"the ice to be updated has {update.mu.shape} cells, the sheet "
                             f"{start.sheet.shape}")  # fmt: skip
        if uniform != update.uniform:
            kind = "one number" if update.uniform else "a map"
            raise InputError(f"the ice to be updated was estimated as {kind}, and stays so")
