"""Possible hidden effects of a blind session: names, likely sizes, and the ice beneath."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from blind import law
from curling_env.typing import Floats

SCATTER = 0.004
"""Standard deviation of ln μ from throw to throw."""
NAMES = (
    "speed_dependent_friction",
    "curl",
    "slope",
    "pebble_wear",
    "pebble_wear:along paths",
    "stone_bias",
    "sweeping",
    "friction_patch",
    "time_drift",
    "spin_drag",
    "air_drag",
    "tracking_offset",
    "lens_distortion",
)
FORMS = (
    "curl:asymmetric",
    "speed_dependent_friction:linear",
    "spin_drag:proportional",
    "friction_patch:soft",
    "lens_distortion:end camera",
    "pebble_wear:linear",
    "time_drift:linear",
    "pebble_wear:under each contact",
    "friction_map:across",
    "friction_map:ripples",
)
"""Effects of the catalogue in forms other than the catalogue's."""
OUTSIDE = (
    "friction_follows_spin",
    "trough",
    "sideways_push",
    "warming_stone",
    "heading_friction",
    "brushed_ice",
)
"""Effects outside the catalogue."""

CHAMPIONSHIP = {
    law.EXPONENT: 0.25,
    law.AIR: 9.5e-4,
    law.CURL: 0.0082,
    law.CURL_V: 0.2,
    law.SPIN_RATE: 0.0115,
    law.SPIN_POWER: 0.6,
}
"""Ice of the preset `standard`."""
STRENGTH_PLACES = {
    "speed_dependent_friction": law.EXPONENT,
    "air_drag": law.AIR,
    "curl": law.CURL,
    "spin_drag": law.SPIN_RATE,
}
"""Places of its strengths, which differ from day to day."""
GIVEN = tuple(name for name in NAMES if name not in STRENGTH_PLACES)
"""Effects that the preset `standard` lacks."""
MAP_WAVES = 200
"""Number of waves whose sum is a friction map."""
PLAIN = {
    "pebble_wear": (law.WEAR, 0.004, True, "rate"),
    "pebble_wear:along paths": (law.WEAR_ALONG, 0.02, True, "along_path"),
    "pebble_wear:under each contact": (law.WEAR_UNDER, 0.02, True, "under_contacts"),
    "pebble_wear:linear": (law.WEAR_LINEAR, 0.004, True, None),
    "time_drift": (law.DRIFT, 3e-5, True, "rate"),
    "time_drift:linear": (law.DRIFT_LINEAR, 3e-5, True, None),
    "air_drag": (law.AIR, 9.5e-4, False, "coefficient"),
    "friction_map:across": (law.MAP_ACROSS, 0.06, True, None),
    "friction_map:ripples": (law.MAP_RIPPLE, 0.12, True, None),
    "curl:asymmetric": (law.ASYMMETRY, 0.6, False, None),
    "speed_dependent_friction:linear": (law.LINEAR, 0.06, True, None),
    "spin_drag:proportional": (law.SPIN_SHARE, 0.012, False, None),
    "friction_follows_spin": (law.O_SPIN, 0.05, True, None),
    "trough": (law.O_TROUGH, 0.0015, True, None),
    "sideways_push": (law.O_LEFT, 0.002, True, None),
    "warming_stone": (law.O_WARM, 0.006, False, None),
    "heading_friction": (law.O_HEADING, 0.12, True, None),
    "brushed_ice": (law.O_BRUSHED, 0.15, True, None),
}
"""Effects of one number: its place, its usual size, possible signs, and its name."""


def hidden_numbers(rng: np.random.Generator) -> Floats:
    """Return ice on which nothing is missing."""
    q = np.zeros(law.SIZE)
    q[law.MU] = rng.uniform(0.007, 0.011)
    q[law.COUPLING] = 19.1 * law.BAND**2 / 0.2008 * rng.uniform(0.9, 1.1)
    q[law.STONE] = -1
    q[law.STONE_FACTOR] = q[law.STONE_CURL] = q[law.SWEEP] = q[law.PATCH_FACTOR] = 1.0
    return q


def championship_numbers(rng: np.random.Generator) -> Floats:
    """Return ice like that of the preset `standard`, each strength off by 10 to 40 per cent."""
    q = hidden_numbers(rng)
    q[list(CHAMPIONSHIP)] = list(CHAMPIONSHIP.values())
    for strength in STRENGTH_PLACES.values():
        q[strength] *= 1.0 + rng.choice([-1.0, 1.0]) * rng.uniform(0.1, 0.4)
    q[law.CURL_V], q[law.CURL_W] = rng.uniform(0.0, 0.4), rng.choice([0.0, 0.2])
    q[law.SPIN_POWER] = rng.uniform(0.4, 0.8)
    return q


def hide(
    name: str,
    q: Floats,
    camera: dict[str, Any],
    rng: np.random.Generator,
    *,
    scale: float = 1.0,
) -> dict[str, Any]:
    """Put an effect of a likely size, times a scale, into the numbers; return its true
    parameters.
    """
    sign = rng.choice([-1.0, 1.0])
    size = scale * float(np.exp(rng.uniform(np.log(0.5), np.log(2.0))))
    if name in PLAIN:
        place, usual, signed, parameter = PLAIN[name]
        q[place] = (sign if signed else 1.0) * usual * size
        return {} if parameter is None else {parameter: q[place]}
    if name == "friction_map":
        q[law.MAP_SD], q[law.MAP_LENGTH] = (
            rng.uniform(0.03, 0.06),
            np.exp(rng.uniform(*np.log([1.5, 6.0]))),
        )
        return {"sd": q[law.MAP_SD], "length": q[law.MAP_LENGTH]}
    if name == "speed_dependent_friction":
        q[law.FORM] = float(rng.random() < 0.3)
        q[law.EXPONENT] = min(0.2 * size, 0.45)
        return {"exponent": q[law.EXPONENT]} if q[law.FORM] == 0 else {}
    if name == "curl":
        q[law.CURL] = 0.006 * size
        q[law.CURL_V], q[law.CURL_W] = rng.choice([0.0, 0.2, 0.5]), rng.choice([0.0, 0.0, 0.3])
        return {
            "strength": q[law.CURL],
            "speed_exponent": q[law.CURL_V],
            "spin_exponent": q[law.CURL_W],
        }
    if name == "slope":
        angle = rng.uniform(0, 2 * np.pi)
        q[law.SLOPE_X], q[law.SLOPE_Y] = 2e-4 * size * np.array([np.cos(angle), np.sin(angle)])
        return {"x": q[law.SLOPE_X], "y": q[law.SLOPE_Y]}
    if name == "stone_bias":
        q[law.STONE], q[law.STONE_FACTOR] = rng.integers(0, 3), 1.0 + sign * 0.025 * size
        return {"stone": q[law.STONE], "factor": q[law.STONE_FACTOR]}
    if name == "stone_bias:curl":
        q[law.STONE], q[law.STONE_CURL] = rng.integers(0, 3), 1.0 + sign * 0.15 * size
        return {"stone": q[law.STONE], "curl_factor": q[law.STONE_CURL]}
    if name == "sweeping":
        q[law.SWEEP] = 1.0 - 0.08 * size
        return {"friction_factor": q[law.SWEEP]}
    if name == "friction_patch":
        x, y = rng.uniform(-1.0, 0.0), rng.uniform(-9.0, 5.0)
        q[law.PATCH_X0], q[law.PATCH_X1] = x, x + rng.uniform(0.8, 2.0)
        q[law.PATCH_Y0], q[law.PATCH_Y1] = y, y + rng.uniform(2.0, 6.0)
        q[law.PATCH_FACTOR] = 1.0 + sign * 0.12 * size
        return {"factor": q[law.PATCH_FACTOR]}
    if name == "spin_drag":
        q[law.SPIN_RATE], q[law.SPIN_POWER] = 0.012 * size, rng.uniform(0.3, 0.9)
        return {"rate": q[law.SPIN_RATE], "speed_exponent": q[law.SPIN_POWER]}
    if name == "tracking_offset":
        angle = rng.uniform(0, 2 * np.pi)
        camera["offset"] = 0.015 * size * np.array([np.cos(angle), np.sin(angle)])
        return {"forward": camera["offset"][0], "left": camera["offset"][1]}
    if name == "lens_distortion":
        camera["k1"] = sign * 0.006 * size
        camera["centre"] = rng.uniform(-3.0, 3.0) if rng.random() < 0.5 else 0.0
        return {"k1": camera["k1"], "centre_y": camera["centre"]}
    if name == "friction_patch:soft":
        hide("friction_patch", q, camera, rng, scale=scale)
        q[law.PATCH_SOFT] = 1.0
        return {}
    assert name == "lens_distortion:end camera", name
    camera["end_k1"] = sign * 0.02 * size
    return {}


def draw_map(q: Floats, rng: np.random.Generator) -> Floats:
    """Draw wave numbers and phases of the friction map, (n, 3); empty if the ice has no map.

    Waves of normal wave numbers add up to a field whose correlation falls off as
    exp(−d²/(2·length²)).
    """
    waves = np.column_stack([rng.normal(size=(MAP_WAVES, 2)), rng.uniform(0, 2 * np.pi, MAP_WAVES)])
    waves[:, :2] /= max(q[law.MAP_LENGTH], 1e-9)
    return waves if q[law.MAP_SD] > 0.0 else waves[:0]


def has_map(q: Floats) -> bool:
    """Return whether friction differs smoothly from place to place."""
    return bool(q[law.MAP_SD] or q[law.MAP_ACROSS] or q[law.MAP_RIPPLE])


def log_map(q: Floats, pattern: Floats) -> Floats:
    """Return ln of the map's factor on friction at the centres of the paper's cells, (89, 9)."""
    y, x = np.meshgrid(np.arange(89) * 0.5 - 22.0, np.arange(9) * 0.5 - 2.0, indexing="ij")
    waves = np.cos(pattern[:, 0] * x[..., None] + pattern[:, 1] * y[..., None] + pattern[:, 2])
    smooth = q[law.MAP_SD] * math.sqrt(2.0 / max(len(pattern), 1)) * waves.sum(axis=-1)
    ripples = 1.0 + q[law.MAP_RIPPLE] * np.sin(2.0 * math.pi * y / law.RIPPLE_PERIOD)
    return smooth + np.log1p(q[law.MAP_ACROSS] * x) + np.log(ripples)
