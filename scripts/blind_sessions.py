"""Sessions with something hidden in them, made without the project's force law.

Formulas, integrator (midpoint at 2 ms over a ring of 24 contacts) and noise are written here anew,
so that discovery is judged on data that its own model did not make.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np

from curling_env.typing import Floats

G = 9.80665
STEP = 2e-3
CONTACTS = 24
BAND = 0.0625
STOP = 3e-4
SCATTER = 0.004
"""Standard deviation of ln μ from throw to throw."""
EDGE = 21.95
HOG = 10.9725

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
)
"""Effects of the catalogue in forms that are not the catalogue's own."""
BESIDE_CURL = ("stone_bias:curl",)
"""Effects that change the curl, and show only where there is some."""
OUTSIDE = (
    "friction_follows_spin",
    "trough",
    "sideways_push",
    "warming_stone",
    "friction_across",
    "heading_friction",
    "rippled_friction",
    "brushed_ice",
)

# Places in the vector of hidden numbers.
(
    MU,
    COUPLING,
    EXPONENT,
    CURL,
    CURL_V,
    CURL_W,
    SLOPE_X,
    SLOPE_Y,
    WEAR,
    DRIFT,
    STONE,
    STONE_FACTOR,
    SWEEP,
    PATCH_X0,
    PATCH_X1,
    PATCH_Y0,
    PATCH_Y1,
    PATCH_FACTOR,
    SPIN_RATE,
    SPIN_POWER,
    AIR,
    O_SPIN,
    O_TROUGH,
    O_LEFT,
    O_WARM,
    O_ACROSS,
    O_HEADING,
    O_RIPPLE,
    O_BRUSHED,
    FORM,
    ASYMMETRY,
    LINEAR,
    SPIN_SHARE,
    PATCH_SOFT,
    WEAR_LINEAR,
    DRIFT_LINEAR,
    WEAR_ALONG,
    WEAR_UNDER,
    MAP_SD,
    MAP_LENGTH,
    STONE_CURL,
    SIZE,
) = range(42)  # fmt: skip

CHAMPIONSHIP = {
    EXPONENT: 0.25,
    AIR: 9.5e-4,
    CURL: 0.0082,
    CURL_V: 0.2,
    SPIN_RATE: 0.0115,
    SPIN_POWER: 0.6,
}
"""The ice of the preset `standard`."""
STRENGTH_NAMES = {
    "speed_dependent_friction": EXPONENT,
    "air_drag": AIR,
    "curl": CURL,
    "spin_drag": SPIN_RATE,
}
"""Where its strengths stand, which differ from day to day."""
MAP_WAVES = 200
"""Waves of which a friction map is the sum."""

ACROSS, ALONG = 0.0125, 0.05
"""Sides of the squares on which passes of earlier stones are counted [m]."""
SQUARES = (401, 901)


@numba.njit(cache=True)
def square_of(x: float, y: float) -> Any:
    i = int(x / ACROSS + 0.5 * SQUARES[0])
    j = int(y / ALONG + 0.5 * SQUARES[1])
    return min(max(i, 0), SQUARES[0] - 1), min(max(j, 0), SQUARES[1] - 1)


@numba.njit(cache=True)
def worn(rate: float, passes: Any, x: float, y: float, ex: float, ey: float, phi: float) -> float:
    """Factor on friction where the contact at phi stands."""
    forward, left = BAND * math.cos(phi), BAND * math.sin(phi)
    i, j = square_of(x + forward * ex - left * ey, y + forward * ey + left * ex)
    return math.exp(rate * passes[i, j])


@numba.njit(cache=True)
def run_over(passes: Any, path: Any) -> None:
    """Count one more pass on every square that the band ran over."""
    touched = np.zeros(passes.shape, dtype=np.bool_)
    for k in range(0, path.shape[0], 5):
        low, first = square_of(path[k, 0] - BAND, path[k, 1] - BAND)
        high, last = square_of(path[k, 0] + BAND, path[k, 1] + BAND)
        for i in range(low, high + 1):
            for j in range(first, last + 1):
                x = (i + 0.5 - 0.5 * SQUARES[0]) * ACROSS - path[k, 0]
                y = (j + 0.5 - 0.5 * SQUARES[1]) * ALONG - path[k, 1]
                if x * x + y * y < BAND * BAND:
                    touched[i, j] = True
    passes += touched


@numba.njit(cache=True)
def rates(
    q: Any,
    pattern: Any,
    passes: Any,
    s: Any,
    t: float,
    clock: float,
    order: float,
    stone: float,
    swept: float,
) -> Any:
    x, y, vx, vy, theta, spin = s[0], s[1], s[2], s[3], s[4], s[5]
    v = math.sqrt(vx * vx + vy * vy) + 1e-12
    ex, ey = vx / v, vy / v
    mu = q[MU] * math.exp(q[WEAR] * order + q[DRIFT] * clock)
    mu *= (1.0 + q[WEAR_LINEAR] * order) * (1.0 + q[DRIFT_LINEAR] * clock)
    if stone == q[STONE]:
        mu *= q[STONE_FACTOR]
    if swept > 0.5:
        mu *= q[SWEEP]
    if q[PATCH_SOFT] > 0.0:
        u = (2.0 * x - q[PATCH_X0] - q[PATCH_X1]) / (q[PATCH_X1] - q[PATCH_X0])
        w = (2.0 * y - q[PATCH_Y0] - q[PATCH_Y1]) / (q[PATCH_Y1] - q[PATCH_Y0])
        mu *= 1.0 + (q[PATCH_FACTOR] - 1.0) * math.exp(-1.5 * (u * u + w * w))
    elif q[PATCH_X0] < x < q[PATCH_X1] and q[PATCH_Y0] < y < q[PATCH_Y1]:
        mu *= q[PATCH_FACTOR]
    log_map = 0.0
    for k in range(pattern.shape[0]):
        log_map += math.cos(pattern[k, 0] * x + pattern[k, 1] * y + pattern[k, 2])
    if pattern.shape[0] > 0:
        mu *= math.exp(q[MAP_SD] * math.sqrt(2.0 / pattern.shape[0]) * log_map)
    mu *= 1.0 + q[O_SPIN] * (abs(spin) - 1.5)
    mu *= 1.0 - q[O_WARM] * t
    mu *= 1.0 + q[O_ACROSS] * x
    mu *= 1.0 + q[O_HEADING] * math.sin(theta)
    mu *= 1.0 + q[O_RIPPLE] * math.sin(2.0 * math.pi * y / 5.0)
    mu *= 1.0 + q[O_BRUSHED] * (1.0 if vy > 0 else -1.0) * math.exp(-v)
    if q[WEAR_ALONG] != 0.0:
        mean = 0.0
        for k in range(CONTACTS):
            phi = 2.0 * math.pi * (k + 0.5) / CONTACTS
            mean += worn(q[WEAR_ALONG], passes, x, y, ex, ey, phi) / CONTACTS
        mu *= mean
    along = 0.0
    across = 0.0
    torque = 0.0
    for k in range(CONTACTS):
        phi = 2.0 * math.pi * (k + 0.5) / CONTACTS
        ux = v - spin * BAND * math.sin(phi)
        uy = spin * BAND * math.cos(phi)
        slip = math.sqrt(ux * ux + uy * uy) + 1e-9
        local = mu
        if q[EXPONENT] != 0.0:
            if q[FORM] == 1.0:  # 1/(v + 0.06), as in the Digital Curling simulator
                local *= 1.0 - q[EXPONENT] + q[EXPONENT] * 1.0638578 / (slip + 0.0638578)
            else:
                local *= max(slip, 0.02) ** (-q[EXPONENT])
        local *= 1.0 + q[LINEAR] * (1.5 - slip)
        local *= 1.0 - q[ASYMMETRY] * math.cos(phi)
        if q[WEAR_UNDER] != 0.0:
            local *= worn(q[WEAR_UNDER], passes, x, y, ex, ey, phi)
        along -= local * ux / slip
        across -= local * uy / slip
        torque -= local * (-math.sin(phi) * ux + math.cos(phi) * uy) / slip
    along *= G / CONTACTS
    across *= G / CONTACTS
    turn = q[COUPLING] * G / BAND * torque / CONTACTS
    sense = math.tanh(spin / 0.02)
    along -= q[AIR] * v * v
    curl = q[CURL] * v ** q[CURL_V] * (abs(spin) / 1.5 + 1e-9) ** q[CURL_W]
    if stone == q[STONE]:
        curl *= q[STONE_CURL]
    across += sense * curl
    across += q[O_LEFT]
    turn -= sense * q[SPIN_RATE] * max(v, 0.05) ** (-q[SPIN_POWER])
    turn -= q[SPIN_SHARE] * spin
    ax = along * ex - across * ey + G * q[SLOPE_X] - q[O_TROUGH] * x
    ay = along * ey + across * ex + G * q[SLOPE_Y]
    return ax, ay, turn


@numba.njit(cache=True)
def throw_path(
    q: Any,
    pattern: Any,
    passes: Any,
    start: Any,
    clock: float,
    order: float,
    stone: float,
    sweep: Any,
    out: Any,
) -> int:
    """States every `STEP` until rest or the edge; how many."""
    s = start.copy()
    middle = np.empty(6)
    n = 0
    for n in range(out.shape[0]):
        t = n * STEP
        out[n] = s
        v = math.sqrt(s[2] ** 2 + s[3] ** 2)
        if v < STOP or abs(s[1]) > EDGE:
            return n + 1
        swept = 1.0 if sweep[0] <= t < sweep[1] else 0.0
        ax, ay, at = rates(q, pattern, passes, s, t, clock + t, order, stone, swept)
        # The last millimetre per second would be overshot by a whole step.
        h = min(STEP, 0.5 * v / math.sqrt(ax * ax + ay * ay + 1e-18))
        half = 0.5 * h
        middle[0] = s[0] + half * s[2]
        middle[1] = s[1] + half * s[3]
        middle[4] = s[4] + half * s[5]
        middle[2] = s[2] + half * ax
        middle[3] = s[3] + half * ay
        middle[5] = s[5] + half * at
        ax, ay, at = rates(q, pattern, passes, middle, t + half, clock + t, order, stone, swept)
        s[0] += h * middle[2]
        s[1] += h * middle[3]
        s[4] += h * middle[5]
        s[2] += h * ax
        s[3] += h * ay
        s[5] += h * at
    return n + 1


def hidden_numbers(rng: np.random.Generator) -> Floats:
    """Ice on which nothing is missing."""
    q = np.zeros(SIZE)
    q[MU] = rng.uniform(0.007, 0.011)
    q[COUPLING] = 19.1 * BAND**2 / 0.2008 * rng.uniform(0.9, 1.1)
    q[STONE] = -1
    q[STONE_FACTOR] = q[STONE_CURL] = q[SWEEP] = q[PATCH_FACTOR] = 1.0
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
        return {}
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
        "friction_across": (O_ACROSS, 0.06),
        "heading_friction": (O_HEADING, 0.12),
        "rippled_friction": (O_RIPPLE, 0.12),
        "brushed_ice": (O_BRUSHED, 0.15),
    }
    place, usual = outside[name]
    q[place] = (sign if name != "warming_stone" else 1.0) * usual * size
    return {}


def from_the_end(xy: Floats, k1: float) -> Floats:
    """Positions read through an undistorted model of a camera that distorts, 5 m up, 6 m behind."""
    height, behind, tilt = 5.0, 28.0, math.atan2(5.0, 28.0)
    depth = xy[:, 1] + behind
    ahead = depth * math.cos(tilt) + height * math.sin(tilt)
    u = xy[:, 0] / ahead
    v = (height * math.cos(tilt) - depth * math.sin(tilt)) / ahead
    stretch = 1.0 + k1 * (u * u + v * v)
    u, v = u * stretch, v * stretch
    depth = height * (math.cos(tilt) - v * math.sin(tilt)) / (v * math.cos(tilt) + math.sin(tilt))
    ahead = depth * math.cos(tilt) + height * math.sin(tilt)
    return np.column_stack([u * ahead, depth - behind])


def coloured(n: int, t: Floats, sigma: float, memory: float, rng: np.random.Generator) -> Floats:
    """White noise, or noise that remembers."""
    noise = rng.normal(size=n)
    if memory > 0:
        for i in range(1, n):
            keep = math.exp(-(t[i] - t[i - 1]) / memory)
            noise[i] = keep * noise[i - 1] + math.sqrt(1 - keep * keep) * noise[i]
    return sigma * noise


def waves(count: int, rng: np.random.Generator, *, period: float) -> Any:
    """A smooth random function of unit size with values (n, count): cosines around a period."""
    number = 2.0 * np.pi / (period * rng.uniform(0.5, 4.0, (24, count)))
    phase = rng.uniform(0.0, 2.0 * np.pi, (24, count))

    def at(u: Floats) -> Floats:
        return np.cos(u[:, None, None] * number + phase).sum(axis=1) / math.sqrt(12.0)

    return at


FILM_PLACE = 0.002
"""Of the errors of places that all throws share [m]."""
FILM_WANDERS = (0.0005, 0.0015, 0.03)
"""Of the errors of x, y and the heading that last for seconds [m, m, rad]: as measured on films by
`film_sessions.py`, of a camera above the sheet."""
FILM_CLAIMS = (0.0023, 0.05)
"""What the tracks claim of themselves [m, rad]."""


def log_map(sd: float, pattern: Floats) -> Floats:
    """ln of the map's factor on friction at the centres of the paper's cells, (89, 9)."""
    y, x = np.meshgrid(np.arange(89) * 0.5 - 22.0, np.arange(9) * 0.5 - 2.0, indexing="ij")
    waves_ = np.cos(pattern[:, 0] * x[..., None] + pattern[:, 1] * y[..., None] + pattern[:, 2])
    return sd * math.sqrt(2.0 / len(pattern)) * waves_.sum(axis=-1)


def make_session(
    effects: tuple[str, ...],
    rng: np.random.Generator,
    *,
    throws: int = 16,
    fresh: int = 0,
    ways: int = 2,
    film: bool = False,
    championship: bool = False,
    scale: float = 1.0,
    bad: bool = False,
) -> tuple[dict[str, list[Any]], dict[str, Any]]:
    """Columns of a track file, and the sealed truth.

    Parameters
    ----------
    fresh : throws played on after the session, on the same ice; the last in the columns
    ways : directions of play, 2 or 1
    film : whether the tracks err as those from films do: smoothly, and all alike at a place
    championship : whether the ice beneath is that of the preset `standard`, each of its strengths
        off by 10 to 40 per cent
    scale : factor on the usual sizes of the effects
    bad : whether positions err by 8 mm with a memory of a second, and throws scatter by 1 %
    """
    q = hidden_numbers(rng)
    if championship:
        q[list(CHAMPIONSHIP)] = list(CHAMPIONSHIP.values())
        for strength in STRENGTH_NAMES.values():
            q[strength] *= 1.0 + rng.choice([-1.0, 1.0]) * rng.uniform(0.1, 0.4)
        q[CURL_V], q[CURL_W] = rng.uniform(0.0, 0.4), rng.choice([0.0, 0.2])
        q[SPIN_POWER] = rng.uniform(0.4, 0.8)
    camera: dict[str, Any] = {}
    truth = {name: hide(name, q, camera, rng, scale=scale) for name in effects}
    numbers = np.column_stack(
        [rng.normal(size=(MAP_WAVES, 2)), rng.uniform(0, 2 * np.pi, MAP_WAVES)]
    )
    numbers[:, :2] /= max(q[MAP_LENGTH], 1e-9)
    pattern = numbers if q[MAP_SD] > 0.0 else numbers[:0]
    sigma = 0.008 if bad else rng.uniform(0.003, 0.006)
    memory = 1.0 if bad else float(rng.choice([0.0, 0.15, 0.3]))
    scatter = 0.01 if bad else SCATTER
    missing, outliers = float(rng.choice([0.0, 0.1])), float(rng.choice([0.0, 0.004]))
    columns: dict[str, list[Any]] = {
        k: [] for k in ("throw", "t", "x", "y", "theta", "stone", "clock", "swept")
    }
    speeds = rng.permutation(np.linspace(1.3, 3.0, throws) + rng.uniform(-0.1, 0.1, throws))
    clock = 0.0
    gap = rng.integers(throws // 3, 2 * throws // 3)
    base_mu = q[MU]
    misplaced = [waves(2, rng, period=20.0) for _ in range(2)] if film else []
    passes = np.zeros(SQUARES)
    # As in a game, every stone is played about equally often; a stone that is not cannot be found.
    stones = np.concatenate([rng.permutation(np.arange(throws) % 4), rng.integers(0, 4, fresh)])
    speeds = np.concatenate([speeds, rng.uniform(1.4, 2.9, fresh)])
    for k in range(throws + fresh):
        direction = 1.0 if k % ways == 0 else -1.0
        line = rng.normal(0, 0.008)
        start = np.array(
            [
                rng.uniform(-1.0, 1.0),
                -direction * HOG,
                -direction * speeds[k] * math.sin(line),
                direction * speeds[k] * math.cos(line),
                rng.uniform(-np.pi, np.pi),
                rng.choice([-1.0, 1.0]) * rng.uniform(0.8, 2.4),
            ]
        )
        sweep = np.zeros(2)
        if rng.random() < 0.4:
            begin = rng.uniform(1.0, 6.0)
            sweep = np.array([begin, begin + rng.uniform(3.0, 9.0)])
        stone = int(stones[k])
        q[MU] = base_mu * math.exp(rng.normal(0, scatter))
        path = np.empty((int(70 / STEP), 6))
        n = throw_path(q, pattern, passes, start, clock, float(k), float(stone), sweep, path)
        run_over(passes, path[:n])
        t = np.arange(n) * STEP
        frames = np.arange(0.0, t[-1], 1 / 30)
        frames = frames[(rng.random(len(frames)) > missing) | (frames == 0)]
        xy = np.column_stack([np.interp(frames, t, path[:n, j]) for j in (0, 1)])
        theta = np.interp(frames, t, path[:n, 4])
        if "offset" in camera:
            a, b = camera["offset"]
            xy[:, 0] += a * np.cos(theta) - b * np.sin(theta)
            xy[:, 1] += a * np.sin(theta) + b * np.cos(theta)
        if "k1" in camera:
            away = xy - np.array([0.0, camera["centre"]])
            xy = xy + away * camera["k1"] * (away**2).sum(axis=1, keepdims=True) / 400.0
        if "end_k1" in camera:
            xy = from_the_end(xy, camera["end_k1"])
        swept = (frames >= sweep[0]) & (frames < sweep[1])
        xy = xy * camera.get("scale", 1.0)
        shown = frames * camera.get("time", 1.0)
        if film:
            wandering = waves(3, rng, period=3.0)(frames) * FILM_WANDERS
            shared = misplaced[0](xy[:, 1]) + misplaced[1](xy[:, 1]) * xy[:, :1]
            xy = xy + FILM_PLACE * shared + wandering[:, :2]
            theta = theta + wandering[:, 2]
            columns.setdefault("sigma_xy", []).extend([FILM_CLAIMS[0]] * len(frames))
            columns.setdefault("sigma_theta", []).extend([FILM_CLAIMS[1]] * len(frames))
        else:
            for j in range(2):
                xy[:, j] += coloured(len(frames), frames, sigma, memory, rng)
            theta = theta + coloured(len(frames), frames, 0.02, 0.0, rng)
            wild = rng.random(len(frames)) < outliers
            xy[wild] += rng.normal(0, 0.15, (int(wild.sum()), 2))
        rows = len(frames)
        columns["throw"] += [k] * rows
        columns["t"] += np.round(shown, 4).tolist()
        columns["x"] += np.round(xy[:, 0], 5).tolist()
        columns["y"] += np.round(xy[:, 1], 5).tolist()
        columns["theta"] += np.round(theta, 5).tolist()
        columns["stone"] += [stone] * rows
        columns["clock"] += [round(clock, 1)] * rows
        columns["swept"] += swept.astype(int).tolist()
        clock += rng.uniform(40, 85) + (1500.0 if k == gap else 0.0)
    q[MU] = base_mu
    sealed = {"effects": truth, "mu": base_mu, "sigma": sigma, "memory": memory}
    if len(pattern):
        sealed["map"] = log_map(q[MAP_SD], pattern).tolist()
    if championship:
        sealed["strengths"] = {name: float(q[place]) for name, place in STRENGTH_NAMES.items()}
    return columns, sealed
