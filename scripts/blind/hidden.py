"""What may be hidden in a blind session: its names, its likely sizes, and the ice beneath."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from blind.law import (
    AIR,
    ASYMMETRY,
    BAND,
    COUPLING,
    CURL,
    CURL_V,
    CURL_W,
    DRIFT,
    DRIFT_LINEAR,
    EXPONENT,
    FORM,
    LINEAR,
    MAP_ACROSS,
    MAP_LENGTH,
    MAP_RIPPLE,
    MAP_SD,
    MU,
    O_BRUSHED,
    O_HEADING,
    O_LEFT,
    O_SPIN,
    O_TROUGH,
    O_WARM,
    PATCH_FACTOR,
    PATCH_SOFT,
    PATCH_X0,
    PATCH_X1,
    PATCH_Y0,
    PATCH_Y1,
    RIPPLE_PERIOD,
    SIZE,
    SLOPE_X,
    SLOPE_Y,
    SPIN_POWER,
    SPIN_RATE,
    SPIN_SHARE,
    STONE,
    STONE_CURL,
    STONE_FACTOR,
    SWEEP,
    WEAR,
    WEAR_ALONG,
    WEAR_LINEAR,
    WEAR_UNDER,
)
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
"""Effects of the catalogue in forms that are not the catalogue's own."""
BESIDE_CURL = ("stone_bias:curl",)
"""Effects that change the curl, and show only where there is some."""
OUTSIDE = (
    "friction_follows_spin",
    "trough",
    "sideways_push",
    "warming_stone",
    "heading_friction",
    "brushed_ice",
)
"""What the catalogue does not have."""

CHAMPIONSHIP = {
    EXPONENT: 0.25,
    AIR: 9.5e-4,
    CURL: 0.0082,
    CURL_V: 0.2,
    SPIN_RATE: 0.0115,
    SPIN_POWER: 0.6,
}
"""The ice of the preset `standard`."""
STRENGTH_PLACES = {
    "speed_dependent_friction": EXPONENT,
    "air_drag": AIR,
    "curl": CURL,
    "spin_drag": SPIN_RATE,
}
"""Where its strengths stand, which differ from day to day."""
GIVEN = tuple(name for name in NAMES if name not in STRENGTH_PLACES)
"""Effects that the preset `standard` lacks."""
MAP_WAVES = 200
"""Waves of which a friction map is the sum."""


def hidden_numbers(rng: np.random.Generator) -> Floats:
    """Ice on which nothing is missing."""
    q = np.zeros(SIZE)
    q[MU] = rng.uniform(0.007, 0.011)
    q[COUPLING] = 19.1 * BAND**2 / 0.2008 * rng.uniform(0.9, 1.1)
    q[STONE] = -1
    q[STONE_FACTOR] = q[STONE_CURL] = q[SWEEP] = q[PATCH_FACTOR] = 1.0
    return q


def championship_numbers(rng: np.random.Generator) -> Floats:
    """Ice like that of the preset `standard`, each strength off by 10 to 40 per cent."""
    q = hidden_numbers(rng)
    q[list(CHAMPIONSHIP)] = list(CHAMPIONSHIP.values())
    for strength in STRENGTH_PLACES.values():
        q[strength] *= 1.0 + rng.choice([-1.0, 1.0]) * rng.uniform(0.1, 0.4)
    q[CURL_V], q[CURL_W] = rng.uniform(0.0, 0.4), rng.choice([0.0, 0.2])
    q[SPIN_POWER] = rng.uniform(0.4, 0.8)
    return q


def hide(
    name: str,
    q: Floats,
    camera: dict[str, Any],
    rng: np.random.Generator,
    *,
    scale: float = 1.0,
) -> dict[str, Any]:
    """Put an effect of a likely size, times a scale, into the numbers; its true parameters."""
    sign = rng.choice([-1.0, 1.0])
    size = scale * float(np.exp(rng.uniform(np.log(0.5), np.log(2.0))))
    if name == "friction_map":
        q[MAP_SD], q[MAP_LENGTH] = rng.uniform(0.03, 0.06), np.exp(rng.uniform(*np.log([1.5, 6.0])))
        return {"sd": q[MAP_SD], "length": q[MAP_LENGTH]}
    if name == "speed_dependent_friction":
        q[FORM] = float(rng.random() < 0.3)
        q[EXPONENT] = min(0.2 * size, 0.45)
        return {"exponent": q[EXPONENT]} if q[FORM] == 0 else {}
    if name == "curl":
        q[CURL] = 0.006 * size
        q[CURL_V], q[CURL_W] = rng.choice([0.0, 0.2, 0.5]), rng.choice([0.0, 0.0, 0.3])
        return {"strength": q[CURL], "speed_exponent": q[CURL_V], "spin_exponent": q[CURL_W]}
    if name == "slope":
        angle = rng.uniform(0, 2 * np.pi)
        q[SLOPE_X], q[SLOPE_Y] = 2e-4 * size * np.array([np.cos(angle), np.sin(angle)])
        return {"x": q[SLOPE_X], "y": q[SLOPE_Y]}
    if name == "pebble_wear":
        q[WEAR] = sign * 0.004 * size
        return {"rate": q[WEAR]}
    if name == "pebble_wear:along paths":
        q[WEAR_ALONG] = sign * 0.02 * size
        return {"along_path": q[WEAR_ALONG]}
    if name == "pebble_wear:under each contact":
        q[WEAR_UNDER] = sign * 0.02 * size
        return {"under_contacts": q[WEAR_UNDER]}
    if name == "stone_bias":
        q[STONE], q[STONE_FACTOR] = rng.integers(0, 3), 1.0 + sign * 0.025 * size
        return {"stone": q[STONE], "factor": q[STONE_FACTOR]}
    if name == "stone_bias:curl":
        q[STONE], q[STONE_CURL] = rng.integers(0, 3), 1.0 + sign * 0.15 * size
        return {"stone": q[STONE], "curl_factor": q[STONE_CURL]}
    if name == "sweeping":
        q[SWEEP] = 1.0 - 0.08 * size
        return {"friction_factor": q[SWEEP]}
    if name == "friction_patch":
        x, y = rng.uniform(-1.0, 0.0), rng.uniform(-9.0, 5.0)
        q[PATCH_X0], q[PATCH_X1] = x, x + rng.uniform(0.8, 2.0)
        q[PATCH_Y0], q[PATCH_Y1] = y, y + rng.uniform(2.0, 6.0)
        q[PATCH_FACTOR] = 1.0 + sign * 0.12 * size
        return {"factor": q[PATCH_FACTOR]}
    if name == "time_drift":
        q[DRIFT] = sign * 3e-5 * size
        return {"rate": q[DRIFT]}
    if name == "spin_drag":
        q[SPIN_RATE], q[SPIN_POWER] = 0.012 * size, rng.uniform(0.3, 0.9)
        return {"rate": q[SPIN_RATE], "speed_exponent": q[SPIN_POWER]}
    if name == "air_drag":
        q[AIR] = 9.5e-4 * size
        return {"coefficient": q[AIR]}
    if name == "tracking_offset":
        angle = rng.uniform(0, 2 * np.pi)
        camera["offset"] = 0.015 * size * np.array([np.cos(angle), np.sin(angle)])
        return {"forward": camera["offset"][0], "left": camera["offset"][1]}
    if name == "lens_distortion":
        camera["k1"] = sign * 0.006 * size
        camera["centre"] = rng.uniform(-3.0, 3.0) if rng.random() < 0.5 else 0.0
        return {"k1": camera["k1"], "centre_y": camera["centre"]}
    if name == "frame_rate_error":
        camera["time"] = rng.choice([25 / 30, 30 / 25, 0.97, 1.04])
        return {"factor": camera["time"]}
    if name == "scale_error":
        camera["scale"] = rng.choice([0.96, 1.03])
        return {"factor": camera["scale"]}
    if name == "friction_map:across":
        q[MAP_ACROSS] = sign * 0.06 * size
        return {}
    if name == "friction_map:ripples":
        q[MAP_RIPPLE] = sign * 0.12 * size
        return {}
    if name == "pebble_wear:linear":
        q[WEAR_LINEAR] = sign * 0.004 * size
        return {}
    if name == "time_drift:linear":
        q[DRIFT_LINEAR] = sign * 3e-5 * size
        return {}
    if name == "curl:asymmetric":
        q[ASYMMETRY] = 0.6 * size
        return {}
    if name == "speed_dependent_friction:linear":
        q[LINEAR] = sign * 0.06 * size
        return {}
    if name == "spin_drag:proportional":
        q[SPIN_SHARE] = 0.012 * size
        return {}
    if name == "friction_patch:soft":
        hide("friction_patch", q, camera, rng, scale=scale)
        q[PATCH_SOFT] = 1.0
        return {}
    if name == "lens_distortion:end camera":
        camera["end_k1"] = sign * 0.02 * size
        return {}
    outside = {
        "friction_follows_spin": (O_SPIN, 0.05),
        "trough": (O_TROUGH, 0.0015),
        "sideways_push": (O_LEFT, 0.002),
        "warming_stone": (O_WARM, 0.006),
        "heading_friction": (O_HEADING, 0.12),
        "brushed_ice": (O_BRUSHED, 0.15),
    }
    place, usual = outside[name]
    q[place] = (sign if name != "warming_stone" else 1.0) * usual * size
    return {}


def draw_map(q: Floats, rng: np.random.Generator) -> Floats:
    """Wave numbers and phases of the friction map, (n, 3); none where the ice has no map.

    Waves of normal wave numbers add up to a field whose correlation falls off as
    exp(−d²/(2·length²)).
    """
    waves = np.column_stack([rng.normal(size=(MAP_WAVES, 2)), rng.uniform(0, 2 * np.pi, MAP_WAVES)])
    waves[:, :2] /= max(q[MAP_LENGTH], 1e-9)
    return waves if q[MAP_SD] > 0.0 else waves[:0]


def has_map(q: Floats) -> bool:
    """Whether friction differs smoothly from place to place."""
    return bool(q[MAP_SD] or q[MAP_ACROSS] or q[MAP_RIPPLE])


def log_map(q: Floats, pattern: Floats) -> Floats:
    """ln of the map's factor on friction at the centres of the paper's cells, (89, 9)."""
    y, x = np.meshgrid(np.arange(89) * 0.5 - 22.0, np.arange(9) * 0.5 - 2.0, indexing="ij")
    waves = np.cos(pattern[:, 0] * x[..., None] + pattern[:, 1] * y[..., None] + pattern[:, 2])
    smooth = q[MAP_SD] * math.sqrt(2.0 / max(len(pattern), 1)) * waves.sum(axis=-1)
    ripples = 1.0 + q[MAP_RIPPLE] * np.sin(2.0 * math.pi * y / RIPPLE_PERIOD)
    return smooth + np.log1p(q[MAP_ACROSS] * x) + np.log(ripples)
