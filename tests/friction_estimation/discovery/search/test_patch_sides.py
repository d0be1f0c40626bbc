"""The sides of a patch along the sheet are placed where the throws say."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.sheet import PAPER_SHEET
from friction_estimation.discovery import (
    CARD,
    Term,
    base_model,
    crossed_by,
    field_along,
    fit_with_noise,
    open_session,
    refit,
    standard_errors,
)
from friction_estimation.discovery.evidence.intervals import with_sides
from friction_estimation.discovery.model.candidates import known_effects
from friction_estimation.discovery.search.patch_sides import (
    foreseen_deviances,
    place_sides,
    sides_along,
    with_side,
)
from tests.friction_estimation.discovery.conftest import effect

PATCH = {"x_min": -0.4, "x_max": 0.6, "y_min": -4.0, "y_max": 6.0}


@pytest.fixture
def off_to_the_right(make_session):
    """A fit whose patch begins 0.3 m too far right."""
    tracks = make_session([effect("friction_patch", **PATCH, factor=0.9)], throws=14)
    session = open_session(tracks)
    plain = fit_with_noise(base_model(None, session), session)
    card = known_effects(session.measurements)["friction_patch"]
    values = {**PATCH, "x_min": -0.1, "factor": 0.95}
    term = Term(card=card, values=values, free=("factor",))
    return refit(plain, plain.model.with_terms(term))


def test_what_a_place_would_bring_is_foreseen(off_to_the_right) -> None:
    label = "friction_patch"
    places = (-0.8, -0.4, -0.2, 0.1, 0.3)
    models = [with_side(off_to_the_right.model, label, "x_min", place) for place in places]
    assert all(model is not None for model in models)
    kept = [model for model in models if model is not None]
    foreseen = foreseen_deviances(off_to_the_right, kept)
    fitted = np.array([refit(off_to_the_right, model).deviance for model in kept])
    assert int(np.argmin(foreseen)) == int(np.argmin(fitted)) == 1
    # Where a place is better, the gain is foreseen within a third of it.
    gain = off_to_the_right.deviance - fitted[1]
    assert gain > 100
    assert off_to_the_right.deviance - foreseen[1] == pytest.approx(gain, rel=0.33)


def test_a_side_goes_where_it_fits(off_to_the_right) -> None:
    placed = place_sides(off_to_the_right)
    term = placed.model.term("friction_patch")
    assert sides_along(term) == ("x_min", "x_max")
    assert term.values["x_min"] == pytest.approx(-0.4, abs=0.15)
    assert term.values["factor"] == pytest.approx(0.9, abs=0.01)
    # What is not known of the sides makes the rest less sure too.
    plain = standard_errors(placed)
    sigma = with_sides(placed, plain)
    for side in ("x_min", "x_max"):
        assert 0.05 <= sigma["friction_patch", side] < 0.5
        assert abs(term.values[side] - PATCH[side]) < 3 * sigma["friction_patch", side]
    strength = "friction_patch", "factor"
    assert plain[strength] <= sigma[strength] < 4 * plain[strength]
    assert abs(term.values["factor"] - 0.9) < 3 * sigma[strength]


def test_beside_a_map_a_side_elsewhere_begins_with_the_friction_that_was_there(
    off_to_the_right,
) -> None:
    model, session = off_to_the_right.model, off_to_the_right.session
    paths = [session.xy[session.rows(i)] for i in range(len(session))]
    field = field_along(PAPER_SHEET, crossed_by(PAPER_SHEET, paths), 1.0, np.inf)
    mapped = model.with_terms(Term(card=CARD, map_field=field))
    wider = with_side(mapped, "friction_patch", "x_min", -1.1)
    assert wider is not None
    assert wider.map_field is not None
    x, y = np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres)
    taken = (x >= -1.1) & (x < -0.1) & (y >= PATCH["y_min"]) & (y <= PATCH["y_max"])
    crossed = np.zeros(PAPER_SHEET.shape, dtype=bool)
    crossed.ravel()[wider.map_field.crossed] = True
    change = wider.map_field.ln_mu
    # The patch has taken these cells; the map gives back as much.
    factor = model.term("friction_patch").values["factor"]
    assert change[taken & crossed].mean() == pytest.approx(-np.log(factor), abs=0.015)
    assert np.abs(change[~taken & crossed]).mean() < 0.01
