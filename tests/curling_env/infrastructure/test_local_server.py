"""Servers on this machine answer their own page, and close other connections soon."""

from __future__ import annotations

import http.client
import socket
import threading
import time
from contextlib import suppress
from http import HTTPStatus

import pytest

from curling_env.infrastructure import LocalHandler, LocalServer, local_server


class Handler(LocalHandler):
    policy = "default-src 'none'"

    def answer(self, path: str, body: bytes | None) -> tuple[HTTPStatus, str, bytes]:
        if path == "/broken":
            raise KeyError("a stranger's request")
        return HTTPStatus.OK, "text/plain", body or b"page"


@pytest.fixture
def server():
    with LocalServer(Handler) as served:
        threading.Thread(target=served.serve_forever, args=(0.01,), daemon=True).start()
        yield served
        served.shutdown()


def ask(server, method="GET", path="/", body=None, **headers):
    """Status, headers and content of an answer; headers of the request replace the usual ones."""
    line = http.client.HTTPConnection("127.0.0.1", server.server_address[1], timeout=120)
    line.putrequest(method, path, skip_host=True)
    own = f"127.0.0.1:{server.server_address[1]}"
    sent = {"Host": own, **({} if body is None else {"Content-Length": str(len(body))}), **headers}
    for name, value in sent.items():
        line.putheader(name, value.replace("OWN", own))
    line.endheaders(body)
    answer = line.getresponse()
    return answer.status, answer.headers, answer.read()


def test_its_own_page_is_answered_with_a_policy(server):
    status, headers, content = ask(server, Origin="http://OWN")
    assert (status, content) == (200, b"page")
    assert headers["Content-Security-Policy"].startswith("default-src 'none'")
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert ask(server, "POST", body=b"x")[2] == b"x"
    local = f"localhost:{server.server_address[1]}"
    assert ask(server, Host=local, Origin=f"http://{local}")[0] == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "evil.example:80"},
        {"Host": ""},
        {"Host": "127.0.0.1"},  # another port
        {"Origin": "http://evil.example"},
        {"Origin": "null"},  # a page from a file, or in a frame that may do nothing
        {"Origin": "https://OWN"},
        {"Origin": "http://OWN.evil.example"},
        {"Host": "evil.example", "Origin": "http://evil.example"},
    ],
)
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_no_host_and_no_origin_but_its_own(server, method, headers):
    assert ask(server, method, body=b"x" if method == "POST" else None, **headers)[0] == 403


def test_broken_or_too_long_messages_are_refused(server):
    assert ask(server, path="/broken")[0] == 400
    for length in ("100001", "-1", "many", "9" * 5000, ""):
        assert ask(server, "POST", **{"Content-Length": length})[0] == 413
    assert ask(server, "DELETE")[0] == 501
    assert ask(server)[0] == 200


def test_silent_connections_hold_no_threads(server, monkeypatch):
    monkeypatch.setattr(local_server, "IDLE_TIMEOUT", 0.1)
    monkeypatch.setattr(Handler, "timeout", 0.1)
    before = threading.active_count()
    silent = [socket.create_connection(server.server_address, timeout=5) for _ in range(24)]
    for connection in silent[:12]:
        connection.sendall(b"POST / HTTP/1.1\r\nContent-Le")
    time.sleep(0.1)
    assert threading.active_count() - before <= local_server.MAX_CONNECTIONS
    deadline = time.monotonic() + 60
    while threading.active_count() > before and time.monotonic() < deadline:
        time.sleep(0.02)
    assert threading.active_count() == before
    assert ask(server)[0] == 200
    for connection in silent:
        connection.close()


def test_one_connection_too_many_is_closed_and_the_others_go_on(server):
    silent = [
        socket.create_connection(server.server_address, timeout=60)
        for _ in range(local_server.MAX_CONNECTIONS)
    ]
    with socket.create_connection(server.server_address, timeout=60) as last, suppress(OSError):
        assert last.recv(1) == b""
    for connection in silent:
        connection.close()
    deadline = time.monotonic() + 60
    while server._open and time.monotonic() < deadline:
        time.sleep(0.02)
    assert ask(server)[0] == 200
