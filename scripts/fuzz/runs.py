"""One run of `curling` in a separate process, and the verdict on its end.

The process is forked from one that has loaded and compiled everything, so that a run takes
milliseconds and a hanging or crashing one does no harm.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import resource
import signal
import sys
import time
import traceback
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from fuzz.surroundings import SURROUNDINGS

PR_SET_PDEATHSIG = 1
"""Number of the option of Linux's prctl(2)."""
MAX_SECONDS = 20.0
"""Maximum processor time of a run [s]."""
PATIENCE = 6.0
"""Maximum wall time, as a multiple of the processor time, because a machine may be busy."""
ANSWER = 60.0
"""Timeout of the local server's answer on a busy machine [s]."""
MAX_BYTES = 2**30
"""Maximum memory of a run above that at its start [bytes]."""
MAX_LINE = 300
KEPT = (".unfinished/",)
"""Unnamed files that a command keeps of the films before the one that it refused."""
LARGE = 2**30
"""Size from which files are sparse, without disk space for their zeros [bytes]."""
UNHEARD = ("all streams closed", "stdout piped away", "stdout on a full disk")
"""Environments in which an error, or the result, cannot be printed."""
HERE = "{here}"
"""Placeholder in arguments for the folder of the run."""
Given = Mapping[str, Callable[[Path], object]]
"""Python functions by name, which get the file instead of a command."""


@dataclass(frozen=True, kw_only=True)
class Ended:
    """End of a run.

    Parameters
    ----------
    faults : reasons why it is unclean; empty for a clean end
    status : exit status; negative for a signal
    stderr : its output on stderr
    seconds : time on the clock [s]
    memory : largest resident memory beyond that of the process it was forked from [bytes]
    """

    faults: tuple[str, ...]
    status: int
    stderr: str
    seconds: float
    memory: int


def run(
    arguments: Sequence[str],
    folder: Path,
    surroundings: str = "",
    variables: Mapping[str, str] | None = None,
    given: Given | None = None,
    *,
    kill: float | None = None,
    room: int | None = None,
) -> Ended:
    """Run `curling` in a folder and judge its end.

    Parameters
    ----------
    arguments : words after `curling`; after ``read``, the name of a function and its file
    folder : the current folder of the run, with its inputs; other files are results
    surroundings : one of `SURROUNDINGS`; empty for the usual ones
    variables : environment variables of a Python that is started again; None for a fork
    given : the functions for ``read``
    kill : time after which the process is killed, though not its workers [s]
    room : largest file that it may write, in place of a full disk [bytes]
    """
    before = _content(folder)
    loaded = _loaded() if variables is None else 0
    begun = time.monotonic()
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        _end_with(parent)
        if room is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))
        _be_curling(arguments, folder, surroundings, variables, given or {})
    status, memory, worked, hung = _await(child, kill)
    seconds = time.monotonic() - begun
    stderr = (folder.parent / "stderr").read_text(errors="replace")
    memory = max(0, memory - loaded)
    after = _content(folder)
    faults: list[str] = []
    if kill is not None and status == -signal.SIGKILL:
        faults += [] if _ends(child) else ["a worker did not end"]
        status, after = 0, {name: content for name, content in after.items() if "~" not in name}
    if hung or worked > MAX_SECONDS:
        faults.append("too long")
    if status not in (0, 2) and not hung:
        faults.append(f"status {status}")
    if "Traceback" in stderr or "internal error" in stderr:
        faults.append("traceback")
    if status == 2 and surroundings not in UNHEARD:
        lines = stderr.splitlines()
        if len(lines) != 1 or not stderr.startswith("curling: "):
            faults.append(f"{len(lines)} lines")
        if any(len(line) > MAX_LINE for line in lines):
            faults.append("long line")
        new = sorted(set(after) - set(before))
        kept = KEPT if room is None else (*KEPT, "films/", "runs/", "found/")
        left = [name for name in new if name not in stderr and not any(k in name for k in kept)]
        if left:
            faults.append(f"left {left[:3]}")
    lost = [name for name, content in before.items() if after.get(name) != content]
    # An update replaces its own input on purpose; if it cannot print the result, it names the file.
    updated = stderr.partition("already written:")[2]
    lost = [name for name in lost if name not in after or name not in updated]
    if lost and (status != 0 or "-o" not in arguments):
        faults.append(f"lost {lost[:3]}")
    if any("~" in name for name in after) and not hung:
        faults.append("draft left")
    if memory > MAX_BYTES:
        faults.append(f"{memory / 2**20:.0f} MB")
    return Ended(faults=tuple(faults), status=status, stderr=stderr, seconds=seconds, memory=memory)


def _end_with(parent: int) -> None:
    """Let Linux kill this process when its parent ends for any reason."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def _be_curling(
    arguments: Sequence[str],
    folder: Path,
    surroundings: str,
    variables: Mapping[str, str] | None,
    given: Given,
) -> None:
    """Run as the command; never returns."""
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
        os.environ.pop("CURLING_TRACEBACK", None)
        words = [word.replace(HERE, str(folder)) for word in arguments]
        if variables is not None:
            os.environ.update(variables)
            os.execv(sys.executable, [sys.executable, "-m", "curling", *words])
        SURROUNDINGS.get(surroundings, lambda: None)()
        status = _called(words, given)
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError, AttributeError):
                stream.flush()
    finally:
        os._exit(status)


def _called(words: Sequence[str], given: Given) -> int:
    """Call the command or the function; return a status."""
    from curling_env.commands.cli import main
    from curling_env.errors import CurlingError
    from curling_env.infrastructure.streams import silenced_libraries

    webbrowser.open = lambda *_: False
    try:
        if words[0] != "read":
            if words[0] == "corners":
                _mark_as_asked()
            return main(list(words))
        with silenced_libraries():  # libpng prints its own remarks; a program may let it or not
            given[words[1]](Path(words[2]))
    except CurlingError as error:
        print("curling:", str(error)[:290], file=sys.stderr)
        return 2
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 1
    except BaseException:
        traceback.print_exc()
        return 1
    return 0


def _mark_as_asked() -> None:
    """Replace the browser of `curling corners` by requests of the fuzzer."""
    import http.client
    from urllib.parse import urlsplit

    from friction_estimation.camera.annotation.server import AnnotationServer

    def wait(self: Any, timeout: float | None = None) -> None:
        at = urlsplit(self.url)
        asked = Path("q.json").read_bytes() if Path("q.json").is_file() else b"{}"
        for path in ("", "film.json", "still/0", "solve", "save"):
            body = asked if path in ("solve", "save") else None
            line = http.client.HTTPConnection(str(at.hostname), at.port or 0, timeout=ANSWER)
            with suppress(ConnectionError):  # a body that is too large is refused before its end
                line.request("GET" if body is None else "POST", at.path + path, body)
                line.getresponse().read()
            line.close()
        raise SystemExit(0)

    AnnotationServer.wait = wait


def _await(child: int, kill: float | None) -> tuple[int, int, float, bool]:
    """Return status, peak memory and processor time of a child, and true if it was killed."""
    begun, wait, hung = time.monotonic(), 0.001, False
    deadline = begun + PATIENCE * MAX_SECONDS
    while True:
        done, status, usage = os.wait4(child, 0 if hung else os.WNOHANG)
        if done:
            worked = usage.ru_utime + usage.ru_stime
            return os.waitstatus_to_exitcode(status), usage.ru_maxrss * 1024, worked, hung
        if kill is not None and time.monotonic() > begun + kill:
            os.kill(child, signal.SIGKILL)
            kill = None
        if time.monotonic() > deadline:
            os.killpg(child, signal.SIGKILL)
            hung = True
        time.sleep(wait)
        wait = min(wait * 1.2, 0.05)


def _ends(group: int) -> bool:
    """Return whether the processes of a group end after their first was killed."""
    deadline = time.monotonic() + MAX_SECONDS
    while time.monotonic() < deadline:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.02)
    return False


def _content(folder: Path) -> dict[str, str]:
    """Return the digest of each ordinary file below a folder, by name."""
    found = [p for p in sorted(folder.rglob("*")) if p.is_file() and not p.is_symlink()]
    return {str(path.relative_to(folder)): _digest(path) for path in found}


def _digest(path: Path) -> str:
    size = path.stat().st_size
    return (
        hashlib.sha256(path.read_bytes()).hexdigest() if size < LARGE else f"{size} bytes of zeros"
    )


@cache
def _loaded() -> int:
    """Return the memory of a forked process that does nothing [bytes]."""
    child = os.fork()
    if child == 0:
        os._exit(0)
    return os.wait4(child, 0)[2].ru_maxrss * 1024
