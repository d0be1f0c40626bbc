"""Faults from outside: a full disk, a killed process, a home that cannot be written.

`make faults` tries them on every command that writes, and prints how often a file was lost or left
half-written. A full disk is a small tmpfs where that may be mounted, and else a limit on the size
of files.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import Any

from fuzz.good_files import make_good_files
from processes import end_orderly_when_told, end_with

CURLING = [sys.executable, "-m", "curling"]
COMMANDS: tuple[Sequence[str], ...] = (
    ("simulate", "--ice", "standard", "--releases", "r.csv", "-o", "o.csv"),
    ("sweep", "--releases", "r.csv", "--skill", "club", "--seeds", "200", "-o", "o.csv"),
    ("sweep", "--releases", "r.csv", "--skill", "club", "--seeds", "200", "--workers", "2",
     "-o", "o.csv"),
    ("estimate", "t.csv", "--uniform", "--effects", "none", "-o", "o.json", "--report", "report"),
    ("estimate", "t.csv", "--update", "e.json", "-o", "e.json"),
    ("compare", "t.csv", "--ice", "ice.json", "-o", "found"),
    ("athletes", "t.csv", "--ice", "ice.json", "-o", "found"),
    ("match-stones", "t.csv", "--ice", "ice.json", "-o", "o.json"),
    ("replay", "g.jsonl", "--speed", "60", "-o", "o.mp4"),
    ("replay", "g.jsonl", "-o", "o.html"),
    ("play", "--home", "draw", "--away", "draw", "--ends", "1", "-o", "game"),
    ("train", "--config", "c.yml", "--steps", "64", "--targets", "1", "-o", "runs"),
    ("film", "--ice", "standard", "--releases", "r.csv", "--fps", "3", "--size", "64x48", "-o",
     "films"),
    ("convert", "t.csv", "-o", "o.csv"),
    ("donate", "t.csv", "--scene", "s.json", "--consent", "All who threw agree to this.",
     "-o", "o.json"),
)  # fmt: skip


def main() -> int:
    options = argparse.ArgumentParser(prog="faults", description=__doc__)
    options.add_argument("--kills", type=int, default=3, help="of each command")
    options.add_argument("--sizes", type=int, default=3, help="full disks for each command")
    options.add_argument("--seed", type=int, default=0)
    chosen = options.parse_args()
    end_orderly_when_told()
    found = try_faults(chosen.kills, chosen.sizes, random.Random(chosen.seed))
    print(json.dumps(found, indent=2))
    return 1 if found["unclean"] else 0


def try_faults(kills: int, sizes: int, rng: random.Random) -> dict[str, Any]:
    """Try every fault on every command.

    Parameters
    ----------
    kills, sizes : how many kills at random times, and how many sizes of the disk, for each command
    rng : for times and sizes

    Returns
    -------
    counts, and what was unclean
    """
    unclean: list[str] = []
    counts = {"kills": 0, "full disks": 0, "homes that cannot be written": 0}
    with tempfile.TemporaryDirectory(prefix="curling-faults-") as place:
        good = Path(place) / "good"
        good.mkdir()
        files = {
            name: content
            for name, content in make_good_files(good).items()
            if not name.startswith("f.mp4.")
        }
        for words in COMMANDS:
            print(f"{len(unclean)} unclean; next: {' '.join(words)}", file=sys.stderr, flush=True)
            for _ in range(kills):
                counts["kills"] += 1
                unclean += _killed(words, files, Path(place), rng)
            for _ in range(sizes):
                counts["full disks"] += 1
                unclean += _full(words, files, Path(place), rng)
            counts["homes that cannot be written"] += 1
            unclean += _without_home(words, files, Path(place))
    return {**counts, "unclean": unclean}


def _killed(
    words: Sequence[str], files: dict[str, bytes], place: Path, rng: random.Random
) -> list[str]:
    """Kill a command and repeat it: the inputs stand, and it ends as if nothing had happened."""
    folder = _fresh(place / "kill", files)
    process = _start(words, folder)
    time.sleep(rng.uniform(0.5, 6.0))
    with contextlib.suppress(ProcessLookupError):
        os.kill(process.pid, signal.SIGKILL)
    process.wait()
    faults = [] if _ends(process) else ["a worker did not end"]
    # An update may have happened or not; then it happens, or its throws count once.
    faults += _lost(words, folder, files)
    again = _run(words, folder)
    if again.returncode != 0:
        faults.append(f"cannot be repeated: {again.stderr[-200:]}")
    faults += [f"left {name}" for name in _drafts(folder)]
    return [f"killed {' '.join(words)}: {fault}" for fault in faults]


def _full(
    words: Sequence[str], files: dict[str, bytes], place: Path, rng: random.Random
) -> list[str]:
    """Run a command on a disk with little room: it succeeds, or refuses and leaves nothing."""
    faults: list[str] = []
    room = int(2 ** rng.uniform(10, 18))
    with _small_disk(place / "small", sum(map(len, files.values())) + 2**17 + room) as limit:
        folder = _fresh(place / "small" / "run", files)
        if limit is None:  # what the files themselves left is taken up to the room
            _fill(folder.parent / "ballast", room)
        before = _content(folder)
        done = _run(words, folder, limit if limit is None else room)
        after = _content(folder)
        if done.returncode not in (0, 2):
            faults.append(f"status {done.returncode}: {done.stderr[-200:]}")
        if done.returncode == 2:
            faults += [f"changed {name}" for name in before if after.get(name) != before[name]]
            kept = [n for n in set(after) - set(before) if not n.startswith(("films", "runs"))]
            faults += [f"left {name}" for name in kept]
            if len(done.stderr.strip().splitlines()) != 1:
                faults.append(f"said {done.stderr[-300:]!r}")
        faults += _unreadable(folder, set(after) - set(before))
    return [f"{room} bytes for {' '.join(words)}: {fault}" for fault in faults]


def _without_home(words: Sequence[str], files: dict[str, bytes], place: Path) -> list[str]:
    folder = _fresh(place / "home", files)
    environment = {"HOME": "/nonexistent", "XDG_CACHE_HOME": "", "MPLCONFIGDIR": "/nonexistent"}
    quick = [w for w in words if w != "200"] if "--seeds" not in words else list(words)
    done = _run(quick, folder, environment=environment)
    if done.returncode == 0:
        return []
    return [f"without a home {' '.join(words)}: {done.stderr[-200:]}"]


def _fresh(folder: Path, files: dict[str, bytes]) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return folder


def _start(
    words: Sequence[str], folder: Path, limit: int | None = None, **environment: str
) -> subprocess.Popen[str]:
    parent = os.getpid()

    def confine() -> None:
        end_with(parent)
        if limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    return subprocess.Popen(
        [*CURLING, *words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={k: v for k, v in {**os.environ, **environment}.items() if k != "CURLING_TRACEBACK"},
        preexec_fn=confine,
    )


def _run(
    words: Sequence[str],
    folder: Path,
    limit: int | None = None,
    environment: dict[str, str] | None = None,
) -> subprocess.CompletedProcess[str]:
    process = _start(words, folder, limit, **(environment or {}))
    try:
        out, err = process.communicate(timeout=300)
    except subprocess.TimeoutExpired:
        process.kill()
        out, err = process.communicate()
        return subprocess.CompletedProcess(words, 124, out, err)
    return subprocess.CompletedProcess(words, process.returncode, out, err)


def _ends(process: subprocess.Popen[str]) -> bool:
    """Whether the pipes of a killed command close, so that whoever reads them can go on."""
    try:
        process.communicate(timeout=20)
    except subprocess.TimeoutExpired:
        return False
    return True


def _content(folder: Path) -> dict[str, str]:
    return {
        str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in folder.rglob("*")
        if p.is_file()
    }


def _lost(words: Sequence[str], folder: Path, files: dict[str, bytes]) -> list[str]:
    after = _content(folder)
    updated = {"e.json", "e.evidence.npz"} if "--update" in words else set[str]()
    return [
        f"changed {name}"
        for name, content in files.items()
        if name not in updated and after.get(name) != hashlib.sha256(content).hexdigest()
    ]


def _drafts(folder: Path) -> list[str]:
    return [p.name for p in folder.rglob(".*~*") if p.is_file()]


def _unreadable(folder: Path, names: set[str]) -> list[str]:
    """Results that no reader accepts."""
    from curling_env.infrastructure.files.reading import read_arrays, read_json, read_text
    from friction_estimation.film.video import Film

    readers: dict[str, Callable[[Path], object]] = {
        ".json": read_json,
        ".csv": read_text,
        ".npz": read_arrays,
        ".mp4": Film.open,
    }
    faults: list[str] = []
    for name in sorted(names):
        path = folder / name
        if path.suffix in readers:
            try:
                readers[path.suffix](path)
            except Exception as error:
                faults.append(f"unreadable {name}: {error}")
    return faults


@contextlib.contextmanager
def _small_disk(place: Path, size: int) -> Generator[int | None]:
    """A disk of a size; yields None where it is one, and else the limit that stands for it."""
    place.mkdir(parents=True, exist_ok=True)
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={size + 2**16}", "tmpfs", str(place)],
        capture_output=True,
        check=False,
    )
    try:
        yield None if mounted.returncode == 0 else size
    finally:
        if mounted.returncode == 0:
            subprocess.run(["umount", "-l", str(place)], capture_output=True, check=False)


def _fill(ballast: Path, room: int) -> None:
    """Fill a disk up to the room that is left."""
    free = shutil.disk_usage(ballast.parent).free
    with contextlib.suppress(OSError), ballast.open("wb") as file:
        file.write(bytes(max(0, free - room)))


if __name__ == "__main__":
    raise SystemExit(main())
