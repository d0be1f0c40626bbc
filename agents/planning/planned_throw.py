"""Plan: the best throw for an objective, and the second choice."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

import numpy as np

from agents.planning.description import Description
from agents.planning.monte_carlo import Trials
from agents.planning.objective import Objective
from curling_env.analysis.ice_remarks import NO_CURL, UNKNOWN, assumption_remark
from curling_env.physics.slides import SlideEnd
from curling_env.sheet import HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import Delivery, Skill, Throw
from curling_env.typing import Flags, Floats
from curling_env.units import Units, short_length


@dataclass(frozen=True, kw_only=True)
class PlannedThrow:
    """Throw and its expected outcome.

    Parameters
    ----------
    throw : throw without execution error
    sweep : start and end of the sweeping, after the release [s]; None without sweeping
    rest : (2,) place of rest without error, sheet frame [m]
    stones : (k, 2) final positions of the other stones, NaN for one that left play [m]
    time : time from the release until all stones rest [s]
    miss_without_error : distance from the target without error [m]
    trials : trials by the player on ices sampled within the standard errors
    player_trials : trials by the player on the given ice
    ice_trials : trials without execution error on the sampled ices
    map_trials : the same with the standard errors of the map only
    chance_in_house : share of the trials that rest in the house
    description : the throw in a curler's words
    """

    throw: Throw
    sweep: tuple[float, float] | None
    rest: Floats
    stones: Floats
    time: float
    miss_without_error: float
    trials: Trials
    player_trials: Trials
    ice_trials: Trials
    map_trials: Trials
    chance_in_house: float
    description: Description

    @property
    def expected_miss(self) -> float:
        """Mean distance from the target [m]."""
        return self.trials.expected_miss

    def as_dict(self) -> dict[str, object]:
        """Return plain numbers, sheet frame, SI."""
        throw, trials = self.throw, self.trials
        return {
            "speed": throw.speed,
            "angle": throw.angle,
            "spin": throw.spin,
            "x": throw.x,
            "sweep": None
            if self.sweep is None
            else {"start_s": self.sweep[0], "end_s": min(self.sweep[1], self.time)},
            "expected_miss_m": self.expected_miss,
            "expected_worth": trials.expected_value,
            "chance_of_success": float(trials.success.mean()),
            "miss_without_error_m": self.miss_without_error,
            "rest": {"x": float(self.rest[0]), "y": float(self.rest[1])},
            "stones_after": [
                None if np.isnan(x) else {"x": float(x), "y": float(y)} for x, y in self.stones
            ],
            "time_s": self.time,
            "spread": {
                **_spread(trials),
                "chance_in_house": self.chance_in_house,
                "chance_touches_a_stone": trials.chance(SlideEnd.CONTACT),
                "chance_out_of_play": float((~trials.in_play).mean()),
            },
            "spread_of_the_hand": _spread(self.player_trials),
            "spread_of_the_ice": _spread(self.ice_trials),
            "spread_of_the_map": _spread(self.map_trials),
            "in_words": self.description.as_dict(),
        }


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Best throw for an objective, and the second choice.

    Parameters
    ----------
    objective : objective of the throw
    skill : player of the plan
    best : the throw with the largest expected value
    second : the best throw of another handle, weight or sweeping; None if there is no other
    ice_is_uncertain : true if the ice has standard errors, which the trials then include
    map_is_uncertain : true if its map has standard errors
    lacks_something : true if the ice is marked as lacking an effect that its tracks show
    lacks_curl : true if the ice was estimated without any effects
    believed : assumed, unmeasured effects that the throw depends on, with the names of those
        parameters
    """

    objective: Objective
    skill: Skill
    best: PlannedThrow
    second: PlannedThrow | None
    ice_is_uncertain: bool
    map_is_uncertain: bool
    lacks_something: bool
    lacks_curl: bool
    believed: Mapping[str, tuple[str, ...]]

    @property
    def target(self) -> Floats:
        """Intended end of the delivered stone, or its aim, (2,) sheet frame [m]."""
        return self.objective.target

    @property
    def direction(self) -> Direction:
        """The end played to."""
        return self.objective.direction

    @property
    def delivery(self) -> Delivery:
        """Start and maximum speed of throws."""
        return self.objective.delivery

    @property
    def stones(self) -> Floats:
        """Centres of the stones that lie on the sheet, (k, 2) [m]."""
        return self.objective.stones

    @property
    def own(self) -> Flags | None:
        """Ownership of each stone by the thrower's team, (k,); None if unknown."""
        return self.objective.own

    def expectation(self, planned: PlannedThrow, units: Units | None = None) -> str:
        """Describe the expected outcome of one of the throws; empty for an exact throw."""
        trials = planned.trials
        if trials.miss.size < 2:
            return ""
        if self.objective.name == "score":
            share = f"{100 * trials.success.mean():.0f} %"
            means = self.objective.success_means
            return f"expected points {trials.expected_value:+.1f}; in {share} of the trials {means}"
        parts: list[str] = []
        if self.objective.name != "rest":
            parts.append(
                f"{100 * trials.success.mean():.0f} % succeed ({self.objective.success_means})"
            )
        if self.objective.miss_means is not None:
            miss = short_length(trials.expected_miss, units)
            parts.append(f"expected miss {miss} ({self.objective.miss_means})")
        return "; ".join(parts)

    @property
    def remarks(self) -> list[str]:
        """Return remarks for the thrower on the target and the ice, in sentences."""
        return [
            *self._about_the_target(),
            *([UNKNOWN] if self.lacks_something else []),
            *([NO_CURL] if self.lacks_curl else []),
            *(assumption_remark(name) for name in self.believed),
        ]

    def _about_the_target(self) -> list[str]:
        x, y = self.target.tolist()
        if not self.objective.comes_to_rest or abs(y) >= HOG_LINE_Y:
            return []
        return [
            f"the target ({x:g}, {y:g}) m is mid-sheet, where no stone stays in play; targets "
            f"are in the sheet frame, whose origin is mid-sheet; the away tee is at (0, {TEE_Y:g})"
        ]

    def as_dict(self) -> dict[str, object]:
        """Return plain numbers, sheet frame, SI, as `curling plan` prints them."""
        return {
            **self.best.as_dict(),
            "task": self.objective.name,
            "miss_means": self.objective.miss_means,
            "success_means": self.objective.success_means,
            "target": {"x": float(self.target[0]), "y": float(self.target[1])},
            "direction": self.direction.name.lower(),
            "release_line_m": self.delivery.line_y,
            "skill": {
                "name": self.skill.name,
                "sigma_speed": self.skill.sigma_speed,
                "sigma_angle": self.skill.sigma_angle,
                "sigma_spin": self.skill.sigma_spin,
                **({"tails": self.skill.tails} if isfinite(self.skill.tails) else {}),
                **({"correlation": self.skill.correlation} if self.skill.correlation else {}),
            },
            "ice_is_uncertain": self.ice_is_uncertain,
            "map_is_uncertain": self.map_is_uncertain,
            "believed": {name: list(those) for name, those in self.believed.items()},
            "remarks": self.remarks,
            "second_choice": None if self.second is None else self.second.as_dict(),
        }


def _spread(trials: Trials) -> dict[str, float]:
    deviation = np.sqrt(np.diag(trials.covariance))
    return {
        "expected_miss_m": trials.expected_miss,
        "median_miss_m": float(np.median(trials.miss)),
        "miss_90_percent_m": float(np.quantile(trials.miss, 0.9)),
        "sigma_across_m": float(deviation[0]),
        "sigma_along_m": float(deviation[1]),
        "chance_of_success": float(trials.success.mean()),
    }
