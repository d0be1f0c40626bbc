from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.errors import FitError
from curling_env.ice import Ice
from curling_env.physics import State, catalogue, slide
from curling_env.throw import Throw
from friction_estimation.discovery import (
    SessionNoise,
    Term,
    base_model,
    candidates,
    fit,
    fit_with_noise,
    linearise,
    misfit_of,
    neutral_values,
    open_session,
    refit,
    standard_errors,
)
from friction_estimation.discovery.model import fit as fits
from friction_estimation.discovery.model.fit import (
    Point,
    SessionFit,
    _behind,
    _most_likely_spread,
    _moved,
    _part_of_the_way,
    _step,
    releases_near,
    singular_fit_refused,
)
from friction_estimation.discovery.model.gaussian_field import GatePlaces
from friction_estimation.discovery.model.linearisation import Linearisation
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.tuning import RELEASE_SIGMA

from ..conftest import effect, plain_session

ANY_ICE: Any = SimpleNamespace(stone=SimpleNamespace(radius=0.14))


def test_friction_scatter_and_errors(make_session):
    session = open_session(make_session(scatter=0.004, throws=16))
    fitted = fit_with_noise(base_model(None, session), session)
    mu = fitted.model.ice.friction.mu[0, 0] * np.exp(fitted.model.ln_mu)
    sigma = standard_errors(fitted)["", "ln_mu"]
    assert abs(np.log(mu / 0.009)) < 4 * sigma
    assert 0.002 < fitted.model.spread < 0.008
    assert misfit_of(fitted).white


def test_a_spin_that_was_not_seen_stays_near_the_usual_one(make_session):
    """Only the last metres tell of it, and not more than the prior does."""
    tracks = [replace(track, theta=np.full(len(track), np.nan)) for track in make_session(throws=4)]
    session = open_session(tracks)
    fitted = fit_with_noise(base_model(None, session), session)
    spins = np.abs(fitted.states[:, State.OMEGA])
    usual = np.abs(session.usual_spins)
    assert np.abs(spins - usual).max() < 1.2
    assert np.abs(spins - usual).max() > 1e-3  # they tell something
    faster = fitted.states.copy()
    faster[:, State.OMEGA] *= 2.0
    again = fit(fitted.model, fitted.session, fitted.noise, states=faster)
    assert np.abs(again.states[:, State.OMEGA]) == pytest.approx(spins, abs=0.05)


def test_a_spin_that_was_not_seen_does_not_change_its_side():
    """The end of a path that is off asks for any spin, and a fit that tries them gets lost."""
    path = slide(Ice.uniform(0.0087), Throw(speed=2.13, spin=1.1).release(), fps=15).trajectory
    share = path.t / path.t[-1]
    off = np.column_stack([0 * share, -0.02 - 0.06 * share**8])
    rng = np.random.default_rng(11)
    seen = replace(
        path,
        xy=path.xy + off + rng.normal(0, 1e-4, path.xy.shape),
        theta=np.full(len(path), np.nan),
    )
    session = open_session([seen])
    fitted = fit_with_noise(base_model(None, session), session)
    assert np.sign(session.usual_spins) * fitted.states[:, State.OMEGA] > 0.2


def test_a_missing_effect_shows_as_slow_misfit(make_session):
    session = open_session(make_session([effect("slope", x=2e-4, y=0.0)]))
    left = misfit_of(fit_with_noise(base_model(None, session), session))
    assert not left.white
    assert left.ratio > 5


def test_of_a_stones_friction_and_curl_in_an_ice_file_what_it_has_is_fitted(make_session):
    session = open_session(make_session(throws=4))

    def terms(**parameters):
        ice = Ice.uniform(0.009, effects=(effect("stone_bias", stone=1, **parameters),))
        return [(term.label, term.free) for term in base_model(ice, session).terms]

    assert terms(factor=1.02) == [("stone_bias[1]", ("factor",))]
    assert terms(curl_factor=1.2) == [("stone_bias[1, curl_factor]", ("curl_factor",))]
    assert terms(factor=1.02, curl_factor=1.2) == [("stone_bias[1]", ("factor", "curl_factor"))]


def test_what_only_differs_between_throws_is_fitted_where_nothing_else_does(make_session):
    """Without a scatter the spread falls to nothing with the step that explains it."""
    tracks = make_session([effect("stone_bias", stone=1, factor=1.07)], scatter=0.0)
    session = open_session(tracks)
    plain = fit_with_noise(base_model(None, session), session)
    assert plain.model.spread > 0.02
    card = catalogue()["stone_bias"]
    term = Term(card=card, values=neutral_values(card, stone=1.0), free=("factor",))
    fitted = refit(plain, plain.model.with_terms(term))
    assert fitted.model.terms[0].values["factor"] == pytest.approx(1.07, abs=2e-3)
    assert fitted.model.spread < 2e-3
    assert plain.deviance - fitted.deviance > 50


def test_base_ice_is_scaled_to_the_throws(make_session):
    session = open_session(make_session())
    base = Ice.uniform(0.012)
    fitted = fit_with_noise(base_model(base, session), session)
    mu = fitted.model.improved_ice({}).friction.mu
    assert mu.shape == base.friction.mu.shape
    assert abs(mu[0, 0] / 0.009 - 1) < 0.01


def test_a_step_after_which_the_numbers_overflow_is_refused(make_session, monkeypatch):
    session = open_session(make_session(throws=3))
    calls = []

    def flying_off(*args):
        calls.append(args)
        predicted, linear = linearise(*args)
        if len(calls) > 1:
            linear = replace(linear, grams=linear.grams.copy())
            linear.grams[:, 6:, 6:] = -1e250
        return predicted, linear

    start = fit_with_noise(base_model(Ice.uniform(0.007), session), session)
    monkeypatch.setattr("friction_estimation.discovery.model.fit.linearise", flying_off)
    found = fit(start.model, session, start.noise)
    assert len(calls) > 1
    assert np.isfinite(found.deviance)
    assert np.isfinite(found.predicted).all()


@pytest.fixture
def far_from_its_law(make_session):
    """A fit with friction of another law than the ice, and a model far from that law."""
    law = effect("speed_dependent_friction", exponent=1.0, share=0.25, speed_offset=0.06)
    session = open_session(make_session([law], throws=8, seed=1))
    plain = fit_with_noise(base_model(None, session), session)
    term = next(t for t in candidates(session) if t.label == law.name)
    begin = term.with_values(exponent=1.0, share=0.7, speed_offset=0.06)
    return plain, plain.model.with_terms(begin.freed("share", "speed_offset"))


def test_a_fit_that_cannot_reach_its_goal_ends_early(far_from_its_law, monkeypatch):
    plain, model = far_from_its_law
    taken: list[float] = []
    counted = Linearisation.deviance

    def deviance(linear: Linearisation) -> float:
        taken.append(counted(linear))
        return taken[-1]

    monkeypatch.setattr(Linearisation, "deviance", deviance)
    free = refit(plain, model, iterations=20)
    steps = len(taken)
    assert free.deviance < plain.deviance - 1e5
    # While steps are shortened the deviance falls unevenly, and says little about its end.
    reached = refit(plain, model, iterations=20, goal=free.deviance + 1.0)
    assert reached.deviance == free.deviance
    assert len(taken) == 2 * steps
    hopeless = refit(plain, model, iterations=20, goal=free.deviance - 1e5)
    assert hopeless.deviance > free.deviance
    assert len(taken) < 3 * steps


def test_the_last_step_needs_no_linearisation(make_session):
    session = open_session(make_session([effect("curl", strength=0.006)], throws=8))
    card = catalogue()["curl"]
    term = Term(card=card, values=neutral_values(card), free=card.first)
    found = fit_with_noise(base_model(None, session).with_terms(term), session)
    point = found.states, found.ln_factors
    _, linear = linearise(found.model, found.session, found.noise, *point)
    assert found.deviance == pytest.approx(linear.deviance(), abs=0.1)
    assert found.linear.minimum().step == pytest.approx(linear.minimum().step, abs=1e-4)
    assert found.linear.grams[:, -1, -1] == pytest.approx(linear.grams[:, -1, -1], rel=1e-3)


# --- points and steps that are given -------------------------------------------------------------


def random_columns(rng, throws=3, rows=30, shared=2):
    """Columns of release, factor, shared parameters and residual of each throw."""
    return rng.normal(size=(throws, rows, 6 + 1 + shared + 1))


def linear_of(columns, ln_factors, **model: Any) -> Linearisation:
    grams = np.einsum("kni,knj->kij", columns, columns)
    return Linearisation(model=Model(ice=ANY_ICE, **model), ln_factors=ln_factors, grams=grams)


def test_after_a_step_the_residual_lacks_what_the_step_explains(rng):
    columns, factors = random_columns(rng), 0.1 * rng.normal(size=3)
    linear = linear_of(columns, factors, ln_mu=0.1)
    states, moved = rng.normal(size=(3, 6)), rng.normal(size=(3, 6))
    later = factors + 0.3
    model = replace(linear.model, ln_mu=0.6, ln_coupling=-0.2)
    found = _moved(Point(states, linear, 0.0), model, moved, later)
    steps = np.column_stack([moved - states, later - factors, np.tile([0.5, -0.2], (3, 1))])
    expected = columns.copy()
    expected[:, :, -1] -= np.einsum("kni,ki->kn", columns[:, :, :-1], steps)
    assert found.grams == pytest.approx(np.einsum("kni,knj->kij", expected, expected))
    assert found.ln_factors is later
    assert found.model is model


def test_better_releases_and_frictions_promise_what_least_squares_gain(rng):
    columns, factors, spread = random_columns(rng), 0.1 * rng.normal(size=3), 0.2
    linear = linear_of(columns, factors, spread=spread)
    gain = 0.0
    for block, factor in zip(columns, factors, strict=True):
        own = np.vstack([block[:, :7], np.diag(np.append(1.0 / RELEASE_SIGMA, 1.0 / spread))])
        target = np.concatenate([block[:, -1], np.zeros(6), [-factor / spread]])
        rest = target - own @ np.linalg.lstsq(own, target)[0]
        gain += target @ target - rest @ rest
    assert _behind(linear) == pytest.approx(gain)
    # Without a spread the factor is one, and goes there.
    still = linear_of(columns, np.zeros(3))
    gain = 0.0
    for block in columns:
        own = np.vstack([block[:, :6], np.diag(1.0 / RELEASE_SIGMA)])
        target = np.append(block[:, -1], np.zeros(6))
        rest = target - own @ np.linalg.lstsq(own, target)[0]
        gain += target @ target - rest @ rest
    assert _behind(still) == pytest.approx(gain)


def test_the_likely_spread_is_that_of_the_frictions_less_their_errors(rng):
    """At the present parameters: throws scatter by it and by the error of each."""
    throws, error = 60, 0.003
    own = 0.02 * rng.normal(size=throws)
    around = 0.01 * rng.normal(size=throws)
    reduced = np.zeros((throws, 3, 3))
    reduced[:, 0, 0], reduced[:, 0, -1] = error**-2, (own - around) / error**2
    linear: Any = SimpleNamespace(
        reduced=reduced, ln_factors=around, model=SimpleNamespace(spread=0.1)
    )
    exact = float(np.sqrt(np.mean(own**2) - error**2))
    assert _most_likely_spread(linear) == pytest.approx(exact, rel=0.05)
    linear.model.spread = exact  # that of before is tried too
    assert _most_likely_spread(linear) == pytest.approx(exact, rel=1e-9)


def test_a_shortened_step_changes_amplitudes_by_the_same_part_of_their_logarithm():
    places = GatePlaces(places=np.zeros(2), amplitude=0.01, values=np.zeros(2))
    model = Model(ice=ANY_ICE, systematic_error=places)
    foreseen = model.with_amplitude(0, 0.0001)
    half = _part_of_the_way(model, foreseen, 0.5)
    assert half.fields[0][1].amplitude == pytest.approx(0.001)
    assert _part_of_the_way(model, foreseen, 1.0) is foreseen


def test_a_throw_begins_as_in_the_last_fit_that_knows_it():
    """Known by its number, its stone and its time; another stone of the throw is another."""
    session = plain_session(throws=4, stones=np.array([1, 2, 3, 4]))
    first, last = session.only([0, 1]), session.only([1, 3])

    def fitted(some, number) -> Any:
        return SimpleNamespace(
            session=some, states=np.full((2, 6), number), ln_factors=np.array([number, -number])
        )

    states, ln_factors = releases_near(session, fitted(first, 7.0), fitted(last, 9.0))
    assert states[[0, 1, 3]].tolist() == [[7.0] * 6, [9.0] * 6, [9.0] * 6]
    assert states[2] == pytest.approx(session.first_states[2])
    assert ln_factors.tolist() == [7.0, 9.0, 0.0, -9.0]
    other = fitted(replace(last, stones=np.array([2, 5])), 9.0)
    states, ln_factors = releases_near(session, other)
    assert ln_factors.tolist() == [0.0, 9.0, 0.0, 0.0]
    assert states[3] == pytest.approx(session.first_states[3])


@pytest.mark.parametrize(("turned", "worst"), [(0.1, 1), (0.7, 2)])
def test_the_worst_throw_is_named_by_metres_and_by_the_way_of_its_rim(turned, worst):
    """A radian is 14 cm at the rim of a stone."""
    session = plain_session(throws=3)
    predicted = np.zeros((len(session.times), 6))
    predicted[:, [0, 1, 4]] = session.observed
    predicted[session.rows(1).start + 4, 0] += 0.06
    predicted[session.rows(2).start + 2, 4] -= turned
    model = Model(ice=ANY_ICE)
    linear: Any = SimpleNamespace(model=model)
    noise: Any = None
    fitted = SessionFit(
        session=session, noise=noise, states=np.zeros((3, 6)), predicted=predicted,
        linear=linear, deviance=0.0,
    )  # fmt: skip
    off = {1: "0.06 m and 0 rad", 2: f"0 m and {turned} rad"}[worst]
    assert fitted.worst_throw() == f"throw {worst} fits worst, by {off}"


def test_equations_without_a_solution_are_an_error_of_the_throws():
    with (
        pytest.raises(FitError, match="no ice can be fitted to these throws"),
        singular_fit_refused(),
    ):
        raise np.linalg.LinAlgError("Singular matrix")


# --- steps of a fit, whose deviances are given ---------------------------------------------------


@dataclass(frozen=True)
class GivenLinear:
    model: Model
    value: float

    def deviance(self) -> float:
        return self.value


@pytest.fixture
def steps_of(monkeypatch):
    """Fits whose deviance is that of a list; returns the length of every step, and the last one.

    A step foresees a fall by `promised`.
    """

    def follow(deviances, *, promised=10.0, shared=False, behind=0.0, **options):
        taken, values = [], iter(deviances)

        def step(point, _, damping, shared):
            taken.append((point.deviance, round(damping, 6), shared))
            return point.linear.model, point.states, np.zeros(1), point.deviance - promised

        monkeypatch.setattr(
            fits, "linearise", lambda model, *_: (None, GivenLinear(model, next(values)))
        )
        monkeypatch.setattr(fits, "_step", step)
        monkeypatch.setattr(fits, "_most_likely_spread", lambda _: 0.25)
        monkeypatch.setattr(fits, "_behind", lambda _: behind)
        monkeypatch.setattr(fits, "predict", lambda *_: None)
        monkeypatch.setattr(fits, "_moved", lambda point, *_: point.linear)
        session, noise = plain_session(throws=1), None
        found = fit(Model(ice=ANY_ICE), session, noise, shared=shared, **options)
        assert found.model.spread == (0.25 if shared else 0.0)
        assert found.deviance == pytest.approx(taken[-1][0] - promised)
        return [(value, damping) for value, damping, _ in taken[:-1]], taken[-1]

    return follow


def test_a_step_after_which_the_fit_is_worse_is_repeated_shorter(steps_of):
    """At the least of the parabola; after a better one steps grow again, and only a whole one ends.

    A rise by 30 with a promised fall by 10 is -20 d + 50 d²; one by 10 at 0.2 is -20 d + 350 d².
    """
    values = [100.0, 50.0, 80.0, 60.0, 45.0, 44.99, 44.98, 44.97, 44.96]
    steps, last = steps_of(values, shared=True, iterations=20)
    assert steps == [
        (100, 1),
        (50, 1),
        (50, 0.2),
        (50, 0.028571),
        (45, 0.085714),
        (44.99, 0.257143),
        (44.98, 0.771429),
        (44.97, 1),
    ]
    assert last == (44.96, 1.0, False)


def test_a_fit_ends_after_a_whole_step_that_gains_nothing_and_not_before(steps_of):
    steps, last = steps_of([100.0, 60.0, 59.9, 59.86], iterations=20)
    assert [value for value, _ in steps] == [100.0, 60.0, 59.9]
    assert last == (59.86, 1.0, False)


def test_a_worse_step_that_might_gain_nothing_is_the_last(steps_of):
    steps, last = steps_of([100.0, 60.0, 60.04], shared=True, iterations=20)
    assert steps == [(100.0, 1.0), (60.0, 1.0)]
    assert last[0] == 60.0
    # Otherwise steps are shortened further, to a tenth at most each time, and to a fiftieth.
    steps, last = steps_of([100.0, 60.0, 90.0, 90.0, 90.0], shared=True, iterations=20)
    assert [damping for _, damping in steps] == [1.0, 1.0, 0.2, 0.02]
    assert last == (60.0, 1.0, False)
    # Numbers that overflow are worse than any.
    steps, _ = steps_of([100.0, np.inf, 90.0, 89.0, 88.0], shared=True, iterations=5)
    assert [damping for _, damping in steps[:4]] == [1.0, 0.1, 0.3, 0.9]


def test_releases_alone_have_no_shorter_step(steps_of):
    steps, last = steps_of([100.0, 60.0, 90.0], iterations=20)
    assert steps == [(100.0, 1.0), (60.0, 1.0)]
    assert last == (60.0, 1.0, False)


def test_no_more_steps_are_taken_than_asked_for(steps_of):
    steps, last = steps_of([100.0, 90.0, 80.0, 70.0], iterations=3)
    assert [value for value, _ in steps] == [100.0, 90.0, 80.0]
    assert last[0] == 80.0
    assert len(steps_of([100.0], iterations=1)[0]) == 1


def test_a_step_that_promises_nothing_needs_no_other_linearisation(steps_of):
    """It is taken with the shared parameters; releases alone otherwise."""
    steps, last = steps_of([100.0], promised=0.04, shared=True)
    assert steps == [(100.0, 1.0)]
    assert last == (100.0, 1.0, True)
    steps, last = steps_of([100.0, 90.0, 89.99], promised=0.06, shared=True)
    assert len(steps) == 2
    assert last == (89.99, 1.0, False)
    # Releases that are behind promise something too.
    steps, last = steps_of([100.0, 90.0, 89.99], promised=0.01, behind=0.06, shared=True)
    assert len(steps) == 2
    assert last[2] is False
    # A shortened step promises less than there is.
    values = [100.0, 120.0, 90.0, 89.0, 88.0, 87.99]
    steps, _ = steps_of(values, promised=0.02, behind=0.04, shared=True)
    assert [damping for _, damping in steps] == [1.0, 0.1, 0.3, 0.9, 1.0]


def test_a_fit_ends_where_steps_as_large_as_the_last_would_not_reach_its_goal(steps_of):
    values = [100.0, 90.0, 85.0, 84.0, 83.9, 83.89]
    steps, last = steps_of(values, iterations=10, goal=60.0)
    # After the third point seven steps of 5 would lead to 50, after the fourth six of 1 to 78.
    assert [value for value, _ in steps] == [100.0, 90.0, 85.0]
    assert last[0] == 84.0
    steps, last = steps_of(values, iterations=10, goal=77.0)
    assert last[0] == 84.0
    steps, last = steps_of(values, iterations=10, goal=78.5)
    assert last[0] == 83.9


def best_of_throw(block, factor, spread, shared_step):
    """Release and factor of a throw by least squares, after a step of the shared parameters."""
    own = 7 if spread > 0.0 else 6
    target = block[:, -1] - block[:, 7:-1] @ shared_step
    if spread == 0.0:
        target = target + block[:, 6] * factor
    weak = 1.0 / np.append(RELEASE_SIGMA, spread or 1.0)[:own]
    matrix = np.vstack([block[:, :own], np.diag(weak)])
    beyond = np.zeros(own)
    if spread > 0.0:
        beyond[6] = -factor / spread
    found = np.linalg.lstsq(matrix, np.append(target, beyond))[0]
    return found[:6], factor + found[6] if spread > 0.0 else 0.0


@pytest.mark.parametrize("spread", [0.0, 0.05])
def test_without_shared_parameters_every_throw_goes_to_its_own_best(rng, spread):
    columns, factors = random_columns(rng), 0.1 * rng.normal(size=3)
    linear, states = linear_of(columns, factors, spread=spread), rng.normal(size=(3, 6))
    session = plain_session(throws=3)
    point = Point(states, linear, 123.0)
    model, moved, found, least = _step(point, session, 0.3, False)
    for k, block in enumerate(columns):
        release, factor = best_of_throw(block, factors[k], spread, np.zeros(2))
        assert moved[k] - states[k] == pytest.approx(release, rel=1e-6)
        assert found[k] == pytest.approx(factor, abs=1e-9)
    assert model.vector.tolist() == [0.0, 0.0]
    assert least == 123.0
    assert model.spread == spread


@pytest.mark.parametrize("damping", [1.0, 0.3])
def test_a_step_of_shared_parameters_is_shortened_and_the_throws_follow(rng, damping):
    columns, factors = random_columns(rng, throws=6), 0.02 * rng.normal(size=6)
    columns[:, :, 6] *= 30.0
    columns[:, :, 7:9] *= 5.0
    linear = linear_of(columns, factors, spread=0.1, ln_coupling=0.05)
    states, session = np.zeros((6, 6)), plain_session(throws=6)
    model, moved, found, least = _step(Point(states, linear, 0.0), session, damping, True)
    whole = linear.total(model.spread)
    full = np.linalg.solve(whole[:-1, :-1], whole[:-1, -1])
    step = model.vector - linear.model.vector
    assert step == pytest.approx(damping * full, rel=1e-6)
    assert least == pytest.approx(linear.least(), abs=1e-6)
    for k, block in enumerate(columns):
        release, factor = best_of_throw(block, factors[k], model.spread, step)
        assert moved[k] == pytest.approx(release, rel=1e-5)
        assert found[k] == pytest.approx(factor, abs=1e-8)


def test_no_step_leads_to_impossible_friction_or_to_another_side_of_an_unseen_spin(rng):
    columns, factors = random_columns(rng), np.zeros(3)
    columns[:, :, -1] += 50.0 * columns[:, :, 6]
    columns[:, :, -1] -= 9.0 * columns[:, :, 5]
    session = plain_session(throws=3, usual_spins=np.array([1.5, -1.5, 1.5]))
    theta = session.theta.copy()
    theta[: session.rows(1).stop] = np.nan
    session = replace(session, theta=theta)
    linear = linear_of(columns, factors, spread=100.0)
    _, moved, found, _ = _step(Point(np.zeros((3, 6)), linear, 0.0), session, 1.0, False)
    assert np.exp(found) == pytest.approx(np.full(3, np.exp(2.0)))
    slowest = 1.5 - 2 * 0.6
    assert moved[0, 5] == pytest.approx(slowest)
    assert moved[1, 5] < -slowest  # the other way it is free
    assert moved[2, 5] < -2.0  # its heading was seen


def given_fit(session, rng, *, spread=0.03) -> SessionFit:
    """A fit of white noise whose predictions are off by some millimetres."""
    noise = SessionNoise(white=(0.004, 0.002, 0.02), fading=(0.0,) * 3, memory=(0.1,) * 3)
    predicted = np.zeros((len(session.times), 6))
    predicted[:, [0, 1, 4]] = session.observed + 0.005 * rng.normal(size=(len(predicted), 3))
    throws = len(session)
    grams = np.zeros((throws, 10, 10))
    model = Model(ice=ANY_ICE, spread=spread)
    linear = Linearisation(model=model, ln_factors=0.1 * rng.normal(size=throws), grams=grams)
    return SessionFit(
        session=session, noise=noise, states=session.first_states, predicted=predicted,
        linear=linear, deviance=0.0,
    )  # fmt: skip


def test_columns_around_a_fit_are_weighed_by_the_noise_throw_by_throw(rng):
    """The noise of each coordinate, times the relative noise of each row."""
    session = plain_session(throws=3, rows=5)
    sigma = rng.uniform(0.5, 2.0, (15, 2))
    theta = session.theta.copy()
    theta[7] = np.nan
    session = replace(session, sigma=sigma, theta=theta)
    fitted = given_fit(session, rng)
    fitted = replace(fitted, predicted=np.nan_to_num(fitted.predicted))
    columns = rng.normal(size=(15, 3, 9))
    other = replace(fitted.model, ln_mu=0.7, spread=9.0)
    linear = fitted.linear_in(other, columns, fitted.residuals)
    assert linear.model.ln_mu == 0.7
    assert linear.model.spread == fitted.model.spread
    assert linear.ln_factors is fitted.ln_factors
    residuals = session.observed - fitted.predicted[:, [0, 1, 4]]
    assert fitted.residuals == pytest.approx(residuals, nan_ok=True)
    errors = np.array([0.004, 0.002, 0.02]) * sigma[:, [0, 0, 1]]
    for i, gram in enumerate(linear.grams):
        rows = session.rows(i)
        whole = np.concatenate([columns[rows], residuals[rows][:, :, None]], axis=2)
        whole = (whole / errors[rows][:, :, None]).reshape(-1, 10)
        whole = whole[np.isfinite(whole[:, -1])]
        assert len(whole) == (14 if i == 1 else 15)
        expected = whole.T @ whole
        if i == 1:  # of five headings none shows a spin
            continue
        assert gram[:4, :4] == pytest.approx(expected[:4, :4])
        assert gram[6:, 6:-1] == pytest.approx(expected[6:, 6:-1])
