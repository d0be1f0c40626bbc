"""Sessions from tracks: rows kept, and their standard errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.trajectory import Trajectory
from friction_estimation.discovery import open_session


def track(*, fps: float = 20.0, sigma: object = None, throw: int = 0) -> Trajectory:
    t = np.arange(0.0, 15.0, 1.0 / fps)
    y = -10 + 2 * t - 0.045 * t**2
    claims = np.empty(0) if sigma is None else np.resize(np.asarray(sigma, dtype=float), len(t))
    noise = np.random.default_rng(throw).normal(0.0, 0.004, (len(t), 2))
    xy = np.column_stack([np.zeros(len(t)), y]) + noise
    return Trajectory(t=t, xy=xy, throw=throw, sigma_xy=claims)


@pytest.mark.parametrize(("fps", "kept"), [(20, 20), (40, 40), (120, 40), (240, 40)])
def test_of_a_fast_film_no_more_rows_are_kept_than_are_needed(fps: float, kept: float) -> None:
    session = open_session([track(fps=fps)])
    assert 1.0 / np.diff(session.times).mean() == pytest.approx(kept, rel=0.01)


def test_claims_count_by_their_ratio_and_a_missing_one_as_usual() -> None:
    tracks = [track(sigma=[0.002, 0.004, np.nan]), track(sigma=[0.002, 0.004, np.nan], throw=1)]
    claimed = open_session(tracks).sigma[:, 0]
    assert sorted(set(np.round(claimed, 6))) == pytest.approx([2 / 3, 1.0, 4 / 3])
    assert (open_session([track()]).sigma[:, 0] == 1.0).all()


def test_sweeping_begins_and_ends_midway_between_rows() -> None:
    whole = track()
    swept = ((whole.t > 3.01) & (whole.t < 5.01)) | (whole.t > 9.01)
    before, after = (
        replace(whole, swept=swept.astype(float)),
        replace(track(throw=1), swept=1.0 - swept),
    )
    session = open_session([before, after, track(throw=2)])
    switches, firsts, initially = session.sweeps
    assert np.diff(firsts).tolist() == [3, 3, 0]
    assert initially.tolist() == [0.0, 1.0, 0.0]
    begins = session.clocks.repeat(np.diff(firsts))
    assert begins + switches == pytest.approx([3.025, 5.025, 9.025] * 2)


@pytest.mark.parametrize("angle", [0.0, 0.02, np.pi, np.pi + 0.02])
def test_a_stone_turns_to_the_side_to_which_its_path_bends(angle: float) -> None:
    """Both ways along the sheet, and at any angle to it."""
    tracks: list[Trajectory] = []
    for throw, bend in enumerate((0.005, -0.005)):
        straight = track(throw=throw)
        curled = straight.xy + np.outer(bend * straight.t**2, [-1.0, 0.0])  # to the left
        turned = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
        tracks.append(replace(straight, xy=curled @ np.array(turned)))
    spins = open_session(tracks).with_spins_from_curvature().usual_spins
    assert np.sign(spins).tolist() == [1.0, -1.0]  # to the left as seen from above: positive
    assert spins[0] == -spins[1]
