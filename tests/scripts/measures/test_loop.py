"""The loop from hidden ice to throws on it, at small size."""

from __future__ import annotations

import numpy as np
import pytest
from blind.law import STEP
from measures.hidden_ice import (
    POSITION_NOISE,
    draw_hidden_ice,
    mixed_practice,
    noisy_track,
)
from measures.loop import misses

from agents.planning import plan_throw
from curling_env.physics import slide
from curling_env.sheet import TEE_Y
from curling_env.throw import Throw


@pytest.mark.parametrize("effects", [True, False])
def test_stones_run_on_the_hidden_ice_as_on_its_truth(effects: bool) -> None:
    hidden = draw_hidden_ice(np.random.default_rng(3), effects=effects)
    truth = hidden.truth()
    assert bool(truth.effects) is effects
    assert 0.03 < np.log(truth.friction.mu).std() < 0.11
    for speed, angle, spin in ((1.95, 0.03, 1.2), (1.7, -0.02, -1.5)):
        release = Throw(speed=speed, angle=angle, spin=spin).release()
        path, rest = hidden.path(release), slide(truth, release)
        # Another integrator, a continuous field instead of cells: millimetres apart.
        assert np.hypot(path[-1, 0] - rest.x, path[-1, 1] - rest.y) < 8e-3
        assert path[-1, 4] == pytest.approx(rest.theta, abs=0.03)


def test_the_cameras_errors_are_its_noise() -> None:
    hidden = draw_hidden_ice(np.random.default_rng(3))
    release = mixed_practice(4, np.random.default_rng(1))[2]
    track = noisy_track(hidden, release, 2, np.random.default_rng(2))
    path = hidden.path(release)
    t = np.arange(len(path)) * STEP
    true = np.column_stack([np.interp(track.t, t, path[:, k]) for k in (0, 1)])
    assert (track.xy - true).std() == pytest.approx(POSITION_NOISE, rel=0.1)
    assert np.diff(track.t).mean() == pytest.approx(1 / 30)


def test_plans_on_the_truth_succeed_on_the_hidden_ice() -> None:
    hidden = draw_hidden_ice(np.random.default_rng(3))
    truth = hidden.truth()
    draw = plan_throw(truth, (0.4, TEE_Y), skill="none")
    assert misses(hidden, truth, draw, np.zeros((1, 3)))[0] < 0.02
    hit = plan_throw(truth, "takeout", (-0.5, 17.8), skill="elite")
    made = misses(hidden, truth, hit, np.array([[0.0, 0.0, 0.0], [0.0, 0.03, 0.0]]))
    assert made[0] < 0.01
    assert made[1] == pytest.approx(28.6 * 0.03, rel=0.1)  # a metre beside the stone
