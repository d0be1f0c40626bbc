"""Effects that are named together with an unknown one."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from friction_estimation import discover
from friction_estimation.discovery import Dependence, Following, fit, naming, refit, sentence
from friction_estimation.discovery.evidence.unknown.explanation import Explanation

from .conftest import effect


@pytest.mark.parametrize("pushes", [(Following("speed", "along"),), ()])
def test_an_unknown_with_which_the_throws_fit_worse_takes_no_name(
    make_session, without_effects, monkeypatch, pushes
):
    """An explanation that goes astray, here on purpose, must not cost what is proved."""

    def astray(fitted, own, *, beyond_map):
        result = explain(fitted, own, beyond_map=beyond_map)
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

    def by_place(fitted, own, *, beyond_map):
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
