"""Practice throws on the hidden ice, and what a camera reports of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from agents.closed_loop.hidden_ice import HiddenIce, run
from curling_env.sheet import PAPER_SHEET, RULE_BOOK_STONE, Direction
from curling_env.throw import Release, Throw
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats

FPS = 30.0
FILM_FPS = 15.0
"""Frames a second of films [1/s]: tracking takes its time."""
FILM_SIZE = (960, 540)
"""Of their pictures [px]."""
NOISE = 0.005
"""Of a measured coordinate, frame by frame [m]."""
HEADING_NOISE = 0.02
"""Of a measured heading [rad]."""
SLOWEST, FASTEST = 1.8, 3.0
"""Weights, from stones that may stop before the house to takeouts [m/s]."""
PAUSE = 60.0
"""Between two throws [s]."""


def practice_throws(n: int, rng: np.random.Generator) -> list[Release]:
    """Releases of a practice: both ends, both handles, weights from guard to takeout in any order.

    Most are of draw weight, which is where the ice has to be known.
    """
    share = np.linspace(0.0, 1.0, n) ** 1.7
    speeds = rng.permutation(SLOWEST + (FASTEST - SLOWEST) * share)
    releases: list[Release] = []
    for k in range(n):
        spin = (1.0 if k % 4 < 2 else -1.0) * rng.uniform(0.8, 1.8)
        # A counter-clockwise stone curls to the left by a metre or so.
        aim = rng.uniform(-1.3, 1.3) + np.sign(spin) * 0.8 * (2.0 / speeds[k]) ** 2
        throw = Throw(
            speed=float(speeds[k]), angle=float(-np.arctan2(aim, 28.35)), spin=float(spin)
        )
        direction = Direction.AWAY if k % 2 == 0 else Direction.HOME
        releases.append(throw.release(direction, clock=PAUSE * k, order=k))
    return releases


def watch(ice: HiddenIce, release: Release, throw: int, rng: np.random.Generator) -> Trajectory:
    """The track of a throw as a camera gives it: every frame a little wrong.

    It ends when the stone touches the edge of the ice or a second after it rests.
    """
    path = run(ice, release)
    frames = np.arange(0.0, path[-1, 0] + (1.0 if _rests(path) else 0.0), 1 / FPS)
    seen = np.column_stack([np.interp(frames, path[:, 0], path[:, j]) for j in (1, 2, 5)])
    seen += rng.normal(size=seen.shape) * [NOISE, NOISE, HEADING_NOISE]
    return Trajectory(t=frames, xy=seen[:, :2], theta=seen[:, 2], throw=throw, clock=release.clock)


def track(
    ice: HiddenIce,
    releases: list[Release],
    rng: np.random.Generator,
    tell: Callable[[str, float], None],
) -> list[Trajectory]:
    """The tracks of throws, see `watch`."""
    return [watch(ice, release, k, rng) for k, release in enumerate(releases)]


def film(
    ice: HiddenIce,
    releases: list[Release],
    rng: np.random.Generator,
    tell: Callable[[str, float], None],
    *,
    folder: Path,
    workers: int,
) -> list[Trajectory]:
    """The tracks of throws that were filmed from above and followed on the film.

    Parameters
    ----------
    folder : gets the films
    workers : processes
    """
    from agents.closed_loop.filming import film_paths

    paths: list[Trajectory] = []
    for k, release in enumerate(releases):
        way = run(ice, release)
        paths.append(
            Trajectory(t=way[:, 0], xy=way[:, 1:3], theta=way[:, 5], throw=k, clock=release.clock)
        )
    films = film_paths(
        folder, paths, PAPER_SHEET, RULE_BOOK_STONE, seed=int(rng.integers(1000)),
        fps=FILM_FPS, frame_size=FILM_SIZE, workers=workers, tell=tell,
    )  # fmt: skip
    return films.tracks


def track_errors(ice: HiddenIce, releases: list[Release], tracks: list[Trajectory]) -> Floats:
    """RMS distance of each track from the true path, release to end, (n,) [m].

    The two are compared in the session's time: a track may begin before the release.
    """
    errors: list[float] = []
    for release, seen in zip(releases, tracks, strict=True):
        path = run(ice, release)
        t = seen.t + (seen.clock - release.clock)
        shown = (t >= 0) & ((t <= path[-1, 0]) | _rests(path))
        true = np.column_stack([np.interp(t[shown], path[:, 0], path[:, j]) for j in (1, 2)])
        errors.append(float(np.sqrt(((seen.xy[shown] - true) ** 2).sum(axis=1).mean())))
    return np.array(errors)


def _rests(path: Floats) -> bool:
    return bool(np.hypot(path[-1, 3], path[-1, 4]) < 1e-3)
