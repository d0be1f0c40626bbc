"""Practice throws on a hidden ice, and what a camera reports of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from agents.closed_loop.filming import FPS, film_paths
from agents.closed_loop.hidden_ice import HiddenIce
from agents.closed_loop.integrator import comes_to_rest, run_stone
from curling_env.sheet import PAPER_SHEET, RULE_BOOK_STONE, TEE_Y, Direction
from curling_env.throw import Release, Throw
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Progress

SECONDS_BETWEEN_THROWS = 60.0
POSITION_NOISE, HEADING_NOISE = 0.005, 0.02
"""Standard deviations of a measured coordinate [m] and heading [rad], frame by frame."""


class ThrowCamera(Protocol):
    """Gives the measured tracks of throws on a hidden ice."""

    def __call__(
        self,
        ice: HiddenIce,
        releases: list[Release],
        rng: np.random.Generator,
        progress: Progress,
        /,
    ) -> list[Trajectory]: ...


def draw_practice(n: int, rng: np.random.Generator) -> list[Release]:
    """Releases of n practice draws towards the away end, with both handles and several lines.

    A club player throws them without knowing the ice: about draw weight on the standard ice, at
    targets from one side of the house to the other.
    """
    releases: list[Release] = []
    for k in range(n):
        aim = (1.3 - 2.6 * k / max(n - 1, 1)) * (-1.0) ** (k // 2)
        spin = (-1.0) ** k * rng.uniform(0.8, 1.3)
        speed = 2.09 + rng.uniform(-0.06, 0.05)
        # A counter-clockwise stone curls about 1.4 m to the left, so it is aimed to the right.
        bend = 1.4 * np.sign(spin)
        angle = -np.arctan2(aim + bend, TEE_Y + 10.97)
        throw = Throw(speed=speed, angle=float(angle), spin=float(spin))
        releases.append(throw.release(Direction.AWAY, clock=SECONDS_BETWEEN_THROWS * k, order=k))
    return releases


def mixed_practice(n: int, rng: np.random.Generator) -> list[Release]:
    """Releases of n throws to both ends, with both handles and weights from guard to takeout.

    Most have draw weight, because that is where the ice has to be known best.
    """
    slowest, fastest = 1.8, 3.0
    share = np.linspace(0.0, 1.0, n) ** 1.7
    speeds = rng.permutation(slowest + (fastest - slowest) * share)
    releases: list[Release] = []
    for k in range(n):
        spin = (1.0 if k % 4 < 2 else -1.0) * rng.uniform(0.8, 1.8)
        # A counter-clockwise stone curls to the left by about a metre.
        aim = rng.uniform(-1.3, 1.3) + np.sign(spin) * 0.8 * (2.0 / speeds[k]) ** 2
        throw = Throw(
            speed=float(speeds[k]), angle=float(-np.arctan2(aim, 28.35)), spin=float(spin)
        )
        direction = Direction.AWAY if k % 2 == 0 else Direction.HOME
        releases.append(throw.release(direction, clock=SECONDS_BETWEEN_THROWS * k, order=k))
    return releases


def noisy_track(
    ice: HiddenIce, release: Release, throw: int, rng: np.random.Generator, *, fps: float = 30.0
) -> Trajectory:
    """The track of one throw with white noise in every frame.

    It ends when the stone touches the edge of the ice, or a second after it comes to rest.
    """
    path = run_stone(ice, release)
    frames = np.arange(0.0, path[-1, 0] + (1.0 if comes_to_rest(path) else 0.0), 1 / fps)
    seen = np.column_stack([np.interp(frames, path[:, 0], path[:, j]) for j in (1, 2, 5)])
    seen += rng.normal(size=seen.shape) * [POSITION_NOISE, POSITION_NOISE, HEADING_NOISE]
    return Trajectory(t=frames, xy=seen[:, :2], theta=seen[:, 2], throw=throw, clock=release.clock)


def noisy_camera(
    ice: HiddenIce, releases: list[Release], rng: np.random.Generator, _progress: Progress
) -> list[Trajectory]:
    """A `ThrowCamera` that adds white noise to the true paths."""
    return [noisy_track(ice, release, k, rng) for k, release in enumerate(releases)]


def film_camera(
    ice: HiddenIce,
    releases: list[Release],
    rng: np.random.Generator,
    progress: Progress,
    *,
    folder: Path,
    workers: int,
    fps: float = FPS,
) -> list[Trajectory]:
    """A `ThrowCamera` that films the throws from above and tracks the films.

    Parameters
    ----------
    folder : directory for the films
    workers : number of processes
    fps : frames a second [1/s]
    """
    paths: list[Trajectory] = []
    for k, release in enumerate(releases):
        rows = run_stone(ice, release)
        paths.append(
            Trajectory(
                t=rows[:, 0], xy=rows[:, 1:3], theta=rows[:, 5], throw=k, clock=release.clock
            )
        )
    return film_paths(
        folder,
        paths,
        PAPER_SHEET,
        RULE_BOOK_STONE,
        seed=int(rng.integers(1000)),
        fps=fps,
        frame_size=(960, 540),
        workers=workers,
        progress=progress,
    ).tracks


def track_errors(
    ice: HiddenIce, releases: Sequence[Release], tracks: Sequence[Trajectory]
) -> Floats:
    """RMS distance of each track from the true path, from release to end, (n,) [m].

    The two are compared in the session's time, because a film may begin before the release.
    """
    errors: list[float] = []
    for release, track in zip(releases, tracks, strict=True):
        path = run_stone(ice, release)
        t = track.t + (track.clock - release.clock)
        shown = (t >= 0) & ((t <= path[-1, 0]) | comes_to_rest(path))
        true = np.column_stack([np.interp(t[shown], path[:, 0], path[:, j]) for j in (1, 2)])
        errors.append(float(np.sqrt(((track.xy[shown] - true) ** 2).sum(axis=1).mean())))
    return np.array(errors)
