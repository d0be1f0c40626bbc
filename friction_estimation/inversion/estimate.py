"""From measured paths to the friction of the ice they ran on, its effects being known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import FrictionMap, Ice
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Progress, no_progress
from friction_estimation.inversion.friction.information import StoredInformation
from friction_estimation.inversion.friction.posterior import Hyperparameters
from friction_estimation.inversion.noise import Noise
from friction_estimation.inversion.paper_method import average_cells
from friction_estimation.inversion.systematic.camera_bias_evidence import CameraBiasSearch
from friction_estimation.inversion.throw.fitted import FittedThrow
from friction_estimation.inversion.trajectory_fit import CameraBiasChoice, fit_trajectories
from friction_estimation.tracks.free_slide import FreeSlide, free_slides

Method = Literal["trajectory", "paper"]
METHODS: tuple[Method, ...] = ("trajectory", "paper")

_NORMAL_95 = 1.959964
"""Standard errors on either side of the mean that hold 95 % of a normal distribution."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """An ice estimated from throws, and how well it is known.

    Parameters
    ----------
    ice : the estimate; friction.sigma and friction.observed for each cell
    method : method of the estimate
    uniform : whether one μ was asked for
    mu, sigma : level of μ over the cells that were crossed, and its standard error
    slides : free slides that were used
    skipped : reasons why other throws were not used
    scatter : standard deviation of ln μ from throw to throw
    noise : noise of a measured distance along the path; None for the paper's method
    throws : throws as fitted; empty for the paper's method
    resolved : number of independent numbers that the data determine in the map
    information : information of all throws so far, with the prior of the map; None for the paper's
        method
    bias_search : result of the search for a bias of the camera, and the bias that was fitted with
        the map; None without a search
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
    throws: tuple[FittedThrow, ...] = ()
    resolved: float = 1.0
    information: StoredInformation | None = None
    bias_search: CameraBiasSearch | None = None

    @property
    def hyperparameters(self) -> Hyperparameters | None:
        """Hyperparameters of the map's prior, chosen by the data; None without a map."""
        return None if self.information is None else self.information.hyperparameters

    @property
    def interval(self) -> tuple[float, float]:
        """Interval that holds the level of μ with 95 % probability."""
        if self.method == "paper":
            return self.mu - _NORMAL_95 * self.sigma, self.mu + _NORMAL_95 * self.sigma
        factor = float(np.exp(_NORMAL_95 * self.sigma / self.mu))
        return self.mu / factor, self.mu * factor

    @property
    def leftovers(self) -> list[tuple[Floats, Floats]]:
        """For each throw the times of its fitted rows [s] and what is left along its travel [m]."""
        return [(throw.t[throw.keep], throw.residual[throw.keep]) for throw in self.throws]

    @property
    def resolution(self) -> float:
        """Side of the patch of crossed ice for which the data determine one number [m]."""
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
        if self.information is not None and self.information.throws > len(self.slides):
            document["throws_before"] = self.information.throws - len(self.slides)
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
        if self.hyperparameters is not None:
            smoothness = self.hyperparameters.smoothness
            document["map"] |= {
                "resolution_m": self.resolution,
                "spread": self.hyperparameters.spread,
                "length_m": self.hyperparameters.length,
                "smoothness": smoothness if np.isfinite(smoothness) else "gaussian",
            }
        if self.bias_search is not None:
            document["camera_bias"] = self.bias_search.summary()
        if self.ice.effects:
            document["effects"] = [
                {
                    "name": e.name,
                    "parameters": dict(e.parameters),
                    "sigma": dict(e.sigma),
                    **({"believed": list(e.believed)} if e.believed else {}),
                }
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
                entry["rms_m"] = float(np.sqrt((fitted.residual[fitted.keep] ** 2).mean()))
            each.append(entry)
        return each


def estimate_friction(
    tracks: Sequence[Trajectory],
    *,
    start: Ice | None = None,
    method: Method = "trajectory",
    uniform: bool = False,
    prior: FrictionMap | None = None,
    update: StoredInformation | None = None,
    camera_bias: CameraBiasChoice = "auto",
    progress: Progress = no_progress,
) -> Estimate:
    """Estimate the friction of an ice from the tracks of throws on it.

    The defaults suit a session of which nothing is known: a map on the paper's sheet, without
    effects. The tracks may come straight from `curling_env.read_tracks` or from `track_film`.

    Parameters
    ----------
    tracks : tracks of one session, in order of play; lead-in, rest and wild rows are found and left
        out
    start : sheet, stone and effects that stay in the law, and a first guess of the friction; the
        paper's sheet without effects by default
    method : ``trajectory``, the joint fit of all throws, or ``paper``, differentiate and average
    uniform : whether one μ for the sheet is wanted instead of a map
    prior : an earlier map of the sheet, such as yesterday's; its pattern holds within its sigma and
        what the throws show to have changed since
    update : information of the throws from which `start` was estimated, to which these are added
    camera_bias : when to fit a smooth bias of the camera along the sheet with the map: ``auto``, if
        the throws clearly show one; ``on``, if they could show one; ``off``, never
    progress : called as the fit advances

    Raises
    ------
    TrackTooShortError : no throw has a free slide that is long enough
    InputError : an unknown method, or a prior or an update that does not go with the rest
    """
    if method not in METHODS:
        raise InputError(f"method must be one of {', '.join(METHODS)}, got {method!r}")
    start = Ice.uniform(0.0082) if start is None else start
    if update is not None or prior is not None:
        _check_earlier(start, method, uniform, prior, update)
    if camera_bias == "on" and (method != "trajectory" or uniform):
        raise InputError("a bias of the camera is fitted with a map, by the trajectory method")
    slides, skipped = free_slides(tracks)
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
        slides,
        start,
        uniform=uniform,
        prior=prior,
        earlier=update,
        camera_bias=camera_bias,
        progress=progress,
    )
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
        information=fit.information,
        bias_search=fit.bias_search,
    )


def _check_earlier(
    start: Ice,
    method: Method,
    uniform: bool,
    prior: FrictionMap | None,
    update: StoredInformation | None,
) -> None:
    if method != "trajectory":
        raise InputError("the paper's method knows neither a prior nor an update")
    shape = start.sheet.shape
    if prior is not None:
        if update is not None:
            raise InputError("give an earlier ice as prior or to be updated, not both")
        if uniform:
            raise InputError("a prior is a map: it does not go with one number for the sheet")
        if prior.mu.shape != shape:
            raise InputError(f"the prior has {prior.mu.shape} cells, the sheet {shape}")
    if update is not None:
        if update.mu.shape != shape:
            raise InputError(
                f"the ice to be updated has {update.mu.shape} cells, the sheet {shape}"
            )
        if uniform != update.uniform:
            kind = "one number" if update.uniform else "a map"
            raise InputError(f"the ice to be updated was estimated as {kind}, and stays so")
