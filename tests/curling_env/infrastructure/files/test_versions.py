"""Numbered formats: old files are brought up to date, newer ones are refused in one line."""

from __future__ import annotations

import copy

import pytest

from curling_env.errors import InputError
from curling_env.infrastructure import FileFormat


def in_metres(document):
    """From number 1 to 2: a length in feet becomes one in metres."""
    document["length"] = 0.3048 * document.pop("length_ft")
    return document


def with_name(document):
    """From number 2 to 3: everything has a name."""
    return {**document, "name": document.get("name", "unnamed")}


RULER = FileFormat(name="ruler", what="a ruler", steps=(in_metres, with_name))
OLD = FileFormat(name="ruler", what="a ruler", steps=(in_metres, with_name), numbered=False)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (
            {"format": "ruler/1", "length_ft": 10.0},
            {"format": "ruler/3", "length": 3.048, "name": "unnamed"},
        ),
        (
            {"format": "ruler/2", "length": 2.0, "name": "a"},
            {"format": "ruler/3", "length": 2.0, "name": "a"},
        ),
        ({"format": "ruler/3", "length": 2.0}, {"format": "ruler/3", "length": 2.0}),
    ],
)
def test_every_number_is_brought_up_to_date_by_the_steps_that_it_lacks(old, new):
    before = copy.deepcopy(old)
    assert RULER.newest == "ruler/3"
    assert RULER.brought_up(old) == new
    assert old == before  # what was given stays as it is


def test_a_file_without_a_number_is_the_first_where_the_format_once_had_none():
    assert OLD.brought_up({"length_ft": 1.0})["length"] == 0.3048
    with pytest.raises(InputError, match="expected a ruler of format 'ruler/3', found 'None'"):
        RULER.brought_up({"length_ft": 1.0})


@pytest.mark.parametrize("number", ["4", "0", "12345"])
def test_a_number_of_a_later_release_is_told_as_that(number):
    with pytest.raises(InputError, match=r"reads a ruler up to 'ruler/3'"):
        RULER.brought_up({"format": f"ruler/{number}"})


@pytest.mark.parametrize(
    "document",
    [
        *({"format": f} for f in ("ruler", "ruler/", "ruler/x", "ruler/-1", "ruler/²", "rule/1")),
        *({"format": f} for f in (None, 3, ["ruler/1"], "ruler/" + "9" * 5000)),
        *([], None, "ruler/1"),
    ],
)
def test_anything_else_is_another_format(document):
    with pytest.raises(InputError, match="expected a ruler of format 'ruler/3', found") as refused:
        RULER.brought_up(document)
    assert len(str(refused.value)) < 150
