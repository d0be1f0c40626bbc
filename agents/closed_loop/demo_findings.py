"""The results of the demo, as numbers and in plain words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from agents.planning import Plan
from curling_env.ice import Ice
from curling_env.sheet import TEE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Flags, Floats
from curling_env.units import Units, length, miss
from friction_estimation.reports.keen_and_heavy import Zone, zones


@dataclass(frozen=True, kw_only=True)
class ComparedDraw:
    """Draw planned on two ices and thrown on the hidden ice both times.

    Parameters
    ----------
    target : (2,) intended place of rest, sheet frame [m]
    rest : (2,) place of rest, planned on the better known ice [m]
    other : (2,) place of rest, planned on the other ice [m]
    """

    target: Floats
    rest: Floats
    other: Floats

    @property
    def miss(self) -> float:
        """Distance of `rest` from the target [m]."""
        return float(np.hypot(*(self.rest - self.target)))

    @property
    def other_miss(self) -> float:
        """Distance of `other` from the target [m]."""
        return float(np.hypot(*(self.other - self.target)))


@dataclass(frozen=True, kw_only=True)
class Findings:
    """Results on the page; all of them are computed in the same run.

    Parameters
    ----------
    true_ice, estimated_ice, average_ice : the hidden ice, its estimate, and uniform ice fitted to
        the same tracks
    tracks : measured tracks in order of play
    track_errors : (n,) RMS distance of each track from the true path [m]
    plan, average_plan : the tested draw, planned on the estimated and on the average ice
    on_estimated : (2,) place of rest of the tested draw on the estimated ice [m]
    tested : the tested draw on the hidden ice, planned on the estimated and on the average ice
    draws : the same for draws to other places in the house
    missing : a draw planned with and without the effect that the model lacked
    named : names of the discovered effects
    film_frames, film_size : number of frames in all films, and their size [px]
    seconds : duration of the demo [s]
    units : units of lengths in sentences and pictures
    """

    true_ice: Ice
    estimated_ice: Ice
    average_ice: Ice
    tracks: Sequence[Trajectory]
    track_errors: Floats
    plan: Plan
    average_plan: Plan
    on_estimated: Floats
    tested: ComparedDraw
    draws: list[ComparedDraw]
    missing: ComparedDraw
    named: list[str]
    film_frames: int
    film_size: tuple[int, int]
    seconds: float
    units: Units = Units.METRES

    @property
    def observed(self) -> Flags:
        """Return the cells that a stone crossed, (rows, columns)."""
        return self.estimated_ice.friction.observed

    def difference(self, ice: Ice) -> Floats:
        """Return the friction of an ice over its mean in the observed cells, minus one, (rows,
        columns).
        """
        mu = ice.friction.mu
        return mu / mu[self.observed].mean() - 1.0

    def map_error(self, ice: Ice) -> float:
        """Return the relative RMS error of an ice's μ in the observed cells."""
        ratio = ice.friction.mu / self.true_ice.friction.mu
        return float(np.sqrt(np.mean((ratio - 1.0)[self.observed] ** 2)))

    @cached_property
    def areas(self) -> list[Zone]:
        """Heavy and keen parts of the estimated sheet, the most different first."""
        found = [zone for zone in zones(self.estimated_ice) if zone.stands_out]
        return sorted(found, key=lambda zone: -abs(zone.relative or 0.0))

    def true_difference(self, area: Zone) -> float:
        """Return the mean relative difference of the hidden ice where stones ran in a part."""
        sheet = self.true_ice.sheet
        x, y = np.meshgrid(sheet.x_centres, sheet.y_centres)
        inside = (area.x[0] <= x) & (x < area.x[1]) & (area.y[0] <= y) & (y < area.y[1])
        return float(self.difference(self.true_ice)[inside & self.observed].mean())

    @property
    def miss_on_estimated(self) -> float:
        """Miss of the tested draw on the ice that it was planned on [m]."""
        return float(np.hypot(*(self.on_estimated - self.plan.target)))

    @property
    def mean_miss(self) -> float:
        """Mean miss of the draws planned on the estimated map [m]."""
        return float(np.mean([draw.miss for draw in self.draws]))

    @property
    def mean_other_miss(self) -> float:
        """Mean miss of the draws planned on the average ice [m]."""
        return float(np.mean([draw.other_miss for draw in self.draws]))

    def in_units(self, metres: float) -> str:
        """Format a miss for people."""
        return miss(metres, self.units)

    def headline(self) -> str:
        """Return the result in one sentence."""
        if self.mean_miss < self.mean_other_miss:
            return (
                f"Draws planned on the estimated ice stop {self.in_units(self.mean_miss)} from "
                "their targets; planned on its average friction only, "
                f"{self.in_units(self.mean_other_miss)}."
            )
        return (
            "This time the map did not help: draws planned on it stop "
            f"{self.in_units(self.mean_miss)} "
            f"from their targets, those planned on the average friction "
            f"{self.in_units(self.mean_other_miss)}."
        )

    def area_sentences(self) -> list[str]:
        """Describe each heavy or keen part, and the true difference of its friction."""
        sentences = [
            f"{area.name}: {area.words} (± {100 * area.sigma:.1f}), in truth "
            f"{100 * self.true_difference(area):+.1f} %"
            for area in self.areas
        ]
        return sentences or ["no part that differs clearly from the rest"]

    def draw_sentences(self) -> list[str]:
        """Describe the tested draw: the throw, and its place of rest."""
        x, y = self.plan.target
        place = "the button" if np.hypot(x, y - TEE_Y) < 0.02 else self._place(x, y)
        return [
            f"A draw to {place}: {self.plan.best.description.call_in(self.units)}.",
            f"On the estimated ice it stops {self.in_units(self.miss_on_estimated)} from its "
            "target; "
            f"on the hidden ice {self.in_units(self.tested.miss)}. Planned on average ice it would "
            f"have missed by {self.in_units(self.tested.other_miss)}.",
        ]

    def _place(self, x: float, y: float) -> str:
        if self.units is Units.METRES:
            return f"({x:.2f}, {y:.2f}) m"
        past = f"{length(y - TEE_Y, self.units)} {'past' if y > TEE_Y else 'short of'} the tee"
        return f"{length(x, self.units)} {'right' if x > 0 else 'left'}, {past}"

    def missing_sentence(self) -> str:
        """Describe the discovery of the missing effect, and its gain."""
        named = " and ".join(self.named) or "nothing"
        return (
            f"The same films, read with a model that has no curl: a draw planned on it misses "
            f"by {self.in_units(self.missing.other_miss)}; discovery names {named}; planned again, "
            f"the draw misses by {self.in_units(self.missing.miss)}."
        )

    def sentences(self) -> list[str]:
        """Return the complete result, for the terminal."""
        return [
            f"Filmed {len(self.tracks)} practice throws, {self.film_frames} frames of "
            f"{self.film_size[0]} × {self.film_size[1]}; the stone was tracked to "
            f"{self.in_units(float(np.median(self.track_errors)))} (median over throws).",
            "The ice according to the film:",
            *(f"  {sentence}" for sentence in self.area_sentences()),
            f"Over the {int(self.observed.sum())} cells that stones crossed, the map is within "
            f"{100 * self.map_error(self.estimated_ice):.1f} % of the hidden ice; one average "
            f"number for all of them, within {100 * self.map_error(self.average_ice):.1f} %.",
            *self.draw_sentences(),
            self.missing_sentence(),
            f"Over {len(self.draws)} draws across the house: {self.headline()}",
        ]

    def as_dict(self) -> dict[str, object]:
        """Return the numbers, for programs."""
        return {
            "throws": len(self.tracks),
            "film_frames": self.film_frames,
            "track_rms_m": [float(value) for value in self.track_errors],
            "map_error": self.map_error(self.estimated_ice),
            "average_error": self.map_error(self.average_ice),
            "hidden_effect": {
                "named": self.named,
                "miss_before_m": self.missing.other_miss,
                "miss_after_m": self.missing.miss,
            },
            "areas": [
                {
                    "kind": area.kind,
                    "place": area.name,
                    "found": area.relative,
                    "sigma": area.sigma,
                    "true": self.true_difference(area),
                }
                for area in self.areas
            ],
            "plan": self.plan.as_dict(),
            "miss_on_estimated_ice_m": self.miss_on_estimated,
            "miss_on_true_ice_m": self.tested.miss,
            "miss_planned_on_average_ice_m": self.tested.other_miss,
            "draws": len(self.draws),
            "mean_miss_m": self.mean_miss,
            "mean_miss_planned_on_average_ice_m": self.mean_other_miss,
            "seconds": round(self.seconds, 1),
            "headline": self.headline(),
        }
