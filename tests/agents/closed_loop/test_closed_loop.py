"""The loop from hidden ice to throws on it, at small size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agents.closed_loop import (
    POSITION_NOISE,
    draw_hidden_ice,
    execute_plan,
    mixed_practice,
    noisy_track,
    run_stone,
    track_errors,
)
from agents.planning import plan, plan_task
from curling_env.physics import slide
from curling_env.sheet import TEE_Y
from curling_env.throw import Throw


@pytest.mark.parametrize("effects", [True, False])
def test_stones_run_on_the_hidden_ice_as_on_its_truth(effects: bool) -> None:
    hidden = draw_hidden_ice(np.random.default_rng(3), effects=effects)
    truth = hidden.truth()
    assert bool(truth.effects) is effects
    assert 0.045 < hidden.spread < 0.085
    for speed, angle, spin in ((1.95, 0.03, 1.2), (1.7, -0.02, -1.5)):
        release = Throw(speed=speed, angle=angle, spin=spin).release()
        path, rest = run_stone(hidden, release), slide(truth, release)
        # Another integrator, a continuous field instead of cells: millimetres apart.
        assert np.hypot(path[-1, 1] - rest.x, path[-1, 2] - rest.y) < 8e-3
        assert path[-1, 5] == pytest.approx(rest.theta, abs=0.03)


def test_the_cameras_errors_are_its_noise() -> None:
    hidden = draw_hidden_ice(np.random.default_rng(3))
    release = mixed_practice(4, np.random.default_rng(1))[2]
    track = noisy_track(hidden, release, 2, np.random.default_rng(2))
    path = run_stone(hidden, release)
    true = np.column_stack([np.interp(track.t, path[:, 0], path[:, k]) for k in (1, 2)])
    assert (track.xy - true).std() == pytest.approx(POSITION_NOISE, rel=0.1)
    assert np.diff(track.t).mean() == pytest.approx(1 / 30)


def test_tracks_are_compared_with_the_truth_in_the_time_of_the_session() -> None:
    hidden = draw_hidden_ice(np.random.default_rng(3))
    releases = mixed_practice(4, np.random.default_rng(1))
    rng = np.random.default_rng(2)
    tracks = [noisy_track(hidden, release, k, rng) for k, release in enumerate(releases)]
    assert track_errors(hidden, releases, tracks) == pytest.approx(
        POSITION_NOISE * np.sqrt(2), rel=0.1
    )
    late = [replace(seen, t=seen.t + 0.5, clock=seen.clock - 0.5) for seen in tracks]
    assert track_errors(hidden, releases, late) == pytest.approx(
        POSITION_NOISE * np.sqrt(2), rel=0.1
    )
    # An error of half a second in the clock is as far as a stone runs in that time.
    assert track_errors(hidden, releases, [replace(s, t=s.t + 0.5) for s in tracks]).min() > 0.3


def test_plans_on_the_truth_succeed_on_the_hidden_ice() -> None:
    hidden = draw_hidden_ice(np.random.default_rng(3))
    truth = hidden.truth()
    draw = plan(truth, (0.4, TEE_Y), skill="none")
    made = execute_plan(hidden, truth, truth, draw, np.zeros((1, 3)))
    assert made.miss[0] < 0.02
    assert made.success.all()
    hit = plan_task(truth, "takeout", (-0.5, 17.8), skill="elite")
    made = execute_plan(hidden, truth, truth, hit, np.array([[0.0, 0.0, 0.0], [0.0, 0.03, 0.0]]))
    assert made.success.tolist() == [True, False]  # the second passes a metre beside the stone
    assert made.miss[0] < 0.01
    assert made.miss[1] == pytest.approx(28.6 * 0.03, rel=0.1)
