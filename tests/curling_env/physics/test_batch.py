"""Many throws at once: the same as one by one, on any number of threads, and among other stones."""

from __future__ import annotations

import pickle
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice, load_ice
from curling_env.physics import (
    FINE_TOLERANCE,
    QUICK_TOLERANCE,
    RELEASE_DTYPE,
    Aim,
    BatchEngine,
    Engine,
    SlideEnd,
    catalogue,
    play_batch,
    play_bounds,
    release_table,
    slide,
    throw_batch,
)
from curling_env.sheet import RULE_BOOK_STONE, TEE_Y, Direction
from curling_env.throw import Release, Throw

G = 9.80665
R = RULE_BOOK_STONE.radius


def mapped(rng: np.random.Generator) -> Ice:
    ice = load_ice("standard")
    mu = ice.friction.mu * np.exp(0.05 * rng.standard_normal(ice.friction.mu.shape))
    return replace(ice, friction=replace(ice.friction, mu=mu))


def some_releases(rng: np.random.Generator, n: int) -> list[Release]:
    return [
        Throw(speed=v, angle=a, spin=w).release()
        for v, a, w in rng.uniform([1.5, -0.03, -3], [3, 0.03, 3], (n, 3))
    ]


def test_a_batch_is_its_throws_one_by_one(rng: np.random.Generator) -> None:
    ice, releases = mapped(rng), some_releases(rng, 40)
    rests = throw_batch(ice, releases, tolerance=FINE_TOLERANCE)
    alone = [slide(ice, release) for release in releases]
    assert rests.x.tolist() == [path.x for path in alone]
    assert rests.y.tolist() == [path.y for path in alone]
    assert rests.theta.tolist() == [path.theta for path in alone]
    assert rests.time.tolist() == [path.time for path in alone]
    assert rests.end.tolist() == [int(path.end) for path in alone]


def test_any_number_of_threads_gives_the_same_bits(rng: np.random.Generator) -> None:
    ice, releases = mapped(rng), release_table(some_releases(rng, 1500))
    one, three = throw_batch(ice, releases), throw_batch(ice, releases, workers=3)
    assert one.x.tobytes() == three.x.tobytes()
    assert one.time.tobytes() == three.time.tobytes()
    stones = np.tile([[0.3, TEE_Y], [-0.4, TEE_Y - 1]], (1500, 1, 1))
    one, three = play_batch(ice, stones, releases), play_batch(ice, stones, releases, workers=3)
    assert one.xy.tobytes() == three.xy.tobytes()


def test_each_throw_may_have_its_own_ice(rng: np.random.Generator) -> None:
    ices, releases = [load_ice("paper"), mapped(rng), load_ice("standard")], some_releases(rng, 9)
    which = np.array([0, 1, 2] * 3)
    rests = throw_batch(ices, releases, which=which, workers=2)
    for i, release in enumerate(releases):
        assert rests.x[i] == slide(ices[which[i]], release, tolerance=QUICK_TOLERANCE).x


def test_paths_end_where_the_stone_does(rng: np.random.Generator) -> None:
    releases = [Throw(speed=2.0, angle=0.01, spin=1).release()] * 2
    rests = throw_batch(mapped(rng), releases, fps=20)
    assert rests.paths is not None
    path = rests.paths[0]
    path = path[np.isfinite(path[:, 0])]
    assert len(path) == int(rests.time[0] * 20) + 1
    assert path[-1, :2] == pytest.approx([rests.x[0], rests.y[0]], abs=1e-3)


def peak_memory(throws: int) -> int:
    """Return the peak memory of a table of slow releases, their throws and the results [bytes].

    numpy reports its arrays to tracemalloc, and the compiled loops allocate nothing.
    """
    one = release_table([Throw(speed=0.2, spin=1.0).release()])
    throw_batch(load_ice("paper"), one)  # compiles
    tracemalloc.start()
    try:
        rests = throw_batch(load_ice("paper"), np.repeat(one, throws))
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(rests.x) == throws
    return peak


def test_a_million_throws_fit_in_little_memory() -> None:
    few, many = peak_memory(20_000), peak_memory(120_000)
    assert 10 * (many - few) < 140e6  # of which 88 MB are the releases themselves
    assert few < 4e6


def test_invalid_releases_are_refused() -> None:
    table = release_table([Throw(speed=1, angle=0, spin=0).release()] * 3)
    table["vy"][1] = np.nan
    with pytest.raises(InputError, match="release 1"):
        throw_batch(load_ice("paper"), table)
    with pytest.raises(InputError, match="structured array"):
        throw_batch(load_ice("paper"), np.zeros((3, 4)))
    with pytest.raises(InputError, match="index"):
        throw_batch([load_ice("paper")], table[:1], which=np.array([1]))
    overlapping = np.array([[[0.0, 17.0], [0.1, 17.0]]])
    with pytest.raises(InputError, match="one place"):
        play_batch(load_ice("paper"), overlapping, table[:1])
    for place in ([0.0, 40.0], [np.inf, 0.0], [0.0, np.nan], [-1e308, 0.0]):
        with pytest.raises(InputError, match="inside the bounds"):
            play_batch(load_ice("paper"), np.array([[place]]), table[:1])
    beside = np.array([[[table["x"][0] + 0.1, table["y"][0]]]])
    with pytest.raises(InputError, match="one place"):
        play_batch(load_ice("paper"), beside, table[:1])


def test_a_head_on_hit_follows_the_textbook() -> None:
    ice, speed = load_ice("paper"), 1.0
    ice = replace(ice, stone=replace(ice.stone, radius=R))
    mu, e = 0.0019 * G, ice.stone.restitution
    after = play_batch(
        ice, np.array([[[0.0, -4.0]]]), [Throw(speed=speed, angle=0, spin=0).release()]
    )
    v = np.sqrt(speed**2 - 2 * mu * (6.9725 - 2 * R))
    assert after.collisions.tolist() == [1]
    assert after.xy[0, 0] == pytest.approx([0, -4 + ((1 + e) / 2 * v) ** 2 / (2 * mu)], abs=2e-5)
    assert after.xy[0, 1] == pytest.approx(
        [0, -4 - 2 * R + ((1 - e) / 2 * v) ** 2 / (2 * mu)], abs=2e-5
    )


def test_stones_never_overlap_and_far_ones_are_not_moved(rng: np.random.Generator) -> None:
    n = 400
    grid = np.array([[x, TEE_Y + y] for x in (-0.6, 0.0, 0.6) for y in (-0.9, 0.0, 0.9)])
    stones = grid + rng.uniform(-0.14, 0.14, (n, 9, 2))
    stones = np.concatenate([stones, np.tile([1.9, 5.0], (n, 1, 1))], axis=1)
    ice = mapped(rng)
    after = play_batch(ice, stones, some_releases(rng, n))
    assert (after.collisions >= 0).all()
    assert (after.collisions > 1).mean() > 0.1
    gaps = np.hypot(*(after.xy[:, :, None] - after.xy[:, None]).transpose(3, 0, 1, 2))
    gaps[:, range(11), range(11)] = np.inf
    assert np.nanmin(gaps) >= 2 * R - 1e-5
    quiet = after.collisions == 0
    assert (after.xy[quiet, :10] == stones[quiet]).all()


def test_a_throw_that_meets_nothing_is_a_lone_throw(rng: np.random.Generator) -> None:
    ice, releases = mapped(rng), [Throw(speed=1.9, angle=0, spin=1.0).release()]
    lone = throw_batch(ice, releases)
    after = play_batch(ice, np.array([[[2.0, 20.0], [np.nan, np.nan]]]), releases)
    # Among other stones its path is finer.
    assert after.xy[0, 2] == pytest.approx([lone.x[0], lone.y[0]], abs=QUICK_TOLERANCE)
    assert np.isnan(after.xy[0, 1]).all()


def test_a_row_of_touching_stones_moves_on_together() -> None:
    ice = load_ice("paper")
    ice = replace(ice, stone=replace(ice.stone, radius=R))
    row = np.array([[[0.0, 2 * R * k] for k in range(5)]])
    after = play_batch(ice, row, [Throw(speed=1.0, angle=0, spin=0).release()])
    assert after.collisions[0] >= 5
    travelled = after.xy[0, :5, 1] - row[0, :, 1]
    assert travelled[0] > 0.2
    assert travelled == pytest.approx(travelled[0], abs=1e-3)
    assert (np.diff(after.xy[0, :5, 1]) >= 2 * R - 1e-4).all()


ROUNDING = 1e-9
"""Distance beyond a line that counts as rounding [m]."""
CREEPING_OUT = (  # velocity and spin of stones that come to rest 40 and 11 µm past a line
    ((0.01909538582548148, 2.1637225522045886, 0.4245847929376072), True),
    ((0.11249791688802013, 1.7302909933092934, -1.1469223796361812), False),
)


@pytest.mark.parametrize(("moves", "tabulated"), CREEPING_OUT)
def test_a_stone_that_creeps_over_a_line_at_the_last_is_out(moves, tabulated) -> None:
    ice = load_ice("standard")
    bounds = play_bounds(ice, Direction.AWAY)
    release = np.zeros(1, dtype=RELEASE_DTYPE)
    release["y"] = -10.9725
    release["vx"], release["vy"], release["omega"] = moves

    def beyond(x: float, y: float) -> bool:
        return abs(x) > bounds[1] + ROUNDING or y > bounds[3] + ROUNDING

    alone = throw_batch(ice, release, bounds=bounds)
    assert alone.end[0] == SlideEnd.LEFT_BOUNDS or not beyond(alone.x[0], alone.y[0])
    aside = np.array([[[-1.0, 14.0]]])
    run = play_batch(ice, aside, release, bounds=bounds, tabulated=tabulated)
    assert np.isnan(run.xy[0, 1, 0]) == beyond(*run.last[0, 1])
    play_batch(ice, run.xy, release, bounds=bounds, tabulated=tabulated)


def test_a_stone_on_the_very_line_stays_in_play() -> None:
    ice = load_ice("standard")
    bounds = play_bounds(ice, Direction.AWAY)
    on_it = np.array([[[np.nextafter(bounds[1], 9), 14.0], [0.5, np.nextafter(bounds[3], 99)]]])
    run = play_batch(ice, on_it, [Throw(speed=1.9).release()], bounds=bounds)
    np.testing.assert_array_equal(run.xy[:, :2], on_it)
    with pytest.raises(InputError, match="inside the bounds"):
        play_batch(ice, on_it + 1e-6, [Throw(speed=1.9).release()], bounds=bounds)


@pytest.mark.parametrize("tabulated", [False, True])
def test_an_engine_plays_each_batch_as_if_it_were_the_first(tabulated: bool) -> None:
    rng = np.random.default_rng(5)
    ice = mapped(rng)
    engine = BatchEngine(ice, tabulated=tabulated)
    for stones in (4, 1, 4, 0):
        places = np.full((30, stones, 2), np.nan)
        places[:, :, 0] = np.linspace(-0.9, 0.9, stones) + rng.uniform(-0.05, 0.05, (30, stones))
        places[:, :, 1] = TEE_Y + rng.uniform(-1.5, 1.5, (30, stones))
        releases = some_releases(rng, 30)
        again = engine.play(places, releases)
        first = play_batch(ice, places, releases, tabulated=tabulated)
        assert again.last.tobytes() == first.last.tobytes()
        assert again.collisions.tolist() == first.collisions.tolist()
    assert first.collisions.max() == 0


@pytest.mark.parametrize("kind", [Engine, BatchEngine, Aim])
def test_an_engine_takes_no_addresses_to_another_process(kind: type) -> None:
    engine = kind(load_ice("standard"), tolerance=FINE_TOLERANCE)
    law = (
        engine._laws.common
        if kind is BatchEngine
        else engine.law
        if kind is Engine
        else engine._law
    )
    content = pickle.dumps(engine)
    assert not any(address.tobytes() in content for address in law.kernels)
    copied = pickle.loads(content)
    assert copied.ice.effects == engine.ice.effects
    if kind is Aim:
        assert copied.draw(0.3, 0.1, 1.5) == engine.draw(0.3, 0.1, 1.5)


# --- the law from a table -------------------------------------------------------------------------

FRICTION_PATCH = {"x_min": -1.0, "x_max": 1.0, "y_min": -2.0, "y_max": 4.0, "factor": 1.2}
BESIDE_THE_TABLE = (
    ActiveEffect(name="friction_patch", parameters=FRICTION_PATCH),
    ActiveEffect(name="slope", parameters={"x": 1e-4, "y": -1e-4}),
    ActiveEffect(name="time_drift", parameters={"rate": 1e-4}),
    ActiveEffect(name="sweeping"),
)
"""Effects that depend on more than speed and spin, before those of the table and after them."""
TABLED = {
    "standard": load_ice("standard"),
    "fcv1": load_ice("fcv1"),
    "mapped": mapped(np.random.default_rng(2)),
    "effects of place": replace(
        load_ice("standard"),
        effects=(*BESIDE_THE_TABLE[:2], *load_ice("standard").effects, *BESIDE_THE_TABLE[2:]),
    ),
}


@pytest.mark.parametrize("name", TABLED)
def test_throws_by_a_table_of_the_law_agree_with_small_steps(name):
    rng = np.random.default_rng(3)
    n, ice = 250, TABLED[name]
    bounds = play_bounds(ice, Direction.AWAY)
    stones = np.full((n, 3, 2), np.nan)
    places = rng.uniform([-0.9, -1.2], [0.9, 0.6], (n, 2)) + np.array([0.0, TEE_Y])
    stones[n // 4 :, 0] = places[n // 4 :]
    stones[:, 1:] = [[1.6, TEE_Y + 1.2], [-1.6, TEE_Y + 1.2]]
    speed, spin = rng.uniform(1.9, 3.2, n), rng.uniform(-2.5, 2.5, n)
    spin[:3] = 9.0, -20.0, 0.0
    angle = 0.04 * np.sign(spin) + rng.normal(0.0, 0.01, n)
    throws = [Throw(speed=v, angle=a, spin=w) for v, a, w in zip(speed, angle, spin, strict=True)]
    releases = release_table([throw.release(clock=100.0, sweep=(3.0, 9.0)) for throw in throws])
    found, fine = (
        BatchEngine(ice, tolerance=tolerance, tabulated=tabulated).play(
            stones, releases, bounds=bounds
        )
        for tolerance, tabulated in ((1e-4, True), (1e-5, False))
    )
    assert (found.last != fine.last).any()  # the table was used
    assert np.array_equal(np.isnan(found.xy), np.isnan(fine.xy))
    assert np.array_equal(found.collisions, fine.collisions)
    off = np.nanmax(np.hypot(*(found.last - fine.last).transpose(2, 0, 1)), axis=1)
    turned = np.abs(found.theta - fine.theta)[:, -1]
    alone, once = fine.collisions == 0, fine.collisions == 1
    assert alone.sum() > 50
    assert once.sum() > 30
    assert off[alone].max() < 2e-4
    assert np.nanmax(turned[alone]) < 2e-3
    assert np.abs(found.time - fine.time)[alone].max() < 0.01
    assert off[once].max() < 1e-3
    assert np.median(off[once]) < 1e-4


def test_a_law_of_the_contacts_that_depends_on_more_is_evaluated(monkeypatch) -> None:
    card = catalogue()["speed_dependent_friction"]
    cards = {**catalogue(), card.name: replace(card, of_speed_and_spin=False)}
    monkeypatch.setattr("curling_env.physics.law.catalogue", lambda: cards)
    ice, no_stones = load_ice("standard"), np.empty((1, 0, 2))
    release = [Throw(speed=2.05, angle=0.03, spin=1.5).release()]
    tabled, exact = (
        play_batch(ice, no_stones, release, tolerance=1e-4, tabulated=t) for t in (True, False)
    )
    np.testing.assert_array_equal(tabled.last, exact.last)
