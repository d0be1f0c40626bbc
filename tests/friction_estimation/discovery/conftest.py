"""Sessions with known effects, for the tests of discovery."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics import register, slide, unregister
from curling_env.sheet import Direction
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory
from friction_estimation.discovery import measurement_effects
from friction_estimation.discovery.data.session import Session

MakeSession = Callable[..., list[Trajectory]]


def effect(name: str, **parameters: float) -> ActiveEffect:
    return ActiveEffect(name=name, parameters=parameters)


def plain_session(throws: int = 2, rows: int = 12, spacing: float = 0.5, **columns) -> Session:
    """Straight throws without noise, in turn in both directions, that slow down evenly.

    They turn with 1.2 rad/s. Other columns of the session may be given.
    """
    t = spacing * np.arange(rows)
    ways = np.where(np.arange(throws) % 2 == 0, 1.0, -1.0)
    y = np.concatenate([way * (-10.0 + 2.0 * t - 0.045 * t**2) for way in ways])
    session = Session(
        throws=np.arange(throws),
        orders=np.arange(throws),
        stones=np.zeros(throws, dtype=np.intp),
        clocks=60.0 * np.arange(throws),
        times=np.tile(t, throws),
        xy=np.column_stack([np.zeros(len(y)), y]),
        theta=np.tile(1.2 * t, throws),
        swept=np.zeros(len(y)),
        sigma=np.ones((len(y), 2)),
        starts=np.arange(throws + 1) * rows,
        usual_spins=np.full(throws, 1.5),
    )
    return replace(session, **columns)


@contextmanager
def _without_effects(*names: str) -> Generator[None]:
    taken_out = [unregister(name) for name in names]
    try:
        yield
    finally:
        for card in taken_out:
            register(card)


@pytest.fixture
def without_effects() -> Callable[..., AbstractContextManager[None]]:
    """A context in which the catalogue lacks the effects of these names."""
    return _without_effects


@pytest.fixture
def make_session() -> MakeSession:
    def make(
        effects: Sequence[ActiveEffect] = (),
        *,
        throws: int = 12,
        seed: int = 1,
        sigma: float = 0.004,
        scatter: float = 0.002,
        mu: float = 0.009,
        fps: int = 15,
    ) -> list[Trajectory]:
        """Throws in both directions, with both spins, three stones, some of them swept."""
        rng = np.random.default_rng(seed)
        camera = {card.name: card for card in measurement_effects()}
        on_ice = tuple(e for e in effects if e.name not in camera)
        speeds = rng.permutation(np.linspace(1.3, 2.9, throws))
        tracks: list[Trajectory] = []
        for k in range(throws):
            ice = Ice.uniform(mu * float(np.exp(rng.normal(0, scatter))), effects=on_ice)
            throw = Throw(
                speed=float(speeds[k]),
                angle=float(rng.normal(0, 0.006)),
                spin=float(rng.choice([-1, 1]) * rng.uniform(0.8, 2.2)),
                x=float(rng.uniform(-0.8, 0.8)),
            )
            release = throw.release(
                Direction.AWAY if k % 2 == 0 else Direction.HOME,
                stone=k % 3,
                clock=70.0 * k + (1500.0 if k > throws // 2 else 0.0),
                order=k,
                sweep=(3.0, 9.0) if k % 3 == 1 else (0.0, 0.0),
            )
            path = slide(ice, release, fps=fps, throw=k).trajectory
            assert path is not None
            xy, theta = path.xy.copy(), path.theta
            for e in effects:
                if e.name in camera:
                    card = camera[e.name]
                    assert card.displacement is not None
                    values = {p.name: p.default or 0.0 for p in card.parameters}
                    xy += card.displacement(path.xy, theta, {**values, **e.parameters})
            tracks.append(
                replace(
                    path,
                    xy=xy + rng.normal(0, sigma, xy.shape),
                    theta=theta + rng.normal(0, 0.02, len(theta)),
                )
            )
        return tracks

    return make
