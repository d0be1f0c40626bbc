"""The fitted ice lies where the rows want it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import load_ice
from curling_env.validation import Shots, fit_to_rows
from curling_env.validation.fit import cost, fitted_rows, law_ice, residuals

FITTED = {
    "friction": 0.00822, "exponent": 0.269, "curl": 0.0067, "spin_drag": 0.0174, "air_drag": 9.5e-4,
}  # fmt: skip


def test_no_neighbour_of_the_fitted_ice_meets_the_rows_better() -> None:
    rows = fitted_rows()
    best = cost(residuals(load_ice("fitted"), rows))
    assert best < cost(residuals(load_ice("standard"), rows)) - 2.0
    for name in ("exponent", "curl"):
        for factor in (0.94, 1.06):
            changed = {**FITTED, name: FITTED[name] * factor}
            assert cost(residuals(law_ice(**changed), rows)) > best, (name, factor)


def test_a_fit_finds_the_law_behind_made_up_rows() -> None:
    hidden = law_ice(0.0088, 0.25, 0.0070, 0.0115, 9.5e-4)
    names = ("friction at 2.1 to 2.2 m/s", "draw, hog to hog", "curl of a draw")
    rows = [row for row in fitted_rows() if row.name in names]
    shots = Shots(hidden)
    truth = []
    for row in rows:
        value = row.value(shots)
        assert value is not None
        truth.append(replace(row, low=value * 0.999, high=value * 1.001))
    fit = fit_to_rows(truth, starts=[(1.0, 1.0)])
    assert np.abs(fit.after).max() < 0.1
    assert fit.parameters["curl"] == pytest.approx(0.0070, rel=0.02)
    assert "curl of a draw" in fit.as_text()
