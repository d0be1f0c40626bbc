"""Formatted lengths."""

from __future__ import annotations

import pytest

from curling_env.units import Units, length, miss, short_length, side, speed

FEET = Units.FEET


@pytest.mark.parametrize(
    ("metres", "text"), [(0.3048, "1 ft 0 in"), (0.2794, "11 in"), (-1.2446, "4 ft 1 in")]
)
def test_lengths_in_feet_and_inches(metres, text):
    assert length(metres, FEET) == text


def test_inches_never_reach_twelve():
    text = [length(metres / 1000, FEET) for metres in range(3000)]
    assert not any(" 12 in" in words or words.startswith("12 in") for words in text)
    text = [short_length(metres / 1000, FEET) for metres in range(3000)]
    assert not any(words in ("12 in", "0 ft 12 in") for words in text)


def test_metres_and_centimetres():
    assert length(-1.234) == "1.23 m"
    assert short_length(0.126) == "13 cm"
    assert short_length(0.997) == "1.00 m"
    assert speed(2.0) == "2.00 m/s"
    assert speed(3.048, FEET) == "10.0 ft/s"


def test_sides_are_the_throwers():
    assert side(0.3) == "30 cm right"
    assert side(-0.3) == "30 cm left"
    assert side(0.3, right="left") == "30 cm left"
    assert side(-1.5, right="past") == "1.50 m short"
    assert side(0.001) == "on the line"
    assert side(-0.001, FEET, right="past") == "on the tee line"


def test_misses_are_formatted_to_visible_precision():
    assert [miss(metres) for metres in (0.0042, 0.0999, 1.5)] == ["4 mm", "10 cm", "1.50 m"]
    text = [miss(metres, FEET) for metres in (0.0032, 0.0127, 0.0250, 0.1, 0.4)]
    assert text == ["⅛ in", "½ in", "1 in", "4 in", "1 ft 4 in"]
