"""One collision of two stones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from curling_env.ice import load_ice
from curling_env.physics.many_stones.events import collide, collision_law
from curling_env.sheet import RULE_BOOK_STONE

R = RULE_BOOK_STONE.radius


@given(
    st.floats(-1.3, 1.3),
    st.lists(st.floats(-3, 3), min_size=4, max_size=4),
    st.floats(-5, 5),
    st.floats(-5, 5),
)
def test_a_collision_keeps_momentum_and_makes_no_energy(
    direction: float, velocities: list[float], spin_a: float, spin_b: float
) -> None:
    collision = collision_law(load_ice("standard"))
    a = np.array([0, 0, velocities[0], velocities[1], 0, spin_a])
    b = np.array([2 * R * np.cos(direction), 2 * R * np.sin(direction), *velocities[2:], 0, spin_b])
    inertia = RULE_BOOK_STONE.inertia / RULE_BOOK_STONE.mass
    before = np.array([a, b])
    hit = collide(collision, a, b)
    after = np.array([a, b])

    def energy(s: np.ndarray) -> float:
        return float((s[:, 2:4] ** 2).sum() + inertia * (s[:, 5] ** 2).sum())

    def turning(s: np.ndarray) -> float:
        return float((s[:, 0] * s[:, 3] - s[:, 1] * s[:, 2] + inertia * s[:, 5]).sum())

    assert after[:, 2:4].sum(0) == pytest.approx(before[:, 2:4].sum(0), abs=1e-12)
    assert turning(after) == pytest.approx(turning(before), abs=1e-12)
    assert energy(after) <= energy(before) + 1e-5  # stones that touch part at 1 mm/s
    if not hit:
        assert (after == before).all()
