"""Specification of a film, and the position of the stone in each of its frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from curling_env.errors import InputError
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera
from friction_estimation.synthetic.cameras import named_camera
from friction_estimation.synthetic.sheet_drawing import Light


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmSpec:
    """Specification of a film.

    Parameters
    ----------
    camera : a name in `CAMERAS`, or any camera
    size : width and height [px]; None takes the named camera's own
    fps : frames per second
    exposure : exposure time, centred on the time of the frame [s]; it blurs moving stones
    noise : standard deviation of the sensor's noise [grey levels]
    people : show a thrower, sweepers and walkers
    lead_in : duration of the film before the release [s]
    tail : duration of the film after the stone has come to rest [s]
    light : lighting
    click_px : standard error of the clicks in the scene file [px]
    seed : seed for the ice's texture, the noise, the people and the clicks

    Raises
    ------
    InputError : a value out of range, or an unknown camera
    """

    camera: str | Camera = "end"
    size: tuple[int, int] | None = None
    fps: float = 30.0
    exposure: float = 0.004
    noise: float = 2.0
    people: bool = True
    lead_in: float = 0.5
    tail: float = 1.0
    light: Light = field(default_factory=Light)
    click_px: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not 1.0 <= self.fps <= 1000.0:
            raise InputError(f"expected 1 to 1000 frames per second, got {self.fps:g}")
        for name in ("noise", "lead_in", "tail", "click_px"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise InputError(f"{name} of a film must not be negative, got {value}")
        if not 0.0 <= self.exposure <= 1.0 / self.fps:
            raise InputError(
                f"exposure must be between 0 and a frame's {1 / self.fps:.3g} s, "
                f"got {self.exposure:g} s"
            )
        if self.seed < 0:
            raise InputError(f"a seed must not be negative, got {self.seed}")
        if not isinstance(self.camera, str) and self.size not in (None, self.camera.size):
            raise InputError("size belongs to the camera; set it there")
        self.resolved()

    def resolved(self) -> Camera:
        """Camera, looked up if it was given by name."""
        if isinstance(self.camera, str):
            return named_camera(self.camera, self.size)
        return self.camera

    @property
    def name(self) -> str:
        """Name of the film's files: that of the camera."""
        return self.camera if isinstance(self.camera, str) else "camera"


def on_film(trajectory: Trajectory, spec: FilmSpec) -> Trajectory:
    """Return the true place of the stone in every frame, with times from the first frame.

    A cubic through the trajectory's samples and velocities. Before the release the stone moves
    straight with its speed and spin at the release, and after the last sample it rests. Gaps in
    the headings are interpolated; if no heading is known, the handle points along +x.

    Raises
    ------
    InputError : a trajectory without samples
    """
    return all_on_film([trajectory], spec)[0]


def all_on_film(trajectories: Sequence[Trajectory], spec: FilmSpec) -> list[Trajectory]:
    """Return the true places of several stones in every frame; see `on_film`.

    Parameters
    ----------
    trajectories : the thrown stone's trajectory, then those of the others with times on the same
        clock; before its first sample each of the others rests there
    spec : specification of the film

    Raises
    ------
    InputError : a trajectory without samples
    """
    if any(len(trajectory) == 0 for trajectory in trajectories):
        raise InputError("a throw without a path cannot be filmed")
    # The film's times count from its first frame; the trajectories have another clock.
    start = float(trajectories[0].t[0])
    stop = max(float(trajectory.t[-1]) for trajectory in trajectories)
    count = int(np.floor((spec.lead_in + stop - start + spec.tail) * spec.fps + 1e-9)) + 1
    t = np.arange(count) / spec.fps
    since = t - spec.lead_in + start
    return [
        _on_film(trajectory, spec, t, since, thrown=k == 0)
        for k, trajectory in enumerate(trajectories)
    ]


def _on_film(
    trajectory: Trajectory, spec: FilmSpec, t: Floats, since: Floats, *, thrown: bool
) -> Trajectory:
    """Return places of one stone at times since the first frame (t) and on its own clock
    (since).
    """
    state, rate = _states(trajectory, spec)
    start, stop = float(trajectory.t[0]), float(trajectory.t[-1])
    values = state(np.clip(since, start, stop))
    if thrown:
        values = values + np.minimum(since - start, 0.0)[:, None] * rate(start)
    before = np.searchsorted(trajectory.t, since + 1e-9) - 1
    swept = trajectory.swept[np.maximum(before, 0)] * ((since >= start) & (since <= stop))
    return Trajectory(
        t=t,
        xy=values[:, :2],
        theta=values[:, 2],
        swept=swept,
        throw=trajectory.throw,
        stone=trajectory.stone,
        clock=trajectory.clock - spec.lead_in,
    )


def _states(trajectory: Trajectory, spec: FilmSpec) -> tuple[Any, Any]:
    """Return two functions of time: x, y, theta (n, 3), and their rates of change."""
    theta = trajectory.theta
    known = np.isfinite(theta)
    if known.any():
        theta = np.interp(trajectory.t, trajectory.t[known], theta[known])
    else:
        theta = np.zeros(len(trajectory))
    values = np.column_stack([trajectory.xy, theta])
    if len(trajectory) == 1:
        return (lambda t: np.repeat(values, np.size(t), axis=0)), (lambda t: np.zeros(3))
    order = 2 if len(trajectory) > 2 else 1
    rates = np.gradient(values, trajectory.t, axis=0, edge_order=order)
    curve = CubicHermiteSpline(trajectory.t, values, rates)
    return curve, curve.derivative()
