"""The range of throws that actions choose from."""

from __future__ import annotations

import pytest

import curling_env  # noqa: F401  (registers the environments)
from curling_env.envs import ThrowRange, throw_range_for
from curling_env.envs.sheet.action import weight_to
from curling_env.errors import InputError
from curling_env.ice import Ice, load_ice
from curling_env.physics import slide
from curling_env.sheet import TEE_Y, Direction
from curling_env.throw import Throw


@pytest.mark.parametrize("ice", [load_ice("standard"), load_ice("paper")])
def test_weights_are_found_for_the_ice(ice):
    # Without spin nothing curls, so that the straight distance is the one asked for.
    y = TEE_Y
    alone = slide(ice, Throw(speed=weight_to(ice, y)).release())
    assert alone.y == pytest.approx(y, abs=0.1)
    draws, hits = (throw_range_for(ice, Direction.AWAY, hits=hits) for hits in (False, True))
    assert draws.speed[0] < weight_to(ice, y) < draws.speed[1] < hits.speed[1]


def test_ice_too_heavy_to_throw_on_still_has_a_range():
    assert throw_range_for(Ice.uniform(0.5), Direction.AWAY, hits=True).speed[1] <= 6.0


@pytest.mark.parametrize(
    "ranges", [{"speed": (2.0, 1.0)}, {"speed": (0.0, 2.0)}, {"speed": (1, 2), "spin": (0, 99)}]
)
def test_impossible_ranges_are_refused(ranges):
    with pytest.raises(InputError, match="range of"):
        ThrowRange(**ranges)
