"""The law from a table says what the law says, and holds only what depends on speed and spin."""

from dataclasses import replace

import numpy as np
import pytest

from curling_env import Throw, load_ice
from curling_env.commands.benchmarks import mapped_ice
from curling_env.ice import ActiveEffect
from curling_env.physics import (
    CLOCK,
    HEADING,
    MOTION_SIZE,
    ORDER,
    PUSH_SIZE,
    STONE,
    SWEPT,
    T,
    catalogue,
    compile_law,
    play_batch,
)
from curling_env.physics import law as law_module
from curling_env.physics.law import NO_TABLE
from curling_env.physics.motion import (
    CONTACTS,
    LOG_SLIP,
    LOG_SPEED,
    SLIP,
    SPEED,
    SPIN,
    TRAVEL_X,
    TRAVEL_Y,
    X,
    Y,
)

TABLED = sorted(name for name, card in catalogue().items() if card.of_speed_and_spin)


def forces(law, speeds, spins, swept=0.0):
    """Accelerations (n, 3) of stones that travel across the sheet at an angle."""
    motion = np.zeros(MOTION_SIZE)
    motion[SWEPT] = swept
    states = np.column_stack(
        [np.full(len(speeds), 0.3), np.full(len(speeds), 2.0), 0.6 * speeds, 0.8 * speeds, spins]
    )
    out = np.empty((len(speeds), 3))
    law_module._force(law, motion, np.empty(PUSH_SIZE), np.empty(6), states, out)
    return out


@pytest.mark.parametrize("preset", ["standard", "fcv1", "paper"])
def test_the_table_follows_the_law(preset, rng):
    ice = load_ice(preset)
    speeds, spins = rng.uniform(0.02, 4.0, 4000), rng.uniform(-3.0, 3.0, 4000)
    exact, table = (forces(compile_law(ice, tabulated=t), speeds, spins) for t in (False, True))
    off = np.abs(table - exact) / np.abs(exact).max(axis=0)
    ratio = ice.stone.band_radius * np.abs(spins) / speeds
    fast = ratio < 0.7
    assert fast.sum() > 2000
    assert off[fast].max() < 1e-4
    assert off.max() < 0.06


def test_beyond_the_table_the_law_is_evaluated():
    ice = load_ice("standard")
    speeds, spins = np.array([9.0, 1e-4, 2.0, 2.0]), np.array([1.5, 1.5, 9.0, -20.0])
    exact, table = (forces(compile_law(ice, tabulated=t), speeds, spins) for t in (False, True))
    np.testing.assert_array_equal(table, exact)


def test_effects_of_place_and_sweeping_act_beside_the_table():
    ice = load_ice("standard")
    patch = {"x_min": -1.0, "x_max": 1.0, "y_min": 0.0, "y_max": 4.0, "factor": 1.2}
    others = (
        ActiveEffect(name="friction_patch", parameters=patch),
        ActiveEffect(name="slope", parameters={"x": 0.0002, "y": -0.0001}),
        ActiveEffect(name="sweeping"),
    )
    speeds, spins = np.linspace(0.5, 3.0, 50), np.full(50, -1.2)
    for swept in (0.0, 1.0):
        bare = forces(compile_law(ice, tabulated=True), speeds, spins, swept)
        with_others = replace(ice, effects=(*others, *ice.effects))
        exact = forces(compile_law(with_others), speeds, spins, swept)
        table = forces(compile_law(with_others, tabulated=True), speeds, spins, swept)
        np.testing.assert_allclose(table, exact, rtol=1e-4, atol=1e-7)
        assert np.abs(table - bare).max() > 1e-3


@pytest.mark.parametrize("name", TABLED)
def test_a_kernel_in_the_table_reads_speed_spin_and_slips_alone(name, rng):
    import ctypes

    card = catalogue()[name]
    double = ctypes.POINTER(ctypes.c_double)
    kernel = ctypes.CFUNCTYPE(None, double, double, double)(card.kernel.address)
    values = {p.name: 0.6 * max(p.low, -0.5) + 0.4 * min(p.high, 1.0) for p in card.parameters}
    theta = np.array(card.theta(values), dtype=np.float64)
    motion = np.zeros(MOTION_SIZE)
    motion[SPEED], motion[SPIN], motion[CONTACTS] = 1.3, 1.1, 8
    motion[LOG_SPEED] = np.log(1.3)
    motion[SLIP : SLIP + 8] = np.linspace(0.5, 2.0, 8)
    motion[LOG_SLIP : LOG_SLIP + 8] = np.log(motion[SLIP : SLIP + 8])
    pushes = []
    for _ in range(2):
        motion[[X, Y, HEADING, T, CLOCK, ORDER, STONE, SWEPT]] = rng.integers(1, 9, 8)
        motion[[TRAVEL_X, TRAVEL_Y]] = rng.uniform(-1, 1, 2)
        push = np.ones(PUSH_SIZE)
        kernel(*(array.ctypes.data_as(double) for array in (motion, theta, push)))
        pushes.append(push)
    assert (pushes[0] != 1.0).any()
    np.testing.assert_array_equal(*pushes)


def test_an_unknown_law_of_the_contacts_is_evaluated(monkeypatch):
    card = catalogue()["speed_dependent_friction"]
    cards = {**catalogue(), card.name: replace(card, of_speed_and_spin=False)}
    monkeypatch.setattr(law_module, "catalogue", lambda: cards)
    law = compile_law(load_ice("standard"), tabulated=True)
    assert law.table is NO_TABLE
    assert law.tabled == 0


def test_throws_by_the_table_rest_where_the_law_has_them(rng):
    ice = mapped_ice(rng)
    throws = [Throw(speed=v, angle=0.03, spin=s) for v in (1.95, 2.05, 2.1) for s in (-1.5, 0.2)]
    releases = [throw.release() for throw in throws]
    nobody = np.full((len(throws), 1, 2), np.nan)
    exact, table = (
        play_batch(ice, nobody, releases, tolerance=1e-4, tabulated=t) for t in (False, True)
    )
    assert np.abs(table.last - exact.last)[:, -1].max() < 1e-4
    assert (table.last != exact.last)[:, -1].any()
