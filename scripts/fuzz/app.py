"""Requests to the app for athletes and coaches, as their bytes come from the network."""

from __future__ import annotations

import asyncio
import json
import shutil
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from curling_env.errors import CurlingError, InputError

SECRET, PORT = "the-secret", 8711
MANY_BYTES = "ö" * 125 + ".mp4"
"""A name of few letters and 254 bytes."""
PIECE = b"\0\0\0\x18ftypmp42"
PAGES = (
    *("", "practice", "practice/1", "throws", "throws/1", "throws/1/1", "throws/1/1/track", "ice"),
    *("ice/1", "throw", "throw/1", "hand-or-ice/1", "athletes", "athletes/1", "stones/1", "share"),
)
FORMS: tuple[tuple[str, dict[str, str]], ...] = (
    ("practice", {"day": "2026-11-22", "sheet": "A", "name": "x", "camera": "new",
                  "camera_name": "end", "size": "45.72x4.75"}),
    ("practice/1/camera", {"camera": ""}),
    ("practice/1/note", {"text": "keen"}),
    ("practice/1/take", {"file": "sessions/1/a.mp4"}),
    ("practice/1/record", {"source": "0"}),
    ("practice/1/work", {"kind": "track"}),
    ("practice/remove", {"kind": "session", "id": "1"}),
    ("practice/bring-back", {"kind": "session", "id": "1"}),
    ("throws/1/1", {"athlete": "Anna", "hand": "left", "stone": "1", "called": "draw button",
                    "made": "", "note": "x"}),
)  # fmt: skip
PLACE, STONE = {"x": 0.2, "y": 17.0}, {"x": -0.5, "y": 16.0}
DOCUMENTS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("practice/1/films", {"name": "a.mp4", "size": 1000}),
    ("practice/1/films", {"name": MANY_BYTES, "size": 1000}),
    ("throw/run", {"ice": "standard", "throw": {"speed": 2.1, "spin": 1.5}, "stones": [STONE]}),
    ("throw/plan", {"ice": "standard", "target": PLACE, "skill": "club", "stones": [STONE]}),
    ("throw/calls", {"ice": "standard", "position": {"stones": [STONE], "delivered": 7}}),
    ("throw/targets", {"name": "my corner", "place": PLACE}),
)  # fmt: skip


def request(method: str, path: str, headers: Mapping[str, str], body: bytes = b"") -> bytes:
    """Return a request as it is sent; its length is added when it is answered."""
    lines = [f"{method} {path} HTTP/1.1", *(f"{k}: {v}" for k, v in headers.items())]
    return "\r\n".join([*lines, "", ""]).encode() + body


def requests() -> list[bytes]:
    """Return good requests to the app: its pages, forms and documents, and pieces of films."""
    from agents.app import token_for

    token = {"Host": f"127.0.0.1:{PORT}", "X-CSRF-Token": token_for(SECRET)}
    form = token | {"Content-Type": "application/x-www-form-urlencoded", "Accept": "text/html"}
    at = f"/{SECRET}/"
    return [
        *(request("GET", at + page, form) for page in PAGES),
        *(request("POST", at + path, form, urlencode(fields).encode()) for path, fields in FORMS),
        *(
            request("POST", at + path, token, json.dumps(document).encode())
            for path, document in DOCUMENTS
        ),
        *(request("PUT", f"{at}practice/films/{k}?begin=0", token, PIECE) for k in (1, 2)),
    ]


def make_club(folder: Path, tracks: bytes, notes: bytes) -> Path:
    """Make a club with an evening of one session, and two films that are going to be sent."""
    from agents.app import Club
    from agents.app.club.films import begin_film
    from agents.app.take_in import take_in

    (folder / "evening").mkdir(parents=True)
    (folder / "evening" / "tracks.csv").write_bytes(tracks)
    (folder / "evening" / "throws.csv").write_bytes(notes)
    club = Club(folder / "club")
    session = take_in(club, folder / "evening", name="Monday", day="2026-11-23", sheet="A")
    begin_film(club, session, "b.mp4", 1000)
    with suppress(CurlingError):
        begin_film(club, session, MANY_BYTES, len(PIECE))
    return folder / "club"


def answered(club: Path, message: Path) -> None:
    """Let the app of a copy of a club answer the request in a file.

    Raises
    ------
    InputError : the request is refused
    AssertionError : the app answers with an internal error
    """
    from agents.app import Club, WorkQueue
    from agents.app.application import application

    shutil.copytree(club, "club")
    try:
        copy = Club(Path("club"))
        app = application(copy, WorkQueue(copy), secret=SECRET, hosts=["127.0.0.1"])
        status = asyncio.run(answer(app, message.read_bytes()))
    finally:
        shutil.rmtree("club")
    assert status < 500 or status == 503, status
    if status >= 400:
        raise InputError(f"status {status}")


async def answer(app: Any, message: bytes) -> int:
    """Return the status of the answer to a request, as HTTP's library reads it."""
    import h11

    head, _, body = message.partition(b"\r\n\r\n")
    length = b"Content-Length: %d\r\n\r\n" % len(body)
    connection = h11.Connection(h11.SERVER)
    try:
        connection.receive_data(head + b"\r\n" + length + body)
        asked = connection.next_event()
    except h11.RemoteProtocolError:
        return 400
    if not isinstance(asked, h11.Request):
        return 400
    path, _, query = asked.target.partition(b"?")
    scope = {
        "type": "http",
        "asgi": {"version": "3.0", "spec_version": "2.4"},
        "http_version": "1.1",
        "method": asked.method.decode("ascii", "replace"),
        "scheme": "http",
        "path": path.decode("utf-8", "replace"),
        "raw_path": path,
        "query_string": query,
        "root_path": "",
        "headers": list(asked.headers),
        "client": ("127.0.0.1", 50_000),
        "server": ("127.0.0.1", PORT),
    }
    pieces = [body[at : at + 2**15] for at in range(0, len(body), 2**15)] or [b""]
    statuses: list[int] = []

    async def receive() -> dict[str, Any]:
        if not pieces:  # the one who asked waits for the answer
            await asyncio.Event().wait()
        piece = pieces.pop(0)
        return {"type": "http.request", "body": piece, "more_body": bool(pieces)}

    async def send(message: Any) -> None:
        if message["type"] == "http.response.start":
            statuses.append(message["status"])

    await app(scope, receive, send)
    return statuses[0]
