"""Estimated ice with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from curling_env.analysis.ice_remarks import (
    assumption_remark,
    believed_effects,
    missing_effect_remarks,
)
from curling_env.ice import Ice
from curling_env.physics.state import State
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.discovery.discover import Discovery
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.noise import CoordinateNoise
from friction_estimation.discovery.verdict import GATES_SHOW, blind_spots
from friction_estimation.estimation.camera_bias import CameraBias
from friction_estimation.tracks.free_slide import FreeSlide

Method = Literal["trajectory", "paper"]

SPINS_BY_BENDS = (
    "No heading was measured: the direction of rotation is inferred from the bend of the path, "
    "and the rate of rotation is assumed."
)
_NORMAL_95 = 1.959964
"""Standard errors on either side of the mean that hold 95 % of a normal distribution."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Ice estimated from throws, with its uncertainty.

    Parameters
    ----------
    ice : the estimate; friction.sigma and friction.observed for each cell
    method : ``trajectory``, the joint fit of all throws, or ``paper``, differentiate and average
    uniform : whether one μ was asked for
    mu, sigma : level of μ over the cells that were crossed, and its standard error; not a number
        where rounding has lost it
    slides : free slides that were used
    skipped : reasons why other throws were not used
    fit : the fit to the tracks as they are; None for the paper's method
    camera_bias : result of the search for a bias of the camera; None without a search
    discovery : the search for effects that throws prove; None where none were sought
    """

    ice: Ice
    method: Method
    uniform: bool
    mu: float
    sigma: float
    slides: tuple[FreeSlide, ...]
    skipped: tuple[str, ...] = ()
    fit: SessionFit | None = None
    camera_bias: CameraBias | None = None
    discovery: Discovery | None = None

    @property
    def throws(self) -> int:
        """Number of throws that were used: stones that hit each other have several slides."""
        return len({slide.track.throw for slide in self.slides})

    @property
    def tracks(self) -> list[Trajectory]:
        """The tracks of the slides, each once."""
        return list({id(slide.track): slide.track for slide in self.slides}.values())

    @property
    def scatter(self) -> float:
        """Standard deviation of ln μ from throw to throw."""
        return 0.0 if self.fit is None else self.fit.model.spread

    @property
    def noise(self) -> CoordinateNoise | None:
        """Noise of a measured coordinate; None for the paper's method."""
        return None if self.fit is None else self.fit.noise.coordinate

    @property
    def interval(self) -> tuple[float, float]:
        """Interval that holds the level of μ with 95 % probability."""
        if self.method == "paper":
            return self.mu - _NORMAL_95 * self.sigma, self.mu + _NORMAL_95 * self.sigma
        factor = float(np.exp(_NORMAL_95 * self.sigma / self.mu))
        return self.mu / factor, self.mu * factor

    @property
    def travel_residuals(self) -> list[tuple[Floats, Floats]]:
        """For each throw the times of its fitted rows [s] and the residuals along its travel
        [m].
        """
        if self.fit is None:
            return []
        session = self.fit.session
        out: list[tuple[Floats, Floats]] = []
        for i in range(len(session)):
            rows = session.rows(i)
            velocity = self.fit.predicted[rows, State.VX : State.VY + 1]
            travel = velocity / np.maximum(np.hypot(*velocity.T), 1e-6)[:, None]
            along = (self.fit.residuals[rows, :2] * travel).sum(axis=1)
            out.append((session.times[rows], along))
        return out

    @property
    def resolved(self) -> float:
        """Number of independent numbers that the data determine in the map."""
        field = None if self.fit is None else self.fit.model.map_field
        return 1.0 if field is None else float(((field.values / field.amplitude) ** 2).sum())

    @property
    def resolution(self) -> float | None:
        """Side of the patch of crossed ice for which the data determine one number [m].

        None without a map.
        """
        if self.fit is None or self.fit.model.map_field is None:
            return None
        crossed = int(self.ice.friction.observed.sum()) * self.ice.sheet.cell_size**2
        return float(np.sqrt(crossed / max(self.resolved, 1.0)))

    @property
    def remarks(self) -> list[str]:
        """Remarks on effects: lacking in the ice, assumed, or not shown by the session."""
        found = missing_effect_remarks(self.ice)
        found += [assumption_remark(name) for name in believed_effects(self.ice)]
        remarks = [f"{words[0].upper()}{words[1:]}." for words in found]
        if self.fit is not None and self.fit.session.gates is not None:
            remarks.append(GATES_SHOW)
        if self.discovery is not None:
            remarks += blind_spots(self.discovery, no_heading=SPINS_BY_BENDS)
        return remarks

    def summary(self) -> dict[str, Any]:
        """Estimate in numbers, for JSON; an error lost to rounding is null."""
        low, high = self.interval
        is_known = bool(np.isfinite(self.sigma))
        document: dict[str, Any] = {
            "mu": self.mu,
            "sigma": self.sigma if is_known else None,
            "low": low if is_known else None,
            "high": high if is_known else None,
            "throws": self.throws,
            "samples": sum(len(slide.rows) for slide in self.slides),
            "method": self.method,
        }
        if self.noise is not None:
            document["scatter"] = self.scatter
            document["noise_m"] = {
                "white": self.noise.white,
                "slow": self.noise.slow,
                "slow_time_s": self.noise.time,
            }
        if not self.uniform:
            document["map"] = self._map()
        if self.camera_bias is not None:
            document["camera_bias"] = self.camera_bias.summary()
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
        document["each"] = [self._throw(slide) for slide in self.slides]
        if self.skipped:
            document["skipped"] = list(self.skipped)
        return document

    def _map(self) -> dict[str, Any]:
        """Map in numbers, with the hyperparameters of its prior."""
        friction = self.ice.friction
        seen = friction.observed
        found: dict[str, Any] = {
            "observed_cells": int(seen.sum()),
            "cells": int(seen.size),
            "mu_keenest": float(friction.mu[seen].min()),
            "mu_heaviest": float(friction.mu[seen].max()),
            "sigma_median": float(np.median(friction.sigma[seen])),
        }
        field = None if self.fit is None else self.fit.model.map_field
        if field is not None:
            found |= {
                "resolution_m": self.resolution,
                "spread": field.amplitude,
                "length_m": field.length,
                "smoothness": field.smoothness if np.isfinite(field.smoothness) else "gaussian",
            }
        return found

    def _throw(self, slide: FreeSlide) -> dict[str, Any]:
        """One throw in numbers."""
        entry: dict[str, Any] = {
            "throw": slide.track.throw,
            "released_at_s": slide.released_at,
            "seconds": slide.duration,
            "rests": slide.rests,
            "wild_rows": slide.wild,
        }
        place = self.place(slide)
        if self.fit is not None and place is not None:
            session, state = self.fit.session, self.fit.states[place]
            off = self.fit.residuals[session.rows(place), :2]
            entry["speed"] = float(np.hypot(state[State.VX], state[State.VY]))
            entry["mu_factor"] = float(np.exp(self.fit.ln_factors[place]))
            entry["rms_m"] = float(np.sqrt(np.nanmean(off**2)))
        return entry

    def place(self, slide: FreeSlide) -> int | None:
        """Return the index of a free slide's throw in the fit; None if it is not among them."""
        if self.fit is None:
            return None
        session, track = self.fit.session, slide.track
        same = (session.throws == track.throw) & (session.stones == track.stone)
        # Discovery may begin a slide at the hog line, before a push seems to end, but not earlier
        # than the contact before it.
        first, last = slide.stretch
        since = session.clocks - track.clock
        within = (since >= track.t[first] - 1e-6) & (since <= track.t[last - 1])
        places = np.flatnonzero(same & within)
        return int(places[0]) if len(places) else None
