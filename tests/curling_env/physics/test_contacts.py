"""Simultaneous contacts: conserved quantities, symmetries, known cases, both engines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from curling_env.ice import Ice, load_ice
from curling_env.physics import (
    FINE_TOLERANCE,
    Engine,
    StoneState,
    contact_law,
    find_contacts,
    new_contacts,
    play_batch,
    play_bounds,
    solve_contacts,
)
from curling_env.sheet import RULE_BOOK_STONE, TEE_Y, Direction, Stone
from curling_env.throw import Throw

R = RULE_BOOK_STONE.radius
V, OMEGA = slice(2, 4), 5


def groups(seed: int, stones: int) -> np.ndarray:
    """States (n, 6) of stones that touch each other in a chain or a heap, some of them moving."""
    rng = np.random.default_rng(seed)
    states = np.zeros((stones, 6))
    for k in range(1, stones):
        while True:
            onto = states[int(rng.integers(k)), :2]
            turn = rng.uniform(0, 2 * np.pi) if seed % 2 else np.pi / 3 * rng.integers(6)
            place = onto + 2 * R * np.array([np.cos(turn), np.sin(turn)])
            if np.hypot(*(states[:k, :2] - place).T).min() > 2 * R - 1e-9:
                break
        states[k, :2] = place
    moving = rng.permutation(stones)[: int(rng.integers(1, stones + 1))]
    states[moving, V] = rng.normal(0, 1.5, (len(moving), 2))
    states[moving, OMEGA] = rng.normal(0, 3, len(moving))
    return states


def together(states: np.ndarray, stone: Stone) -> np.ndarray:
    """Return the states after all contacts, solved by sweeps, until no two approach."""
    law, contacts = contact_law(stone), new_contacts(len(states))
    status = np.zeros(len(states), dtype=np.int64)
    for _ in range(200):
        count = find_contacts(law, states, status, contacts)
        if count == 0:
            return states
        solve_contacts(law, states, contacts, count)
    raise AssertionError("stones that touch went on closing")


def energy(states: np.ndarray, stone: Stone) -> float:
    turning = stone.inertia * states[:, OMEGA] ** 2
    return float((stone.mass * (states[:, V] ** 2).sum(1) + turning).sum() / 2)


def turning(states: np.ndarray, stone: Stone) -> float:
    orbit = states[:, 0] * states[:, 3] - states[:, 1] * states[:, 2]
    return float((stone.mass * orbit + stone.inertia * states[:, OMEGA]).sum())


seeds, sizes = st.integers(0, 100_000), st.integers(2, 16)
restitutions, frictions = st.sampled_from([0.0, 0.5, 0.85, 1.0]), st.sampled_from([0.0, 0.2, 1.0])


@given(seeds, sizes, restitutions, frictions)
def test_contacts_keep_momentum_and_add_no_energy(seed, size, e, mu):
    stone = replace(RULE_BOOK_STONE, restitution=e, stone_friction=mu)
    before = groups(seed, size)
    after = together(before.copy(), stone)
    np.testing.assert_allclose(after[:, V].sum(0), before[:, V].sum(0), atol=1e-12)
    assert turning(after, stone) == pytest.approx(turning(before, stone), abs=1e-10)
    assert energy(after, stone) <= energy(before, stone) * (1 + 1e-11)
    if e == 1.0 and mu == 0.0:
        assert energy(after, stone) == pytest.approx(energy(before, stone), rel=1e-11)


@given(seeds, sizes)
def test_the_mirror_image_of_contacts_is_theirs(seed, size):
    mirror = np.array([-1, 1, -1, 1, -1, -1])
    states = groups(seed, size)
    mirrored = together(states * mirror, RULE_BOOK_STONE)
    np.testing.assert_allclose(mirrored, together(states, RULE_BOOK_STONE) * mirror, atol=1e-9)


@given(seeds, sizes)
def test_the_numbers_of_the_stones_do_not_matter(seed, size):
    states = groups(seed, size)
    order = np.random.default_rng(seed).permutation(size)
    np.testing.assert_array_equal(
        together(states[order], RULE_BOOK_STONE), together(states.copy(), RULE_BOOK_STONE)[order]
    )


def test_a_stone_passes_half_its_share_through_a_frozen_pair():
    # Without loss, and all at once: −1/3, 2/3, 2/3 of the speed keep momentum and energy.
    states = np.zeros((3, 6))
    states[:, 1] = 2 * R * np.arange(3)
    states[0, 3] = 1.5
    after = together(states, replace(RULE_BOOK_STONE, restitution=1.0))
    np.testing.assert_allclose(after[:, 3], [-0.5, 1.0, 1.0], atol=1e-12)


def test_a_stone_between_two_pushes_both_alike():
    # Struck in the gap of two that touch: e = 1 without friction has a solution by hand.
    turn = np.pi / 6
    states = np.zeros((3, 6))
    states[1, :2] = 2 * R * np.array([np.sin(turn), np.cos(turn)])
    states[2, :2] = states[1, :2] * [-1, 1]
    states[0, 3] = 1.0
    after = together(states, replace(RULE_BOOK_STONE, restitution=1.0, stone_friction=0.0))
    push = 2 * np.cos(turn) / (1 + 2 * np.cos(turn) ** 2)
    assert after[0, 3] == pytest.approx(1 - 2 * push * np.cos(turn), abs=1e-12)
    np.testing.assert_allclose(
        after[1, V], push * np.array([np.sin(turn), np.cos(turn)]), atol=1e-12
    )


@pytest.mark.parametrize(("gap", "together_"), [(5e-6, True), (3e-5, False)])
def test_frozen_stones_are_struck_together(gap, together_):
    # One after the other the first stops dead and the last alone goes on; together two go on.
    ice = Ice.uniform(0.01, stone=replace(RULE_BOOK_STONE, band_radius=0.0, restitution=1.0))
    pair = np.array([[0.0, TEE_Y], [0.0, TEE_Y + 2 * R + gap]])
    release = Throw(speed=2.6).release()
    engine = Engine(ice).play(release, [StoneState(x=x, y=y) for x, y in pair.tolist()])
    batch = play_batch(
        ice, pair[None], [release], bounds=play_bounds(ice, Direction.AWAY),
        tolerance=FINE_TOLERANCE,
    )  # fmt: skip
    went = engine.stones[0].y - pair[0, 1]
    assert bool(went > 0.3) is together_
    assert batch.last[0, 0, 1] == pytest.approx(engine.stones[0].y, abs=1e-3)
    assert batch.last[0, 1, 1] == pytest.approx(engine.stones[1].y, abs=1e-3)


@settings(max_examples=40)
@given(seeds, st.integers(1, 8), st.booleans())
def test_engine_and_batch_leave_the_stones_alike(seed, size, frozen):
    rng = np.random.default_rng(seed)
    ice = load_ice("fcv1" if seed % 2 else "standard")
    lying = np.empty((0, 2))
    while len(lying) < size:
        place = rng.uniform((-1.0, TEE_Y - 3.0), (1.0, TEE_Y + 1.5))
        if frozen and len(lying) == 1:
            turn = rng.uniform(0, 2 * np.pi)
            place = lying[0] + 2 * R * np.array([np.cos(turn), np.sin(turn)])
        if (np.hypot(*(lying - place).T) > 2 * R - 1e-9).all():
            lying = np.vstack([lying, place])
    release = Throw(speed=rng.uniform(2.2, 3.4), angle=rng.normal(-0.04, 0.03), spin=1.5).release()
    bounds = play_bounds(ice, Direction.AWAY)
    engine = Engine(ice).play(release, [StoneState(x=x, y=y) for x, y in lying.tolist()])
    nudged = np.stack([lying, lying + np.array([1e-6, 0.0])])
    batch = play_batch(ice, nudged, [release] * 2, bounds=bounds, tolerance=FINE_TOLERANCE)
    places = np.array([(stone.x, stone.y) for stone in engine.stones])
    off = np.hypot(*(batch.last[0] - places).T).max()
    # A chain of thin hits magnifies rounding; by how much, the nudge tells.
    magnified = np.hypot(*(batch.last[1] - batch.last[0]).T).max() / 1e-6
    assert off < max(1e-3, 1e-4 * magnified)


@settings(max_examples=30)
@given(seeds, st.integers(2, 8))
def test_a_shot_does_not_depend_on_the_numbers_of_the_stones(seed, size):
    rng = np.random.default_rng(seed)
    ice = load_ice("standard")
    heap = groups(seed, size)[:, :2] * (1 + 1e-9)
    heap = heap[np.hypot(*heap.T) < 1.2] + [0.0, TEE_Y - 0.5]
    order = rng.permutation(len(heap))
    release = Throw(speed=rng.uniform(2.3, 4), spin=1.0, x=rng.uniform(-0.2, 0.2)).release()
    ends = []
    for lying in (heap, heap[order]):
        engine = Engine(ice).play(release, [StoneState(x=x, y=y) for x, y in lying.tolist()])
        places = np.array([(stone.x, stone.y) for stone in engine.stones])
        bounds = play_bounds(ice, Direction.AWAY)
        ends.append((places, play_batch(ice, lying[None], [release], bounds=bounds).last[0]))
    for first, second in zip(*ends, strict=True):
        np.testing.assert_array_equal(first[:-1][order], second[:-1])
        np.testing.assert_array_equal(first[-1], second[-1])


def test_a_throw_does_not_depend_on_the_throws_before_it():
    # Stones that a contact leaves almost at rest stop within their first step.
    ice, bounds = load_ice("standard"), play_bounds(load_ice("standard"), Direction.AWAY)
    heaps = np.array([groups(seed, 8)[:, :2] * (1 + 1e-9) + [0.0, TEE_Y] for seed in range(40)])
    releases = [Throw(speed=2.4 + 0.07 * k, spin=1.0, x=0.05).release() for k in range(40)]
    forth = play_batch(ice, heaps, releases, bounds=bounds)
    back = play_batch(ice, heaps[::-1], releases[::-1], bounds=bounds)
    np.testing.assert_array_equal(back.last[::-1], forth.last)


@settings(max_examples=10)
@given(seeds)
def test_sixteen_stones_in_a_jam_come_to_rest_alike(seed):
    rng = np.random.default_rng(seed)
    ice = load_ice("standard")
    heap = groups(seed, 15)[:, :2] * (1 + 1e-9)
    heap += [0.0, TEE_Y] - heap.mean(0)
    release = Throw(speed=rng.uniform(2.5, 5.5), spin=1.0, x=rng.uniform(-0.3, 0.3)).release()
    bounds = play_bounds(ice, Direction.AWAY)
    inside = (np.abs(heap[:, 0]) < bounds[1] - 0.01) & (heap[:, 1] < bounds[3] - 0.01)
    heap = heap[inside]
    outcome = Engine(ice).play(release, [StoneState(x=x, y=y) for x, y in heap.tolist()])
    batch = play_batch(ice, heap[None], [release], bounds=bounds, tolerance=FINE_TOLERANCE)
    assert batch.collisions[0] >= 0
    assert (batch.collisions[0] > 0) == bool(outcome.contacts)
    assert all(stone.vx == stone.vy == 0 for stone in outcome.in_play)
    for lying in (
        np.array([(stone.x, stone.y) for stone in outcome.in_play]).reshape(-1, 2),
        batch.xy[0][np.isfinite(batch.xy[0, :, 0])],
    ):
        apart = np.hypot(*(lying[:, None] - lying).transpose(2, 0, 1))
        assert (apart[np.triu_indices(len(lying), 1)] > 2 * R - 1e-3).all()
