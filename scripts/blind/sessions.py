"""Sessions with a hidden effect, made without the project's force law.

Formulas, integrator and noise are this folder's own, so that discovery is tested on data that its
own model did not make.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from blind.camera import draw_camera, photograph
from blind.hidden import (
    SCATTER,
    STRENGTH_PLACES,
    championship_numbers,
    draw_map,
    has_map,
    hidden_numbers,
    hide,
    log_map,
)
from blind.law import HOG, MU, SQUARES, STEP, run_over, throw_path
from curling_env import throw
from curling_env.typing import Floats

LONGEST = 70.0
"""Maximum duration of a throw [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Release:
    """Release of one throw.

    Parameters
    ----------
    start : (6,) x, y, vx, vy, theta, spin at the hog line, sheet frame
    clock : session time at the release [s]
    order : number of throws played before
    stone : number of the stone
    sweep : (2,) start and end of the sweeping after the release [s]
    mu : friction of this throw, which scatters from throw to throw
    """

    start: Floats
    clock: float
    order: int
    stone: int
    sweep: Floats
    mu: float

    def path(self, q: Floats, pattern: Floats, passes: Floats) -> Floats:
        """Return states every `STEP` until rest or the edge, (n, 6), after earlier `passes`."""
        own = q.copy()
        own[MU] = self.mu
        out = np.empty((int(LONGEST / STEP), 6))
        n = throw_path(
            own,
            pattern,
            passes,
            self.start,
            self.clock,
            float(self.order),
            float(self.stone),
            self.sweep,
            out,
        )
        return out[:n]

    def document(self) -> dict[str, Any]:
        """Return the entry of the sealed truth."""
        return {
            "start": self.start.tolist(),
            "clock": self.clock,
            "order": self.order,
            "stone": self.stone,
            "sweep": self.sweep.tolist(),
            "mu": self.mu,
        }


def release_of(sealed: dict[str, Any]) -> Release:
    """Read a throw of the sealed truth."""
    arrays = {key: np.array(sealed[key]) for key in ("start", "sweep")}
    return Release(**{**sealed, **arrays})


@dataclass(frozen=True, kw_only=True, eq=False)
class TrueIce:
    """Sealed ice before the first stone.

    Parameters
    ----------
    numbers : numbers of `law`
    pattern : (n, 3) wave numbers across and along the sheet [1/m], and phase
    """

    numbers: Floats
    pattern: Floats

    def path(self, release: throw.Release) -> Floats:
        """Return states every `STEP` until rest or the edge, (n, 6)."""
        start = (release.x, release.y, release.vx, release.vy, release.theta, release.omega)
        own = Release(
            start=np.array(start, dtype=float),
            clock=0.0,
            order=0,
            stone=0,
            sweep=np.array([release.sweep_start, release.sweep_end]),
            mu=float(self.numbers[MU]),
        )
        return own.path(self.numbers, self.pattern, np.zeros(SQUARES))


def true_ice(sealed: dict[str, Any]) -> TrueIce:
    """Read the ice of the sealed truth."""
    pattern = np.array(sealed["pattern"]).reshape(-1, 3)
    return TrueIce(numbers=np.array(sealed["numbers"]), pattern=pattern)


def make_session(
    effects: tuple[str, ...],
    rng: np.random.Generator,
    *,
    throws: int = 16,
    fresh: int = 0,
    ways: int = 2,
    championship: bool = False,
    scale: float = 1.0,
    bad: bool = False,
) -> tuple[dict[str, list[Any]], dict[str, Any]]:
    """Make the columns of a track file, and the sealed truth.

    Parameters
    ----------
    fresh : number of throws played after the session, on the same ice; the last in the columns
    ways : directions of play, 2 or 1
    championship : use ice like the preset `standard`, each of its strengths off by 10 to 40 per
        cent
    scale : factor on the usual sizes of the effects
    bad : give positions errors of 8 mm with a memory of a second, and throws a scatter of 1 %
    """
    q = championship_numbers(rng) if championship else hidden_numbers(rng)
    errors: dict[str, Any] = {}
    truth = {name: hide(name, q, errors, rng, scale=scale) for name in effects}
    pattern = draw_map(q, rng)
    camera = draw_camera(errors, rng, bad=bad)
    scatter = 0.01 if bad else SCATTER
    columns: dict[str, list[Any]] = {
        k: [] for k in ("throw", "t", "x", "y", "theta", "stone", "clock", "swept")
    }
    speeds = rng.permutation(np.linspace(1.3, 3.0, throws) + rng.uniform(-0.1, 0.1, throws))
    clock = 0.0
    gap = rng.integers(throws // 3, 2 * throws // 3)
    passes = np.zeros(SQUARES)
    # As in a game, every stone is played about equally often; otherwise it could not be found.
    stones = np.concatenate([rng.permutation(np.arange(throws) % 4), rng.integers(0, 4, fresh)])
    speeds = np.concatenate([speeds, rng.uniform(1.4, 2.9, fresh)])
    releases: list[Release] = []
    for k in range(throws + fresh):
        release = draw_release(
            rng,
            direction=1.0 if k % ways == 0 else -1.0,
            speed=speeds[k],
            stone=int(stones[k]),
            order=k,
            clock=clock,
            mu=q[MU],
            scatter=scatter,
        )
        path = release.path(q, pattern, passes)
        run_over(passes, path)
        rows = photograph(path, release.sweep, camera, rng)
        count = len(rows["t"])
        rows |= {"throw": [k] * count, "stone": [release.stone] * count}
        rows["clock"] = [round(clock, 1)] * count
        for key, values in rows.items():
            columns.setdefault(key, []).extend(values)
        releases.append(release)
        clock += rng.uniform(40, 85) + (1500.0 if k == gap else 0.0)
    sealed = {
        "effects": truth,
        "mu": q[MU],
        "sigma": camera.sigma,
        "memory": camera.memory,
        "scatter": scatter,
        "camera": {key: np.asarray(value).tolist() for key, value in errors.items()},
        "numbers": q.tolist(),
        "pattern": pattern.tolist(),
        "throws": [release.document() for release in releases],
    }
    if has_map(q):
        sealed["map"] = log_map(q, pattern).tolist()
    if championship:
        sealed["strengths"] = {name: float(q[place]) for name, place in STRENGTH_PLACES.items()}
    return columns, sealed


def draw_release(
    rng: np.random.Generator,
    *,
    direction: float,
    speed: float,
    stone: int,
    order: int,
    clock: float,
    mu: float,
    scatter: float,
) -> Release:
    """Draw a throw at a speed towards an end: its line, spin and sweeping, and its own friction."""
    line = rng.normal(0, 0.008)
    start = np.array(
        [
            rng.uniform(-1.0, 1.0),
            -direction * HOG,
            -direction * speed * math.sin(line),
            direction * speed * math.cos(line),
            rng.uniform(-np.pi, np.pi),
            rng.choice([-1.0, 1.0]) * rng.uniform(0.8, 2.4),
        ]
    )
    sweep = np.zeros(2)
    if rng.random() < 0.4:
        begin = rng.uniform(1.0, 6.0)
        sweep = np.array([begin, begin + rng.uniform(3.0, 9.0)])
    return Release(
        start=start,
        clock=clock,
        order=order,
        stone=stone,
        sweep=sweep,
        mu=mu * math.exp(rng.normal(0, scatter)),
    )
