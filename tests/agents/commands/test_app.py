"""`curling app`: its first line, and its refusals in one line."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import urllib.request
from concurrent.futures import ThreadPoolExecutor

import pytest

pytest.importorskip("starlette", reason="the extra `app` is not installed")

from agents.app import Club
from curling_env.commands.cli import main


def refused(capsys, *words: str) -> str:
    # In a thread: a browser that is driven in this one has its loop running there.
    with ThreadPoolExecutor(1) as thread:
        assert thread.submit(main, ["app", "--no-browser", *words]).result() == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.strip().splitlines()
    return line


def test_the_first_line_is_the_address_and_an_interrupt_is_an_orderly_end(tmp_path):
    words = [sys.executable, "-m", "curling", "app", str(tmp_path / "club")]
    app = subprocess.Popen(
        [*words, "--no-browser", "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Tests that run in the background may ignore interrupts.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert app.stdout is not None
    address = app.stdout.readline().strip()
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{20,}/", address)
    with urllib.request.urlopen(address, timeout=120) as answer:
        assert b"<nav" in answer.read()
    os.kill(app.pid, signal.SIGINT)
    out, messages = app.communicate(timeout=120)
    assert (app.returncode, out) == (0, "")
    assert "everything is kept" in messages


def test_a_folder_that_is_open_already_is_refused(tmp_path, capsys):
    with Club(tmp_path / "club").alone():
        assert "another `curling app`" in refused(capsys, str(tmp_path / "club"))


def test_a_port_that_is_taken_is_refused(tmp_path, capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert port in refused(capsys, str(tmp_path / "club"), "--port", port)


@pytest.mark.parametrize("port", ["-1", "65536", "http"])
def test_an_invalid_port_is_refused(tmp_path, capsys, port):
    refused(capsys, str(tmp_path / "club"), "--port", port)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_one_is_refused(tmp_path, capsys):
    file = tmp_path / "club"
    file.write_text("a file")
    assert "a file is in its place" in refused(capsys, str(file))
    assert file.read_text() == "a file"


def test_another_programs_database_is_refused_and_left_alone(tmp_path, capsys):
    database = tmp_path / "club.sqlite"
    database.write_bytes(b"no database" * 500)
    assert "club.sqlite" in refused(capsys, str(tmp_path))
    assert database.read_bytes() == b"no database" * 500


def test_an_import_without_tracks_adds_nothing(tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    words = [str(tmp_path / "club"), "--import", str(tmp_path / "empty")]
    assert "tracks.csv" in refused(capsys, *words)
    assert Club(tmp_path / "club").sessions() == []
