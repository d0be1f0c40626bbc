"""Recovery and coverage of the coaching functions on simulated clubs with known truth."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import simulated_club as club

from agents.coaching import athlete_errors, hand_or_ice, match_stones
from curling_env.sheet import HOG_TO_FAR_TEE
from curling_env.typing import Floats

EVENINGS = 20
"""Number of simulated evenings of each kind."""
SET = 1 + 0.02 * (np.arange(6) - 2.5)
"""Friction of six stones, each 2 % from the next."""
KNOWN, WELL_KNOWN, CURL_SIGMA = 0.004, 0.002, 0.01
"""Standard errors of the ice of the session: ln μ over two metres, and the curl. A draw then rests
5 cm, or 3 cm, from the prediction of the ice file."""
NEAR, FAR = 0.15, 0.5
"""Maximum relative error of a correct cause, and minimum miss of a far throw [m]."""


class CausesFound(NamedTuple):
    """Estimated causes of misses compared with the true ones.

    Parameters
    ----------
    miss : (n,) distance of each throw from its target [m]
    worst : (n,) largest error of a cause of each throw [m]
    ice_off : (n,) error of the ice's part [m]
    held : whether each 95 % interval holds the truth
    """

    miss: Floats
    worst: Floats
    ice_off: Floats
    held: list[bool]


def causes() -> dict[str, float]:
    """Compare the estimated causes of misses with the true ones of simulated evenings."""
    values: dict[str, float] = {}
    for name, sigma in (("well", WELL_KNOWN), ("less", KNOWN)):
        found = causes_found(EVENINGS, sigma)
        right, far = found.worst < NEAR * found.miss, found.miss > FAR
        values |= {
            f"{name}_right": 100 * float(right.mean()),
            f"{name}_right_far": 100 * float(right[far].mean()),
            f"{name}_held": 100 * float(np.mean(found.held)),
            f"{name}_ice_cm": 100 * float(np.sqrt(np.mean(found.ice_off**2))),
        }
    return values


def causes_found(evenings: int, sigma: float) -> CausesFound:
    """Find the causes of the misses of simulated evenings.

    Parameters
    ----------
    evenings : number of evenings of 16 throws
    sigma : standard error of the ice of the session, of ln μ over two metres
    """
    miss: list[float] = []
    worst: list[float] = []
    ice_off: list[float] = []
    held: list[bool] = []
    for seed in range(evenings):
        rng = np.random.default_rng([17, seed])
        athletes = (
            club.Athlete(name="Ada"),
            club.Athlete(name="Bo", bias=(0.02, 0.003, 0.0), spin=1.7),
        )
        evening = club.evening(rng, athletes=athletes, throws=8)
        ice = evening.ice.as_ice(rng, sigma=sigma, curl_sigma=CURL_SIGMA)
        found = hand_or_ice(evening.tracks, ice, evening.notes, believed=evening.believed.as_ice())
        for one in found.throws:
            off: dict[str, float] = {}
            for cause, part in one.parts.items():
                truth = evening.parts[cause][one.throw]
                value = np.array([part.right.value, part.past.value])
                off[cause] = float(np.hypot(*(value - truth)))
                bounds = zip(truth, part.interval(), strict=True)
                held += [bool(low <= x <= high) for x, (low, high) in bounds]
            miss.append(one.distance)
            worst.append(max(off.values()))
            ice_off.append(off["ice"])
    return CausesFound(np.array(miss), np.array(worst), np.array(ice_off), held)


def athletes() -> dict[str, float]:
    """Compare the estimated bias and spread of athletes with the true ones.

    Each has two sessions of ten throws.
    """
    held: dict[str, list[bool]] = {"bias": [], "spread": []}
    ratio: list[Floats] = []
    for seed in range(EVENINGS):
        rng = np.random.default_rng([18, seed])
        spread = np.array([0.03, 0.005, 0.2]) * np.exp(0.4 * rng.standard_normal(3))
        bias = np.array([0.02, 0.003, 0.0]) * rng.standard_normal(3)
        athlete = club.Athlete(name="Ada", bias=tuple(bias), spread=tuple(spread))
        sessions = []
        for _ in range(2):
            evening = club.evening(rng, athletes=(athlete,), throws=10)
            ice = evening.ice.as_ice(rng, sigma=KNOWN, curl_sigma=CURL_SIGMA)
            believed = evening.believed.as_ice()
            sessions.append(hand_or_ice(evening.tracks, ice, evening.notes, believed=believed))
        (found,) = athlete_errors(sessions, seed=seed)
        units = np.array([1.0, -HOG_TO_FAR_TEE, 1.0])
        for group in (found.overall, *found.groups):
            for k in range(3):
                true = abs(units[k]) * spread[k]
                held["spread"].append(bool(group.spread[k].low <= true <= group.spread[k].high))
                if k < 2:  # the usual rotation is the athlete's own, so that it has no bias
                    true = units[k] * bias[k]
                    held["bias"].append(bool(group.bias[k].low <= true <= group.bias[k].high))
        ratio.append(np.array([one.value for one in found.overall.spread]) / np.abs(units * spread))
    return {
        "bias_held": 100 * float(np.mean(held["bias"])),
        "spread_held": 100 * float(np.mean(held["spread"])),
        "spread_ratio": float(np.exp(np.log(ratio).mean())),
    }


def stones() -> dict[str, float]:
    """Compare the estimated friction and curl of stones with the true ones.

    Six stones 2 % apart are thrown eight times each.
    """
    ordered: list[bool] = []
    held: dict[str, list[bool]] = {"friction": [], "curl": []}
    for seed in range(EVENINGS):
        rng = np.random.default_rng([19, seed])
        curls = np.exp(0.06 * rng.standard_normal(6))
        factors = np.column_stack([rng.permutation(SET), curls])
        numbered = {k: (float(f), float(c)) for k, (f, c) in enumerate(factors)}
        evening = club.evening(rng, throws=48, stones=numbered)
        ice = evening.ice.as_ice(rng, sigma=KNOWN, curl_sigma=CURL_SIGMA)
        found = match_stones(evening.tracks, ice, evening.notes)
        against = factors / np.exp(np.log(factors).mean(axis=0))
        order = [float(factors[one.number, 0]) for one in found.stones]
        ordered += (np.diff(order) > 0).tolist()
        for one in found.stones:
            for k, name in enumerate(("friction", "curl")):
                estimate = getattr(one, name)
                true = against[one.number, k]
                held[name].append(bool(estimate.low <= true <= estimate.high))
    return {
        "ordered": 100 * float(np.mean(ordered)),
        "friction_held": 100 * float(np.mean(held["friction"])),
        "curl_held": 100 * float(np.mean(held["curl"])),
    }
