"""A practice filmed in one go: rendered, tracked, and held against what was really thrown.

python scripts/practice_film.py -o runs/practice                    an hour from the gantry
python scripts/practice_film.py -o runs/jumps --minutes 3 --between nothing --camera side

Four throws with a thrower, a skip and up to two sweepers at work, and scenes in which people cross,
walk along, clean a house, or slide, push and carry a stone, are rendered once by the renderer of
`other_films.py`. Joined in random order, one throw a minute, they are the film; the picture jumps
from one to the next. After a throw its stone is pushed back, pushed aside, or left for a while.
With `--between nothing` throws follow each other at once, from 0.6 s before the release.

`curling track` then tracks the film with the scene that a user would have. The last lines say how
many throws were found, tracked to their rest, cut in two, joined or invented, how far the tracks
are off, and the processor time. What is in the folder already is kept: the film, and the tracks.
"""

from __future__ import annotations

import csv
import json
import os
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import av
import cv2
import numpy as np
import other_people
import typer
from numpy.typing import NDArray
from other_films import MIXED, coding, opened, path_of
from other_people import Part, walker
from other_rink import Rink, draw_stone, rink_of
from other_views import PLACES

from curling_env.trajectory import Trajectory, read_tracks

Array = NDArray[np.floating[Any]]
Shown = tuple[list[Part], Array | None]
"""What a frame shows: people, and the stone's x, y and heading where there is one."""

KINDS = 4
"""Throws that are rendered; each is shown again and again."""
LEAD, REST = 2.6, 2.0
"""What is filmed before the release and after the stone rests [s]."""
QUICK_LEAD, QUICK_REST = 0.6, 1.0
"""The same where throws follow each other at once."""
EDGE, FAR = 2.6, 19.5
"""Where a stone is pushed over the edge, and how far from the middle it is pushed back [m]."""
OVERLAP = 4.0
"""A track that shows so much of a throw is that throw's [s]."""
ENDINGS = ("mp4", "scene.json", "truth.json")
NEAR_REST = 0.5
"""A track that ends no earlier before the stone rests reaches its rest [s]."""


# --- what is filmed -----------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Clip:
    """A part of the film.

    Parameters
    ----------
    shown : what is seen at a time since it begins [s]
    released, rests : when its stone is let go and when it rests, since it begins [s]; None where
        nothing is thrown
    """

    name: str
    frames: int
    shown: Callable[[float], Shown]
    released: float | None = None
    rests: float | None = None


def throw_clip(rink: Rink, k: int, fps: int, *, quick: bool) -> Clip:
    """One of the throws, and what becomes of its stone."""
    way = 1 if k % 2 == 0 else -1
    path = path_of(rink.mu, np.random.default_rng([*rink.key, 3 + k]), way)
    sides = MIXED[k % len(MIXED)]
    people = other_people.People(sides, path, way, np.random.default_rng([*rink.key, k, 1]))
    t, rows = path
    lead, rest = (QUICK_LEAD, QUICK_REST) if quick else (LEAD, REST)
    lasts = float(t[-1])
    pushed = (rows[1] - rows[0]) / (t[1] - t[0])
    x, y, turn = rows[-1].tolist()
    cleared, clear = (0.0, lambda now: ([], None)) if quick else clearing(x, y, turn, way, k)

    def shown(now: float) -> Shown:
        since = now - lead
        if since > lasts + rest:
            return clear(since - lasts - rest)
        stone = np.array([np.interp(since, t, row) for row in rows.T])
        stone += min(since, 0.0) * pushed
        return people.parts(since, stone), stone

    return Clip(name=f"throw{k}-{sides}", frames=round((lead + lasts + rest + cleared) * fps),
                shown=shown, released=lead, rests=lead + lasts)  # fmt: skip


def clearing(
    x: float, y: float, turn: float, way: int, k: int
) -> tuple[float, Callable[[float], Shown]]:
    """How a stone is cleared from where it rests: how long that takes [s], and what is seen."""
    if k % 3 == 0:  # pushed back with the foot
        lasts = (FAR + abs(y)) / 1.3

        def shown(t: float) -> Shown:
            there = y - way * 1.3 * t
            return walker(x + 0.2, there + 0.5 * way, -way, t, k, broom=False), stone_at(x, there)
    elif k % 3 == 1:  # pushed aside with the broom
        lasts = (EDGE - x) / 0.8

        def shown(t: float) -> Shown:
            return walker(x + 0.8 * t - 0.5, y - 0.7, 1, t, k), stone_at(x + 0.8 * t, y)
    else:  # left for a while
        lasts = 5.0

        def shown(t: float) -> Shown:
            return [], stone_at(x, y)

    def stone_at(x: float, y: float) -> Array:
        return np.array([x, y, turn])

    return lasts, shown


def scenes(fps: int) -> list[Clip]:
    """What is seen between throws."""

    def way_along(t: float, pace: float) -> float:
        return pace * t + 0.04 * float(np.sin(2 * np.pi * 1.9 * t))

    def pair(t: float) -> Shown:
        y = -19 + way_along(t, 1.45)
        return walker(-1.0, y, 1, t, 0) + walker(-0.2, y - 0.6, 1, t + 0.3, 1), None

    def stops(t: float) -> Shown:
        walked = t if t < 8 else max(8.0, t - 5)
        return walker(0.9, 18 - way_along(walked, 1.3), -1, walked, 2), None

    def kicked(t: float) -> Shown:
        y = 16.6 - way_along(t, 1.25)
        return walker(0.25, y + 0.6, -1, t, 3, broom=False), np.array([0.0, y, 0.4])

    def carried(t: float) -> Shown:
        y = -18 + way_along(t, 1.4)
        return walker(-0.8, y, 1, t, 4, broom=False, bent=0.5), np.array([-0.8, y + 0.5, 1.0])

    def cleans(t: float) -> Shown:
        x, y = 0.3 * np.sin(0.4 * t), 16 + 1.2 * np.sin(0.25 * t)
        return walker(x, y, 1, t, 1, bent=0.5) + walker(-1.5, -16 + 0.6 * t, 1, t, 0), None

    def cross(t: float) -> Shown:
        return walker(-3.2 + 0.8 * t, 9, 1, t, 0) + walker(3.2 - 0.7 * t, -4, 1, t, 2), None

    def empty(t: float) -> Shown:
        return [], None

    lasts = {pair: 22, stops: 20, kicked: 28, carried: 26, cleans: 16, cross: 12, empty: 15}
    return [
        Clip(name=scene.__name__, frames=seconds * fps, shown=scene)
        for scene, seconds in lasts.items()
    ]


def render(clip: Clip, path: Path, rink: Rink, fps: int, quality: int) -> None:
    """Write a clip, and beside it the places of what is thrown in it."""
    seed = sum(map(ord, clip.name))
    rng = np.random.default_rng([*rink.key, seed])
    size = rink.view.size[1] + 97, rink.view.size[0] + 97, 1
    grain = np.repeat(rng.normal(0, 2.0, size).astype(np.float32), 3, axis=2)
    rows: list[list[float]] = []
    with opened(path, rink, fps, coding("h264", quality, "ultrafast")) as (container, stream):
        for k in range(clip.frames):
            parts, stone = clip.shown(k / fps)
            picture = rink.ice.copy()

            def draw(picture: Array = picture, stone: Array | None = stone) -> None:
                if stone is not None:
                    draw_stone(picture, rink.view, rink.stone, *stone.tolist())

            other_people.draw(
                picture, rink.view, parts, np.zeros(2) if stone is None else stone[:2], draw
            )
            picture = cv2.GaussianBlur(picture, (0, 0), 0.55)
            a, b = rng.integers(0, 97, 2)
            noise = grain[a : a + picture.shape[0], b : b + picture.shape[1]]
            seen = np.asarray(cv2.add(picture, noise, dtype=cv2.CV_8U), np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(seen, format="bgr24")))
            if stone is not None and clip.rests is not None and k / fps <= clip.rests + QUICK_REST:
                rows.append([k / fps, *stone.round(6).tolist()])
        container.mux(stream.encode(None))
    if clip.rests is not None:
        with path.with_suffix(".truth.csv").open("w", newline="") as file:
            csv.writer(file).writerows([["t", "x", "y", "theta"], *rows])


def order_of(
    throws: Sequence[Clip],
    between: Sequence[Clip],
    minutes: float,
    fps: int,
    rng: np.random.Generator,
) -> list[Clip]:
    """The clips of a film in order: one throw a minute, or throws at once without scenes."""
    if not between:
        lasts = sum(clip.frames for clip in throws) / len(throws) / fps
        count = max(1, round(60 * minutes / lasts))
        return [throws[k % len(throws)] for k in rng.permutation(count)]
    thrown = [throws[k % len(throws)] for k in rng.permutation(max(1, round(minutes)))]
    left = 60 * minutes - sum(clip.frames for clip in thrown) / fps
    shares = rng.uniform(0.4, 1.6, len(thrown))
    found: list[Clip] = []
    debt = 0.0
    for clip, share in zip(thrown, left * shares / shares.sum(), strict=True):
        found.append(clip)
        debt += share
        while debt > 6:
            found.append(between[int(rng.integers(len(between)))])
            debt -= found[-1].frames / fps
    return found


def join(clips: Sequence[Clip], folder: Path, film: Path, fps: int) -> list[dict[str, Any]]:
    """Join clips to one film, without encoding them anew; gives what is thrown in it, and when."""
    begins, thrown = 0, []
    with av.open(str(film), "w") as joined, av.open(str(folder / f"{clips[0].name}.mp4")) as first:
        stream = joined.add_stream_from_template(first.streams.video[0])
        for clip in clips:
            if clip.released is not None and clip.rests is not None:
                at = begins / fps
                thrown.append({"clip": clip.name, "begins": at, "released": at + clip.released,
                               "rests": at + clip.rests})  # fmt: skip
            with av.open(str(folder / f"{clip.name}.mp4")) as part:
                for packet in part.demux(part.streams.video[0]):
                    if packet.size and packet.pts is not None and packet.dts is not None:
                        shift = round(begins / fps / packet.time_base)
                        packet.pts, packet.dts = packet.pts + shift, packet.dts + shift
                        packet.stream = stream
                        joined.mux(packet)
            begins += clip.frames
    return thrown


# --- what is made of it -------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class TrackOfThrow:
    """A track beside the throw that it shows.

    Parameters
    ----------
    throw : index of the throw
    clip : what was thrown
    begins : its first row, since the release [s]
    to_rest : whether it reaches the stone's rest
    error : root mean square distance from the truth [m]
    """

    throw: int
    clip: str
    begins: float
    to_rest: bool
    error: float


@dataclass(frozen=True, kw_only=True)
class Score:
    """What was made of a practice film.

    Parameters
    ----------
    thrown : number of throws
    tracks : those of throws
    joined : tracks that show more than one throw
    invented : tracks that show none
    """

    thrown: int
    tracks: tuple[TrackOfThrow, ...]
    joined: int
    invented: int

    @property
    def found(self) -> int:
        """Throws that some track shows."""
        return len({track.throw for track in self.tracks})

    @property
    def to_rest(self) -> int:
        """Throws with a track that reaches their rest."""
        return len({track.throw for track in self.tracks if track.to_rest})

    @property
    def split(self) -> int:
        """Throws that more than one track shows."""
        shown = [track.throw for track in self.tracks]
        return len({throw for throw in shown if shown.count(throw) > 1})

    def lines(self) -> Iterator[str]:
        """The score in words, a line for each kind of throw."""
        yield (
            f"{self.found} of {self.thrown} throws found, {self.to_rest} tracked to the rest, "
            f"{self.split} cut in two, {self.joined} joined, {self.invented} invented"
        )
        for clip in sorted({track.clip for track in self.tracks}):
            own = [track for track in self.tracks if track.clip == clip]
            errors = 1e3 * np.array([track.error for track in own])
            late = max(track.begins for track in own)
            yield (
                f"{clip}: {len(own)} tracks, {np.median(errors):.1f} mm off in the middle and "
                f"{errors.max():.1f} at most; the latest begins {late:.1f} s after the release"
            )


def score(
    tracks: Sequence[Trajectory], thrown: Sequence[dict[str, Any]], truths: Mapping[str, Array]
) -> Score:
    """Hold tracks against what was thrown.

    Parameters
    ----------
    tracks : of the whole film; of each throw the first is that of the thrown stone
    thrown : clip, and when it begins, its stone is released and rests [s], of each throw
    truths : by clip, rows of t [s], x and y [m], since the clip begins
    """
    own = {track.throw: track for track in reversed(tracks)}
    found: list[TrackOfThrow] = []
    joined = invented = 0
    for _, track in sorted(own.items()):
        t = track.clock + track.t
        shown = [
            k
            for k, one in enumerate(thrown)
            if min(t[-1], one["rests"]) - max(t[0], one["released"]) > OVERLAP
        ]
        invented += not shown
        joined += len(shown) > 1
        for k in shown:
            one = thrown[k]
            true = truths[one["clip"]]
            during = (t >= one["released"]) & (t <= one["begins"] + true[-1, 0])
            there = [np.interp(t[during] - one["begins"], true[:, 0], true[:, c]) for c in (1, 2)]
            off = track.xy[during] - np.column_stack(there)
            found.append(
                TrackOfThrow(
                    throw=k,
                    clip=one["clip"],
                    begins=float(t[0] - one["released"]),
                    to_rest=bool(t[-1] > one["rests"] - NEAR_REST),
                    error=float(np.sqrt((off**2).sum(axis=1).mean())),
                )
            )
    return Score(thrown=len(thrown), tracks=tuple(found), joined=joined, invented=invented)


def track(film: Path, scene: Path, output: Path) -> float:
    """Track a film with the command that a user has, on one core; gives the processor time [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    one_core = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
    words = [sys.executable, "-m", "curling", "track", str(film), "--scene", str(scene)]
    with output.with_suffix(".json").open("w") as told:
        subprocess.run([*words, "-o", str(output), "--json"], env={**os.environ, **one_core},
                       stdout=told, check=True)  # fmt: skip
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def film_practice(
    output: Path,
    minutes: float = 60,
    coded: tuple[int, int] = (15, 23),
    *,
    quick: bool = False,
    camera: str = "gantry",
    size: int = 480,
    seed: int = 0,
) -> None:
    """Render the film of a practice, its scene and its truth, unless they are there.

    Parameters
    ----------
    coded : frames per second and quality
    quick : whether throws follow each other at once
    """
    output.mkdir(parents=True, exist_ok=True)
    film, scene, truth = (output / f"practice.{end}" for end in ENDINGS)
    if truth.exists():
        return
    cv2.setNumThreads(1)
    (rate, quality), rink = coded, rink_of(camera, size, seed)
    throws = [throw_clip(rink, k, rate, quick=quick) for k in range(KINDS)]
    other = [] if quick else scenes(rate)
    for clip in (*throws, *other):
        render(clip, output / clip.name, rink, rate, quality)
        print(f"{clip.name}: {clip.frames / rate:.0f} s", file=sys.stderr, flush=True)
    clips = order_of(throws, other, minutes, rate, np.random.default_rng([*rink.key, 77]))
    thrown = join(clips, output, film, rate)
    scene.write_text(json.dumps(rink.scene))
    truth.write_text(json.dumps(thrown))


def score_practice(output: Path) -> Score:
    """Score the tracks of a practice that was rendered; track it if they are not there."""
    film, scene, truth = (output / f"practice.{end}" for end in ENDINGS)
    if not (tracks := output / "tracks.csv").exists():
        print(f"{track(film, scene, tracks):.0f} s of processor time", file=sys.stderr)
    thrown = json.loads(truth.read_text())
    files = {one["clip"]: output / f"{one['clip']}.truth.csv" for one in thrown}
    truths = {clip: np.loadtxt(file, delimiter=",", skiprows=1) for clip, file in files.items()}
    return score(read_tracks(tracks), thrown, truths)


def main(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR")] = Path("runs/practice"),
    minutes: Annotated[float, typer.Option(min=1, help="Of film, with a throw each.")] = 60,
    between: Annotated[
        str, typer.Option(help="Between throws: people, or nothing, and throws follow at once.")
    ] = "people",
    camera: Annotated[str, typer.Option(help="end, gantry, side or ceiling.")] = "gantry",
    size: Annotated[int, typer.Option(help="Lines of the picture.")] = 480,
    rate: Annotated[int, typer.Option(help="Frames per second.")] = 15,
    quality: Annotated[int, typer.Option(help="Of H.264: 18 is fine, 30 coarse.")] = 23,
    seed: Annotated[int, typer.Option(help="Of camera, stone, throws and their order.")] = 0,
    only_film: Annotated[bool, typer.Option("--only-film", help="Do not track it.")] = False,
) -> None:
    """Film a practice whose throws are known, track it, and say what was found and how well.

    An hour takes about a minute to render and six to track. Files in the folder are kept.
    """
    if between not in ("people", "nothing"):
        raise typer.BadParameter("people or nothing", param_hint="--between")
    if camera not in PLACES:
        raise typer.BadParameter(", ".join(PLACES), param_hint="--camera")
    quick, coded = between == "nothing", (rate, quality)
    film_practice(output, minutes, coded, quick=quick, camera=camera, size=size, seed=seed)
    if not only_film:
        print(*score_practice(output).lines(), sep="\n")


if __name__ == "__main__":
    typer.run(main)
