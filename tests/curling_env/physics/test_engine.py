"""Many stones on one sheet: paths, contacts, leaving play."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.optimize import brentq

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, FrictionMap, Ice, load_ice
from curling_env.physics import (
    Engine,
    Slide,
    Status,
    StoneState,
    play_bounds,
    slide,
)
from curling_env.sheet import (
    BACK_LINE_Y,
    HOG_LINE_Y,
    PAPER_SHEET,
    RULE_BOOK_STONE,
    TEE_Y,
    Direction,
)
from curling_env.throw import Release, Throw

R = RULE_BOOK_STONE.radius


def patchy(seed: int = 0) -> Ice:
    """Return standard ice whose friction varies by some per cent from cell to cell."""
    rng = np.random.default_rng(seed)
    mu = 0.0082 * (1 + 0.05 * rng.standard_normal(PAPER_SHEET.shape))
    return replace(
        load_ice("standard"),
        friction=FrictionMap(mu=mu, sigma=0 * mu, observed=np.ones(mu.shape, dtype=bool)),
    )


def coulomb(mu: float = 0.01) -> Ice:
    """Return constant friction under a point contact: straight paths with closed forms."""
    return Ice.uniform(mu, stone=replace(RULE_BOOK_STONE, band_radius=0.0))


def everywhere(outcome) -> np.ndarray:
    return np.array([(s.x, s.y, s.theta) for s in outcome.stones])


# --- a lone stone -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["standard", "fcv1", "paper"])
@pytest.mark.parametrize("speed", [1.0, 1.9, 2.1])
def test_a_lone_throw_is_the_slide(name, speed):
    ice = load_ice(name)
    release = Throw(speed=speed, angle=-0.02, spin=1.2).release(Direction.HOME)
    alone = slide(ice, release, bounds=play_bounds(ice, Direction.HOME))
    stone = Engine(ice).play(release).delivered
    assert np.hypot(stone.x - alone.x, stone.y - alone.y) < 1e-4
    assert stone.theta == pytest.approx(alone.theta, abs=1e-4)


def test_resting_stones_that_are_not_touched_stay_exactly_where_they_are():
    stones = [StoneState(x=1.5, y=17.0, theta=0.7, stone=4), StoneState(x=-1.5, y=15.0)]
    outcome = Engine(load_ice("standard")).play(Throw(speed=2.0).release(), stones, fps=10)
    assert outcome.stones[:2] == tuple(stones)
    assert outcome.moved == (2,)
    assert outcome.contacts == ()


# --- contacts -------------------------------------------------------------------------------------


def impulse(a: np.ndarray, b: np.ndarray, stone) -> tuple[np.ndarray, np.ndarray]:
    """Two states after the textbook impulse between equal discs, with Coulomb friction."""
    a, b = a.copy(), b.copy()
    n = (b[:2] - a[:2]) / np.hypot(*(b[:2] - a[:2]))
    s = np.array([-n[1], n[0]])
    normal = (a[2:4] - b[2:4]) @ n
    sliding = (a[2:4] - b[2:4]) @ s + stone.radius * (a[5] + b[5])
    push = (1 + stone.restitution) * normal * stone.mass / 2
    grip = sliding / (2 / stone.mass + 2 * stone.radius**2 / stone.inertia)
    rub = np.clip(grip, -stone.stone_friction * push, stone.stone_friction * push)
    for state, sign in ((a, -1), (b, 1)):
        state[2:4] += sign * (push * n + rub * s) / stone.mass
        state[5] += -stone.radius * rub / stone.inertia
    return a, b


@pytest.mark.parametrize(
    "ice", [coulomb(), load_ice("standard"), patchy()], ids=["coulomb", "standard", "patchy"]
)
@pytest.mark.parametrize("offset", [0.0, 0.03, -0.12, 0.22, -0.28])
def test_a_hit_rolls_out_where_the_textbook_impulse_sends_it(ice, offset):
    release = Throw(speed=2.6, spin=1.5, x=0.4).release()
    to_tee = play_bounds(ice, Direction.AWAY)
    to_tee[3] = TEE_Y
    target = StoneState(x=slide(ice, release, bounds=to_tee).x + offset, y=TEE_Y, theta=0.3)
    outcome = Engine(ice).play(release, [target])

    # The same by hand: slide to the contact, apply the impulse, slide both on alone.
    bounds = play_bounds(ice, Direction.AWAY)

    def at(y: float) -> Slide:
        return slide(ice, release, bounds=np.array([*bounds[:3], y]))

    def gap(y: float) -> float:
        here = at(y)
        return np.hypot(here.x - target.x, here.y - target.y) - 2 * R

    touching = at(brentq(gap, TEE_Y - 2 * R - 0.1, TEE_Y, xtol=1e-9))
    state = np.array([getattr(touching, name) for name in ("x", "y", "vx", "vy", "theta", "omega")])
    struck = np.array([target.x, target.y, 0, 0, target.theta, 0])
    after = impulse(state, struck, ice.stone)
    for mine, stone in zip(after, (outcome.delivered, outcome.stones[0]), strict=True):
        x, y, vx, vy, theta, omega = mine
        on = slide(ice, Release(x=x, y=y, vx=vx, vy=vy, theta=theta, omega=omega), bounds=bounds)
        assert np.hypot(on.x - stone.x, on.y - stone.y) < 1e-3
        assert on.theta == pytest.approx(stone.theta, abs=0.05)
    assert len(outcome.contacts) == 1


@pytest.mark.parametrize(("gap", "meets"), [(-1e-4, True), (1e-4, False)])
def test_a_graze_of_a_tenth_of_a_millimetre_is_seen(gap, meets):
    stone = StoneState(x=2 * R + gap, y=14.3)
    outcome = Engine(coulomb()).play(Throw(speed=2.4).release(), [stone])
    assert bool(outcome.contacts) is meets


@pytest.mark.parametrize("gap", [-1e-4, 1e-4])
def test_a_graze_between_two_moving_stones_is_seen(gap):
    # The second stone crosses; in its frame the first one passes at 2R + gap.
    ice = coulomb(1e-3)
    across = StoneState(x=-2.0 + 1e-9, y=0.0, vx=2.0)
    u = np.array([-2.0, 2.0]) / np.sqrt(8)  # direction in which the first moves relative to it
    left = np.array([-u[1], u[0]])
    start = np.array([-2.0, 0.0]) + (2 * R + gap) * left - 2.0 * u
    release = Release(x=start[0], y=start[1], vx=0.0, vy=2.0)
    outcome = Engine(ice).play(release, [across])
    assert bool(outcome.contacts) is (gap < 0)


def test_a_line_of_touching_stones_moves_on_together():
    ice = coulomb()
    line = [StoneState(x=0.0, y=TEE_Y - 1 + 2 * R * k) for k in range(3)]
    outcome = Engine(ice).play(Throw(speed=2.35).release(), line)
    gone = [a.y - b.y for a, b in zip(outcome.stones, line, strict=False)]
    assert gone[0] > 0.1
    assert gone[1] == pytest.approx(gone[0], abs=1e-3)
    assert gone[2] == pytest.approx(gone[0], abs=1e-3)
    assert outcome.delivered.y < line[0].y - 2 * R - 0.01  # it came back from three times its mass
    assert all(abs(s.x) < 1e-6 for s in outcome.stones)


def test_a_symmetric_break_stays_symmetric():
    two = [StoneState(x=side * (R + 1e-7), y=TEE_Y) for side in (-1, 1)]
    outcome = Engine(coulomb()).play(Throw(speed=2.5).release(), two)
    left, right, thrown = outcome.stones
    assert left.x == pytest.approx(-right.x, abs=1e-6)
    assert left.y == pytest.approx(right.y, abs=1e-6)
    assert left.x < -0.3
    assert thrown.x == pytest.approx(0, abs=1e-6)


@given(st.integers(0, 10_000))
@example(8591)  # a slow stone that curls into one it slides along, for a second
@example(346)
def test_a_crowded_house_comes_to_rest_without_overlap(seed):
    rng = np.random.default_rng(seed)
    places: list[np.ndarray] = []
    while len(places) < 10:
        place = rng.uniform((-0.8, 16.6), (0.8, 18.4))
        if all(np.hypot(*(place - other)) >= 2 * R for other in places):
            places.append(place)
    stones = [StoneState(x=x, y=y) for x, y in places]
    throw = Throw(speed=rng.uniform(2.1, 3.5), angle=rng.normal(-0.02, 0.02), spin=1.0)
    outcome = Engine(patchy()).play(throw.release(), stones)
    lying = np.array([(s.x, s.y) for s in outcome.in_play])
    if len(lying) > 1:
        apart = np.hypot(*(lying[:, None] - lying).transpose(2, 0, 1))
        assert apart[np.triu_indices(len(lying), 1)].min() > 2 * R - 1e-4
    assert all(s.vx == s.vy == s.omega == 0 for s in outcome.in_play)
    assert np.isfinite(everywhere(outcome)).all()


# --- symmetries -----------------------------------------------------------------------------------


def test_mirrored_throws_end_mirrored():
    engine = Engine(load_ice("standard"))
    stones = [StoneState(x=0.5, y=15.5), StoneState(x=-0.2, y=17.5)]
    throw = Throw(speed=2.6, angle=-0.04, spin=1.0)
    mirrored = Throw(speed=2.6, angle=0.04, spin=-1.0)
    a = engine.play(throw.release(), stones)
    b = engine.play(mirrored.release(), [replace(s, x=-s.x) for s in stones])
    assert a.contacts
    np.testing.assert_allclose(everywhere(a), everywhere(b) * [-1, 1, -1], atol=1e-6)
    assert a.status == b.status


def test_the_other_end_is_half_a_turn_away():
    engine = Engine(load_ice("standard"))
    stones = [StoneState(x=0.5, y=15.5), StoneState(x=-0.2, y=17.5)]
    throw = Throw(speed=2.6, angle=-0.04, spin=1.0, x=0.3)
    a = engine.play(throw.release(Direction.AWAY), stones)
    b = engine.play(throw.release(Direction.HOME), [replace(s, x=-s.x, y=-s.y) for s in stones])
    np.testing.assert_allclose(everywhere(a), everywhere(b) * [-1, -1, 1], atol=1e-6)
    assert a.status == b.status


def test_playing_leaves_nothing_behind_in_the_engine():
    engine = Engine(patchy())
    stones = [StoneState(x=0.1, y=16.5), StoneState(x=-0.2, y=17.5)]
    release = Throw(speed=2.6, angle=-0.03, spin=1.0).release()
    first = engine.play(release, stones, fps=20)
    engine.play(Throw(speed=3.3, spin=-2).release(Direction.HOME))
    assert engine.play(release, stones, fps=20) == first


# --- leaving play ---------------------------------------------------------------------------------


@pytest.mark.parametrize("direction", Direction)
@pytest.mark.parametrize(
    ("throw", "status"),
    [
        (Throw(speed=2.1, angle=-0.05, spin=1.0), Status.REST),
        (Throw(speed=2.1, angle=0.12), Status.OUT_SIDE),
        (Throw(speed=2.1, angle=-0.12), Status.OUT_SIDE),
        (Throw(speed=3.0), Status.OUT_BACK),
        (Throw(speed=1.7), Status.HOGGED),
    ],
)
def test_outcome_of_a_throw(throw, status, direction):
    outcome = Engine(load_ice("standard")).play(throw.release(direction))
    assert outcome.delivered_status is status
    assert (len(outcome.in_play) == 1) is (status is Status.REST)
    if status is Status.OUT_SIDE:
        assert abs(outcome.delivered.x) == pytest.approx(PAPER_SHEET.width / 2 - R, abs=1e-5)
    if status is Status.OUT_BACK:
        assert abs(outcome.delivered.y) == pytest.approx(BACK_LINE_Y + R, abs=1e-5)


@pytest.mark.parametrize(("clear", "status"), [(1e-3, Status.REST), (-1e-3, Status.HOGGED)])
def test_a_stone_must_wholly_clear_the_hog_line(clear, status):
    mu = 0.01
    distance = 2 * HOG_LINE_Y + R + clear
    release = Throw(speed=float(np.sqrt(2 * mu * 9.80665 * distance))).release()
    assert Engine(coulomb(mu)).play(release).delivered_status is status


def test_a_short_stone_that_struck_another_stays():
    guard = StoneState(x=0.0, y=HOG_LINE_Y + R + 0.05)
    outcome = Engine(coulomb()).play(Throw(speed=2.2).release(), [guard])
    assert outcome.delivered.y < HOG_LINE_Y + R
    assert outcome.delivered_status is Status.REST


def test_a_stone_driven_out_is_marked_and_where_it_left():
    back = StoneState(x=0.0, y=19.0, stone=7)
    outcome = Engine(coulomb()).play(Throw(speed=2.9).release(), [back])
    assert outcome.status[0] is Status.OUT_BACK
    assert outcome.stones[0].stone == 7
    assert outcome.stones[0].y == pytest.approx(BACK_LINE_Y + R, abs=1e-5)
    assert outcome.stones[0].vy > 0
    assert outcome.stones[0] not in outcome.in_play


# --- trajectories ---------------------------------------------------------------------------------


def test_trajectories_hold_every_stone_that_moved():
    stones = [StoneState(x=1.6, y=15.0, stone=1), StoneState(x=0.0, y=17.0, theta=0.4, stone=2)]
    release = Throw(speed=2.5).release(stone=9, clock=100.0)
    outcome = Engine(coulomb()).play(release, stones, fps=25, throw=3)
    assert outcome.moved == (1, 2)
    struck, thrown = outcome.trajectories
    assert (struck.stone, thrown.stone, thrown.throw, thrown.clock) == (2, 9, 3, 100.0)
    np.testing.assert_allclose(struck.xy[0], (0.0, 17.0), atol=1e-12)
    assert struck.theta[0] == pytest.approx(0.4)
    hit = outcome.contacts[0].time
    assert hit - 1 / 25 <= struck.t[0] <= hit
    assert thrown.t[0] == 0
    np.testing.assert_allclose(np.diff(thrown.t)[:-1], 1 / 25, atol=1e-9)
    for path, k in zip(outcome.trajectories, outcome.moved, strict=True):
        assert path.t[-1] == outcome.ends[k]
        final = outcome.stones[k]
        np.testing.assert_allclose(path.xy[-1], (final.x, final.y))
    # No sample lies behind the contact: the thrown stone never enters the one it strikes.
    before = thrown.xy[thrown.t <= hit]
    assert np.hypot(before[:, 0], before[:, 1] - 17.0).min() >= 2 * R - 1e-6


def test_trajectories_do_not_change_the_outcome():
    engine = Engine(patchy())
    stones = [StoneState(x=0.1, y=16.5), StoneState(x=-0.2, y=17.5)]
    release = Throw(speed=2.6, angle=-0.03, spin=1.0).release()
    with_paths = engine.play(release, stones, fps=100)
    assert replace(with_paths, trajectories=()) == engine.play(release, stones)


# --- the session ----------------------------------------------------------------------------------


def test_sweeping_carries_the_delivered_stone_only():
    ice = coulomb().with_effect(ActiveEffect(name="sweeping", parameters={"friction_factor": 0.9}))
    stone = StoneState(x=0.0, y=17.0)
    plain = Engine(ice).play(Throw(speed=2.5).release(), [stone])
    late = plain.contacts[0].time + 0.1
    swept = Engine(ice).play(Throw(speed=2.5).release(sweep=(late, 60.0)), [stone])
    assert swept.delivered.y > plain.delivered.y + 1e-3
    assert swept.stones[0].y == pytest.approx(plain.stones[0].y, abs=1e-6)


def test_a_stones_own_friction_follows_its_identifier():
    ice = coulomb().with_effect(
        ActiveEffect(name="stone_bias", parameters={"stone": 7, "factor": 1.1})
    )
    far = {
        stone: Engine(ice).play(Throw(speed=2.1).release(stone=stone)).delivered.y
        for stone in (6, 7)
    }
    assert far[7] < far[6] - 1.0


def test_a_stones_own_curl_follows_its_identifier():
    bent = {"stone": 7, "curl_factor": 1.5}
    ice = load_ice("standard").with_effect(ActiveEffect(name="stone_bias", parameters=bent))
    throw = Throw(speed=2.1, spin=1.5)
    aside = {stone: Engine(ice).play(throw.release(stone=stone)).delivered.x for stone in (6, 7)}
    assert aside[7] == pytest.approx(1.5 * aside[6], rel=0.05)
    alone = slide(ice, throw.release(stone=7), bounds=play_bounds(ice, Direction.AWAY))
    assert alone.x == pytest.approx(aside[7], abs=1e-4)


# --- bad input ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("stones", "says"),
    [
        ([StoneState(x=0, y=17), StoneState(x=0.2, y=17)], "one place"),
        ([StoneState(x=2.2, y=17)], "inside the side lines"),
        ([StoneState(x=0, y=20.5)], "back line"),
    ],
)
def test_impossible_positions_are_refused(stones, says):
    with pytest.raises(InputError, match=says):
        Engine(load_ice("standard")).play(Throw(speed=2).release(), stones)


def test_positions_must_be_numbers():
    with pytest.raises(InputError, match="finite"):
        StoneState(x=float("nan"), y=0)


def test_ice_that_drives_stones_is_refused_in_words():
    # Steeper than its friction: a stone thrown sideways of the slope never comes to rest, and the
    # stone that is asked about lies where nothing can take it out of play.
    slope = ActiveEffect(name="slope", parameters={"x": 0.0, "y": -0.002})
    ice = Ice.uniform(0.002, effects=(slope,))
    with pytest.raises(InputError, match="never stops"):
        Engine(ice).play(Release(x=0.0, y=0.0, vx=0.0, vy=-0.05))


def test_the_paper_stone_is_smaller():
    stone = StoneState(x=0.25, y=10.0)
    assert not Engine(load_ice("paper")).play(Throw(speed=1.0).release(), [stone]).contacts
    assert Engine(coulomb()).play(Throw(speed=2.2).release(), [stone]).contacts


def test_a_stone_that_creeps_past_the_back_line_at_the_last_is_out():
    engine = Engine(load_ice("paper"))
    past = play_bounds(engine.ice, Direction.AWAY)[3] + 1e-5

    def thrown(on):
        release = Release(x=0.0, y=-HOG_LINE_Y + on, vx=0.0, vy=2.06, omega=1.0)
        return engine.play(release, [StoneState(x=0.0, y=14.0 + on, stone=0)])

    # It has struck another, and its last way leads over the line.
    near = thrown(4.9)
    outcome = thrown(4.9 + past - near.delivered.y)
    assert outcome.contacts
    assert outcome.delivered.y > past - 5e-6
    assert outcome.delivered_status is Status.OUT_BACK
    engine.play(Throw(speed=1.0).release(), outcome.in_play)
