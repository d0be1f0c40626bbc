"""Files of about 10 MB, to every command that reads their kind: `python -m fuzz.large`.

Each is valid for as long as it can be, so that the limits of meaning are reached and not only those
of syntax. Printed: how each run ended, its processor time, and its memory beyond what is loaded.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from tqdm import tqdm

from fuzz.good_files import make_good_files
from fuzz.runs import run

SIZE = 10 * 2**20
"""About how large a file is made [bytes]."""

Good = Mapping[str, bytes]


def _repeated(line: bytes, size: int = SIZE) -> bytes:
    return line * (size // len(line) + 1)


def _json_list(item: Any) -> str:
    text = json.dumps(item)
    return f"[{', '.join([text] * (SIZE // (len(text) + 2)))}]"


def _with_list(document: Any, member: str, item: Any) -> bytes:
    """A JSON document with a member that is a long list of one item."""
    return json.dumps(document | {member: "@"}).replace('"@"', _json_list(item)).encode()


def _points(good: Good) -> bytes:
    scene = json.loads(good["s.json"])
    del scene["corners_px"]
    return _with_list(scene, "points", {"sheet": [0.5, 17.0], "px": [30.0, 20.0]})


def _allowed_points(good: Good) -> bytes:
    """As many marks as are read, spread over the picture."""
    spread = np.random.default_rng(0).uniform(-1, 1, (500, 2))
    points = [
        {"sheet": [2.2 * x, 22.0 * y], "px": [30 + (20 - 5 * y) * x, 60 - 50 * y]}
        for x, y in spread.tolist()
    ]
    return json.dumps({"points": points, "stone": {"radius": 0.145}}).encode()


def _scene_with_members(good: Good) -> bytes:
    notes = {f"note {k}": "of a hall" for k in range(SIZE // 26)}
    return json.dumps(json.loads(good["s.json"]) | notes).encode()


def _lens(good: Good) -> bytes:
    return _with_list(json.loads(good["cam.json"]), "distortion", 0.0)


def _stones(good: Good) -> bytes:
    return _json_list(json.loads(good["st.json"])[0]).encode()


def _passwords(good: Good) -> bytes:
    return json.dumps({f"user {k}": "keen ice" for k in range(SIZE // 26)}).encode()


def _game_of_many_shots(good: Good) -> bytes:
    """One end, played again and again: every line is as it should be by itself."""
    first, *shots, score = good["g.jsonl"].splitlines(keepends=True)
    return first + _repeated(b"".join(shots)) + score


def _game_of_a_long_line(good: Good) -> bytes:
    first, rest = good["g.jsonl"].split(b"\n", 1)
    noted = json.dumps(json.loads(first) | {"note": "x" * SIZE}).encode()
    return noted + b"\n" + rest


def _kinovea(good: Good) -> bytes:
    head = good["k.csv"].splitlines(keepends=True)[0]
    rows = (f'{33 * k},"{0.001 * (k % 999):.3f}","{1e-4 * k:.4f}"\n' for k in range(SIZE // 24))
    return head + "".join(rows).encode()


def _tracker(good: Good) -> bytes:
    rows = (f"{k / 30:.4f}\t{1e-4 * k:.4f}\t0.0\n" for k in range(SIZE // 22))
    return b"mass A\nt\tx\ty\n" + "".join(rows).encode()


def _many_marks(good: Good) -> bytes:
    """An export of thousands of objects, of which each is a column."""
    head = ",".join(["Time (ms)", *(f'"s/{k}/X","s/{k}/Y"' for k in range(SIZE // 36))])
    return f"{head}\n{','.join(['0'] * (head.count(',') + 1))}\n".encode()


def _notes(good: Good) -> bytes:
    head = good["throws.csv"].splitlines(keepends=True)[0]
    return head + b"".join(b"%d,Anna,1,draw,\n" % k for k in range(SIZE // 22))


def _yaml_list(good: Good) -> bytes:
    return good["c.yml"] + _repeated(b"more: [1, 2, 3]\n")


def _yaml_laughs(good: Good) -> bytes:
    aliases = "".join(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 12))
    return b"a0: &a0 [1, 1]\n" + aliases.encode() + good["c.yml"]


def _archive(members: Iterable[tuple[str, bytes]]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, content in members:
            archive.writestr(name, content)
    return packed.getvalue()


def _array(shape: tuple[int, ...]) -> bytes:
    content = io.BytesIO()
    np.lib.format.write_array(content, np.zeros(shape))
    return content.getvalue()


def _unpacking(good: Good) -> bytes:
    return _archive([("weights.npy", _array((75_000_000,)))])


def _many_members(good: Good) -> bytes:
    member = _array((4,))
    return _archive((f"a{k}.npy", member) for k in range(SIZE // 300))


def _picture(suffix: str, side: int) -> bytes:
    rng = np.random.default_rng(0)
    coarse = rng.integers(0, 255, (side // 40, side // 40, 3), dtype=np.uint8)
    picture = cv2.resize(coarse, (side, side), interpolation=cv2.INTER_NEAREST)
    return cv2.imencode(suffix, picture)[1].tobytes()


def _png(good: Good) -> bytes:
    return _picture(".png", 6000)


def _jpeg(good: Good) -> bytes:
    return _picture(".jpg", 6000)


def _tiff(good: Good) -> bytes:
    return _picture(".tiff", 6000)


def _marked_png(good: Good) -> bytes:
    """A small PNG with thousands of remarks before its picture."""
    import zlib

    text = b"tEXt" + b"note\0" + b"x" * 200
    chunk = (len(text) - 4).to_bytes(4, "big") + text + zlib.crc32(text).to_bytes(4, "big")
    small = good["e.png"]
    return small[:33] + _repeated(chunk) + small[33:]


def _film(size: tuple[int, int], frames: int) -> bytes:
    from friction_estimation.film.writer import film_writer

    rng = np.random.default_rng(0)
    coarse = rng.integers(0, 255, (size[1] // 40, size[0] // 40, 3), dtype=np.uint8)
    picture = cv2.resize(coarse, size, interpolation=cv2.INTER_NEAREST)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        with film_writer(path, size, 30.0, threads=1) as writer:
            for k in range(frames):
                writer.write(np.roll(picture, 8 * k, 0).astype(np.uint8))
        return path.read_bytes()


def _film_4k(good: Good) -> bytes:
    return _film((3840, 2160), 60)


def _film_of_many_frames(good: Good) -> bytes:
    return _film((64, 48), 20_000)


LARGE: list[tuple[str, Callable[[Good], bytes], str, str]] = [
    ("200,000 marks of a scene", _points, "s.json", "track f.mp4 --scene s.json -o o.csv"),
    ("", _points, "s.json", "stones n.png --empty e.png --scene s.json -o o.json"),
    ("", _points, "s.json", "discover t.csv --scene s.json -o found"),
    ("", _points, "s.json", "corners e.png --no-browser --start s.json -o o.json"),
    ("", _points, "s.json", "live file://{here}/f.mp4 --scene s.json --throws 1 -o o.csv"),
    (
        "",
        _points,
        "s.json",
        "join-cameras f.mp4 g.mp4 --scene s.json --scene s.json -o o.csv",
    ),
    ("500 marks of a scene", _allowed_points, "s.json", "read scene s.json"),
    ("", _allowed_points, "s.json", "stones n.png --empty e.png --scene s.json -o o.json"),
    (
        "a scene of 400,000 members",
        _scene_with_members,
        "s.json",
        "track f.mp4 --scene s.json -o o.csv",
    ),
    ("a lens of 2 million terms", _lens, "cam.json", "read lens cam.json"),
    ("", _lens, "cam.json", "track f.mp4 --scene hall.json --camera cam.json -o o.csv"),
    ("300,000 stones", _stones, "st.json", "plan --ice standard --target 0,17 --stones st.json"),
    ("a game of thousands of shots", _game_of_many_shots, "g.jsonl", "replay g.jsonl -o o.html"),
    ("", _game_of_many_shots, "g.jsonl", "replay g.jsonl --end 1 --speed 100 -o o.mp4"),
    ("a game with a note of 10 MB", _game_of_a_long_line, "g.jsonl", "replay g.jsonl -o o.html"),
    ("an export of 400,000 rows", _kinovea, "k.csv", "convert k.csv -o o.csv"),
    ("the same of another program", _tracker, "k.txt", "convert k.txt -o o.csv"),
    ("an export of 300,000 objects", _many_marks, "k.csv", "convert k.csv -o o.csv"),
    ("500,000 notes", _notes, "throws.csv", "throws t.csv"),
    ("", _notes, "throws.csv", "compare t.csv --ice ice.json"),
    ("YAML of a long list", _yaml_list, "c.yml", "train --config c.yml -o runs"),
    ("YAML that multiplies itself", _yaml_laughs, "c.yml", "train --config c.yml -o runs"),
    (
        "an archive that unpacks to 600 MB",
        _unpacking,
        "net.npz",
        "play --home net.npz --away draw --ends 1",
    ),
    ("", _unpacking, "net.npz", "train --resume net.npz -o runs"),
    ("", _unpacking, "e.evidence.npz", "estimate t.csv --update e.json -o e.json"),
    (
        "an archive of 35,000 arrays",
        _many_members,
        "net.npz",
        "play --home net.npz --away draw --ends 1",
    ),
    ("", _many_members, "net.npz", "train --resume net.npz -o runs"),
    ("", _many_members, "e.evidence.npz", "estimate t.csv --update e.json -o e.json"),
    ("passwords of 400,000 users", _passwords, "p.json", "read passwords p.json"),
    (
        "a PNG of 36 million pixels",
        _png,
        "n.png",
        "stones n.png --empty n.png --scene s.json",
    ),
    (
        "",
        _png,
        "n.png",
        "locate n.png --mark away_tee=9,9 --mark away_hog_centre=9,90",
    ),
    ("", _png, "n.png", "corners n.png --no-browser -o o.json"),
    ("a JPEG of as many", _jpeg, "n.png", "stones n.png --empty n.png --scene s.json"),
    ("a TIFF of as many", _tiff, "n.png", "stones n.png --empty n.png --scene s.json"),
    (
        "a PNG of 50,000 remarks",
        _marked_png,
        "n.png",
        "stones n.png --empty n.png --scene s.json",
    ),
    ("a film in 4K", _film_4k, "f.mp4", "corners f.mp4 --no-browser -o o.json"),
    ("", _film_4k, "f.mp4", "live file://{here}/f.mp4 --scene hall.json --throws 1 -o o.csv"),
    (
        "",
        _film_4k,
        "f.mp4",
        "join-cameras f.mp4 g.mp4 --scene hall.json --scene hall.json -o o.csv",
    ),
    (
        "a film of 20,000 frames",
        _film_of_many_frames,
        "f.mp4",
        "track f.mp4 --scene hall.json -o o.csv",
    ),
    ("", _film_of_many_frames, "f.mp4", "corners f.mp4 --no-browser -o o.json"),
    (
        "",
        _film_of_many_frames,
        "f.mp4",
        "live file://{here}/f.mp4 --scene hall.json --throws 1 -o o.csv",
    ),
]
"""What is large, how it is made, the file it stands for, and the command. No name: as before."""


def main() -> int:
    options = argparse.ArgumentParser(prog="fuzz.large", description=__doc__)
    options.add_argument("--only", default="", help="part of a command line")
    options.add_argument("--light", action="store_true", help="without estimates and models")
    chosen = options.parse_args()
    os.environ.pop("CURLING_TRACEBACK", None)
    tqdm.monitor_interval = 0
    cv2.setNumThreads(1)
    place = Path(tempfile.mkdtemp(prefix="curling-large-"))
    unclean = 0
    try:
        (place / "good").mkdir()
        good = make_good_files(place / "good", light=chosen.light)
        name, made, by = "", b"", None
        for told, maker, file, line in LARGE:
            name = told or name
            if chosen.only not in line:
                continue
            if maker is not by:
                made, by = maker(good), maker
            folder = place / "run"
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            for other, content in good.items():
                (folder / other).write_bytes(content)
            (folder / file).write_bytes(made)
            ended = run(line.split(), folder)
            unclean += bool(ended.faults)
            said = " ".join(ended.said.split())[-110:]
            print(
                f"{name:34} {len(made) / 2**20:5.1f} MB  {line.split()[0]:12} "
                f"status {ended.status}  {ended.memory / 2**30:5.2f} GB  {ended.worked:5.1f} s  "
                f"{', '.join(ended.faults) or 'clean'}  {said}",
                flush=True,
            )
    finally:
        shutil.rmtree(place, ignore_errors=True)
    print(f"{unclean} unclean", file=sys.stderr)
    return 1 if unclean else 0


if __name__ == "__main__":
    raise SystemExit(main())
