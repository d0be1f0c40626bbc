"""What the demo found, in numbers and in plain words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.closed_loop.areas import Area, relative
from agents.closed_loop.missing_effect import Missing
from agents.planning import Plan
from curling_env.ice import Ice
from curling_env.sheet import TEE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats


@dataclass(frozen=True, kw_only=True)
class Draw:
    """One draw, planned on ice that somebody believes in and thrown on the hidden ice.

    Parameters
    ----------
    target : (2,) sheet frame [m]
    by_map, by_average : (2,) where it rested on the hidden ice, planned on the estimated map and
        on ice of its average friction [m]
    """

    target: Floats
    by_map: Floats
    by_average: Floats

    @property
    def miss_by_map(self) -> float:
        """Distance from the target [m]."""
        return float(np.hypot(*(self.by_map - self.target)))

    @property
    def miss_by_average(self) -> float:
        """Distance from the target [m]."""
        return float(np.hypot(*(self.by_average - self.target)))


@dataclass(frozen=True, kw_only=True)
class Findings:
    """Everything the page shows; all of it computed in this run.

    Parameters
    ----------
    true_ice, estimated_ice, average_ice : the hidden ice, its estimate, and uniform ice fitted to
        the same tracks
    tracks : measured, in order of play
    track_errors : (n,) RMS distance of each track from where its stone was [m]
    plan, average_plan : the tested draw, planned on the estimated and on the average ice
    on_estimated, on_true, average_on_true : (2,) where the tested draws rested [m]
    draws : more of them, to other places in the house
    areas : heavy and keen areas found
    missing : what another ice hid from its model, and what finding it gained
    film_frames, film_size : frames filmed in all, and the films' size [px]
    seconds : the demo took [s]
    """

    true_ice: Ice
    estimated_ice: Ice
    average_ice: Ice
    tracks: list[Trajectory]
    track_errors: Floats
    plan: Plan
    average_plan: Plan
    on_estimated: Floats
    on_true: Floats
    average_on_true: Floats
    draws: list[Draw]
    areas: list[Area]
    missing: Missing
    film_frames: int
    film_size: tuple[int, int]
    seconds: float

    @property
    def observed(self) -> NDArray[np.bool_]:
        """Cells that a stone crossed."""
        return self.estimated_ice.friction.observed

    @property
    def true_difference(self) -> Floats:
        """Hidden friction over its mean in the observed cells, less one."""
        return relative(self.true_ice.friction.mu, self.observed)

    @property
    def found_difference(self) -> Floats:
        """The same of the estimate."""
        return relative(self.estimated_ice.friction.mu, self.observed)

    @property
    def map_error(self) -> float:
        """RMS error of μ in the observed cells, relative."""
        mu, true = self.estimated_ice.friction.mu, self.true_ice.friction.mu
        return float(np.sqrt(np.mean((mu / true - 1.0)[self.observed] ** 2)))

    @property
    def average_error(self) -> float:
        """The same for ice of the average friction."""
        mu, true = self.average_ice.friction.mu, self.true_ice.friction.mu
        return float(np.sqrt(np.mean((mu / true - 1.0)[self.observed] ** 2)))

    @property
    def miss(self) -> float:
        """Of the tested draw on the hidden ice [m]."""
        return float(np.hypot(*(self.on_true - self.plan.target)))

    @property
    def average_miss(self) -> float:
        """The same for the plan on average ice [m]."""
        return float(np.hypot(*(self.average_on_true - self.plan.target)))

    @property
    def mean_miss(self) -> float:
        """Of all draws planned on the map [m]."""
        return float(np.mean([draw.miss_by_map for draw in self.draws]))

    @property
    def mean_average_miss(self) -> float:
        """Of all draws planned on average ice [m]."""
        return float(np.mean([draw.miss_by_average for draw in self.draws]))

    def area_sentences(self) -> list[str]:
        """Each area found: where, how much, and what the hidden ice has there."""
        sentences: list[str] = []
        for area in self.areas:
            true = float(self.true_difference[area.cells].mean())
            sentences.append(
                f"{area.kind} ice {area.place}: {_percent(area.difference)} friction "
                f"(± {100 * area.sigma:.1f}), in truth {_percent(true)}"
            )
        return sentences or ["no area that differs clearly from the rest"]

    def headline(self) -> str:
        """The result in one sentence."""
        if self.mean_miss < self.mean_average_miss:
            return (
                f"Draws planned on the ice read from film stop {_length(self.mean_miss)} from "
                f"where they were wanted; planned on its average friction alone, "
                f"{_length(self.mean_average_miss)}."
            )
        return (
            f"This time the map did not help: draws planned on it stop {_length(self.mean_miss)} "
            f"from where they were wanted, those planned on the average friction "
            f"{_length(self.mean_average_miss)}."
        )

    def sentences(self) -> list[str]:
        """All of it, for the terminal."""
        x, y = self.plan.target
        place = "the button" if np.hypot(x, y - TEE_Y) < 0.02 else f"({x:.2f}, {y:.2f}) m"
        return [
            f"Filmed {len(self.tracks)} practice throws, {self.film_frames} frames of "
            f"{self.film_size[0]} × {self.film_size[1]}; the stone was followed to "
            f"{1000 * float(np.median(self.track_errors)):.0f} mm (median over throws).",
            "What the film says of the ice:",
            *(f"  {sentence}" for sentence in self.area_sentences()),
            f"Over the {int(self.observed.sum())} cells the stones crossed the map is within "
            f"{100 * self.map_error:.1f} % of the hidden ice; one average number for all of them, "
            f"within {100 * self.average_error:.1f} %.",
            f"A draw to {place}: {self.plan.best.words.call}.",
            f"On the estimated ice it stops {_length(self._miss_on_estimated)} from its target; on "
            f"the hidden ice {_length(self.miss)}. Planned on average ice it would have missed by "
            f"{_length(self.average_miss)}.",
            self.missing.sentence(),
            f"Over {len(self.draws)} draws across the house: {self.headline()}",
        ]

    @property
    def _miss_on_estimated(self) -> float:
        return float(np.hypot(*(self.on_estimated - self.plan.target)))

    def as_dict(self) -> dict[str, object]:
        """The numbers, for programs."""
        return {
            "throws": len(self.tracks),
            "film_frames": self.film_frames,
            "track_rms_m": [float(value) for value in self.track_errors],
            "map_error": self.map_error,
            "average_error": self.average_error,
            "hidden_effect": {
                "named": self.missing.names,
                "miss_before_m": self.missing.miss_before,
                "miss_after_m": self.missing.miss_after,
            },
            "areas": [
                {
                    "kind": area.kind,
                    "place": area.place,
                    "found": area.difference,
                    "sigma": area.sigma,
                    "true": float(self.true_difference[area.cells].mean()),
                }
                for area in self.areas
            ],
            "plan": self.plan.as_dict(),
            "miss_on_estimated_ice_m": self._miss_on_estimated,
            "miss_on_true_ice_m": self.miss,
            "miss_planned_on_average_ice_m": self.average_miss,
            "draws": len(self.draws),
            "mean_miss_m": self.mean_miss,
            "mean_miss_planned_on_average_ice_m": self.mean_average_miss,
            "seconds": round(self.seconds, 1),
            "headline": self.headline(),
        }


def _percent(share: float) -> str:
    return f"{100 * share:+.1f} %"


def _length(metres: float) -> str:
    if metres < 0.01:
        return f"{1000 * metres:.0f} mm"
    return f"{100 * metres:.0f} cm" if metres < 1.0 else f"{metres:.2f} m"
