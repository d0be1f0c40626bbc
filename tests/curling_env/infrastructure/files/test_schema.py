"""A document of another format, or of a newer one, is refused in one line."""

from __future__ import annotations

import copy

import pytest

from curling_env.errors import InputError
from curling_env.infrastructure import FileFormat

RULER = FileFormat(name="ruler/1", what="a ruler")
OLD = FileFormat(name="ruler/1", what="a ruler", numbered=False)


def test_a_document_of_the_format_is_accepted_and_stays_as_it_is():
    given = {"format": "ruler/1", "length": 2.0}
    before = copy.deepcopy(given)
    assert RULER.accept(given) == given == before


def test_a_file_without_a_format_is_accepted_where_it_may_have_none():
    assert OLD.accept({"length": 1.0}) == {"format": "ruler/1", "length": 1.0}
    with pytest.raises(InputError, match="expected a ruler of format 'ruler/1', found 'None'"):
        RULER.accept({"length": 1.0})


@pytest.mark.parametrize("number", ["2", "0", "12345"])
def test_a_number_of_a_later_release_is_reported_as_that(number):
    with pytest.raises(InputError, match=r"expected a ruler of format 'ruler/1' or earlier"):
        RULER.accept({"format": f"ruler/{number}"})


@pytest.mark.parametrize(
    "document",
    [
        *({"format": f} for f in ("ruler", "ruler/", "ruler/x", "ruler/-1", "ruler/²", "rule/1")),
        *({"format": f} for f in (None, 3, ["ruler/1"], "ruler/" + "9" * 5000)),
        *([], None, "ruler/1"),
    ],
)
def test_anything_else_is_another_format(document):
    with pytest.raises(InputError, match="expected a ruler of format 'ruler/1', found") as refused:
        RULER.accept(document)
    assert len(str(refused.value)) < 150


def test_an_error_is_one_line_whatever_a_key_holds():
    refused = InputError("expected a number", source="ice.json", where="effects[0].sigma.a\n\x03b")
    assert str(refused) == "ice.json, effects[0].sigma.a �b: expected a number"
