"""Memory of the ice: amount and place of wear, the same in games and sessions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.game import Call, GameSimulator, IceEvolution, ice_for_game
from curling_env.ice import ActiveEffect, FrictionMap, Ice, load_ice
from curling_env.physics import (
    PATH_FPS,
    slide,
    slides_in_turn,
    wear_along_path,
    wear_of,
    wear_under_contacts,
    worn,
)
from curling_env.sheet import Direction, Sheet
from curling_env.throw import Throw
from curling_env.worn_tracks import WORN_WIDTH

ALONG = -0.01
DRAW = Throw(speed=2.09, angle=-0.045, spin=1.5)
WEARING = load_ice("standard").with_effect(
    ActiveEffect(name="pebble_wear", parameters={"along_path": ALONG})
)


def wearing(cell_size: float) -> Ice:
    sheet = Sheet(cell_size=cell_size)
    effect = ActiveEffect(name="pebble_wear", parameters={"along_path": ALONG})
    return Ice.uniform(0.009, sheet, effects=(effect,))


def session(n: int):
    both = [DRAW, Throw(speed=2.2, angle=0.03, spin=-1.2)]
    return [
        both[k % 2].release(Direction.AWAY if k % 3 else Direction.HOME, order=k) for k in range(n)
    ]


@pytest.mark.parametrize("cell_size", [0.5, 0.25, 0.1, 0.05])
def test_the_worn_area_is_that_covered_by_the_band_on_any_cells(cell_size):
    ice = wearing(cell_size)
    path = np.array([[0.21, -9.0], [0.21, 3.0], [0.86, 7.0]])
    wear = wear_of(ice, [path])
    length = 12.0 + np.hypot(0.65, 4.0)
    assert wear.sum() * cell_size**2 == pytest.approx(ALONG * WORN_WIDTH * length, rel=1e-9)
    touched = wear != 0
    x, y = np.meshgrid(ice.sheet.x_centres, ice.sheet.y_centres)
    assert x[touched].min() > 0.21 - WORN_WIDTH / 2 - cell_size / 2
    assert x[touched].max() < 0.86 + WORN_WIDTH / 2 + cell_size / 2
    assert y[touched].min() > -9.0 - cell_size
    # A cell wears by one full pass where the whole of it lies under the band, and never by more.
    straight = wear_of(ice, [np.array([[0.1, -9.0], [0.1, 3.0]])])
    assert straight.min() == pytest.approx(ALONG * min(WORN_WIDTH / cell_size, 1.0), rel=0.11)


def test_wear_adds_up_and_does_not_depend_on_how_a_path_is_cut():
    ice = wearing(0.5)
    path = np.array([[0.1, -9.0], [-0.3, 1.0], [0.4, 8.0]])
    whole = wear_of(ice, [path])
    assert wear_of(ice, [path[:2], path[1:]]) == pytest.approx(whole, abs=1e-15)
    assert wear_of(ice, [path, path]) == pytest.approx(2 * whole, abs=1e-15)
    assert wear_of(ice, [path[::-1]]) == pytest.approx(whole, abs=1e-15)
    finer = np.column_stack(
        [np.interp(np.linspace(0, 2, 301), [0, 1, 2], path[:, k]) for k in (0, 1)]
    )
    assert wear_of(ice, [finer]) == pytest.approx(whole, abs=1e-3 * abs(ALONG))
    assert not wear_of(ice, [path[:1], np.repeat(path[:1], 5, axis=0)]).any()


def test_wear_knows_no_left_from_right():
    """The mirrored path wears the mirrored map; the half-turned one the half-turned map."""
    path = slide(WEARING, DRAW.release(), fps=PATH_FPS).trajectory
    assert path is not None
    wear = wear_of(WEARING, [path.xy])
    assert wear_of(WEARING, [path.xy * [-1, 1]]) == pytest.approx(wear[:, ::-1], abs=1e-15)
    assert wear_of(WEARING, [-path.xy]) == pytest.approx(wear[::-1, ::-1], abs=1e-15)


def test_a_session_remembers_where_its_stones_went():
    runs = list(slides_in_turn(WEARING, session(12), fps=10))
    plain = list(slides_in_turn(load_ice("standard"), session(12), fps=10))
    assert (runs[0].x, runs[0].y) == (plain[0].x, plain[0].y)
    for k in (9, 10, 11):
        assert abs(runs[k].y) > abs(plain[k].y) + 0.05
    # Aside of every path the ice is as it was: a stone there runs as on ice without memory.
    aside = replace(DRAW.release(order=12), x=1.9, vx=0.0, omega=0.0)
    alone = slide(load_ice("standard"), aside)
    *_, last = slides_in_turn(WEARING, [*session(12), aside], fps=10)
    # A map that varies anywhere is followed line by line: 0.1 µm beside ice that is all alike.
    assert last.y == pytest.approx(alone.y, abs=1e-6)


def test_the_state_of_a_session_does_not_depend_on_the_number_of_queries():
    seldom = [(run.x, run.y) for run in slides_in_turn(WEARING, session(6), fps=1)]
    often = [(run.x, run.y) for run in slides_in_turn(WEARING, session(6), fps=240)]
    assert seldom == often


@pytest.mark.parametrize(("felt", "rounding"), [("along_path", 1e-9), ("under_contacts", 1e-4)])
def test_a_mirrored_session_ends_in_the_mirror_image(felt, rounding):
    """Also the ice that it leaves behind: wear is fed back through six throws."""
    effect = ActiveEffect(name="pebble_wear", parameters={felt: ALONG})
    ice = load_ice("standard").with_effect(effect)
    rng = np.random.default_rng(4)
    mu = ice.friction.mu * np.exp(0.03 * rng.standard_normal(ice.friction.mu.shape))
    for flip_x, flip_y in ((-1, 1), (-1, -1)):
        here = replace(ice, friction=replace(ice.friction, mu=mu))
        turned = mu[::flip_y, ::flip_x].copy()
        there = replace(ice, friction=replace(ice.friction, mu=turned))
        flipped = [
            replace(
                r,
                x=flip_x * r.x,
                y=flip_y * r.y,
                vx=flip_x * r.vx,
                vy=flip_y * r.vy,
                omega=flip_x * flip_y * r.omega,
            )
            for r in session(6)
        ]
        runs = zip(
            slides_in_turn(here, session(6), fps=PATH_FPS),
            slides_in_turn(there, flipped, fps=PATH_FPS),
            strict=True,
        )
        for one, other in runs:
            assert (flip_x * other.x, flip_y * other.y) == pytest.approx(
                (one.x, one.y), abs=rounding
            )


def test_the_game_wears_its_ice_as_a_session_does():
    """Lone stones of a game and the same releases in a session: the same map, the same rests."""
    ice = load_ice("standard")
    simulator = GameSimulator(ice, ice_evolution=IceEvolution(wear=ALONG))
    state = simulator.begin_end(simulator.new_game(0))
    light = Throw(speed=1.2, angle=-0.02, spin=1.5)  # hogged, and removed: the next one is alone
    throws, rests = [], []
    for k in range(5):
        throws.append(light.release(order=k, stone=k, clock=state.clock))
        state, shot = simulator.play(state, Call(throw=light))
        rests.append([shot.outcome.stones[-1].x, shot.outcome.stones[-1].y])
    lively = ice_for_game(ice, simulator.ice_evolution, 0, sweeping=False)
    runs = list(slides_in_turn(lively, throws, fps=PATH_FPS))
    assert np.array([[run.x, run.y] for run in runs]) == pytest.approx(np.array(rests), abs=1e-9)
    paths = [run.trajectory.xy for run in runs if run.trajectory is not None]
    assert state.wear == pytest.approx(wear_of(lively, paths), abs=1e-12)


def test_an_ice_that_wears_along_paths_does_so_in_a_game_that_is_otherwise_still():
    simulator = GameSimulator(WEARING)
    state = simulator.begin_end(simulator.new_game(0))
    state, _ = simulator.play(state, Call(throw=DRAW))
    assert state.wear is not None
    assert state.wear.min() < 0
    assert (
        wear_along_path(ice_for_game(WEARING, IceEvolution(wear=ALONG), 0, sweeping=False))
        == 2 * ALONG
    )


def test_a_game_keeps_all_wear_in_its_map():
    effect = ActiveEffect(name="pebble_wear", parameters={"under_contacts": ALONG})
    ice = ice_for_game(
        WEARING.without_effect("pebble_wear").with_effect(effect),
        IceEvolution(wear=ALONG),
        0,
        sweeping=False,
    )
    assert wear_under_contacts(ice) == 0.0
    assert wear_along_path(ice) == 2 * ALONG


def test_ice_that_does_not_wear_along_paths_remembers_nothing():
    rate = load_ice("standard").with_effect(
        ActiveEffect(name="pebble_wear", parameters={"rate": -0.01})
    )
    assert wear_along_path(rate) == 0.0
    runs = list(slides_in_turn(rate, session(4), fps=10))
    alone = [slide(rate, release) for release in session(4)]
    assert [(r.x, r.y) for r in runs] == [(r.x, r.y) for r in alone]
    assert worn(rate, None) is rate
    zero = np.zeros(rate.sheet.shape)
    assert np.array_equal(worn(rate, zero).friction.mu, rate.friction.mu)
    assert isinstance(worn(rate, zero).friction, FrictionMap)
