"""Ice hidden from estimators and planner, with its practice throws.

Stones slide by the law of the blind sessions, which shares nothing with `curling_env.physics`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from blind import law
from blind.hidden import hidden_numbers
from blind.sessions import TrueIce

from curling_env.ice import ActiveEffect, FrictionMap, Ice
from curling_env.sheet import PAPER_SHEET, RULE_BOOK_STONE, Direction
from curling_env.throw import Release, Throw
from curling_env.trajectory import Trajectory

WAVES = 24
"""Number of waves that make up the friction map."""
MAP_ALONG, MAP_ACROSS = 4.0, 1.6
"""Distances over which friction changes along and across the sheet [m]."""
TRUTH_CELL = 0.25
"""Cell size of the true ice as an `Ice` [m]; so fine that a draw's rest differs by millimetres."""
SECONDS_BETWEEN_THROWS = 60.0
POSITION_NOISE, HEADING_NOISE = 0.005, 0.02
"""Standard deviations of a measured coordinate [m] and heading [rad], frame by frame."""


@dataclass(frozen=True, kw_only=True, eq=False)
class HiddenIce(TrueIce):
    """Sealed ice that is also known as an `Ice`."""

    def truth(self) -> Ice:
        """Return the same ice as an `Ice` with fine cells."""
        q, sheet = self.numbers, replace(PAPER_SHEET, cell_size=TRUTH_CELL)
        x, y = np.meshgrid(sheet.x_centres, sheet.y_centres)
        waves = np.cos(x[..., None] * self.pattern[:, 0] + y[..., None] * self.pattern[:, 1]
                       + self.pattern[:, 2])  # fmt: skip
        mu = q[law.MU] * np.exp(q[law.MAP_SD] * np.sqrt(2 / WAVES) * waves.sum(axis=-1))
        parameters = {
            "speed_dependent_friction": {"exponent": q[law.EXPONENT]},
            "curl": {"strength": q[law.CURL], "speed_exponent": q[law.CURL_V]},
            "slope": {"x": q[law.SLOPE_X], "y": q[law.SLOPE_Y]},
        }
        stone = RULE_BOOK_STONE
        return Ice(
            sheet=sheet,
            friction=FrictionMap(mu=mu, sigma=0 * mu, observed=np.ones(mu.shape, dtype=bool)),
            effects=tuple(
                ActiveEffect(name=name, parameters={k: float(v) for k, v in values.items()})
                for name, values in parameters.items()
                if any(values.values())
            ),
            stone=replace(stone, inertia=stone.mass * law.BAND**2 / float(q[law.COUPLING])),
        )


def draw_hidden_ice(rng: np.random.Generator, *, effects: bool = True) -> HiddenIce:
    """Draw an ice that is uneven by 5 to 8 %, with or without effects."""
    q = hidden_numbers(rng)
    q[law.MU], q[law.MAP_SD] = rng.uniform(0.007, 0.0095), rng.uniform(0.05, 0.08)
    turn, fall = rng.uniform(0, 2 * np.pi), rng.uniform(0.5e-4, 3e-4)
    strengths = rng.uniform([0.12, 0.005, 0.1], [0.3, 0.01, 0.4])
    if effects:
        q[[law.EXPONENT, law.CURL, law.CURL_V]] = strengths
        q[[law.SLOPE_X, law.SLOPE_Y]] = fall * np.cos(turn), fall * np.sin(turn)
    waves = rng.normal(size=(WAVES, 2)) / [MAP_ACROSS, MAP_ALONG]
    phases = rng.uniform(0.0, 2 * np.pi, WAVES)
    return HiddenIce(numbers=q, pattern=np.column_stack([waves, phases]))


def mixed_practice(n: int, rng: np.random.Generator) -> list[Release]:
    """Return releases of n throws to both ends, both handles, weights from guard to takeout.

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
    """Return the track of one throw with white noise in every frame.

    It ends when the stone leaves the ice, or a second after it comes to rest.
    """
    path = ice.path(release)
    rests = np.hypot(path[-1, 2], path[-1, 3]) < law.STOP
    t = np.arange(len(path)) * law.STEP
    frames = np.arange(0.0, t[-1] + rests, 1 / fps)
    seen = np.column_stack([np.interp(frames, t, path[:, j]) for j in (0, 1, 4)])
    seen += rng.normal(size=seen.shape) * [POSITION_NOISE, POSITION_NOISE, HEADING_NOISE]
    return Trajectory(t=frames, xy=seen[:, :2], theta=seen[:, 2], throw=throw, clock=release.clock)
