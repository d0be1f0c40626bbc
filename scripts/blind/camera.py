"""Measurement of the true places by a camera: its errors, and the noise of tracks."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from blind.law import STEP
from curling_env.typing import Floats

FRAMES = 30.0
"""Frame rate [1/s]."""
HEADING = 0.02
"""Standard deviation of white noise of the heading [rad]."""
WILD = 0.15
"""Standard deviation of positions in wrong frames [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Camera:
    """Measurement of a session.

    Parameters
    ----------
    errors : systematic errors of the camera, see `seen`
    sigma, memory : standard deviation of positions [m], and correlation time of their errors [s]
    missing, outliers : shares of lost and of wrong frames
    """

    errors: dict[str, Any] = field(default_factory=dict)
    sigma: float
    memory: float
    missing: float
    outliers: float


def draw_camera(errors: dict[str, Any], rng: np.random.Generator, *, bad: bool) -> Camera:
    """Draw a camera with usual noise, or with a bad one: 8 mm with a memory of a second."""
    return Camera(
        errors=errors,
        sigma=0.008 if bad else rng.uniform(0.003, 0.006),
        memory=1.0 if bad else float(rng.choice([0.0, 0.15, 0.3])),
        missing=float(rng.choice([0.0, 0.1])),
        outliers=float(rng.choice([0.0, 0.004])),
    )


def photograph(
    path: Floats, sweep: Floats, camera: Camera, rng: np.random.Generator
) -> dict[str, list[Any]]:
    """Return rows of a track file for one throw: t, x, y, theta, swept.

    Parameters
    ----------
    path : (n, 6) states every `STEP`
    sweep : (2,) start and end of the sweeping [s]
    """
    t = np.arange(len(path)) * STEP
    frames = np.arange(0.0, t[-1], 1.0 / FRAMES)
    frames = frames[(rng.random(len(frames)) > camera.missing) | (frames == 0)]
    xy = np.column_stack([np.interp(frames, t, path[:, j]) for j in (0, 1)])
    theta = np.interp(frames, t, path[:, 4])
    xy = seen(xy, theta, camera.errors)
    swept = (frames >= sweep[0]) & (frames < sweep[1])
    rows: dict[str, list[Any]] = {}
    for j in range(2):
        xy[:, j] += coloured(len(frames), frames, camera.sigma, camera.memory, rng)
    theta = theta + coloured(len(frames), frames, HEADING, 0.0, rng)
    wild = rng.random(len(frames)) < camera.outliers
    xy[wild] += rng.normal(0, WILD, (int(wild.sum()), 2))
    rows["t"] = np.round(frames, 4).tolist()
    rows["x"], rows["y"] = np.round(xy, 5).T.tolist()
    rows["theta"] = np.round(theta, 5).tolist()
    rows["swept"] = swept.astype(int).tolist()
    return rows


def seen(xy: Floats, theta: Floats, errors: dict[str, Any]) -> Floats:
    """Return positions of a stone as seen by a camera with errors, (n, 2) [m].

    Parameters
    ----------
    xy, theta : (n, 2), (n,) true places and headings
    errors : ``offset`` of the tracked point; ``k1`` and ``centre``, or ``end_k1``, of the lens
    """
    xy = xy.copy()
    if "offset" in errors:
        a, b = errors["offset"]
        xy[:, 0] += a * np.cos(theta) - b * np.sin(theta)
        xy[:, 1] += a * np.sin(theta) + b * np.cos(theta)
    if "k1" in errors:
        away = xy - np.array([0.0, errors["centre"]])
        xy = xy + away * errors["k1"] * (away**2).sum(axis=1, keepdims=True) / 400.0
    if "end_k1" in errors:
        xy = from_the_end(xy, errors["end_k1"])
    return xy


def from_the_end(xy: Floats, k1: float) -> Floats:
    """Return positions read through an undistorted model of a camera that distorts, 5 m up, 6 m
    behind.
    """
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
    """Draw white noise, or correlated noise."""
    noise = rng.normal(size=n)
    if memory > 0:
        for i in range(1, n):
            keep = math.exp(-(t[i] - t[i - 1]) / memory)
            noise[i] = keep * noise[i - 1] + math.sqrt(1 - keep * keep) * noise[i]
    return sigma * noise
