"""Lines of any kind: they are read or refused, and a damaged one ends nothing else."""

from __future__ import annotations

import json
from copy import deepcopy
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from agents.digital_curling import Client, from_server, record_of, write_line
from curling_env.errors import InputError
from curling_env.game import DrawPlayer

WIRE = Path(__file__).parent / "wire" / "extra-end-team1.jsonl"
BASE = [json.loads(line[2:]) for line in WIRE.read_text().splitlines()[:18] if line.startswith("<")]
JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**6), 10**6)
    | st.floats(allow_nan=False)
    | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner, max_size=3)
    ),
    max_leaves=6,
)


def damaged(message, path, value):
    """Return a message with another value at a place, which a list of numbers leads to."""
    copy = deepcopy(message)
    here = copy
    for k, step in enumerate(path):
        keys = list(here) if isinstance(here, dict) else list(range(len(here)))
        if not keys:
            break
        key = keys[step % len(keys)]
        if k == len(path) - 1 or not isinstance(here[key], dict | list):
            here[key] = value
            break
        here = here[key]
    return copy


def refused(line: bytes) -> str | None:
    """Return the reason why a line is refused; None for one that is read."""
    try:
        message = from_server(line)
    except InputError as error:
        return str(error)
    assert from_server(write_line(message)) == message
    return None


@given(st.binary(max_size=300) | JSON.map(lambda value: json.dumps(value).encode()))
def test_any_line_is_read_or_refused(line):
    assert "\n" not in (refused(line) or "")


@given(st.integers(0, len(BASE) - 1), st.lists(st.integers(0, 40), min_size=1, max_size=6), JSON)
def test_a_damaged_line_is_played_or_refused(number, path, value):
    client = Client(DrawPlayer())
    client.time_manager.prepare = lambda views: None  # which is slow, and the same every time
    for k, message in enumerate(BASE):
        line = json.dumps(damaged(message, path, value) if k == number else message).encode()
        try:
            answer = client.answer(from_server(line))
        except InputError as error:
            problem = str(error)
            break
        if answer is not None:
            write_line(answer)
    else:
        problem = ""
    assert "\n" not in problem
    record_of(client, ice="fcv1")
