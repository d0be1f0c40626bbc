"""Bias and spread of athletes, compared with the true ones."""

from __future__ import annotations

import math

import numpy as np
import pytest
import simulated_club as club

from agents.coaching import (
    HandError,
    SessionCauses,
    ThrowCauses,
    ThrowSheet,
    athlete_errors,
    read_call,
)
from curling_env.sheet import Direction
from curling_env.throw import Throw
from friction_estimation.tracks import Measured, ThrowMeasures, ThrowNote

SPREAD = np.array([0.03, 0.14, 0.2])
MEASURED = np.array([0.001, 0.02, 0.01])


def thrown(rng, n, *, bias=(0.0, 0.0, 0.0), spread=SPREAD, name="Ada", missing=()):
    """Return throws with known errors only, in the form of `hand_or_ice`."""
    throws = []
    for k in range(n):
        called = f"{('guard', 'draw')[k // 2 % 2]} {('in', 'out')[k % 2]}"
        error = np.array(bias) + spread * rng.standard_normal(3) + MEASURED * rng.standard_normal(3)
        values = [Measured(float(v), float(s)) for v, s in zip(error, MEASURED, strict=True)]
        reported = dict(zip(("speed", "line", "spin"), values, strict=True))
        throws.append(
            ThrowCauses(
                sheet=ThrowSheet(
                    measures=ThrowMeasures(throw=k, stone=0, clock=0.0, direction=Direction.AWAY),
                    note=ThrowNote(athlete=name, called=called),
                    call=read_call(called),
                ),
                target=np.zeros(2), rest=np.zeros(2), miss=np.zeros(2), parts={},
                errors=HandError(
                    **(reported | dict.fromkeys(missing)), covariance=np.diag(MEASURED**2)
                ),
                intended=Throw(speed=2.0), released=Throw(speed=2.0), draws=np.zeros((2, 0, 2)),
            )
        )  # fmt: skip
    return throws


def session(*throws):
    return SessionCauses(
        throws=tuple(throws), left_out={}, pattern=None, athletes=(), believed=True
    )


def test_intervals_contain_the_true_values_of_athletes():
    rng = np.random.default_rng(7)
    bias_in, spread_in, ratio = [], [], []
    for case in range(6):
        bias, spread = [0.02, 0.1, 0.1] * rng.standard_normal(3), SPREAD * rng.uniform(0.4, 1.5, 3)
        throws = thrown(rng, 16, bias=bias, spread=spread)
        (found,) = athlete_errors([session(*throws)], seed=case)
        for group in (found.overall, *found.groups):
            bias_in += [one.low <= b <= one.high for one, b in zip(group.bias, bias, strict=True)]
            spread_in += [
                one.low <= s <= one.high for one, s in zip(group.spread, spread, strict=True)
            ]
        ratio.append([one.value / s for one, s in zip(found.overall.spread, spread, strict=True)])
    assert np.mean(bias_in) >= 0.9
    assert np.mean(spread_in) >= 0.9
    assert np.exp(np.log(ratio).mean(axis=0)) == pytest.approx(1.0, abs=0.2)


def test_the_measurement_error_is_removed():
    """The spread of an athlete who throws as exactly as the film shows is not that of the film."""
    rng = np.random.default_rng(3)
    (found,) = athlete_errors([session(*thrown(rng, 60, spread=0.5 * MEASURED))])
    seen = found.errors.std(axis=0)
    assert (np.array([one.value for one in found.overall.spread]) < 0.85 * seen).all()


def test_a_group_of_few_throws_leans_on_the_others():
    rng = np.random.default_rng(1)
    many = [one for one in thrown(rng, 40, bias=(0.05, 0, 0)) if one.call.shot == "draw"]
    few = [one for one in thrown(rng, 4, bias=(-0.1, 0, 0)) if one.call.shot == "guard"]
    (found,) = athlete_errors([session(*many, *few)])
    guards = next(g for g in found.groups if g.weight == "guard" and g.handle is None)
    measured = np.mean([one.errors.speed.value for one in few])
    assert guards.throws == 2
    assert measured < guards.bias[0].value < found.overall.bias[0].value
    draws = next(g for g in found.groups if g.weight == "draw" and g.handle is None)
    width = guards.bias[0].high - guards.bias[0].low
    assert width > 1.5 * (draws.bias[0].high - draws.bias[0].low)


def test_sessions_athletes_and_groups_are_separated():
    rng = np.random.default_rng(2)
    first = session(*thrown(rng, 8, name="Ada"), *thrown(rng, 8, name="Bo", bias=(0.1, 0, 0)))
    second = session(*thrown(rng, 8, name="Ada"), *thrown(rng, 1, name="Cy"))
    ada, bo = athlete_errors([first, second])
    assert (ada.name, ada.sessions, ada.overall.throws) == ("Ada", 2, 16)
    assert (bo.name, bo.sessions) == ("Bo", 1)
    assert bo.overall.bias[0].value > ada.overall.bias[0].value + 0.05
    assert [(g.handle, g.weight) for g in ada.groups] == [
        ("in-turn", "guard"), ("in-turn", "draw"), ("out-turn", "guard"), ("out-turn", "draw"),
        ("in-turn", None), ("out-turn", None), (None, "guard"), (None, "draw"),
    ]  # fmt: skip
    assert ada.as_dict()["groups"][0]["speed_bias_low"] < ada.groups[0].bias[0].value


def test_a_skill_is_the_spread_without_the_bias():
    rng = np.random.default_rng(4)
    (found,) = athlete_errors([session(*thrown(rng, 60, bias=(0.2, 0, 0)))])
    skill = found.skill
    assert skill.sigma_speed == pytest.approx(SPREAD[0], rel=0.3)
    assert skill.sigma_angle == pytest.approx(SPREAD[1] / 28.346, rel=0.3)
    assert skill.sigma_spin == pytest.approx(SPREAD[2], rel=0.3)
    assert "60 throws" in skill.source


def test_a_skill_has_the_tails_and_the_correlation_of_the_throws():
    def errors(rng, tails):
        z = rng.standard_normal((200, 3))
        z[:, 1] = 0.6 * z[:, 0] + 0.8 * z[:, 1]
        return z * np.sqrt((tails - 2) / rng.chisquare(tails, (200, 1))) if tails else z

    for tails in (None, 3.0):
        drawn = iter(errors(np.random.default_rng(9), tails))
        throws = thrown(Drawn(drawn), 200)
        (found,) = athlete_errors([session(*throws)])
        assert found.skill.correlation == pytest.approx(-0.6, abs=0.15)
        if tails is None:
            assert found.skill.tails == math.inf
        else:
            assert 2 < found.skill.tails < 5


class Drawn:
    """Errors that were drawn before, without errors of measurement."""

    def __init__(self, drawn):
        self.drawn, self.odd = drawn, False

    def standard_normal(self, n):
        self.odd = not self.odd
        return next(self.drawn) if self.odd else np.zeros(n)


def test_unmeasured_components_take_the_usual_values():
    rng = np.random.default_rng(5)
    (found,) = athlete_errors([session(*thrown(rng, 20, missing=("spin",)))])
    assert np.isnan(found.errors[:, 2]).all()
    speed, _, spin = found.overall.spread
    assert spin.high / spin.low > 1.5 * speed.high / speed.low


def test_an_ellipse_holds_its_share():
    rng = np.random.default_rng(6)
    (found,) = athlete_errors([session(*thrown(rng, 200))])
    ellipse = found.overall.ellipse(0.5)
    centre = np.array([found.overall.bias[1].value, found.overall.bias[0].value])
    inverse = np.linalg.inv(np.cov((ellipse - centre).T, bias=True))
    points = found.errors[:, [1, 0]] - centre
    inside = np.einsum("ni,ij,nj->n", points, inverse, points) <= 2.0
    assert inside.mean() == pytest.approx(0.5, abs=0.1)


def test_athletes_of_a_simulated_club():
    """From tracks to spreads: the complete path, once."""
    from agents.coaching import hand_or_ice

    rng = np.random.default_rng(8)
    ada = club.Athlete(name="Ada", bias=(0.04, 0.0, 0.0), spread=(0.02, 0.004, 0.15))
    evening = club.evening(rng, athletes=(ada,), throws=10)
    ice = evening.ice.as_ice(rng, sigma=0.002)
    causes = hand_or_ice(evening.tracks, ice, evening.notes, believed=evening.believed.as_ice())
    (found,) = athlete_errors([causes])
    speed, line, _ = found.overall.bias
    assert speed.low < 0.04 < speed.high
    assert speed.low > 0.01
    assert line.low < 0.0 < line.high
    assert found.overall.spread[0].low < 0.02 < found.overall.spread[0].high
