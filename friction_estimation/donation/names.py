"""Removal of identities: names become numbers, and free text is excluded."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from curling_env.errors import InputError
from friction_estimation.donation.session import ThrownBy
from friction_estimation.tracks.throw_list import ThrowNote

_WORDS = """
draw guard freeze hit takeout stay and peel tap raise button top back left right four eight twelve
centre center corner in out broom normal firm hack board control turn turns short past m cm ft inch
inches s
"""
CALL_WORDS = frozenset(_WORDS.split())
"""Words of a call; a called shot with any other word is dropped."""


def without_names(
    notes: Mapping[int, ThrowNote], hands: Mapping[str, str]
) -> tuple[list[ThrownBy], int]:
    """Return the publishable notes on the throws, with athletes numbered in order of first throw.

    Parameters
    ----------
    notes : notes by number of the throw
    hands : `right` or `left` by athlete

    Returns
    -------
    the kept notes, in the order of play, and the number of dropped called shots
    """
    numbers: dict[str, int] = {}
    kept: list[ThrownBy] = []
    left_out = 0
    for throw, note in sorted(notes.items()):
        athlete = numbers.setdefault(note.athlete, len(numbers)) if note.athlete else None
        called = note.called if is_a_call(note.called) else ""
        left_out += bool(note.called) and not called
        kept.append(
            ThrownBy(
                throw=throw,
                athlete=athlete,
                hand=hands.get(note.athlete, "") if note.athlete else "",
                called=called,
            )
        )
    return kept, left_out


def is_a_call(text: str) -> bool:
    """Return whether a text has only numbers and words of calls, so that it can contain no name."""
    words = re.findall(r"[^\W\d_]+", text.lower())
    plain = all(letter.isascii() for letter in text)
    return plain and bool(text) and all(word in CALL_WORDS for word in words)


def refuse_names(text: str, names: Iterable[str]) -> None:
    """Refuse a text that contains the name of an athlete, or a part of it.

    Parameters
    ----------
    text : text for publication
    names : names of the athletes of the session

    Raises
    ------
    InputError : it contains a word of a name; the message does not repeat it
    """
    words = set(re.findall(r"[^\W\d_]+", text.casefold()))
    for name in names:
        parts = {p for p in re.findall(r"[^\W\d_]+", name.casefold()) if len(p) > 1}
        if parts & words:
            raise InputError(
                "names an athlete of the session; expected a text without names (write 'all of "
                "us')",
                source="--consent",
            )
