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


def points(good: Good) -> bytes:
    scene = json.loads(good["s.json"])
    del scene["corners_px"]
    return _with_list(scene, "points", {"sheet": [0.5, 17.0], "px": [30.0, 20.0]})


def allowed_points(good: Good) -> bytes:
    """As many marks as are read, spread over the picture."""
    spread = np.random.default_rng(0).uniform(-1, 1, (500, 2))
    points = [
        {"sheet": [2.2 * x, 22.0 * y], "px": [30 + (20 - 5 * y) * x, 60 - 50 * y]}
        for x, y in spread.tolist()
    ]
    return json.dumps({"points": points, "stone": {"radius": 0.145}}).encode()


def scene_with_members(good: Good) -> bytes:
    notes = {f"note {k}": "of a hall" for k in range(SIZE // 26)}
    return json.dumps(json.loads(good["s.json"]) | notes).encode()


def lens(good: Good) -> bytes:
    return _with_list(json.loads(good["cam.json"]), "distortion", 0.0)


def stones(good: Good) -> bytes:
    return _json_list(json.loads(good["st.json"])[0]).encode()


def passwords(good: Good) -> bytes:
    return json.dumps({f"user {k}": "keen ice" for k in range(SIZE // 26)}).encode()


def game_of_many_shots(good: Good) -> bytes:
    """One end, played again and again: every line is as it should be by itself."""
    first, *shots, score = good["g.jsonl"].splitlines(keepends=True)
    return first + _repeated(b"".join(shots)) + score


def game_of_a_long_line(good: Good) -> bytes:
    first, rest = good["g.jsonl"].split(b"\n", 1)
    noted = json.dumps(json.loads(first) | {"note": "x" * SIZE}).encode()
    return noted + b"\n" + rest


def kinovea(good: Good) -> bytes:
    head = good["k.csv"].splitlines(keepends=True)[0]
    rows = (f'{33 * k},"{0.001 * (k % 999):.3f}","{1e-4 * k:.4f}"\n' for k in range(SIZE // 24))
    return head + "".join(rows).encode()


def tracker(good: Good) -> bytes:
    rows = (f"{k / 30:.4f}\t{1e-4 * k:.4f}\t0.0\n" for k in range(SIZE // 22))
    return b"mass A\nt\tx\ty\n" + "".join(rows).encode()


def many_marks(good: Good) -> bytes:
    """An export of thousands of objects, of which each is a column."""
    head = ",".join(["Time (ms)", *(f'"s/{k}/X","s/{k}/Y"' for k in range(SIZE // 36))])
    return f"{head}\n{','.join(['0'] * (head.count(',') + 1))}\n".encode()


def notes(good: Good) -> bytes:
    head = good["throws.csv"].splitlines(keepends=True)[0]
    return head + b"".join(b"%d,Anna,1,draw,\n" % k for k in range(SIZE // 22))


def yaml_list(good: Good) -> bytes:
    return good["c.yml"] + _repeated(b"more: [1, 2, 3]\n")


def yaml_laughs(good: Good) -> bytes:
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


def unpacking(good: Good) -> bytes:
    return _archive([("weights.npy", _array((75_000_000,)))])


def many_members(good: Good) -> bytes:
    member = _array((4,))
    return _archive((f"a{k}.npy", member) for k in range(SIZE // 300))


def _picture(suffix: str, side: int) -> bytes:
    rng = np.random.default_rng(0)
    coarse = rng.integers(0, 255, (side // 40, side // 40, 3), dtype=np.uint8)
    picture = cv2.resize(coarse, (side, side), interpolation=cv2.INTER_NEAREST)
    return cv2.imencode(suffix, picture)[1].tobytes()


def png(good: Good) -> bytes:
    return _picture(".png", 6000)


def jpeg(good: Good) -> bytes:
    return _picture(".jpg", 6000)


def tiff(good: Good) -> bytes:
    return _picture(".tiff", 6000)


def marked_png(good: Good) -> bytes:
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


def film_4k(good: Good) -> bytes:
    return _film((3840, 2160), 60)


def film_of_many_frames(good: Good) -> bytes:
    return _film((64, 48), 20_000)


MAKERS: dict[str, Callable[[Good], bytes]] = {
    maker.__name__: maker
    for maker in (
        points, allowed_points, scene_with_members, lens, stones, game_of_many_shots,
        game_of_a_long_line, kinovea, tracker, many_marks, notes, yaml_list, yaml_laughs,
        unpacking, many_members, passwords, png, jpeg, tiff, marked_png, film_4k,
        film_of_many_frames,
    )
}  # fmt: skip
LARGE = """
# 200,000 marks of a scene
points              s.json         track f.mp4 --scene s.json -o o.csv
points              s.json         stones n.png --empty e.png --scene s.json -o o.json
points              s.json         discover t.csv --scene s.json -o found
points              s.json         corners e.png --no-browser --start s.json -o o.json
points              s.json         live file://{here}/f.mp4 --scene s.json --throws 1 -o o.csv
points              s.json         join-cameras f.mp4 g.mp4 --scene s.json --scene s.json -o o.csv
# 500 marks of a scene
allowed_points      s.json         read scene s.json
allowed_points      s.json         stones n.png --empty e.png --scene s.json -o o.json
# a scene of 400,000 members
scene_with_members  s.json         track f.mp4 --scene s.json -o o.csv
# a lens of 2 million terms
lens                cam.json       read lens cam.json
lens                cam.json       track f.mp4 --scene hall.json --camera cam.json -o o.csv
# 300,000 stones
stones              st.json        plan --ice standard --target 0,17 --stones st.json
# a game of thousands of shots
game_of_many_shots  g.jsonl        replay g.jsonl -o o.html
game_of_many_shots  g.jsonl        replay g.jsonl --end 1 --speed 100 -o o.mp4
# a game with a note of 10 MB
game_of_a_long_line g.jsonl        replay g.jsonl -o o.html
# an export of 400,000 rows
kinovea             k.csv          convert k.csv -o o.csv
# the same of another program
tracker             k.txt          convert k.txt -o o.csv
# an export of 300,000 objects
many_marks          k.csv          convert k.csv -o o.csv
# 500,000 notes
notes               throws.csv     throws t.csv
notes               throws.csv     compare t.csv --ice ice.json
# YAML of a long list
yaml_list           c.yml          train --config c.yml -o runs
# YAML that multiplies itself
yaml_laughs         c.yml          train --config c.yml -o runs
# an archive that unpacks to 600 MB
unpacking           net.npz        play --home net.npz --away draw --ends 1
unpacking           net.npz        train --resume net.npz -o runs
unpacking           e.evidence.npz estimate t.csv --update e.json -o e.json
# an archive of 35,000 arrays
many_members        net.npz        play --home net.npz --away draw --ends 1
many_members        net.npz        train --resume net.npz -o runs
many_members        e.evidence.npz estimate t.csv --update e.json -o e.json
# passwords of 400,000 users
passwords           p.json         read passwords p.json
# a PNG of 36 million pixels
png                 n.png          stones n.png --empty n.png --scene s.json
png                 n.png          locate n.png --mark away_tee=9,9 --mark away_hog_centre=9,90
png                 n.png          corners n.png --no-browser -o o.json
# a JPEG of as many
jpeg                n.png          stones n.png --empty n.png --scene s.json
# a TIFF of as many
tiff                n.png          stones n.png --empty n.png --scene s.json
# a PNG of 50,000 remarks
marked_png          n.png          stones n.png --empty n.png --scene s.json
# a film in 4K
film_4k             f.mp4          corners f.mp4 --no-browser -o o.json
film_4k             f.mp4          live file://{here}/f.mp4 --scene hall.json --throws 1 -o o.csv
film_4k             f.mp4          join-cameras f.mp4 g.mp4 --scene hall.json --scene hall.json
# a film of 20,000 frames
film_of_many_frames f.mp4          track f.mp4 --scene hall.json -o o.csv
film_of_many_frames f.mp4          corners f.mp4 --no-browser -o o.json
film_of_many_frames f.mp4          live file://{here}/f.mp4 --scene hall.json --throws 1 -o o.csv
"""
"""How a file is made, which it stands for, and the command; before that, what is large about it."""


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
        name, made, by = "", b"", ""
        for row in LARGE.split("\n"):
            if row.startswith("# "):
                name = row[2:]
            if row[:1] in ("", "#") or chosen.only not in row:
                continue
            maker, file, line = row.split(None, 2)
            if maker != by:
                made, by = MAKERS[maker](good), maker
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
