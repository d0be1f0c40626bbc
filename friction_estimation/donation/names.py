"""What might tell who threw: names become numbers, and free text stays at home."""

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
"""The words of a call; a called shot with any other word is left out."""


def without_names(
    notes: Mapping[int, ThrowNote], hands: Mapping[str, str]
) -> tuple[list[ThrownBy], int]:
    """What may be told of the throws, with athletes as numbers in the order of their first throw.

    Parameters
    ----------
    notes : by number of the throw
    hands : `right` or `left` by athlete

    Returns
    -------
    what is kept, in the order of play, and how many called shots were left out
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
    """Whether a text has numbers and words of calls alone, so that it can hold no name."""
    words = re.findall(r"[^\W\d_]+", text.lower())
    plain = all(letter.isascii() for letter in text)
    return plain and bool(text) and all(word in CALL_WORDS for word in words)


def refuse_names(text: str, names: Iterable[str]) -> None:
    """Refuse a text in which the name of an athlete stands, or a part of it.

    Parameters
    ----------
    text : that is going to be given away
    names : of the athletes of the session

    Raises
    ------
    InputError : it holds a word of a name; the message does not repeat it
    """
    words = set(re.findall(r"[^\W\d_]+", text.casefold()))
    for name in names:
        parts = {p for p in re.findall(r"[^\W\d_]+", name.casefold()) if len(p) > 1}
        if parts & words:
            raise InputError(
                "names an athlete of the session; a donated file has no names (write 'all of us')",
                source="--consent",
            )
