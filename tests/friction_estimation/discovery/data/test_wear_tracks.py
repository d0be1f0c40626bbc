"""Wear along the paths of earlier stones: stored, found, distinguished from other wear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics import slides_in_turn, wear_along_path, with_wear_in_map
from curling_env.sheet import PAPER_SHEET, Direction
from curling_env.throw import Throw
from curling_env.worn_tracks import WORN_WIDTH
from friction_estimation import discover
from friction_estimation.discovery import (
    Combination,
    SessionNoise,
    base_model,
    candidates,
    document,
    fit,
    nearby,
    open_session,
    refit,
)
from friction_estimation.discovery.data.wear_tracks import (
    LONGEST_PATH,
    WearTracks,
    _path,
    _slow_part,
    smoothed_path,
    wear_refinement,
)

ALONG = -0.012
LABEL = "pebble_wear[along_path]"


def wearing(along=ALONG, cell_size=0.1, felt="along_path"):
    sheet = replace(PAPER_SHEET, cell_size=cell_size)
    effect = ActiveEffect(name="pebble_wear", parameters={felt: along})
    return Ice.uniform(0.009, sheet, effects=(effect,))


def play(ice, rng, *, throws=12, sigma=0.004, scatter=0.003):
    """Throws in turn on ice that wears, with scatter of friction and noise."""
    releases = [
        Throw(
            speed=float(speed),
            angle=float(rng.normal(0, 0.006)),
            spin=float(rng.choice([-1, 1]) * rng.uniform(0.8, 2.2)),
            x=float(rng.uniform(-0.5, 0.5)),
        ).release(Direction.AWAY if k % 2 else Direction.HOME, stone=k % 3, clock=70.0 * k, order=k)
        for k, speed in enumerate(rng.permutation(np.linspace(1.4, 2.3, throws)))
    ]
    releases = [replace(r, throw=k) for k, r in enumerate(releases)]
    factors = np.exp(rng.normal(0, scatter, throws))
    worn = list(slides_in_turn(ice, releases, fps=15))
    tracks = []
    for k, run in enumerate(worn):
        path = run.trajectory
        assert path is not None
        # The scatter of a throw's friction: as time and speed would change, to first order.
        path = replace(path, t=path.t / np.sqrt(factors[k]))
        xy = path.xy + rng.normal(0, sigma, path.xy.shape)
        theta = path.theta + rng.normal(0, 0.02, len(path))
        tracks.append(replace(path, xy=xy, theta=theta))
    return tracks


def test_wear_tracks_count_the_stones_before_and_no_trembling():
    line = np.column_stack([np.zeros(60), np.linspace(-10.0, 10.0, 60)])
    trembling = line[-1] + 0.02 * np.random.default_rng(1).normal(size=(3000, 2))
    tracks = WearTracks.of([(2, line), (0, np.vstack([line, trembling]))])
    sheet = replace(PAPER_SHEET, cell_size=0.1)
    passes = tracks.passes(sheet)[tracks.before(np.array([0, 1, 2, 3]))]
    under = sheet.cell_of([0.0, 0.0])
    assert passes[:, *under] == pytest.approx([0.0, 1.0, 1.0, 2.0], rel=0.1)
    area = passes.sum(axis=(1, 2)) * sheet.cell_size**2
    assert area == pytest.approx([0.0, 2.5, 2.5, 5.0], rel=0.03)


def test_what_goes_further_than_a_stone_can_leaves_no_wear_track(rng):
    rubbish = rng.uniform(-1.5, 1.5, (400, 2))
    assert np.hypot(*np.diff(rubbish, axis=0).T).sum() > LONGEST_PATH
    assert len(WearTracks.of([(0, rubbish), (1, np.zeros((0, 2)))]).paths) == 0


def test_a_path_is_known_better_than_its_rows(rng):
    (clean,) = play(Ice.uniform(0.009), rng, throws=1, sigma=0.0, scatter=0.0)
    # White noise of 3 mm, and as much with a memory of three rows.
    slow = lfilter(
        [np.sqrt(1 - np.exp(-2 / 3))], [1, -np.exp(-1 / 3)], rng.normal(size=clean.xy.shape), 0
    )
    seen = clean.xy + 3e-3 * (slow + rng.normal(size=clean.xy.shape))
    smooth = smoothed_path(clean.t, seen)
    aside, jitter = (smooth - clean.xy)[:, 0].std(), (seen - clean.xy)[:, 0].std()
    assert aside < 0.7 * jitter
    # Rows at rest are left as they were seen, and so is what no stone's path follows.
    assert np.array_equal(smooth[-5:], seen[-5:])
    struck = seen + np.maximum(clean.t - 8.0, 0.0)[:, None] * [0.5, 0.0]
    assert np.abs(smoothed_path(clean.t, struck) - struck).max() < WORN_WIDTH / 2
    pieces = seen + (clean.t > 8.0)[:, None] * [0.3, 0.0]
    assert np.array_equal(smoothed_path(clean.t, pieces), pieces)


@pytest.fixture
def worn_fit(rng):
    """A fit with wear under contacts, to throws whose noise has a memory."""
    session = open_session(play(wearing(-0.02, 0.5, "under_contacts"), rng, throws=8))
    model = base_model(None, session)
    wear = next(t for t in candidates(session) if t.label == "pebble_wear[under_contacts]")
    noise = SessionNoise(white=(2e-3, 2e-3, 0.02), fading=(3e-3, 3e-3, 0.0), memory=(0.3, 0.3, 0.1))
    return fit(model.with_terms(wear), session, noise)


def test_wear_that_is_left_out_costs_what_a_fit_says(worn_fit):
    (label,) = (term.label for term in worn_fit.model.terms)
    around = nearby(worn_fit, [label])
    spread = worn_fit.model.spread
    have, lack = (Combination(effects=frozenset(e), spread=spread) for e in ([label], []))
    loss = around.minimum_cost(lack) - around.minimum_cost(have)
    without = refit(worn_fit, worn_fit.model.without(label))
    assert loss == pytest.approx(without.deviance - worn_fit.deviance, rel=0.2)


@pytest.mark.parametrize(
    ("felt", "cell_size"), [("along_path", 0.1), ("along_path", 0.5), ("under_contacts", 0.5)]
)
def test_the_forward_model_runs_on_the_ice_that_stones_have_left(rng, felt, cell_size):
    ice = wearing(-0.03, cell_size, felt)
    session = open_session(play(ice, rng, throws=6, sigma=0.0, scatter=0.0))
    exact = SessionNoise(white=(1e-3, 1e-3, 1e-2), fading=(0.0, 0.0, 0.0), memory=(0.1, 0.1, 0.1))
    model = base_model(ice, session)
    worn = fit(model, session, exact, shared=False)
    untouched = model.without(model.terms[0].label)
    plain = fit(untouched, session, exact, shared=False)
    assert np.abs(worn.residuals[:, :2]).max() < 2e-3
    assert np.abs(plain.residuals[:, :2]).max() > 2e-2


@pytest.mark.parametrize(("felt", "kept"), [("along_path", 0.5), ("under_contacts", 0.1)])
def test_wear_along_paths_is_named_sized_and_kept(rng, felt, kept):
    """Felt under the centre of a stone in cells of 0.5 m, or by each contact on its own."""
    tracks = play(wearing(cell_size=0.5, felt=felt), rng, throws=10)
    found = discover(tracks)
    (effect,) = document(found)["effects"]
    assert effect["name"] == "pebble_wear"
    assert list(effect["parameters"]) == [felt]
    along = effect["parameters"][felt]
    assert abs(along["value"] - ALONG) < max(3 * along["stderr"], 0.1 * abs(ALONG))
    assert "where stones have run" in document(found)["verdict"]
    ice = found.improved_ice()
    assert wear_along_path(with_wear_in_map(ice)) == pytest.approx(along["value"], rel=1e-4)
    assert ice.sheet.cell_size == pytest.approx(kept)
    if felt == "along_path":
        assert document(discover(tracks, ice))["effects"] == []
    # The simulation reads it: later throws of the same release run further on worn ice.
    throw = Throw(speed=1.9, angle=0.0, spin=1.2).release(Direction.AWAY)
    runs = [run.trajectory for run in slides_in_turn(ice, [throw] * 4, fps=15)]
    assert runs[0] is not None
    assert runs[-1] is not None
    assert runs[-1].xy[-1, 1] > runs[0].xy[-1, 1] + 0.1


def test_throws_held_out_wear_the_ice_all_the_same(rng):
    session = open_session(play(wearing(), rng))
    some = session.only([3, 7, 11])
    sheet = replace(PAPER_SHEET, cell_size=0.1)
    whole = session.wear_tracks.passes(sheet)[session.wear_tracks.before(session.orders)]
    kept = some.wear_tracks.passes(sheet)[some.wear_tracks.before(some.orders)]
    assert np.array_equal(kept, whole[[3, 7, 11]])
    thinned = session.without_rows(np.arange(len(session.times)) % 5 == 4)
    assert thinned.wear_tracks is session.wear_tracks


def test_both_kinds_of_wear_are_candidates_until_one_is_in_the_model(rng):
    session = open_session(play(wearing(0.0), rng, throws=3))
    labels = {term.label for term in candidates(session)}
    assert {"pebble_wear", LABEL} <= labels
    along = next(term for term in candidates(session) if term.label == LABEL)
    left = {term.label for term in candidates(session, (along,))}
    assert "pebble_wear" in left
    assert LABEL not in left
    first = session.only([0])
    alone = replace(first, wear_tracks=replace(first.wear_tracks, orders=first.orders))
    assert LABEL not in {term.label for term in candidates(alone)}


def test_cells_are_narrow_enough_for_a_worn_track():
    for cell_size, times in ((0.5, 5), (0.25, 3), (0.125, 1), (0.1, 1), (0.3, 3)):
        assert wear_refinement(replace(PAPER_SHEET, cell_size=cell_size)) == times


def test_points_of_a_path_are_two_tenths_of_a_metre_apart():
    y = np.array([0.0, 0.1, 0.19, 0.21, 0.3, 0.405, 0.42, 5.0])
    path = _path(np.column_stack([0 * y, y]))
    assert path is not None
    assert path[:, 1].tolist() == [0.0, 0.21, 0.42, 5.0]
    assert _path(np.column_stack([0 * y[:3], y[:3]])) is None  # it stays where it is
    assert _path(np.zeros((0, 2))) is None
    for length, possible in ((59.0, True), (61.0, False)):
        y = np.linspace(0.0, length, 200)
        assert (_path(np.column_stack([0 * y, y])) is not None) == possible


def test_stones_of_earlier_throws_ran_before():
    y = np.linspace(0.0, 5.0, 30)
    run = np.column_stack([0 * y, y])
    tracks = WearTracks.of([(4, run + 1.0), (1, run), (1, run + 2.0)])
    assert tracks.orders.tolist() == [1, 1, 4]
    assert tracks.paths[0][0].tolist() == [0.0, 0.0]
    assert tracks.before(np.array([0, 1, 2, 4, 5])).tolist() == [0, 0, 2, 2, 3]


def test_passes_add_up_from_stone_to_stone():
    """Of running bands across the whole length of a sheet, in cells of its width."""
    y = np.linspace(-15.0, 15.0, 200)
    runs = [np.column_stack([np.full(200, x), y]) for x in (-0.5, 0.5)]
    tracks = WearTracks.of(enumerate(runs))
    sheet = replace(PAPER_SHEET, cell_size=0.1)
    passes = tracks.passes(sheet)
    assert passes.shape == (3, *sheet.shape)
    assert not passes[0].any()
    left, right = (sheet.cell_of([x, 0.0]) for x in (-0.5, 0.5))
    assert passes[1][*left] == pytest.approx(passes[2][*left])
    assert passes[1][*right] == 0.0
    assert passes[2][*right] == pytest.approx(passes[1][*left], rel=0.3)
    assert tracks.passes(sheet) is passes  # computed once
    fresh, layers = tracks.tracks(sheet)
    assert not fresh.passes.any()
    assert len(layers) == 3
    assert not layers[0].any()
    assert layers[2].sum() == pytest.approx(2 * layers[1].sum(), rel=0.05)
    assert tracks.tracks(sheet)[1] is layers


def test_outlying_rows_do_not_bend_a_path():
    t = np.arange(60.0)
    basis = np.column_stack([np.ones(60), t])
    seen = np.column_stack([3.0 + 0.1 * t, -t]) + 1e-3 * np.random.default_rng(1).normal(
        size=(60, 2)
    )
    bent = seen.copy()
    bent[10:13] += 1.0
    assert np.abs(_slow_part(basis, bent) - _slow_part(basis, seen)).max() < 1e-3
