"""The sides of a patch along the sheet are placed where the throws say."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.discovery import (
    Term,
    base_model,
    fit_with_noise,
    open_session,
    refit,
    standard_errors,
)
from friction_estimation.discovery.evidence.intervals import with_sides
from friction_estimation.discovery.model.candidates import known_effects
from friction_estimation.discovery.search.patches import (
    place_sides,
    scan_side,
    sides_along,
)
from friction_estimation.discovery.tuning import NARROWEST_PATCH
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
    label, values = "friction_patch", off_to_the_right.model.term("friction_patch").values
    scan = scan_side(off_to_the_right, label, "x_min")
    assert (np.diff(scan.shifts) > 0).all()
    assert (scan.shifts < values["x_max"] - values["x_min"] - NARROWEST_PATCH).all()
    fitted: list[float] = []
    for shift in scan.shifts:
        moved = off_to_the_right.model.term(label).with_values(x_min=values["x_min"] + shift)
        model = off_to_the_right.model.without(label).with_terms(moved)
        fitted.append(refit(off_to_the_right, model).deviance)
    best = int(np.argmin(fitted))
    assert int(np.argmin(scan.deviances)) == best
    assert values["x_min"] + scan.shifts[best] == pytest.approx(-0.4, abs=0.05)
    # Where a place is better, the gain is foreseen within a third of it.
    gain = off_to_the_right.deviance - fitted[best]
    assert gain > 100
    assert off_to_the_right.deviance - scan.deviances[best] == pytest.approx(gain, rel=0.33)


def test_a_side_goes_where_it_fits(off_to_the_right) -> None:
    placed = place_sides(off_to_the_right)
    term = placed.model.term("friction_patch")
    assert sides_along(placed.model) == [(term.label, "x_min"), (term.label, "x_max")]
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
