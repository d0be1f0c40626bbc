"""A throw to which something happened once is set aside; an effect is not."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from friction_estimation.discovery import (
    base_model,
    exceptional_throws,
    fit_with_noise,
    misfit_of,
    open_session,
)
from friction_estimation.discovery.discover import (
    Discovery,
    _excess_without,
    _is_other_ice,
    search_session,
)

from .conftest import effect, plain_session

DISCOVER = import_module("friction_estimation.discovery.discover")


def found_in(tracks):
    session = open_session(tracks)
    fitted = fit_with_noise(base_model(None, session), session)
    return [int(session.throws[k]) for k in exceptional_throws(fitted, session)]


def test_a_throw_that_was_touched_is_found(make_session):
    tracks = make_session(throws=12)
    touched = tracks[4]
    after = np.maximum(touched.t - 6.0, 0.0)[:, None]
    way = touched.xy[-1] - touched.xy[0]
    across = np.array([-way[1], way[0]]) / np.hypot(*way)
    tracks[4] = replace(touched, xy=touched.xy + 0.05 * across * after)
    assert found_in(tracks) == [4]


def test_no_throw_is_an_event_where_nothing_happened(make_session):
    assert found_in(make_session(throws=10)) == []


def test_an_effect_in_every_throw_is_no_event(make_session):
    assert found_in(make_session([effect("slope", x=4e-4, y=0.0)], throws=10)) == []


@pytest.mark.parametrize(("calm", "odd"), [(True, True), (True, False), (False, True)])
def test_an_event_is_reported_if_the_others_are_explained_and_it_is_not(
    make_session, monkeypatch, calm, odd
):
    session = open_session(make_session(throws=9, fps=5))
    fitted = fit_with_noise(base_model(None, session), session)

    def accepted(everything, selection, *_):
        return Discovery(
            fit=everything,
            after=misfit_of(everything),
            session=everything.session,
            selection=selection,
            final_base=everything,
            seen=everything,
            final=everything,
        )

    def misfit(fitted):
        one = len(fitted.session) == 1
        return SimpleNamespace(white=calm, surprise=np.full(1, 9.0 if odd and one else 1.0))

    monkeypatch.setattr(DISCOVER, "_select", lambda one, *_: (SimpleNamespace(best=one), []))
    monkeypatch.setattr(DISCOVER, "_accept", accepted)
    monkeypatch.setattr(DISCOVER, "exceptional_throws", lambda *_: np.array([4]))
    monkeypatch.setattr(DISCOVER, "misfit_of", misfit)
    found = search_session(fitted, np.random.default_rng(0))
    assert found.events == ([4] if calm and odd else [])
    assert len(found.session) == (8 if calm and odd else 9)


@pytest.mark.parametrize(
    ("throws", "excess", "odd"),
    [
        (10, {(): 900.0, (2,): 200.0}, [2]),
        (10, {(): 900.0, (2,): 280.0}, []),  # a third of the misfit is left
        (10, {(): 130.0, (2,): 0.0}, []),  # less than five deviations of χ²
        (10, {(): 140.0, (2,): 0.0}, [2]),
        (14, {(): 900.0, (2,): 300.0, (2, 7): 100.0}, [2, 7]),
        (13, {(): 900.0, (2,): 300.0, (2, 7): 100.0}, []),  # two of 13 are too many
        (20, {(): 900.0, (7,): 500.0, (7, 2): 400.0, (7, 2, 5): 260.0}, [2, 5, 7]),
        (20, {(): 900.0, (7,): 500.0, (7, 2): 400.0, (7, 2, 5): 280.0, (7, 2, 5, 1): 0.0}, []),
        (5, {(): 900.0, (2,): 200.0}, [2]),
    ],
)
def test_a_few_throws_are_exceptional_if_they_explain_the_misfit(monkeypatch, throws, excess, odd):
    monkeypatch.setattr(DISCOVER, "fit_to", lambda best, _: best)
    monkeypatch.setattr(DISCOVER, "place_sides", lambda fitted: fitted)
    monkeypatch.setattr(
        DISCOVER, "_excess_without", lambda _, chosen, __: excess.get(tuple(chosen), 890.0)
    )
    session = plain_session(throws=throws)
    # Of 36 values a throw: 130 < 5 √(2 · 360) < 140.
    any_fit: Any = SimpleNamespace()
    assert exceptional_throws(any_fit, session).tolist() == odd


def test_the_excess_of_throws_is_that_of_a_fit_without_some(rng):
    """Three throws of ten rows by two parameters, against least squares."""
    columns, values = rng.normal(size=(3, 10, 2)), rng.normal(size=(3, 10))
    values[1] += 20.0
    whole = np.concatenate([columns, values[:, :, None]], axis=2)
    grams = np.einsum("kni,knj->kij", whole, whole)
    prior = np.diag([4.0, 0.25, 0.0])
    linear = SimpleNamespace(each=lambda: (grams, np.zeros(3)), prior=prior)
    fitted: Any = SimpleNamespace(linear=linear)
    dof = np.full(3, 5.0)
    for odd in ([], [1], [2, 0]):
        others = [k for k in range(3) if k not in odd]
        matrix = np.vstack([*columns[others], np.diag([2.0, 0.5])])
        step = np.linalg.lstsq(matrix, np.append(values[others].ravel(), [0.0, 0.0]))[0]
        chi2 = ((values[others] - columns[others] @ step) ** 2).sum(axis=1)
        expected = np.maximum(chi2 - 5.0, 0.0).sum()
        assert _excess_without(fitted, odd, dof) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("worse", "uniform", "terms", "other"),
    [(17.0, False, (), True), (15.0, False, (), False), (99.0, True, (), False),
     (99.0, True, ("curl",), True)],
)  # fmt: skip
def test_a_given_ice_is_of_other_ice_if_uniform_friction_fits_clearly_better(
    monkeypatch, worse, uniform, terms, other
):
    monkeypatch.setattr(DISCOVER, "base_model", lambda *_: None)
    monkeypatch.setattr(DISCOVER, "fit", lambda *_: SimpleNamespace(deviance=1000.0))
    ice: Any = SimpleNamespace(friction=SimpleNamespace(is_uniform=uniform))
    base: Any = SimpleNamespace(
        deviance=1000.0 + worse, model=SimpleNamespace(terms=terms), session=None, noise=None
    )
    assert _is_other_ice(ice, base) == other
    assert not _is_other_ice(None, base)


def test_what_is_left_and_what_came_second_is_reported():
    trials = [SimpleNamespace(term=SimpleNamespace(label=k), gain=g) for k, g in
              (("curl", 90.0), ("slope", 12.3456789))]  # fmt: skip
    rounds = [SimpleNamespace(chosen="curl", trials=trials),
              SimpleNamespace(chosen="sweeping", trials=trials[:1])]  # fmt: skip
    before = SimpleNamespace(white=False, excess=200.0)
    any_fit: Any = SimpleNamespace()
    selection: Any = SimpleNamespace(before=before, rounds=rounds)
    session = plain_session(throws=8)
    after: Any = SimpleNamespace(excess=50.0)
    found = Discovery(
        fit=any_fit, after=after, session=session, selection=selection,
        final_base=any_fit, seen=any_fit, final=any_fit,
    )  # fmt: skip
    assert found.closure == 0.75
    assert found.enough
    assert not replace(found, session=session.only(range(7))).enough
    assert found.runner_up("curl") == {"name": "slope", "gain": 12.3457}
    assert found.runner_up("sweeping") is None
    assert found.runner_up("air_drag") is None
    before.white = True
    assert found.closure == 1.0


@pytest.fixture
def searched(monkeypatch):
    """Search a session of some throws, of which some are odd; the steps that were taken."""

    def run(throws, odd=(), *, white=False, terms=()):
        steps: list[str] = []

        def step(name, result=None):
            def taken(given, *_, **__):
                steps.append(name)
                return given if result is None else result

            return taken

        found = SimpleNamespace(final=SimpleNamespace(model=None, noise=None))
        for name in ("refine", "renew_map", "_too_few"):
            monkeypatch.setattr(DISCOVER, name, step(name))
        monkeypatch.setattr(DISCOVER, "_select", step("select", (SimpleNamespace(best=None), [])))
        monkeypatch.setattr(DISCOVER, "_accept", step("accept", found))
        monkeypatch.setattr(DISCOVER, "misfit_of", lambda _: SimpleNamespace(white=white))
        monkeypatch.setattr(DISCOVER, "exceptional_throws", step("odd", np.array(odd, dtype=int)))
        monkeypatch.setattr(DISCOVER, "fit_with_noise", step("rest"))
        monkeypatch.setattr(DISCOVER, "fit", step("alone"))
        everything: Any = SimpleNamespace(
            session=plain_session(throws=throws), model=SimpleNamespace(terms=terms)
        )
        search_session(everything, np.random.default_rng(0))
        return steps

    return run


def test_a_given_model_is_refined_before_the_search_where_it_leaves_more_than_noise(searched):
    assert searched(9) == ["renew_map", "select", "odd", "accept"]
    assert searched(9, terms=("curl",)) == ["refine", "renew_map", "select", "odd", "accept"]
    assert searched(9, terms=("curl",), white=True) == ["renew_map", "select", "odd", "accept"]
    assert searched(8) == ["renew_map", "select", "odd", "accept"]
    assert searched(7) == ["renew_map", "_too_few"]


def test_throws_are_odd_only_where_eight_others_are_left(searched):
    """If something is left without them, too, all are searched together."""
    again = ["renew_map", "select", "odd", "rest", "select", "accept", "alone", "accept"]
    assert searched(9, [4, 5]) == ["renew_map", "select", "odd", "accept"]
    assert searched(10, [4, 5]) == again
    assert searched(9, [4]) == again
