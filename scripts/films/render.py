"""Renderer of films of known throws that shares no code with this project.

Lens, ray caster, stone, paint and motion are independent; OpenCV blurs and PyAV compresses. Cameras
are placed slightly differently for every seed, stones have radii of 0.140 to 0.146 m and their own
profile, and lenses are distorted and slightly askew. The user's knowledge goes into
NAME.scene.json, the truth into NAME.truth.json and NAME-K.truth.csv.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from av.container import OutputContainer
from av.video.stream import VideoStream
from numpy.typing import NDArray

from films.people import Part, People, draw
from films.rink import BAND, HOG, Rink, draw_stone, rink_of

Array = NDArray[np.floating[Any]]
GRAVITY = 9.80665
SIDES_BY_THROW = ("both", "left", "both", "right")
"""Sides of the sweepers in successive throws, see `people.SIDES`."""
LEAD, TAIL = 0.6, 1.0
"""Filmed time before the release and after the stone rests [s]."""
NOISE = 2.0
"""Standard deviation of the camera's noise [grey levels]."""
SOFT = 0.55
"""Standard deviation of the lens's blur [px]."""
FPS = 15
FINE, COARSE = 23, 28
"""Qualities of H.264: of a film, and of a copy of it."""


def path_of(mu: float, rng: np.random.Generator, way: int) -> tuple[Array, Array]:
    """Return times, and x, y and heading of a throw to rest, from the release at the hog line."""
    speed = np.sqrt(2 * GRAVITY * mu * rng.uniform(25.5, 29.5))
    aim, spin = rng.uniform(-0.015, 0.015), rng.choice([-1, 1]) * rng.uniform(0.7, 1.5)
    state = np.array([rng.uniform(-0.3, 0.3), -HOG * way, speed * np.sin(aim),
                      way * speed * np.cos(aim), rng.uniform(0, 6.28), spin])  # fmt: skip
    around = 2 * np.pi * (np.arange(32) + 0.5) / 32
    ring = BAND * np.stack([np.cos(around), np.sin(around)], 1)
    dt, t, rows = 1 / 480, [0.0], [state[[0, 1, 4]].copy()]

    def change(s: Array) -> Array:
        slip = s[2:4] + s[5] * np.stack([-ring[:, 1], ring[:, 0]], 1)
        push = -slip / (np.linalg.norm(slip, axis=1) + 1e-7)[:, None]
        force = mu * GRAVITY * push.mean(axis=0)
        force += 0.0045 * np.sign(s[5]) * np.array([-s[3], s[2]]) / (np.hypot(s[2], s[3]) + 1e-3)
        torque = mu * GRAVITY * (ring[:, 0] * push[:, 1] - ring[:, 1] * push[:, 0]).mean()
        return np.array([s[2], s[3], force[0], force[1], s[5], torque / (0.5 * 0.1435**2)])

    while np.hypot(state[2], state[3]) > 0.004 and t[-1] < 60:
        half = state + 0.5 * dt * change(state)
        state = state + dt * change(half)
        t.append(t[-1] + dt)
        rows.append(state[[0, 1, 4]].copy())
    return np.array(t), np.array(rows)


def rendered(folder: Path, camera: str, lines: int, seed: int, *, people: bool = False) -> Path:
    """Render the film of a throw, with its scene and its truth, unless it exists.

    Parameters
    ----------
    camera, lines : name of the camera, and lines of the picture
    people : show a thrower, a skip and two sweepers
    seed : seed of camera, stone and throw
    """
    folder.mkdir(parents=True, exist_ok=True)
    name = f"{camera}{lines}f{FPS}"
    base = folder / f"{name}-0"
    if not base.with_suffix(".truth.csv").exists():
        rink = rink_of(camera, lines, seed)
        (folder / f"{name}.scene.json").write_text(json.dumps(rink.scene))
        truth = {"mu": rink.mu, "released_at_s": LEAD}
        (folder / f"{name}.truth.json").write_text(json.dumps(truth))
        path = path_of(rink.mu, np.random.default_rng([*rink.key, 3]), 1)
        on_ice = people_of(rink, 0, path, 1) if people else None
        _film(base, rink, path, on_ice)
    return base.with_suffix(".mp4")


def people_of(rink: Rink, k: int, path: tuple[Array, Array], way: int) -> People:
    """Return the people around the k-th throw, away from home (way 1) or back (-1)."""
    sides = SIDES_BY_THROW[k % len(SIDES_BY_THROW)]
    return People(sides, path, way, np.random.default_rng([*rink.key, k, 1]))


def _film(base: Path, rink: Rink, path: tuple[Array, Array], people: People | None) -> None:
    """Write a throw's film and its truth."""
    t, rows = path
    view, ice = rink.view, rink.ice
    rng = np.random.default_rng([*rink.key, 0])
    moments = np.arange(int((LEAD + t[-1] + TAIL) * FPS)) / FPS
    there = np.stack([np.interp(moments - LEAD, t, row) for row in rows.T], 1)
    early = moments < LEAD
    there[early] += (moments[early] - LEAD)[:, None] * (rows[1] - rows[0]) * 480
    blurred, sharp = cv2.GaussianBlur(ice, (0, 0), SOFT), ice.copy()
    grain = Grain(rink, rng)
    with opened(base, rink, FPS) as (container, stream):
        for moment, (x, y, turn) in zip(moments, there, strict=True):
            picture = blurred
            if people is not None:
                own = np.array([x, y, turn])
                picture = composed(rink, people.parts(moment - LEAD, own), own)
            elif (changed := draw_stone(sharp, view, rink.stone, x, y, turn)) is not None:
                near = tuple(slice(max(s.start - 6, 0), s.stop + 6) for s in changed)
                picture = blurred.copy()
                picture[near] = cv2.GaussianBlur(sharp[near], (0, 0), SOFT)
                sharp[changed] = ice[changed]
            container.mux(stream.encode(grain.frame(picture)))
        container.mux(stream.encode(None))
    write_truth(base.with_suffix(".truth.csv"), np.column_stack([moments, there]))


def composed(rink: Rink, parts: list[Part], stone: Array | None) -> Array:
    """Return the picture of the ice with people and a stone at x, y and heading, blurred."""
    picture = rink.ice.copy()

    def draw_one() -> None:
        if stone is not None:
            draw_stone(picture, rink.view, rink.stone, *stone.tolist())

    draw(picture, rink.view, parts, np.zeros(2) if stone is None else stone[:2], draw_one)
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), SOFT), np.float32)


class Grain:
    """Noise of a camera, a picture of it that is shifted from frame to frame."""

    def __init__(self, rink: Rink, rng: np.random.Generator) -> None:
        width, height = rink.view.size
        noise = rng.normal(0, NOISE, (height + 97, width + 97)).astype(np.float32)
        self._noise, self._rng = np.repeat(noise[..., None], 3, axis=2), rng

    def frame(self, picture: Any) -> av.VideoFrame:
        """Return the frame of a picture (rows, columns, 3) with its noise."""
        a, b = self._rng.integers(0, 97, 2)
        noise = self._noise[a : a + picture.shape[0], b : b + picture.shape[1]]
        shown = np.asarray(cv2.add(picture, noise, dtype=cv2.CV_8U), np.uint8)
        return av.VideoFrame.from_ndarray(shown, format="bgr24")


def write_truth(path: Path, rows: Array) -> None:
    """Write t, x, y and heading of a stone in every frame, (n, 4)."""
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([["t", "x", "y", "theta"], *rows.round(6).tolist()])


@contextmanager
def opened(base: Path, rink: Rink, fps: int) -> Iterator[tuple[OutputContainer, VideoStream]]:
    """Provide a film for writing."""
    with av.open(str(base.with_suffix(".mp4")), "w") as container:
        yield container, stream_of(container, Fraction(fps), rink.view.size, FINE, "ultrafast")


def stream_of(
    container: OutputContainer, fps: Fraction, size: tuple[int, int], quality: int, preset: str
) -> VideoStream:
    """Add a stream of H.264 to a film; presets are x264's names for the effort."""
    stream = container.add_stream("libx264", rate=fps)
    assert isinstance(stream, VideoStream)
    stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
    stream.options = {"crf": str(quality), "preset": preset, "threads": "1"}
    return stream
