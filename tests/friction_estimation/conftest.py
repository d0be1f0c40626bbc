"""Measured throws from a path that shares no code with the estimator.

Plain NumPy, fourth-order Runge–Kutta in time for many throws at once, with its own sum over the
contacts of the running band and a smooth field of friction that is a function, not a map.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.physics.slides import NO_BOUNDS, slide
from curling_env.sheet import HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory

G = 9.80665
BAND = 0.0625
COUPLING = 0.3716  # m r²/I of a rule-book stone
SINE = np.sin(2 * np.pi * (np.arange(24) + 0.5) / 24)
MEANS = np.array([np.ones(24), SINE]) / 24

Field = Callable[[np.ndarray, np.ndarray], np.ndarray]


def uniform(mu: float) -> Field:
    return lambda x, y: np.full(np.shape(x), mu)


def random_field(
    rng: np.random.Generator, *, mu: float, spread: float, length: float, rough: bool = False
) -> Field:
    """A Gaussian field of Gaussian (or, if rough, Matérn 3/2) correlation: random cosines."""
    waves = rng.normal(0, 1 / length, (120, 2))
    if rough:
        waves /= np.sqrt(rng.gamma(1.5, 1 / 1.5, 120))[:, None]
    phase = rng.uniform(0, 2 * np.pi, 120)

    def field(x, y):
        inner = np.multiply.outer(x, waves[:, 0])
        inner += np.multiply.outer(y, waves[:, 1])
        inner += phase
        return mu * (1 + spread * np.sqrt(2 / 120) * np.cos(inner, out=inner).sum(axis=-1))

    return field


def varied_starts(rng: np.random.Generator, count: int, *, spin: float = 1.2) -> np.ndarray:
    """Throws of several speeds, lines, turns and both directions, (n, 5): x, y, vx, vy, ω."""
    away = np.where(np.arange(count) % 2 == 0, 1.0, -1.0)
    speed = rng.uniform(1.3, 2.4, count)
    x, aim = rng.uniform(-1.5, 1.5, (2, count))
    angle = np.arctan2(aim - x, 33.0)
    omega = spin * rng.choice([-1.0, 1.0], count) * rng.uniform(0.6, 1.4, count)
    return np.column_stack(
        [x, -away * 10.9725, speed * np.sin(angle), away * speed * np.cos(angle), omega]
    )


def measured_throws(
    field: Field,
    starts: np.ndarray,
    rng: np.random.Generator,
    *,
    noise: float = 0.005,
    fps: int = 30,
    curl: float = 0.0,
    factor: np.ndarray | None = None,
    exponent: float = 0.0,
    until: float = 21.9,
    rest: float = 0.0,
) -> list[Trajectory]:
    """Make tracks with noise on position and heading, until the stones rest or pass |y| = until.

    Parameters
    ----------
    curl : a stone turns left of its travel with curl·sgn(ω)·v^0.2 [m/s²]
    factor : of each throw on μ
    exponent : μ falls with the speed as v^-exponent
    rest : how long the resting stone is filmed [s]
    """
    count = len(starts)
    factor = np.ones(count) if factor is None else factor
    step = 1 / (2 * fps)
    state = np.vstack([starts[:, :4].T, np.zeros(count), starts[:, 4]])

    def rates(s):
        """Rates of change of x, y, vx, vy, theta, omega, (6, n), and the speeds (n,)."""
        x, y, vx, vy, _, omega = s
        speed = np.maximum(np.sqrt(vx * vx + vy * vy), 1e-6)
        rim = BAND * omega
        # A contact slips by speed - rim·sin(φ) along the travel and by rim·cos(φ) across it.
        square = (speed * speed + rim * rim)[:, None] - (2 * speed * rim)[:, None] * SINE
        inverse, sine = (MEANS @ (1 / (np.sqrt(square) + 1e-9)).T).reshape(2, count)
        mu = field(x, y) * factor
        if exponent:
            mu = mu * speed**-exponent
        slow = G * mu * (speed * inverse - rim * sine) / speed
        turn = 0.0
        if curl:
            turn = np.sign(omega) * curl * speed**0.2 / speed
        torque = G * COUPLING / BAND * mu * (speed * sine - rim * inverse)
        push = (-turn * vy - slow * vx, turn * vx - slow * vy)
        return np.array([vx, vy, *push, omega, torque]), speed

    def advanced(s, k1, step):
        k2, _ = rates(s + step / 2 * k1)
        k3, _ = rates(s + step / 2 * k2)
        k4, _ = rates(s + step * k3)
        return s + step / 6 * (k1 + 2 * (k2 + k3) + k4)

    frames, ended = [state.T], np.full(count, -1)
    moving = np.ones(count, dtype=bool)
    ticks = 0
    while moving.any() and ticks * step < 90:
        k1, speed = rates(state)
        limit = 1.5 * step * np.hypot(k1[2], k1[3]) + 1e-4
        # One step from frame to frame, and two where a stone may stop or pass the end.
        if ticks % 2 == 0 and (speed > 4 * limit)[moving].all():
            after = np.where(moving, advanced(state, k1, 2 * step), state)
            if (np.abs(after[1, moving]) <= until).all():
                state, ticks = after, ticks + 2
                frames.append(state.T)
                continue
        stops = moving & (speed < limit)
        state = np.where(moving & ~stops, advanced(state, k1, step), state)
        ticks += 1
        moving &= ~stops & (np.abs(state[1]) <= until)
        ended[~moving & (ended < 0)] = ticks
        if ticks % 2 == 0:
            frames.append(state.T)
    whole = np.array(frames + [frames[-1]] * int(rest * fps + 1))
    tracks = []
    for k in range(count):
        rests = abs(whole[-1, k, 1]) <= until
        n = ended[k] // 2 + 1 + (int(rest * fps) if rests else 0)
        xy = whole[:n, k, :2] + rng.normal(0, noise, (n, 2))
        theta = whole[:n, k, 4] + rng.normal(0, 0.01, n)
        tracks.append(Trajectory(t=np.arange(n) / fps, xy=xy, theta=theta, throw=k))
    return tracks


@pytest.fixture(scope="session")
def sliding() -> SimpleNamespace:
    """The generator of measured throws: uniform, random_field, varied_starts, measured_throws."""
    return SimpleNamespace(
        uniform=uniform,
        random_field=random_field,
        varied_starts=varied_starts,
        measured_throws=measured_throws,
    )


def gate_log(
    ice: Ice,
    rng: np.random.Generator,
    *,
    throws: int = 24,
    width: float = 0.262,
    noise: float = 0.003,
    offset: float = 0.005,
    scatter: float = 0.01,
) -> list[tuple[str, float, float]]:
    """Sensor, start and end of every break of a beam by thrown stones, in both directions.

    Parameters
    ----------
    width : length of a stone where the beams cross it, which differ by 6 mm [m]
    noise : standard deviation of a time [s]
    offset : standard deviation of the places of the gates [m]
    scatter : standard deviation of ln μ from throw to throw
    """
    gates = {"T-Line": TEE_Y, "Hog-Line": HOG_LINE_Y}
    names = [(name, end) for name in gates for end in (1, 2)]
    widths = dict(zip(names, width + rng.normal(0, 0.006, 4), strict=True))
    offsets = dict(zip(names, rng.normal(0, offset, 4), strict=True))
    rows: list[tuple[str, float, float]] = []
    for k in range(throws):
        away = k % 2 == 0
        mu = ice.friction.mu * np.exp(rng.normal(0, scatter))
        own = replace(ice, friction=replace(ice.friction, mu=mu))
        speed = rng.uniform(1.95, 2.7)
        spin = rng.choice([-1.4, 1.4])
        throw = Throw(speed=speed, angle=rng.normal(0, 0.005), spin=spin)
        direction = Direction.AWAY if away else Direction.HOME
        path = slide(own, throw.release(direction=direction), bounds=NO_BOUNDS, fps=240).trajectory
        assert path is not None
        t, y = path.t, direction * path.xy[:, 1]
        for name, end in names:
            line = gates[name] * (1 if (end == 2) == away else -1) + offsets[name, end]
            edges = line + np.array([-0.5, 0.5]) * widths[name, end]
            if edges[1] > y[-1]:
                continue
            # A hand slides with the stone at one speed before the hog line.
            before = (edges + HOG_LINE_Y) / speed
            times = np.where(edges < y[0], before, np.interp(edges, y, t)) + rng.normal(0, noise, 2)
            rows.append((f"{name} {end}", *(1e3 + 60 * k + times)))
    return sorted(rows, key=lambda row: -row[1])


def write_gate_log(path: Path, rows: list[tuple[str, float, float]]) -> Path:
    """Write a log of gates, the last event first."""
    lines = ["Sensor,Break,Interval,Time,Start,End,Comments"]
    lines += [f"{name},{b - a:.4f},0.0,{a:.4f},{a:.6f},{b:.6f}," for name, a, b in rows]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="session")
def gates() -> SimpleNamespace:
    """The generator of logs of light gates: log, write."""
    return SimpleNamespace(log=gate_log, write=write_gate_log)


@pytest.fixture(scope="session")
def club_photo() -> SimpleNamespace:
    """Make a club's photo from its ceiling camera: turned upright, small, stretched, and cropped.

    empty, picture : (rows, columns, 3), the second with stones and people
    px : where points of the ice (n, 2) [m] are in both [px]
    stones : (k, 2) where stones lie [m]
    """
    from friction_estimation.synthetic import FilmRenderer, FilmSpec, StoneOnIce

    resting = [
        StoneOnIce(x=0.9, y=17.9, theta=0.4, vx=0.0, vy=0.0, colour=(40, 200, 230)),
        StoneOnIce(x=-0.5, y=13.1, theta=2.0, vx=0.0, vy=0.0, colour=(40, 40, 200)),
    ]
    spec = FilmSpec(camera="ceiling", size=(640, 480), fps=1.0, seed=4, lead_in=0.0, tail=0.0)
    t = np.arange(0, 4.01, 0.25)
    xy = np.column_stack([-1.2 + 0.1 * t, 9.0 + 2.0 * t - 0.04 * t**2])
    thrown = Trajectory(t=t, xy=xy, theta=0.5 * t, swept=np.ones(len(t)))
    renderer = FilmRenderer(spec, resting=resting)
    *_, frame = renderer.frames(thrown)
    bare_renderer = FilmRenderer(spec)
    rng = np.random.default_rng(2)
    empty = np.asarray(bare_renderer.still, dtype=np.float64)
    empty = np.clip(empty + rng.normal(0, 2.0, empty.shape), 0, 255).astype(np.uint8)
    wide, high, cut = 0.72, 0.62, (12, 30)

    def passed_on(image: np.ndarray) -> np.ndarray:
        upright = cv2.rotate(image, cv2.ROTATE_90_COUNTERCLOCKWISE)
        small = cv2.resize(upright, None, fx=high, fy=wide, interpolation=cv2.INTER_AREA)
        return np.ascontiguousarray(small[cut[0] :, cut[1] :])

    def px(ice: np.ndarray) -> np.ndarray:
        u, v = renderer.camera.project(np.column_stack([ice, np.zeros(len(ice))])).T
        turned = np.column_stack([v, renderer.camera.size[0] - 1 - u]) + 0.5
        return turned * np.array([high, wide]) - 0.5 - np.array([cut[1], cut[0]])

    return SimpleNamespace(
        empty=passed_on(empty),
        picture=passed_on(frame),
        px=px,
        stones=np.array([[0.9, 17.9], [-0.5, 13.1], xy[-1]]),
    )
