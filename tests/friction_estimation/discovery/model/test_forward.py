"""Paths of the inference's forward model: right, smooth in every parameter, and safe to ask for."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.ice import Ice, load_ice
from curling_env.physics import State, slide
from curling_env.physics.law import acceleration
from curling_env.sheet import PAPER_SHEET, Direction
from curling_env.throw import Release, Throw
from friction_estimation.discovery import base_model, open_session, predict
from friction_estimation.discovery.data.session import Session, UnknownPushes
from friction_estimation.discovery.data.wear_tracks import WearTracks
from friction_estimation.discovery.model.model import true_states
from friction_estimation.discovery.model.response import Instants
from friction_estimation.discovery.model.sensitivity import friction_along

from ..conftest import effect, plain_session

ONE = np.zeros(1)
EDGE = effect("friction_patch", x_min=-0.5, x_max=1.5, y_min=-4.7, y_max=4.7, factor=1.16)


def state_of(release: Release):
    r = release
    return np.array([[r.x, r.y, r.vx, r.vy, r.theta, r.omega]])


def a_throw(ice: Ice, sweep=(0.0, 0.0), **throw: float):
    """A session of one throw that was measured without noise, and how it began."""
    given = {"speed": 2.0, "angle": 0.01, "spin": 1.5, "x": -0.2, **throw}
    release = Throw(**given).release(Direction.AWAY, sweep=sweep)
    path = slide(ice, release, fps=10, tolerance=1e-5).trajectory
    assert path is not None
    return open_session([path]), state_of(release), path


def mapped(interpolation: str, cell_size: float = 0.5) -> Ice:
    """Standard ice whose friction differs by five per cent from cell to cell."""
    ice = load_ice("standard")
    if cell_size != ice.sheet.cell_size:
        ice = ice.refined(round(ice.sheet.cell_size / cell_size))
    rough = np.random.default_rng(3).normal(0, 0.05, ice.friction.mu.shape)
    mu = ice.friction.mu * np.exp(rough)
    return replace(ice, friction=replace(ice.friction, mu=mu, interpolation=interpolation))


@pytest.mark.parametrize(
    "ice",
    [
        load_ice("standard"),
        load_ice("paper"),
        Ice.uniform(0.009, effects=(EDGE,)),
        mapped("cell"),
        mapped("bilinear"),
    ],
    ids=["standard", "paper", "sharp edges", "cells", "bilinear"],
)
def test_paths_are_those_of_the_simulator(ice):
    session, state, path = a_throw(ice, sweep=(2.05, 6.05))
    found = predict(base_model(ice, session), session, state, ONE)
    frames = np.abs(path.t[:, None] - session.times).argmin(axis=0)
    assert len(session.times) > 0.95 * len(path)
    assert np.abs(found[:, :2] - path.xy[frames])[:-1].max() < 2e-5  # the end is between frames


def test_a_path_may_have_more_nodes_than_there_is_room_for_at_first(monkeypatch):
    ice = mapped("cell")
    session, state, _ = a_throw(ice)
    model = base_model(ice, session)
    found = predict(model, session, state, ONE)
    monkeypatch.setattr("friction_estimation.discovery.model.forward.NODES", 10)
    assert np.array_equal(predict(model, session, state, ONE), found)


def rates(ice: Ice, session: Session, state, times, half=1e-4):
    """States at some times of one throw, and how fast the velocities change there."""
    around = (times[:, None] + [-half, 0.0, half]).ravel()
    starts = np.array([0, len(around)])
    states = true_states(base_model(ice, session), session, state, ONE, around, starts)
    before, now, after = states.reshape(-1, 3, 6).swapaxes(0, 1)
    velocities = [State.VX, State.VY, State.OMEGA]
    return now, (after - before)[:, velocities] / (2 * half)


def test_a_throw_may_be_swept_several_times():
    ice = Ice.uniform(0.009, effects=(effect("sweeping", friction_factor=0.8),))
    session, state, _ = a_throw(ice)
    swept = ((session.times > 2.0) & (session.times < 5.0)) | (session.times > 9.0)
    session = replace(session, swept=swept.astype(float))
    times = np.array([1.0, 1.9, 2.1, 3.0, 4.9, 5.1, 7.0, 8.9, 9.2, 12.0])
    now, seen = rates(ice, session, state, times)
    is_swept = ((times > 2.0) & (times < 5.0)) | (times > 9.0)
    for k, s in enumerate(now):
        law = acceleration(ice, s[None, [0, 1, 2, 3, 5]], swept=bool(is_swept[k]))
        assert seen[k] == pytest.approx(law[0], abs=1e-5)


def test_something_unknown_pushes_beside_the_law():
    ice = load_ice("standard")
    session, state, _ = a_throw(ice)
    sizes = np.linspace(0, 1, 200)[:, None] * np.array([0.1, 2e-3, 1e-3, 0.02])
    pushes = UnknownPushes(sizes, np.array([0, 200]), np.array([0.15]))
    session = replace(session, pushes=pushes)
    times = np.array([0.5, 4.0, 9.0, 15.0])
    now, seen = rates(ice, session, state, times)
    heavier = replace(ice, friction=replace(ice.friction, mu=2 * ice.friction.mu))
    for k, s in enumerate(now):
        ln_mu, left, across, turn = pushes.at(0, times[k : k + 1])[0]
        moving = s[None, [0, 1, 2, 3, 5]]
        plain, doubled = (acceleration(i, moving)[0] for i in (ice, heavier))
        vx, vy = s[State.VX], s[State.VY]
        aside = left / np.hypot(vx, vy)
        law = plain + (np.exp(ln_mu) - 1) * (doubled - plain)
        law += [across - aside * vy, aside * vx, turn]
        assert seen[k] == pytest.approx(law, abs=2e-5)


@pytest.mark.parametrize("ice", [load_ice("standard"), mapped("cell")], ids=["standard", "cells"])
def test_differences_by_the_speed_are_smooth(ice):
    session, state, _ = a_throw(ice)
    model = base_model(ice, session)
    step = np.array([0.0, 0.0, 0.0, 2e-4, 0.0, 0.0])
    differences = []
    for k in range(8):
        begin = state * (1 + 1e-5 * k * (np.arange(6) == 3))
        two = [predict(model, session, s, ONE)[:, :2] for s in (begin, begin + step)]
        differences.append((two[1] - two[0]) / step.max())
    size = np.abs(differences).max()
    bent = np.diff(differences, 2, axis=0)
    assert np.sqrt(np.mean(bent**2)) < 3e-4 * size


def test_a_stone_that_a_trial_sends_off_the_sheet_is_left_far_off():
    ice = replace(load_ice("standard"), sheet=PAPER_SHEET)
    session, state, _ = a_throw(ice)
    found = predict(base_model(ice, session), session, 1e4 * state, ONE)
    assert np.isfinite(found).all()
    still = predict(base_model(ice, session), session, 0 * state, ONE)
    assert np.array_equal(still, np.zeros_like(still))


# --- several throws, each in its own circumstances -----------------------------------------------

VARIED = (
    effect("sweeping", friction_factor=0.8),
    effect("time_drift", rate=5e-4),
    effect("stone_bias", stone=1, factor=1.3),
    effect("curl", strength=0.006),
)
LN_FACTORS = np.array([0.0, 0.2, -0.1])


def varied_session() -> Session:
    """Throws of two stones: unswept, swept twice, and swept at first and in the end."""
    session = plain_session(throws=3, rows=41, spacing=0.25, stones=np.array([0, 1, 0]))
    t, own = session.times, session.owner
    twice = ((t > 2.1) & (t < 4.1)) | ((t > 6.1) & (t < 7.1))
    ends = (t < 3.1) | (t > 8.1)
    swept = np.where(own == 1, twice, np.where(own == 2, ends, False))
    return replace(session, swept=swept.astype(float))


def is_swept(throw: int, t: float) -> bool:
    """Return whether a throw of that session is swept: begin and end are midway between rows."""
    if throw == 1:
        return 2.125 < t < 4.125 or 6.125 < t < 7.125
    return throw == 2 and (t < 3.125 or t > 8.125)


INSTANTS = np.array([0.3, 2.0, 2.4, 4.0, 4.3, 6.0, 6.3, 7.0, 7.5, 8.0, 8.4])


def law_at(ice: Ice, throw: int, t: float, s: np.ndarray) -> np.ndarray:
    """Acceleration of a stone of that session in a state."""
    mu = ice.friction.mu * np.exp(LN_FACTORS[throw])
    own = replace(ice, friction=replace(ice.friction, mu=mu))
    given: Any = {"t": t, "clock": 60.0 * throw + t, "heading": s[State.THETA]}
    swept, stone = is_swept(throw, t), int(throw == 1)
    moving = s[None, [0, 1, 2, 3, 5]]
    return acceleration(own, moving, swept=swept, stone=stone, order=throw, **given)[0]


@pytest.mark.parametrize("ice", [Ice.uniform(0.009), mapped("bilinear")], ids=["even", "mapped"])
def test_every_throw_slides_in_its_own_circumstances(ice):
    ice = replace(ice, effects=VARIED)
    session = varied_session()
    half = 1e-4
    around = np.tile((INSTANTS[:, None] + [-half, 0.0, half]).ravel(), 3)
    starts = 3 * len(INSTANTS) * np.arange(4)
    model = base_model(ice, session)
    found = true_states(model, session, session.first_states, LN_FACTORS, around, starts)
    before, now, after = found.reshape(-1, 3, 6).swapaxes(0, 1)
    velocities = [State.VX, State.VY, State.OMEGA]
    seen = (after - before)[:, velocities] / (2 * half)
    for k, s in enumerate(now):
        throw, at = divmod(k, len(INSTANTS))
        assert seen[k] == pytest.approx(law_at(ice, throw, INSTANTS[at], s), abs=3e-5)


@pytest.mark.parametrize("ice", [Ice.uniform(0.009), mapped("bilinear")], ids=["even", "mapped"])
def test_the_part_of_friction_is_what_twice_the_friction_adds(ice, rng):
    ice = replace(ice, effects=VARIED)
    session = varied_session()
    path = np.column_stack([
        *rng.uniform(-1.5, 1.5, (2, 33)), *rng.uniform(0.3, 2.0, (2, 33)), *rng.normal(size=(2, 33))
    ])  # fmt: skip
    instants = Instants(np.tile(INSTANTS, 3), len(INSTANTS) * np.arange(4))
    paths: Any = SimpleNamespace(path=path, instants=instants)
    found = friction_along(base_model(ice, session), session, LN_FACTORS, paths)
    heavier = replace(ice, friction=replace(ice.friction, mu=2 * ice.friction.mu))
    for k, s in enumerate(path):
        throw, at = divmod(k, len(INSTANTS))
        part = law_at(heavier, throw, INSTANTS[at], s) - law_at(ice, throw, INSTANTS[at], s)
        assert found[k] == pytest.approx(part, rel=1e-6, abs=1e-9)


def test_stones_that_ran_before_wear_the_ice_of_a_throw():
    """Along one path: after one stone the friction there is that of one pass, and so on."""
    wear = effect("pebble_wear", along_path=-0.08)
    ice = Ice.uniform(0.009, replace(PAPER_SHEET, cell_size=0.1), effects=(wear,))
    y = np.linspace(-15.0, 15.0, 200)
    ran = WearTracks.of((k, np.column_stack([0 * y, y])) for k in range(3))
    session = plain_session(throws=3, wear_tracks=ran)
    path = np.zeros((3, 6))
    path[:, 0], path[:, 3] = [0.0, 0.0, 0.5], 1.5
    instants = Instants(np.full(3, 1.0), np.arange(4))
    paths: Any = SimpleNamespace(path=path, instants=instants)
    model = base_model(ice, session)
    drags = friction_along(model, session, np.zeros(3), paths)[:, 1]
    assert drags[0] < 0.0
    passes = session.wear_tracks.passes(model.wear_sheet)
    under = model.wear_sheet.cell_of([0.0, 0.0])
    assert drags[1] / drags[0] == pytest.approx(np.exp(-0.08 * passes[1][*under]), rel=0.02)
    assert drags[2] / drags[0] == pytest.approx(1.0)  # half a metre beside it the ice is fresh


def test_before_its_release_a_stone_waits_and_after_its_end_it_rests():
    session = plain_session(throws=2)
    ice = Ice.uniform(0.009)
    times, starts = np.array([-1.0, 0.0, 500.0, 600.0]), np.array([0, 4, 4])
    states = session.first_states
    found = true_states(base_model(ice, session), session, states, np.zeros(2), times, starts)
    assert found[0].tolist() == states[0].tolist()
    assert found[1].tolist() == states[0].tolist()
    assert found[3] == pytest.approx(found[2])
    assert np.hypot(found[2, 2], found[2, 3]) < 0.01
    stops = 2.0**2 / (2 * 9.80665 * 0.009) - 10.0
    assert found[2, 1] == pytest.approx(stops, rel=0.03)
