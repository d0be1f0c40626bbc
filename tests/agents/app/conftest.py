"""An app on a separate club, requested without a browser."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette", reason="the extra `app` is not installed")

from agents.app import Club, WorkQueue, do_job, jobs, token_for
from agents.app.application import application
from curling_env.infrastructure import listening, serving

SECRET, PORT = "the-secret", 8711


@dataclass
class Answer:
    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def text(self) -> str:
        return self.body.decode()

    @property
    def document(self) -> Any:
        return json.loads(self.body)


@dataclass
class Visitor:
    """Sends requests to an app as HTTP would, without a network."""

    app: Any
    secret: str = SECRET
    host: str = f"127.0.0.1:{PORT}"
    headers: dict[str, str] = field(default_factory=dict)
    club: Any = None

    @property
    def token(self) -> str:
        return token_for(self.secret)

    def get(self, path: str, **headers: str) -> Answer:
        return self.ask("GET", path, b"", headers)

    def post(self, path: str, fields: dict[str, str], **headers: str) -> Answer:
        from urllib.parse import urlencode

        body = urlencode({"csrf": self.token, **fields}).encode()
        kind = {"content-type": "application/x-www-form-urlencoded"}
        return self.ask("POST", path, body, kind | headers)

    def send(self, path: str, document: Any, method: str = "POST") -> Answer:
        kind = {"content-type": "application/json", "x-csrf-token": self.token}
        return self.ask(method, path, json.dumps(document).encode(), kind)

    def put(self, path: str, body: bytes) -> Answer:
        return self.ask("PUT", path, body, {"x-csrf-token": self.token})

    def ask(self, method: str, path: str, body: bytes, headers: dict[str, str]) -> Answer:
        path, _, query = path.partition("?")
        given = {"host": self.host, "accept": "text/html", "content-length": str(len(body))}
        given |= self.headers | headers
        scope = {
            "type": "http",
            "asgi": {"version": "3.0", "spec_version": "2.4"},
            "http_version": "1.1",
            "method": method,
            "scheme": "http",
            "path": f"/{self.secret}/{path}",
            "raw_path": b"",
            "query_string": query.encode(),
            "headers": [(k.encode(), v.encode()) for k, v in given.items()],
            "server": ("127.0.0.1", PORT),
            "client": ("127.0.0.1", 50000),
            "root_path": "",
        }
        result = False
        came: list[dict[str, Any]] = []

        async def receive() -> dict[str, Any]:
            nonlocal result
            if result:  # the client is still there, and sends nothing more
                await asyncio.Event().wait()
            result = True
            return {"type": "http.request", "body": body, "more_body": False}

        async def send(message: dict[str, Any]) -> None:
            came.append(message)

        # In a separate thread: a browser that is driven in this one has its loop running there.
        with ThreadPoolExecutor(1) as thread:
            thread.submit(lambda: asyncio.run(self.app(scope, receive, send))).result()
        start = next(m for m in came if m["type"] == "http.response.start")
        return Answer(
            status=start["status"],
            headers={k.decode().lower(): v.decode() for k, v in start["headers"]},
            body=b"".join(m.get("body", b"") for m in came if m["type"] == "http.response.body"),
        )


@pytest.fixture(scope="session")
def work_off() -> Callable[[Club], list[str]]:
    """Does the work that waits, in this process, as the queue's processes would."""

    def work(club: Club) -> list[str]:
        done: list[str] = []
        for job in jobs(club)[::-1]:
            if job.state == "waiting":
                with club.database.writing() as connection:
                    connection.execute("update job set state = 'running' where id = ?", (job.id,))
                do_job(club.folder, job.id)
                done.append(job.kind)
        return done

    return work


@contextmanager
def served(club: Club) -> Iterator[str]:
    """Serve a club's app to a browser from a thread; give the address of its pages."""
    app = application(club, WorkQueue(club), secret=SECRET, hosts=["127.0.0.1"])
    ready, port = threading.Event(), [0]
    loop, done = asyncio.new_event_loop(), asyncio.Event()

    async def serve() -> None:
        async with serving(app, listening("127.0.0.1", 0)) as port[0]:
            ready.set()
            await done.wait()

    server = threading.Thread(target=loop.run_until_complete, args=(serve(),), daemon=True)
    server.start()
    assert ready.wait(30)
    yield f"http://127.0.0.1:{port[0]}/{SECRET}/"
    loop.call_soon_threadsafe(done.set)
    server.join(10)


@pytest.fixture(scope="session")
def serve_club() -> Callable[[Club], AbstractContextManager[str]]:
    return served


@pytest.fixture
def club(tmp_path: Path) -> Club:
    return Club(tmp_path / "club")


def visitor_of(club: Club) -> Visitor:
    app = application(club, WorkQueue(club), secret=SECRET, hosts=["127.0.0.1", "localhost"])
    return Visitor(app, club=club)


@pytest.fixture
def visitor(club: Club) -> Visitor:
    """A client that knows the secret; no work is begun."""
    return visitor_of(club)


@pytest.fixture(scope="module")
def lasting_visitor(tmp_path_factory: pytest.TempPathFactory) -> Visitor:
    """A client of one club for all tests of a module that only read, or are refused."""
    return visitor_of(Club(tmp_path_factory.mktemp("club")))
