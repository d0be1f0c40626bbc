"""The tables of the blind benchmark."""

from __future__ import annotations

import pytest
from blind.tables import draws, over_bound, share, tables, wilson


def test_wilsons_interval():
    # Of none in n the upper end is z²/(n + z²).
    assert wilson(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    assert wilson(10, 10) == pytest.approx((0.7225, 1.0), abs=1e-4)
    assert wilson(26, 52) == pytest.approx((0.3689, 0.6311), abs=1e-4)


def test_a_share_of_nothing_is_a_dash():
    assert share([]) == "–"
    assert share([True, True, False, True]).startswith("3 of 4 (75 %")


def test_errors_of_maps_are_pooled_over_sessions():
    rows = [{"map_rmse": 0.02, "map_bound": 0.01}, {"map_rmse": 0.01, "map_bound": 0.01}]
    assert over_bound(rows) == "1.58 (median 1.50)"


def test_draws_without_a_plan_are_said():
    planned = {"miss": 0.3, "miss_on_truth": 0.2, "unplanned": 1}
    lost = {"miss": None, "miss_on_truth": None, "unplanned": 6}
    assert draws([{"draws": planned}, {"draws": lost}, {}]) == (
        "1.500 (worst session 1.50; 7 draws without a plan)"
    )


def test_sessions_that_failed_count_as_not_understood():
    common = {"kind": "one", "throws": 16, "effects": 1, "scale": 1.0, "seconds": 3.0}
    named = {"named": ["curl"], "unknown": [], "wrong_name": False, "visibility": 4.0}
    right = {"hidden": ["curl"], "exact": True, "right": True, "errors": [0.01], "inside": [True]}
    failed = {"hidden": ["slope"], "failed": "InputError: no", "exact": False, "right": False}
    text = tables([{**common, **named, **right}, {**common, **failed}])
    assert "| one effect: exactly named | 1 of 2 (50 %; 9 to 91 %) | 95 % | 99 % |" in text
