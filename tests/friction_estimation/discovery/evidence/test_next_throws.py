"""The throws that would teach most: what they are, and that they do teach more than others."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.physics import catalogue, slide
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, PAPER_SHEET, TEE_Y, Direction
from curling_env.throw import Throw
from friction_estimation.design.design import Informative
from friction_estimation.discovery import (
    SessionNoise,
    Term,
    base_model,
    candidates,
    fit_with_noise,
    neutral_values,
    next_throws,
    open_session,
    refit,
    standard_errors,
)
from friction_estimation.discovery.evidence import next_throws as choice
from friction_estimation.discovery.evidence.next_throws import (
    NextThrow,
    TrialThrow,
    draw_speeds,
    hog_to_hog,
    in_words,
    is_playable,
    is_seen,
    lay_out,
    noise_of_rows,
    trial_throws,
)
from friction_estimation.discovery.model.model import Model

from ..conftest import effect, plain_session

CURL = effect("curl", strength=0.006)


def thrown(rng, k, *, speed, spin, direction, line=0.0, stone=0, swept=False, effects=(CURL,)):
    """A measured throw, simulated on ice of 0.009."""
    ice = Ice.uniform(0.009 * float(np.exp(rng.normal(0, 0.005))), effects=effects)
    release = Throw(speed=speed, spin=spin, x=line * direction).release(
        direction, order=k, stone=stone, clock=70.0 * k, sweep=(2.0, 8.0) if swept else (0.0, 0.0)
    )
    path = slide(ice, release, fps=15, throw=k).trajectory
    return replace(path, xy=path.xy + rng.normal(0, 0.004, path.xy.shape),
                   theta=path.theta + rng.normal(0, 0.02, len(path)))  # fmt: skip


def fitted_with(tracks, *labels):
    session = open_session(tracks)
    model = base_model(None, session)
    terms = [t for t in candidates(session, model.terms) if t.label in labels]
    assert len(terms) == len(labels)
    return fit_with_noise(model.with_terms(*terms), session)


def test_after_one_way_and_one_spin_the_next_throw_is_of_the_other_kind(rng):
    """Curl and slope look alike until stones turn the other way."""
    tracks = [
        thrown(rng, k, speed=1.6 + 0.1 * k, spin=1.5, direction=Direction.AWAY, line=0.1 * k - 0.4)
        for k in range(9)
    ]
    fitted = fitted_with(tracks, "curl", "slope")
    first, *_ = next_throws(fitted)
    assert first.throw.spin < 0.0 or first.throw.direction is Direction.HOME
    assert max(first.teaches["curl"], first.teaches["slope"]) > 0.8
    assert ("in-turn ↻" if first.throw.spin < 0 else "out-turn ↺") in first.words


def test_the_chosen_throw_teaches_more_than_one_like_those_before(rng):
    """Both are simulated and added; the standard errors of the new fits say which taught more."""
    tracks = [
        thrown(rng, k, speed=1.7 + 0.1 * k, spin=1.5, direction=Direction.AWAY) for k in range(8)
    ]
    fitted = fitted_with(tracks, "curl", "slope")
    best = next_throws(fitted, 1)[0].throw

    def errors_with(**options):
        more = [*tracks, thrown(rng, 8, **options)]
        return standard_errors(fitted_with(more, "curl", "slope"))

    chosen = errors_with(
        speed=best.speed,
        spin=best.spin,
        direction=best.direction,
        line=best.line * best.direction,
    )
    alike = errors_with(speed=2.1, spin=1.5, direction=Direction.AWAY)
    for name in (("slope", "x"), ("curl", "strength")):
        assert chosen[name] < 0.6 * alike[name], name


def test_a_stone_that_was_hardly_thrown_is_thrown_again_and_sweeping_is_swept(make_session):
    session = open_session(make_session([CURL], throws=12))
    stones = np.zeros(12, dtype=np.intp)
    stones[3] = 5
    session = replace(session, stones=stones)
    model = base_model(None, session)
    terms = {t.label: t for t in candidates(replace(session, stones=stones), model.terms)}
    bias = terms.get("stone_bias[5]") or next(
        t.with_values(stone=5.0) for t in terms.values() if t.name == "stone_bias"
    )
    fitted = fit_with_noise(model.with_terms(terms["curl"], bias), session)
    first = next_throws(fitted, 1)[0]
    assert first.throw.stone == 5
    assert "with stone 5" in first.words
    assert first.teaches["stone_bias[5]"] == max(first.teaches.values())

    rarely = session.swept * (session.owner == 1)
    once = replace(session, swept=rarely)
    fitted = fit_with_noise(base_model(None, once).with_terms(terms["sweeping"]), once)
    first = next_throws(fitted, 1)[0]
    assert first.throw.swept
    assert first.words.endswith("swept")
    assert not first.words.endswith("unswept")


def test_draws_reach_the_tee_and_times_are_those_of_the_throw(curl_fit):
    fitted = curl_fit(throws=12, scatter=0.0)
    speeds = draw_speeds(fitted)
    ice = Ice.uniform(0.009, effects=(CURL,))
    for direction, speed in speeds.items():
        path = slide(ice, Throw(speed=speed, spin=2.2).release(direction), fps=10).trajectory
        assert path.xy[-1, 1] == pytest.approx(direction * TEE_Y, abs=0.25)
    for each in next_throws(fitted):
        throw = Throw(speed=each.throw.speed, spin=each.throw.spin)
        path = slide(ice, throw.release(Direction.AWAY), fps=60).trajectory
        time = float(np.interp(10.9725, path.xy[:, 1], path.t))
        assert each.hog_to_hog == pytest.approx(time, abs=0.1)
        assert f"{each.hog_to_hog:.1f} s hog to hog" in each.words
        assert each.words.startswith(each.throw.weight)


def test_three_different_throws_of_the_grid_in_falling_order(curl_fit):
    fitted = curl_fit(throws=10)
    found = next_throws(fitted)
    assert len({each.words for each in found}) == 3
    for each in found:
        assert abs(each.throw.spin) in (0.8, 2.2)
        assert each.throw.weight.endswith("weight")
        half_width = fitted.model.ice.sheet.width / 2
        assert abs(round(each.throw.line / half_width, 6)) in (0.0, 0.25, 0.5)
        assert all(0.0 <= part < 1.0 for part in each.teaches.values())
        assert list(each.teaches.values()) == sorted(each.teaches.values(), reverse=True)
    assert sum(found[0].teaches.values()) > sum(found[2].teaches.values())


def test_lines_are_named_as_the_thrower_sees_them(curl_fit):
    fitted = curl_fit(throws=10)
    for each in next_throws(fitted, 12):
        if each.throw.line == 0.0:
            assert "centre line" in each.words
            continue
        right = (each.throw.line > 0) == (each.throw.direction is Direction.AWAY)
        assert f"the {'right' if right else 'left'} side line" in each.words


def test_a_throw_moves_the_posterior_as_it_was_foretold(rng):
    """The share of the variance that a throw removes, against the fit that has it."""
    tracks = [
        thrown(rng, k, speed=1.7 + 0.1 * k, spin=1.5 * (-1) ** k, direction=Direction.AWAY)
        for k in range(10)
    ]
    fitted = fitted_with(tracks, "curl", "slope")
    best = next_throws(fitted, 1)[0]
    more = thrown(
        rng,
        10,
        speed=best.throw.speed,
        spin=best.throw.spin,
        direction=best.throw.direction,
        line=best.throw.line * best.throw.direction,
    )
    session = open_session([*tracks, more])
    after = refit(replace(fit_with_noise(fitted.model, session), noise=fitted.noise), fitted.model)
    before_sigma, after_sigma = standard_errors(fitted), standard_errors(after)
    removed = 1.0 - (after_sigma["curl", "strength"] / before_sigma["curl", "strength"]) ** 2
    assert removed == pytest.approx(best.teaches["curl"], abs=0.12)


@pytest.mark.parametrize("throws", [1, 3])
def test_after_few_throws_there_are_next_ones_too(curl_fit, throws):
    assert len(next_throws(curl_fit(throws=throws))) == 3


# --- trial throws --------------------------------------------------------------------------------

AWAY = TrialThrow(direction=Direction.AWAY, speed=2.0, spin=0.8, weight="draw weight")


def of_effect(name: str, **values: float) -> Term:
    card = catalogue()[name]
    return Term(card=card, values=neutral_values(card, **values), free=card.first)


def test_throws_are_laid_out_as_the_next_of_a_session():
    before = plain_session(throws=3)  # at 0, 60 and 120 s
    home = replace(AWAY, direction=Direction.HOME, spin=-2.2, line=0.5, stone=4, wait=3600.0)
    swept = replace(AWAY, swept=True)
    session, states = lay_out(before, [AWAY, home, swept])
    assert session.throws.tolist() == [0, 1, 2]
    assert session.orders.tolist() == [3, 3, 3]
    assert session.stones.tolist() == [0, 4, 0]
    assert session.clocks.tolist() == [180.0, 3720.0, 180.0]
    assert states.tolist() == [
        [0.0, -HOG_LINE_Y, 0.0, 2.0, 0.0, 0.8],
        [0.5, HOG_LINE_Y, 0.0, -2.0, 0.0, -2.2],
        [0.0, -HOG_LINE_Y, 0.0, 2.0, 0.0, 0.8],
    ]
    # Long enough for a stone to stop, four times per second.
    times = session.times[session.rows(2)]
    assert np.diff(times) == pytest.approx(np.full(len(times) - 1, 0.25))
    assert times[0] == 0.0
    assert 30.0 < times[-1] <= 32.0
    assert len(session.xy) == len(session.theta) == len(session.sigma) == 3 * len(times)
    assert session.starts.tolist() == [0, len(times), 2 * len(times), 3 * len(times)]
    assert not session.swept[: 2 * len(times)].any()
    sweeping = times[session.swept[session.rows(2)] > 0.5]
    assert (sweeping[0], sweeping[-1]) == (2.25, 7.75)
    assert len(sweeping) == 23  # without a gap
    assert not np.isnan(session.observed).any()
    assert session.sigma.tolist() == np.ones((3 * len(times), 2)).tolist()
    two, _ = lay_out(before, [AWAY], np.array([0.0, 60.0]))
    assert two.times.tolist() == [0.0, 60.0]
    assert session.wear_tracks is before.wear_tracks


@pytest.fixture
def at_known_speeds(monkeypatch):
    """A fit of three stones, the last of which was thrown once, whose draws have given speeds."""
    speeds = {Direction.AWAY: 2.0, Direction.HOME: 2.5}
    monkeypatch.setattr(choice, "draw_speeds", lambda _: speeds)
    session = plain_session(throws=5, stones=np.array([3, 5, 3, 5, 7]))
    ice = SimpleNamespace(sheet=PAPER_SHEET)
    fitted: Any = SimpleNamespace(session=session, model=SimpleNamespace(ice=ice))
    return fitted


def test_the_grid_has_every_weight_spin_and_line_both_ways(at_known_speeds):
    throws = trial_throws(at_known_speeds, [of_effect("curl")])
    assert len(throws) == len(set(throws)) == 2 * 5 * 4 * 5
    away = [t for t in throws if t.direction is Direction.AWAY]
    assert len(away) == 100
    for direction, draw in ((Direction.AWAY, 2.0), (Direction.HOME, 2.5)):
        speed = {t.weight: t.speed / draw for t in throws if t.direction is direction}
        order = ["guard weight", "draw weight", "control weight", "normal hit weight"]
        assert sorted(speed, key=speed.__getitem__) == [*order, "peel weight"]
        assert speed["draw weight"] == 1.0
        assert 0.9 < speed["guard weight"] < 0.95
        assert 1.05 < speed["control weight"] < 1.2
        assert 1.3 < speed["normal hit weight"] < 1.5
        assert 1.6 < speed["peel weight"] < 1.9
    spins = sorted({t.spin for t in throws})
    assert spins == [-s for s in spins[::-1]]
    assert 0.5 < spins[2] < 1.0
    assert 2.0 < spins[3] < 2.5
    half = PAPER_SHEET.width / 2
    lines = sorted({t.line for t in throws})
    assert lines == pytest.approx([-half / 2, -half / 4, 0.0, half / 4, half / 2])
    assert {(t.stone, t.swept, t.wait) for t in throws} == {(3, False, 60.0)}


def test_the_grid_varies_what_the_terms_depend_on(at_known_speeds):
    def varied(*terms):
        throws = trial_throws(at_known_speeds, terms)
        return {
            name: sorted({getattr(t, name) for t in throws}) for name in ("stone", "swept", "wait")
        }

    alone = {"stone": [3], "swept": [False], "wait": [60.0]}
    assert varied() == alone
    assert varied(of_effect("sweeping")) == {**alone, "swept": [False, True]}
    assert varied(of_effect("time_drift")) == {**alone, "wait": [60.0, 3600.0]}
    # A stone with an effect is compared with one without.
    assert varied(of_effect("stone_bias", stone=3.0)) == {**alone, "stone": [3, 5]}
    every = [of_effect("stone_bias", stone=float(s)) for s in (5, 3, 7)]
    assert varied(*every) == {**alone, "stone": [3, 5, 7]}


def test_rows_of_a_stone_that_moves_in_play_are_seen():
    path = np.zeros((6, 6))
    path[:, 1] = [0.0, -BACK_LINE_Y + 0.01, BACK_LINE_Y + 0.01, -BACK_LINE_Y - 0.01, 5.0, 5.0]
    path[:, 3] = [1.0, -1.0, 1.0, 1.0, 0.019, 0.0]
    path[:, 2] = [0.0, 0.0, 0.0, 0.0, 0.0, -0.021]
    assert is_seen(path).tolist() == [True, True, False, False, False, True]


def test_a_row_of_a_trial_throw_stands_for_the_frames_around_it():
    """Seven and a half at 30 frames per second."""
    noise = SessionNoise(white=(4e-3, 3e-3, 0.02), fading=(1e-3, 1e-3, 0.0), memory=(0.3,) * 3)
    for spacing, frames in ((1 / 30, 7.5), (1 / 3, 1.0)):
        fitted: Any = SimpleNamespace(session=plain_session(spacing=spacing), noise=noise)
        found = noise_of_rows(fitted)
        assert found.white == pytest.approx(np.array(noise.white) / np.sqrt(frames))
        assert (found.fading, found.memory) == (noise.fading, noise.memory)


def slid(to: float, *, aside: float = 0.0, direction: int = 1) -> np.ndarray:
    """States of a stone that slides evenly from the hog line to a place, and to the side."""
    path = np.zeros((81, 6))
    path[:, 1] = direction * np.linspace(-HOG_LINE_Y, to, 81)
    path[:, 0] = np.linspace(0.0, aside, 81)
    return path


def test_a_throw_is_playable_if_it_passes_the_far_hog_line_and_touches_no_side_line():
    side = PAPER_SHEET.width / 2
    for direction in (1, -1):
        assert is_playable(slid(HOG_LINE_Y + 0.1, direction=direction), PAPER_SHEET)
        assert not is_playable(slid(HOG_LINE_Y - 0.1, direction=direction), PAPER_SHEET)
        assert is_playable(slid(TEE_Y, aside=direction * (side - 0.17)), PAPER_SHEET)
        assert not is_playable(slid(TEE_Y, aside=direction * (side - 0.13)), PAPER_SHEET)
    # Beyond the back line it is out of play, wherever it runs.
    assert is_playable(slid(2 * BACK_LINE_Y, aside=1.4 * side), PAPER_SHEET)
    assert not is_playable(slid(2 * BACK_LINE_Y, aside=1.8 * side), PAPER_SHEET)


def test_the_time_from_hog_line_to_hog_line_is_that_of_an_even_slide():
    path = slid(3 * HOG_LINE_Y)  # half of 80 rows, four of which are a second
    assert hog_to_hog(path, Direction.AWAY) == pytest.approx(10.0)
    back = slid(3 * HOG_LINE_Y, direction=-1)
    assert hog_to_hog(back, Direction.HOME) == pytest.approx(10.0)


def test_a_call_names_handle_line_stone_sweeping_and_time():
    path = slid(TEE_Y)
    time = f"{20.0 * 2 * HOG_LINE_Y / (TEE_Y + HOG_LINE_Y):.1f}"
    half = PAPER_SHEET.width / 2
    rest = "to the tee line at the away end"
    assert in_words(AWAY, path, PAPER_SHEET, ()) == (
        f"draw weight ({time} s hog to hog), slow out-turn ↺, down the centre line, {rest}"
    )
    quick = replace(AWAY, spin=-2.2, line=0.25 * half)
    assert in_words(quick, path, PAPER_SHEET, ()).endswith(
        f"quick in-turn ↻, a quarter of the way from the centre line to the right side line, {rest}"
    )
    left = replace(AWAY, line=-0.5 * half)
    assert "half-way from the centre line to the left side line" in in_words(
        left, path, PAPER_SHEET, ()
    )
    home = replace(left, direction=Direction.HOME)
    assert "half-way from the centre line to the right side line" in in_words(
        home, -path, PAPER_SHEET, ()
    )
    terms = [of_effect("stone_bias", stone=4.0), of_effect("sweeping")]
    asked = replace(AWAY, stone=4, wait=3600.0)
    assert in_words(asked, path, PAPER_SHEET, terms).endswith(
        f"{rest}, with stone 4, unswept, 60 minutes after the last throw"
    )
    assert in_words(replace(asked, swept=True), path, PAPER_SHEET, terms[1:]).endswith(
        f"{rest}, swept, 60 minutes after the last throw"
    )


def test_a_throw_in_a_report_is_rounded_for_people():
    throw = replace(AWAY, speed=2.34567, line=-0.123456, stone=np.int64(3), swept=True)
    shown = NextThrow(
        throw=throw, hog_to_hog=12.3456, words="draw", teaches={"curl": 0.123456, "slope": 0.1}
    ).as_dict()
    assert shown == {
        "words": "draw",
        "weight": "draw weight",
        "hog_to_hog_s": 12.35,
        "speed": 2.346,
        "spin": 0.8,
        "direction": "away",
        "x": -0.123,
        "stone": 3,
        "swept": True,
        "teaches": {"curl": 0.1235, "slope": 0.1},
    }
    back = NextThrow(
        throw=replace(throw, direction=Direction.HOME), hog_to_hog=9.0, words="", teaches={}
    )
    assert back.as_dict()["direction"] == "home"


def test_the_information_of_a_throw_has_a_root_without_its_negligible_rows(rng):
    rows = rng.normal(size=(3, 5)) * [1e4, 1.0, 1e-3, 1.0, 0.0]
    root = choice._root(rows.T @ rows)
    assert root.shape == (3, 5)
    assert root.T @ root == pytest.approx(rows.T @ rows, rel=1e-6, abs=1e-12)


def test_friction_and_every_term_are_to_be_learnt():
    model = Model(
        ice=SimpleNamespace(),
        terms=(of_effect("slope"), of_effect("curl")),
    )
    found = {name: places.tolist() for name, places in choice._targets(model).items()}
    assert found == {"friction": [0], "slope": [2, 3], "curl": [4]}


def test_after_gates_no_throw_is_asked_for(at_known_speeds):
    gated = replace(at_known_speeds.session, gates=SimpleNamespace())
    timed: Any = SimpleNamespace(session=gated)
    assert next_throws(timed) == []


def test_each_throw_is_the_one_that_removes_most_given_those_before(monkeypatch, rng):
    """Against inverses of the information; friction and every effect count alike."""
    ice: Any = SimpleNamespace(sheet=PAPER_SHEET)
    model = Model(ice=ice, terms=(of_effect("slope"), of_effect("curl")))
    throws = [replace(AWAY, spin=0.8 + k) for k in range(5)]
    rows = [rng.normal(size=(2, 5)) * [40.0, 4.0, 1e4, 1e4, 400.0] for _ in throws]
    paths = [slid(TEE_Y) for _ in throws]
    paths[2] = slid(0.0)  # it does not reach the far hog line
    spreads, weights = np.array([0.01, 0.03]), np.array([0.25, 0.75])
    asked = []

    def information_of(_, given, spread):
        asked.append(spread)
        assert given is throws
        return [Informative(np.arange(5), each) for each in rows], paths

    known = rng.normal(size=(9, 5)) * [30.0, 3.0, 1e4, 1e4, 300.0]
    monkeypatch.setattr(
        choice, "mixture", lambda _: SimpleNamespace(spreads=spreads, weights=weights)
    )
    monkeypatch.setattr(choice, "trial_throws", lambda *_: throws)
    monkeypatch.setattr(choice, "_information_of", information_of)
    linear = SimpleNamespace(total=lambda _: np.pad(known.T @ known, (0, 1)))
    fitted: Any = SimpleNamespace(model=model, linear=linear, session=plain_session())
    found = next_throws(fitted, 3)
    assert asked == [pytest.approx(0.025)]

    low, high = model.bounds
    information = known.T @ known + np.diag(12.0 / (high - low) ** 2)
    first = np.diag(np.linalg.inv(information))
    targets = {"friction": [0], "slope": [2, 3], "curl": [4]}

    def removed(info):
        return 1.0 - np.diag(np.linalg.inv(info)) / first

    left = [0, 1, 3, 4]
    for each in found:

        def total(k, present=information):
            share = removed(present + rows[k].T @ rows[k])
            return sum(share[own].mean() for own in targets.values())

        best = max(left, key=total)
        assert each.throw is throws[best]
        left.remove(best)
        share = 1.0 - np.diag(np.linalg.inv(information + rows[best].T @ rows[best])) / np.diag(
            np.linalg.inv(information)
        )
        expected = {name: share[own].mean() for name, own in targets.items()}
        assert each.teaches == pytest.approx(expected)
        assert list(each.teaches.values()) == sorted(each.teaches.values(), reverse=True)
        assert each.hog_to_hog == hog_to_hog(paths[best], Direction.AWAY)
        information = information + rows[best].T @ rows[best]
    assert len(next_throws(fitted, 9)) == 4
    for k in range(5):
        paths[k] = slid(0.0)
    assert next_throws(fitted, 2) == []
