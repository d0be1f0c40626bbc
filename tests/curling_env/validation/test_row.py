"""Agreement of a value with a published one."""

from __future__ import annotations

from typing import Any

import pytest

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.validation import Row, Shots, Verdict

SHOTS = Shots(Ice.uniform(0.01))


def a_row(value: float | None, **given: Any) -> Row:
    fields: dict[str, Any] = {
        "name": "a draw", "part": "draws", "published": "1 to 3 s", "low": 1.0, "high": 3.0,
        "unit": "s", "source": "a source",
    }  # fmt: skip
    return Row(value=lambda _: value, **{**fields, **given})


@pytest.mark.parametrize(
    ("value", "verdict"),
    [
        (1.0, Verdict.AGREES),
        (3.0, Verdict.AGREES),
        (3.01, Verdict.DIFFERS),
        (None, Verdict.NOT_COMPUTED),
        (float("nan"), Verdict.NOT_COMPUTED),
        (float("inf"), Verdict.NOT_COMPUTED),
    ],
)
def test_a_value_agrees_within_the_sources_own_bounds(value, verdict) -> None:
    assert a_row(value).compared(SHOTS).verdict is verdict


def test_a_reason_is_that_of_the_ice_or_of_any() -> None:
    row = a_row(4.0, why={"club": "slow", "any": "round numbers"})
    assert row.compared(SHOTS, "club").why == "slow"
    assert row.compared(SHOTS, "standard").why == "round numbers"
    assert row.compared(SHOTS).verdict is Verdict.EXPLAINED
    known_only = a_row(4.0, why={"club": "slow"})
    assert known_only.compared(SHOTS).verdict is Verdict.DIFFERS


def test_a_row_that_agrees_gives_no_reason() -> None:
    found = a_row(2.0, why={"any": "round numbers"}).compared(SHOTS)
    assert found.why == ""
    assert found.as_dict()["verdict"] == "agrees"


def test_unmeasured_rows_have_a_value_and_no_verdict() -> None:
    row = a_row(2.0, low=None, high=None)
    assert row.compared(SHOTS).verdict is Verdict.NOT_MEASURED
    with pytest.raises(InputError, match="no uncertainty"):
        row.residual(2.0)


def test_residuals_are_in_halves_of_the_bounds() -> None:
    assert a_row(2.0).residual(3.0) == pytest.approx(1.0)
    assert a_row(2.0).residual(1.5) == pytest.approx(-0.5)


@pytest.mark.parametrize("bounds", [{"low": None}, {"high": None}, {"low": 4.0}])
def test_invalid_bounds_are_refused(bounds) -> None:
    with pytest.raises(InputError, match="a draw"):
        a_row(1.0, **bounds)
