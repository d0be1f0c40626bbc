"""Blind sessions: the sealed truth is the origin of the tracks."""

from __future__ import annotations

import json

import numpy as np
import pytest
from blind.hidden import FORMS, NAMES, log_map
from blind.law import (
    COUPLING,
    CURL_V,
    CURL_W,
    MAP_LENGTH,
    MAP_SD,
    MU,
    SIZE,
    SPIN_POWER,
    SQUARES,
    STEP,
)
from blind.sessions import make_session, release_of

from curling_env import simulate
from curling_env.ice import ActiveEffect, Ice
from curling_env.sheet import RULE_BOOK_STONE, Direction
from curling_env.throw import Release


def sealed_session(*hidden, seed=5, **options):
    columns, truth = make_session(hidden, np.random.default_rng(seed), **options)
    return columns, json.loads(json.dumps(truth, default=float))


def numbers_of(sealed):
    return np.array(sealed["numbers"]), np.array(sealed["pattern"]).reshape(-1, 3)


def test_the_sealed_throws_are_those_of_the_tracks():
    columns, sealed = sealed_session("friction_map", "curl", throws=3)
    q, pattern = numbers_of(sealed)
    for k, document in enumerate(sealed["throws"]):
        path = release_of(document).path(q, pattern, np.zeros(SQUARES))
        own = np.array(columns["throw"]) == k
        t = np.arange(len(path)) * STEP
        for name, j in (("x", 0), ("y", 1)):
            away = np.array(columns[name])[own] - np.interp(
                np.array(columns["t"])[own], t, path[:, j]
            )
            assert np.median(np.abs(away)) < sealed["sigma"]


@pytest.mark.parametrize("name", [*NAMES, *FORMS])
def test_whatever_is_hidden_changes_the_tracks(name):
    plain, _ = sealed_session(throws=4, seed=3)
    columns, sealed = sealed_session(name, throws=4, seed=3)
    assert list(sealed["effects"]) == [name]
    assert columns["x"] != plain["x"]
    assert ("map" in sealed) == name.startswith("friction_map")


def test_a_friction_map_has_the_size_and_the_length_that_are_sealed(rng):
    q, values = np.zeros(SIZE), []
    q[MAP_SD], q[MAP_LENGTH] = 0.04, 2.0
    for _ in range(300):
        waves = np.column_stack([rng.normal(size=(200, 2)) / 2.0, rng.uniform(0, 2 * np.pi, 200)])
        values.append(log_map(q, waves)[40:49, 4])
    field = np.array(values)
    assert field.std() == pytest.approx(0.04, rel=0.05)
    for cells, metres in ((2, 1.0), (4, 2.0), (8, 4.0)):
        correlation = (field[:, 0] * field[:, cells]).mean() / 0.04**2
        assert correlation == pytest.approx(np.exp(-(metres**2) / 8.0), abs=0.15)


def test_the_two_laws_agree_on_championship_ice():
    """The generator shares no code with the package, and yet a stone rests at the same place."""
    _, sealed = sealed_session(throws=3, championship=True)
    strengths, (q, pattern) = sealed["strengths"], numbers_of(sealed)
    effects = {
        "speed_dependent_friction": {"exponent": strengths["speed_dependent_friction"]},
        "air_drag": {"coefficient": strengths["air_drag"]},
        "curl": {
            "strength": strengths["curl"],
            "speed_exponent": q[CURL_V],
            "spin_exponent": q[CURL_W],
        },
        "spin_drag": {"rate": strengths["spin_drag"], "speed_exponent": q[SPIN_POWER]},
    }
    q[COUPLING] = RULE_BOOK_STONE.spin_coupling
    ice = Ice.uniform(
        q[MU], effects=tuple(ActiveEffect(name=n, parameters=p) for n, p in effects.items())
    )
    release = release_of({**sealed["throws"][0], "mu": q[MU], "sweep": [0.0, 0.0]})
    x, y, vx, vy, theta, omega = release.start
    release.start[2:4] *= 2.2 / np.hypot(vx, vy)
    vx, vy = release.start[2:4]
    path = release.path(q, pattern, np.zeros(SQUARES))
    ours = simulate(ice, [Release(x=x, y=y, vx=vx, vy=vy, theta=theta, omega=omega)])[0]
    assert Direction.AWAY * path[-1, 1] > 0
    np.testing.assert_allclose(path[-1, :2], ours.xy[-1], atol=0.01)
