"""One run of `curling` in a process of its own, and whether it ended cleanly.

The process is forked from one that has loaded and compiled everything, so that a run takes
milliseconds and a hanging or crashing one harms nobody.
"""

from __future__ import annotations

import hashlib
import os
import resource
import signal
import sys
import time
import webbrowser
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from processes import end_with

from fuzz.readers import read
from fuzz.surroundings import surround

MAX_SECONDS = 20.0
"""Processor time that a run may take [s]."""
PATIENCE = 6.0
"""Times as much on the clock, because a machine may be busy."""
ANSWER = 60.0
"""How long the local server may take to answer on a busy machine [s]."""
MAX_BYTES = 2**30
"""Memory that a run may take beyond what is loaded anyway [bytes]."""
MAX_LINE = 300
KEPT = (".unfinished/",)
"""What a refused command keeps of the films before the one that it refused."""
LARGE = 2**30
"""Files of this size are made of zeros, on which no disk space is spent [bytes]."""
UNHEARD = ("all streams closed",)
"""Surroundings in which nobody could be told why something is refused."""
UNTOLD = ("stdout piped away", "stdout on a full disk")
"""Those in which results stand, and only nobody could be told of them."""
HERE = "{here}"
"""Stands in arguments for the folder of the run."""


@dataclass(frozen=True, kw_only=True)
class Ended:
    """How a run ended.

    Parameters
    ----------
    faults : what was unclean about it; empty for a clean end
    status : exit status; negative for a signal
    said : what it wrote to stderr
    seconds : time on the clock [s]
    worked : processor time [s]
    memory : largest resident memory beyond that of the process it was forked from [bytes]
    """

    faults: tuple[str, ...]
    status: int
    said: str
    seconds: float
    worked: float
    memory: int


def run(arguments: Sequence[str], folder: Path, surroundings: str = "") -> Ended:
    """Run `curling` in a folder and judge its end.

    Parameters
    ----------
    arguments : what follows `curling`
    folder : the current folder of the run, with its inputs; other files are results
    surroundings : one of `SURROUNDINGS`; empty for the usual ones
    """
    before = _content(folder)
    loaded = _loaded()
    begun = time.monotonic()
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        end_with(parent)
        _be_curling(arguments, folder, surroundings)
    status, memory, worked, hung = _await(child)
    seconds = time.monotonic() - begun
    said = (folder.parent / "stderr").read_text(errors="replace")
    memory = max(0, memory - loaded)
    after = _content(folder)
    faults: list[str] = []
    if hung or worked > MAX_SECONDS:
        faults.append("too long")
    if status not in (0, 2) and not hung:
        faults.append(f"status {status}")
    if "Traceback" in said or "mistake of this program" in said:
        faults.append("traceback")
    if status == 2 and surroundings not in (*UNHEARD, *UNTOLD):
        lines = said.splitlines()
        if len(lines) != 1 or not said.startswith("curling: "):
            faults.append(f"{len(lines)} lines")
        if any(len(line) > MAX_LINE for line in lines):
            faults.append("long line")
        left = sorted(n for n in set(after) - set(before) if not any(k in n for k in KEPT))
        if left:
            faults.append(f"left {left[:3]}")
    lost = [name for name, content in before.items() if after.get(name) != content]
    if lost and (status != 0 or "-o" not in arguments):
        faults.append(f"lost {lost[:3]}")
    if any("~" in name for name in after) and not hung:
        faults.append("draft left")
    if memory > MAX_BYTES:
        faults.append(f"{memory / 2**20:.0f} MB")
    return Ended(
        faults=tuple(faults),
        status=status,
        said=said,
        seconds=seconds,
        worked=worked,
        memory=memory,
    )


def _be_curling(arguments: Sequence[str], folder: Path, surroundings: str) -> None:
    """What the forked process does; it never returns."""
    status = 99
    try:
        os.setpgid(0, 0)
        os.chdir(folder)
        for stream, name, flags in (
            (0, os.devnull, os.O_RDONLY),
            (1, "stdout", os.O_WRONLY | os.O_CREAT | os.O_TRUNC),
            (2, "stderr", os.O_WRONLY | os.O_CREAT | os.O_TRUNC),
        ):
            handle = os.open(folder.parent / name if stream else name, flags, 0o600)
            os.dup2(handle, stream)
        sys.stdin, sys.stdout, sys.stderr = (os.fdopen(k, mode) for k, mode in enumerate("rww"))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        webbrowser.open = lambda *_: False
        os.environ.pop("CURLING_TRACEBACK", None)
        from curling_env.commands.cli import main

        if surroundings:
            surround(surroundings)
        words = [word.replace(HERE, str(folder)) for word in arguments]
        try:
            if words[0] == "read":
                status = read(words[1], Path(words[2]))
            else:
                if words[0] == "corners":
                    _mark_as_asked()
                status = main(words)
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 1
        except BaseException:
            import traceback

            traceback.print_exc()
            status = 1
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError, AttributeError):
                stream.flush()
    finally:
        os._exit(status)


def _mark_as_asked() -> None:
    """Let `curling corners` be answered by requests of the fuzzer instead of a browser."""
    import http.client
    from urllib.parse import urlsplit

    from friction_estimation.camera.annotation.server import AnnotationServer

    def wait(self: Any, timeout: float | None = None) -> None:
        at = urlsplit(self.url)
        asked = Path("q.json").read_bytes() if Path("q.json").exists() else b"{}"
        for path in ("", "film.json", "still/0", "solve", "save"):
            body = asked if path in ("solve", "save") else None
            line = http.client.HTTPConnection(str(at.hostname), at.port or 0, timeout=ANSWER)
            line.request("GET" if body is None else "POST", at.path + path, body)
            line.getresponse().read()
            line.close()
        raise SystemExit(0)

    AnnotationServer.wait = wait


def _await(child: int) -> tuple[int, int, float, bool]:
    """Status, peak memory and processor time of a child, and whether it had to be killed."""
    deadline, wait = time.monotonic() + PATIENCE * MAX_SECONDS, 0.002
    while True:
        done, status, usage = os.wait4(child, os.WNOHANG)
        if done:
            return _told(status, usage, hung=False)
        if time.monotonic() > deadline:
            os.killpg(child, signal.SIGKILL)
            _, status, usage = os.wait4(child, 0)
            return _told(status, usage, hung=True)
        time.sleep(wait)
        wait = min(wait * 1.5, 0.1)


def _told(status: int, usage: Any, *, hung: bool) -> tuple[int, int, float, bool]:
    worked = usage.ru_utime + usage.ru_stime
    return os.waitstatus_to_exitcode(status), usage.ru_maxrss * 1024, worked, hung


def _content(folder: Path) -> dict[str, str]:
    """Ordinary files below a folder by name, and what tells whether one has changed."""
    found = [p for p in sorted(folder.rglob("*")) if p.is_file() and not p.is_symlink()]
    return {str(path.relative_to(folder)): _digest(path) for path in found}


def _digest(path: Path) -> str:
    size = path.stat().st_size
    return (
        hashlib.sha256(path.read_bytes()).hexdigest() if size < LARGE else f"{size} bytes of zeros"
    )


@cache
def _loaded() -> int:
    """Memory of a forked process that does nothing [bytes]."""
    child = os.fork()
    if child == 0:
        os._exit(0)
    return os.wait4(child, 0)[2].ru_maxrss * 1024
