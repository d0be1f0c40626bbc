"""Effects that are named together with an unknown one."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.physics import catalogue
from friction_estimation import discover
from friction_estimation.discovery import (
    Dependence,
    Following,
    Term,
    fit,
    naming,
    neutral_values,
    refit,
    sentence,
)
from friction_estimation.discovery.evidence.significance import EffectEvidence
from friction_estimation.discovery.evidence.unknown.explanation import Explanation
from friction_estimation.discovery.model.model import Model

from .conftest import effect


@pytest.mark.parametrize("pushes", [(Following("speed", "along"),), ()])
def test_an_unknown_with_which_the_throws_fit_worse_takes_no_name(
    make_session, without_effects, monkeypatch, pushes
):
    """An explanation that goes astray, here on purpose, must not cost what is proved."""

    def astray(fitted, own):
        result = explain(fitted, own)
        session = result.fit.session
        bend = np.zeros((len(session.times), 3))
        side = np.nan_to_num(np.sign(session.theta - session.theta[0]))
        bend[:, 0] = 0.3 * side * np.sin(session.xy[:, 1] / 3)
        bent = replace(session, xy=session.xy - bend[:, :2], pushes=None)
        model = fitted.model if pushes else replace(fitted.model, terms=())
        astray = fit(model, bent, fitted.noise, states=fitted.states)
        return replace(result, fit=astray, pushes=pushes)

    explain = naming.explain
    monkeypatch.setattr(naming, "explain", astray)
    hidden = [effect("curl", strength=0.005), effect("slope", x=5e-5, y=0.0)]
    tracks = make_session(hidden, throws=9, fps=5)
    with without_effects("slope"):
        found = discover(tracks)
    assert found.unknown
    assert [e.label for e in found.effects] == ["curl"]


def test_throws_that_scatter_more_than_those_on_one_ice_lack_something(make_session):
    found = discover(make_session([effect("curl", strength=0.005)], throws=8, scatter=0.03, fps=5))
    assert [e.label for e in found.effects] == ["curl"]
    assert found.unknown
    assert re.match(
        "The model lacks curl and something unknown, by which friction differs by [2-4] % from "
        "throw to throw: fresh throws",
        sentence(found),
    )


def test_an_unknown_that_follows_the_place_alone_is_reported(make_session, monkeypatch):
    """An effect that it makes superfluous is dropped, and the others stay in the fit."""
    across = Dependence(variable="x", share=1.0, p=1e-6, push="along")

    def by_place(fitted, own):
        bare = refit(fitted, fitted.model.without("slope"))
        return Explanation(fit=bare, pushes=(), dependences=[across])

    monkeypatch.setattr(naming, "explain", by_place)
    hidden = [effect("curl", strength=0.005), effect("slope", x=1e-4, y=0.0)]
    found = discover(make_session(hidden, throws=8, scatter=0.03, fps=5))
    assert found.unknown
    assert [d.variable for d in found.dependences] == ["x"]
    assert "slope" in found.unproved
    assert [e.label for e in found.effects] == ["curl"]
    assert [term.label for term in found.final.model.terms] == ["curl"]


def test_without_a_heading_nothing_that_pushes_sideways_is_named_beside_an_unknown(make_session):
    """It may be curl, which these throws cannot show."""
    tracks = [
        replace(track, theta=np.full(len(track), np.nan))
        for track in make_session([effect("curl", strength=0.008)], throws=8, fps=2)
    ]
    found = discover(tracks)
    assert found.unknown
    assert not found.effects


@pytest.mark.parametrize(
    ("p", "proved"),
    [
        ({"a": 0.04}, "a"),
        ({"a": 0.06}, ""),
        ({"a": 0.024, "b": 1e-9}, "ab"),
        ({"a": 0.026, "b": 1e-9}, "b"),  # each of two has half of 5 %
        ({"a": 0.03, "b": 0.04}, "a"),  # the worst goes first, after which the other has all
        ({"a": 0.03, "b": 0.03}, "b"),  # of two alike that with the smaller gain
        ({"a": 0.2, "b": 0.3, "c": 0.4}, ""),
    ],
)
def test_effects_are_proved_if_all_are_together_at_five_per_cent(monkeypatch, p, proved):
    gains = {"a": 20.0, "b": 30.0, "c": 40.0}

    def fit_of(labels) -> Any:
        model = SimpleNamespace(
            terms=[SimpleNamespace(label=label) for label in labels],
            without=lambda dropped: [label for label in labels if label != dropped],
        )
        return SimpleNamespace(model=model)

    def weigh(_, labels, *__):
        return [
            EffectEvidence(label=k, gain=gains[k], p=p[k], improvements=np.zeros(0)) for k in labels
        ]

    monkeypatch.setattr(naming, "weigh_evidence", weigh)
    monkeypatch.setattr(naming, "without_term", lambda one, label: one.model.without(label))
    monkeypatch.setattr(naming, "prune", lambda labels, _: fit_of(labels))
    session: Any = None
    named, effects, unproved = naming._proved(fit_of(["given", *p]), {"given"}, None, session)
    assert [effect.label for effect in effects] == list(proved)
    assert [term.label for term in named.model.terms] == ["given", *proved]
    assert sorted(unproved) == sorted(set(p) - set(proved))


# --- beside an unknown, with misfits that are given ----------------------------------------------


@pytest.fixture
def beside(monkeypatch):
    """Names beside an unknown: what was found, and what an explanation leaves and proves."""

    def fit_of(excess, *labels, white=False, at_limit=(), pushes=None) -> Any:
        cards = [catalogue()[label] for label in labels]
        cards = [card if pushes is None else replace(card, pushes=pushes) for card in cards]
        terms = tuple(Term(card=c, values=neutral_values(c), free=c.first) for c in cards)
        terms = tuple(
            t.with_values(**{t.free[0]: t.card.parameter(t.free[0]).high}) if t.name in at_limit
            else t
            for t in terms
        )  # fmt: skip
        ice: Any = SimpleNamespace()
        model = Model(ice=ice, terms=terms)
        return SimpleNamespace(
            model=model, excess=excess, white=white, session="pushed", structure=("", 1.0)
        )

    def name(found, explained, *, gains, pushes=("a push",), turns=True, before=900.0, own=()):
        def evidence(labels):
            return [
                EffectEvidence(label=k, gain=gains[k], p=0.001, improvements=np.zeros(0))
                for k in labels
                if k not in own
            ]

        def labels_of(fitted):
            return [term.label for term in fitted.model.terms]

        monkeypatch.setattr(
            naming, "_proved", lambda fitted, *_: (fitted, evidence(labels_of(fitted)), [])
        )
        monkeypatch.setattr(naming, "misfit_of", lambda fitted: fitted)
        monkeypatch.setattr(naming, "_without_pushes", lambda fitted, _: fitted)
        monkeypatch.setattr(naming, "friction_structure", lambda fitted: fitted.structure)

        def refitted(fitted, model):
            return SimpleNamespace(**{**vars(fitted), "model": model})

        monkeypatch.setattr(naming, "refit", refitted)
        session = SimpleNamespace(turns=np.array([turns]))
        base = SimpleNamespace(
            model=SimpleNamespace(terms=[SimpleNamespace(label=k) for k in own]), session=session
        )
        selection: Any = SimpleNamespace(
            base=base, best=found, before=SimpleNamespace(excess=before)
        )
        follows = Dependence(variable="spin", share=0.7, p=1e-4, push="left")
        explanation = Explanation(fit=explained, pushes=pushes, dependences=[follows])
        known = naming.Named(
            fit=found, effects=evidence(labels_of(found)), after=found, structure=("order", 0.003)
        )
        named = naming._beside_unknown(known, explanation, selection)
        assert named.unknown
        return (
            [effect.label for effect in named.effects],
            labels_of(named.fit),
            named.unproved,
            [d.variable for d in named.dependences],
            bool(named.pushes),
        )

    return fit_of, name


def test_effects_are_named_if_they_gain_more_than_the_unknown_leaves(beside):
    fit_of, name = beside
    found = fit_of(400.0, "curl", "slope")
    gains = {"curl": 60.0, "slope": 40.0, "air_drag": 0.0}
    explained = fit_of(50.0, "air_drag", "curl", "slope")
    # The slope may be a proxy of what is left; what was given stays.
    assert name(found, explained, gains=gains, own=("air_drag",)) == (
        ["curl"], ["air_drag", "curl"], ["slope"], ["spin"], True,
    )  # fmt: skip
    noise = fit_of(50.0, "air_drag", "curl", "slope", white=True)
    assert name(found, noise, gains=gains, own=("air_drag",))[0] == ["curl", "slope"]
    limit = fit_of(1.0, "curl", "slope", at_limit=("curl",))
    assert name(found, limit, gains=gains)[:2] == (["slope"], ["slope"])


def test_an_unknown_that_explains_less_than_the_effects_names_those_that_both_have(beside):
    """It is not among the pushes, and the frictions follow what they followed."""
    fit_of, name = beside
    found = fit_of(400.0, "curl", "slope", "friction_patch")
    gains = {"curl": 600.0, "slope": 600.0, "friction_patch": 600.0}
    worse = fit_of(400.0, "curl")
    assert name(found, worse, gains=gains) == (
        ["curl"], ["curl"], ["slope", "friction_patch"], ["spin", "order"], False,
    )  # fmt: skip
    # Without pushes alike.
    assert name(found, fit_of(10.0, "curl"), gains=gains, pushes=())[0] == ["curl"]
    # If it explains nothing at all only friction may copy the unknown through the place.
    assert name(found, fit_of(901.0, "curl"), gains=gains)[0] == ["curl", "slope"]
    assert name(found, fit_of(899.0, "curl"), gains=gains)[0] == ["curl"]
    small = {**gains, "slope": 399.0}
    assert name(found, fit_of(901.0), gains=small)[0] == ["curl"]


def test_without_headings_what_pushes_sideways_may_be_curl(beside):
    fit_of, name = beside
    gains = {"curl": 600.0}
    for pushes, named in ((("along", "left"), []), (("along",), ["curl"])):
        found = fit_of(400.0, "curl", pushes=pushes)
        explained = fit_of(1.0, "curl", pushes=pushes)
        assert name(found, explained, gains=gains, turns=False)[0] == named
        assert name(found, explained, gains=gains, turns=True)[0] == ["curl"]


# --- when something unknown is asked for ---------------------------------------------------------


@pytest.fixture
def asked(monkeypatch):
    """Name effects whose residuals, spread and structure are given; what was asked for then."""

    def name(*labels, white=True, spread=0.01, p=0.5) -> tuple[bool, list[str]]:
        steps: list[str] = []
        fitted: Any = SimpleNamespace(model=SimpleNamespace(spread=spread))
        effects = [
            EffectEvidence(label=k, gain=50.0, p=0.001, improvements=np.zeros(0)) for k in labels
        ]
        misfit = SimpleNamespace(white=white)

        def explain(_, own):
            assert own == {"given"}
            steps.append("explain")

        def noise(named, after):
            steps.append("noise")
            return named, after

        def beside(found, *_):
            steps.append("beside")
            return replace(found, unknown=True)

        monkeypatch.setattr(naming, "_proved", lambda *_: (fitted, effects, ["left"]))
        monkeypatch.setattr(naming, "misfit_of", lambda _: misfit)
        monkeypatch.setattr(naming, "_with_correlated_noise", noise)
        monkeypatch.setattr(naming, "fit_to", lambda named, whole: named)
        monkeypatch.setattr(naming, "friction_structure", lambda _: ("order", p))
        monkeypatch.setattr(naming, "explain", explain)
        monkeypatch.setattr(naming, "_beside_unknown", beside)
        terms = [SimpleNamespace(label="given")]
        selection: Any = SimpleNamespace(
            base=SimpleNamespace(model=SimpleNamespace(terms=terms)), best=fitted
        )
        session: Any = None
        found = naming.name_effects(selection, session, session, lambda *_: None)
        assert found.unproved == ["left"]
        assert found.structure == ("order", p)
        return found.unknown, steps

    return name


@pytest.mark.parametrize(
    ("given", "unknown"),
    [
        ({}, False),
        ({"spread": 0.0149}, False),
        ({"spread": 0.0151}, True),
        ({"p": 0.0041}, False),
        ({"p": 0.0039}, True),
    ],
)
def test_frictions_that_scatter_or_follow_something_lack_something(asked, given, unknown):
    assert asked("curl", **given) == (unknown, ["explain", "beside"] if unknown else [])


def test_residuals_that_are_no_noise_lack_something_unless_it_is_noise_that_lasts(asked):
    assert asked("curl", white=False) == (True, ["noise", "explain", "beside"])


@pytest.mark.parametrize(
    ("smoothed", "white", "dependences", "taken"),
    [(False, True, [], True), (False, False, [], False), (False, True, ["spin"], False),
     (True, True, [], False)],
)  # fmt: skip
def test_noise_of_raw_tracks_may_last_if_nothing_else_is_left(
    monkeypatch, smoothed, white, dependences, taken
):
    calm = SimpleNamespace(is_calm=True)
    left = SimpleNamespace(white=white)
    lasting = []

    def estimated(session, residuals, *, lasting_=lasting, **given):
        lasting_.append(given["lasting"])
        return "noise"

    monkeypatch.setattr(naming, "estimate_noise", estimated)
    monkeypatch.setattr(naming, "replace", lambda named, **_: named)
    monkeypatch.setattr(naming, "refit", lambda *_: calm)
    monkeypatch.setattr(naming, "misfit_of", lambda _: left)
    monkeypatch.setattr(naming, "find_dependences", lambda _: dependences)
    named: Any = SimpleNamespace(
        session=SimpleNamespace(smoothed=smoothed), residuals=None, model=None
    )
    before: Any = SimpleNamespace(white=False)
    found = naming._with_correlated_noise(named, before)
    assert found == ((calm, left) if taken else (named, before))
    assert lasting == ([] if smoothed else [True])
