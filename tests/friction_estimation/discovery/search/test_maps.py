"""The search for the correlation length of a friction map."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curling_env.sheet import PAPER_SHEET
from friction_estimation.discovery import (
    CARD,
    FrictionField,
    Model,
    Term,
    base_model,
    crossed_by,
    field_along,
    fit_with_noise,
    open_session,
    refit,
    renew_map,
)
from friction_estimation.discovery.search import maps
from friction_estimation.discovery.search.maps import find_map


def test_a_map_of_the_wrong_length_is_renewed_and_nearer_to_the_truth(sliding) -> None:
    rng = np.random.default_rng(11)
    truth = sliding.random_field(rng, mu=0.009, spread=0.06, length=5.0)
    tracks = sliding.measured_throws(truth, sliding.varied_starts(rng, 6), rng, fps=10)
    base = fit_with_noise(base_model(None, open_session(tracks)), open_session(tracks))
    session, sheet = base.session, base.model.ice.sheet
    paths = [session.xy[session.rows(i)] for i in range(len(session))]
    short = field_along(sheet, crossed_by(sheet, paths), 1.0, np.inf)
    first = refit(base, base.model.with_terms(Term(card=CARD, map_field=short)))
    renewed = renew_map(first)
    wanted = np.log(truth(*np.meshgrid(sheet.x_centres, sheet.y_centres)) / 0.009)

    def field_of(model: Model) -> FrictionField:
        assert model.map_field is not None
        return model.map_field

    def error(model: Model) -> float:
        field = field_of(model)
        return float(np.std((field.ln_mu - wanted).ravel()[field.crossed]))

    assert field_of(renewed.model).length > 2.5
    assert renewed.deviance < first.deviance - 10.0
    assert error(renewed.model) < 0.8 * error(first.model)
    # Around the new map no other promises more by as much.
    assert field_of(renew_map(renewed).model).length == field_of(renewed.model).length


# --- choices between maps whose gains are given --------------------------------------------------


def a_field(length, *, amplitude=0.04, known=None) -> FrictionField:
    cells = PAPER_SHEET.shape[0] * PAPER_SHEET.shape[1]
    return FrictionField(
        sheet=PAPER_SHEET, length=length, smoothness=2.5, crossed=np.arange(5),
        patterns=np.ones((cells, 1)), amplitude=amplitude, values=np.zeros(1), known=known,
    )  # fmt: skip


@dataclass(frozen=True)
class Given:
    """A fit of which the model and the deviance are known."""

    model: Model
    deviance: float
    session: Any


def given_fit(*fields: FrictionField, gates: Any = None) -> Any:
    ice: Any = SimpleNamespace(sheet=PAPER_SHEET)
    terms = tuple(Term(card=CARD, map_field=field) for field in fields)
    session = SimpleNamespace(gates=gates, paths=[])
    return Given(Model(ice=ice, terms=terms), 500.0, session)


@pytest.fixture
def renewed(monkeypatch):
    """A fit with a map, renewed with the best field that is given, and the goal of its refit."""

    def renew(present, best, deviance):
        goals = []

        def refitted(fitted, model, *, goal):
            goals.append(goal)
            return replace(fitted, model=model, deviance=deviance)

        monkeypatch.setattr(maps, "_fields_of", lambda *_: [best])
        monkeypatch.setattr(maps, "fields_to_try", lambda *_: [best])
        monkeypatch.setattr(maps, "_best_of", lambda *_: (best, 0.0))
        monkeypatch.setattr(maps, "refit", refitted)
        found = renew_map(given_fit(present))
        assert found.model.map_field is not None
        return found.model.map_field.length, goals

    return renew


def test_a_map_of_another_length_must_gain_more_than_one(renewed):
    assert renewed(a_field(2.0), a_field(5.0), 498.9) == (5.0, [499.0])
    assert renewed(a_field(2.0), a_field(5.0), 499.1) == (2.0, [499.0])
    assert renewed(a_field(2.0), a_field(2.0), 0.0) == (2.0, [])  # it is the same
    assert renewed(a_field(2.0), replace(a_field(2.0), smoothness=np.inf), 0.0)[1] == [499.0]


def test_of_an_earlier_map_another_size_of_its_change_is_another_map(renewed):
    known = np.full(PAPER_SHEET.shape[0] * PAPER_SHEET.shape[1], 0.01)
    present = a_field(2.0, known=known)
    assert renewed(present, a_field(2.0, known=known), 0.0)[1] == []
    assert renewed(present, a_field(2.0, known=known, amplitude=0.1), 0.0)[1] == [499.0]
    assert renewed(a_field(2.0), a_field(2.0, amplitude=0.1), 0.0)[1] == []


def test_a_map_is_searched_once_and_not_by_gates(monkeypatch):
    monkeypatch.setattr(maps, "_fields_of", lambda *_: [])
    monkeypatch.setattr(maps, "_best_of", lambda *_: (a_field(3.0), 40.0))
    gated = given_fit(gates=SimpleNamespace())
    assert find_map(gated) is None
    assert find_map(given_fit(a_field(2.0))) is None
    bare: Any = SimpleNamespace(**vars(given_fit()), linear=SimpleNamespace(least=lambda: 100.0))
    found = find_map(bare)
    assert found is not None
    assert (found[0].name, found[1]) == (CARD.name, 60.0)
    even = given_fit()
    assert renew_map(even) is even
