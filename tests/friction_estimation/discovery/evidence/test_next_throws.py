"""The throws that would teach most: what they are, and that they do teach more than others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import Ice
from curling_env.physics import slide
from curling_env.sheet import TEE_Y, Direction
from curling_env.throw import Throw
from friction_estimation.discovery import (
    base_model,
    candidates,
    fit_with_noise,
    next_throws,
    open_session,
    refit,
    standard_errors,
)
from friction_estimation.discovery.evidence.next_throws import draw_speeds

from ..conftest import effect

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
