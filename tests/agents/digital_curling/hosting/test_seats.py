"""A client's seat without a network: any input, in any pieces."""

from __future__ import annotations

import asyncio
import json
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from agents.digital_curling import (
    MAX_BAD_LINES,
    ClientSeat,
    ConcedeMessage,
    OutOfTimeError,
    SeatLostError,
    ShotMessage,
    Turn,
)

MOVES = [
    {"cmd": "move", "move": {"type": "concede"}},
    {"cmd": "move", "move": {"type": "shot", "velocity": {"x": 0, "y": 2.4}, "rotation": "cw"}},
]
GOOD = [json.dumps(move).encode() for move in MOVES]
BAD = [
    b"nonsense",
    b"[]",
    b"{}",
    b'{"cmd":"move"}',
    b'{"cmd":"move","move":{"type":"pass"}}',
    b'{"cmd":"move","move":{"type":"shot","velocity":{"x":0,"y":1e9},"rotation":"cw"}}',
    b'{"cmd":"move","move":{"type":"shot","velocity":{"x":0,"y":NaN},"rotation":"cw"}}',
    b'{"cmd":"dc_ok","name":"x"}',
    b'{"cmd":"ready_ok"}',
    b"\xff\xfe",
    b"{" * 5000,
]


class Deaf:
    """Writer that accepts anything."""

    def __init__(self) -> None:
        self.written = b""

    def write(self, data: bytes) -> None:
        self.written += data

    async def drain(self) -> None:
        return

    def close(self) -> None:
        return

    async def wait_closed(self) -> None:
        return


def decided(pieces: list[bytes], *, left: float = 30.0, hangs_up: bool = True) -> Turn | str:
    """Return the turn of a client that sends these pieces, or why it lost its seat or its time."""

    async def run() -> Turn | str:
        reader = asyncio.StreamReader(limit=65536)
        writer: Any = Deaf()
        seat = ClientSeat(reader, writer)
        for piece in pieces:
            reader.feed_data(piece)
        if hangs_up:
            reader.feed_eof()
        view: Any = None
        try:
            return await seat.decide({"cmd": "update"}, view, left)
        except SeatLostError as error:
            return str(error)
        except OutOfTimeError:
            return "time"
        finally:
            await seat.close()

    # In a thread: the browser of other tests leaves an event loop running in this one.
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, run()).result()


@given(st.lists(st.sampled_from(GOOD + BAD) | st.binary(max_size=60), max_size=14), st.data())
def test_the_first_move_counts_unless_too_much_else_came(lines, data):
    lines = [line.replace(b"\n", b" ") for line in lines]
    sent = [line for line in lines if line.strip()]
    stream = b"".join(line + b"\n" for line in lines)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=5)))
    pieces = [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    first = next((k for k, line in enumerate(sent) if line in GOOD), None)
    outcome = decided(pieces)
    if first is not None and first <= MAX_BAD_LINES:
        assert isinstance(outcome, Turn)
        kind = ConcedeMessage if sent[first] == GOOD[0] else ShotMessage
        assert isinstance(outcome.move, kind)
    else:
        assert isinstance(outcome, str)
        assert "\n" not in outcome
        assert ("too many bad lines" in outcome) is (len(sent) > MAX_BAD_LINES)


def test_a_line_without_end_is_no_move():
    assert "more than 65536 bytes" in decided([b"x" * 200_000])
    assert decided([GOOD[1]]) == "it closed the connection"  # before the end of its line


def test_time_runs_while_bad_lines_come():
    assert decided([BAD[0] + b"\n"], left=0.05, hangs_up=False) == "time"
