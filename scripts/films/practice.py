"""Practice in one film: rendered, tracked, and compared with the true throws.

Four throws with a thrower, a skip and up to two sweepers at work, and scenes in which people cross,
walk along, clean a house, or slide, push and carry a stone, are rendered once. The film joins them
in random order, one throw a minute; the picture jumps from one to the next. After a throw
its stone is pushed back, pushed aside, or left for a while.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.trajectory import Trajectory, read_tracks
from films.people import Part, walker
from films.render import FPS, Grain, composed, opened, path_of, people_of, write_truth
from films.rink import Rink, rink_of

Array = NDArray[np.floating[Any]]
Shown = tuple[list[Part], Array | None]
"""Content of a frame: people, and the stone's x, y and heading if there is one."""

KINDS = 4
"""Rendered throws; each is shown repeatedly."""
LEAD, REST = 2.6, 2.0
"""Filmed time before the release and after the stone rests [s]."""
TRUTH_AFTER = 1.0
"""Time after a stone rests for which its truth is kept [s]."""
EDGE, FAR = 2.6, 19.5
"""Distances from the middle: of a stone pushed over the edge, and of one pushed back [m]."""
OVERLAP = 4.0
"""Minimum overlap of a track with a throw that it shows [s]."""
NEAR_REST = 0.5
"""Maximum time before the stone's rest at which a track that reaches the rest ends [s]."""


# --- the film ---------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Clip:
    """Part of the film.

    Parameters
    ----------
    shown : content at a time since its start [s]
    released, rests : times of its stone's release and rest, since its start [s]; None without a
        throw
    """

    name: str
    frames: int
    shown: Callable[[float], Shown]
    released: float | None = None
    rests: float | None = None


def throw_clip(rink: Rink, k: int) -> Clip:
    """Return one of the throws, with the clearing of its stone."""
    way = 1 if k % 2 == 0 else -1
    path = path_of(rink.mu, np.random.default_rng([*rink.key, 3 + k]), way)
    people = people_of(rink, k, path, way)
    t, rows = path
    lasts = float(t[-1])
    pushed = (rows[1] - rows[0]) / (t[1] - t[0])
    x, y, turn = rows[-1].tolist()
    cleared, clear = clearing(x, y, turn, way, k)

    def shown(now: float) -> Shown:
        since = now - LEAD
        if since > lasts + REST:
            return clear(since - lasts - REST)
        stone = np.array([np.interp(since, t, row) for row in rows.T])
        stone += min(since, 0.0) * pushed
        return people.parts(since, stone), stone

    frames = round((LEAD + lasts + REST + cleared) * FPS)
    rests, sides = LEAD + lasts, people.sides
    return Clip(name=f"throw{k}-{sides}", frames=frames, shown=shown, released=LEAD, rests=rests)


def clearing(
    x: float, y: float, turn: float, way: int, k: int
) -> tuple[float, Callable[[float], Shown]]:
    """Return the clearing of a stone from its place of rest: its duration [s], and its content."""
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


def scenes() -> list[Clip]:
    """Return scenes between throws."""

    def way_along(t: float, speed: float) -> float:
        return speed * t + 0.04 * float(np.sin(2 * np.pi * 1.9 * t))

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
        Clip(name=scene.__name__, frames=seconds * FPS, shown=scene)
        for scene, seconds in lasts.items()
    ]


def render(clip: Clip, path: Path, rink: Rink) -> None:
    """Write a clip, with the positions of its thrown stone."""
    grain = Grain(rink, np.random.default_rng([*rink.key, sum(map(ord, clip.name))]))
    rows: list[list[float]] = []
    with opened(path, rink, FPS) as (container, stream):
        for k in range(clip.frames):
            parts, stone = clip.shown(k / FPS)
            container.mux(stream.encode(grain.frame(composed(rink, parts, stone))))
            if stone is not None and clip.rests is not None and k / FPS <= clip.rests + TRUTH_AFTER:
                rows.append([k / FPS, *stone.tolist()])
        container.mux(stream.encode(None))
    if clip.rests is not None:
        write_truth(path.with_suffix(".truth.csv"), np.array(rows))


def order_of(
    throws: Sequence[Clip], between: Sequence[Clip], minutes: int, rng: np.random.Generator
) -> list[Clip]:
    """Return the clips of a film in order, with one throw a minute."""
    thrown = [throws[k % len(throws)] for k in rng.permutation(minutes)]
    left = 60 * minutes - sum(clip.frames for clip in thrown) / FPS
    shares = rng.uniform(0.4, 1.6, len(thrown))
    found: list[Clip] = []
    debt = 0.0
    for clip, share in zip(thrown, left * shares / shares.sum(), strict=True):
        found.append(clip)
        debt += share
        while debt > 6:
            found.append(between[int(rng.integers(len(between)))])
            debt -= found[-1].frames / FPS
    return found


def join(clips: Sequence[Clip], folder: Path, film: Path) -> list[dict[str, Any]]:
    """Join clips to one film, without encoding them again; return its throws and their times."""
    begins, thrown = 0, []
    with av.open(str(film), "w") as joined, av.open(str(folder / f"{clips[0].name}.mp4")) as first:
        stream = joined.add_stream_from_template(first.streams.video[0])
        for clip in clips:
            if clip.released is not None and clip.rests is not None:
                at = begins / FPS
                thrown.append({"clip": clip.name, "begins": at, "released": at + clip.released,
                               "rests": at + clip.rests})  # fmt: skip
            with av.open(str(folder / f"{clip.name}.mp4")) as part:
                for packet in part.demux(part.streams.video[0]):
                    if packet.size and packet.pts is not None and packet.dts is not None:
                        shift = round(begins / FPS / packet.time_base)
                        packet.pts, packet.dts = packet.pts + shift, packet.dts + shift
                        packet.stream = stream
                        joined.mux(packet)
            begins += clip.frames
    return thrown


# --- its tracks -------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class TrackOfThrow:
    """Track compared with the throw that it shows.

    Parameters
    ----------
    throw : index of the throw
    to_rest : true if it reaches the stone's rest
    error : root mean square distance from the truth [m]
    """

    throw: int
    to_rest: bool
    error: float


@dataclass(frozen=True, kw_only=True)
class Score:
    """Tracks of a practice film compared with the truth.

    Parameters
    ----------
    tracks : tracks of throws
    joined : number of tracks that show more than one throw
    invented : number of tracks that show none
    """

    tracks: tuple[TrackOfThrow, ...]
    joined: int
    invented: int

    @property
    def to_rest(self) -> int:
        """Return throws with a track that reaches their rest."""
        return len({track.throw for track in self.tracks if track.to_rest})

    @property
    def split(self) -> int:
        """Return throws with more than one track."""
        shown = [track.throw for track in self.tracks]
        return len({throw for throw in shown if shown.count(throw) > 1})


def score(
    tracks: Sequence[Trajectory], thrown: Sequence[dict[str, Any]], truths: Mapping[str, Array]
) -> Score:
    """Compare tracks with the true throws.

    Parameters
    ----------
    tracks : tracks of the whole film; the first of each throw is that of the thrown stone
    thrown : clip, and times of its start, release and rest [s], of each throw
    truths : by clip, rows of t [s], x and y [m], since the start of the clip
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
                    to_rest=bool(t[-1] > one["rests"] - NEAR_REST),
                    error=float(np.sqrt((off**2).sum(axis=1).mean())),
                )
            )
    return Score(tracks=tuple(found), joined=joined, invented=invented)


def score_practice(folder: Path, minutes: int = 60) -> Score:
    """Render the film of a practice unless it exists, track it, and score the tracks."""
    folder.mkdir(parents=True, exist_ok=True)
    film, scene, truth = (folder / f"practice.{end}" for end in ("mp4", "scene.json", "truth.json"))
    if not truth.exists():
        cv2.setNumThreads(1)
        rink = rink_of("gantry", 480, 0)
        throws, other = [throw_clip(rink, k) for k in range(KINDS)], scenes()
        for clip in (*throws, *other):
            render(clip, folder / clip.name, rink)
        clips = order_of(throws, other, minutes, np.random.default_rng([*rink.key, 77]))
        thrown = join(clips, folder, film)
        scene.write_text(json.dumps(rink.scene))
        truth.write_text(json.dumps(thrown))
    thrown = json.loads(truth.read_text())
    files = {one["clip"]: folder / f"{one['clip']}.truth.csv" for one in thrown}
    truths = {clip: np.loadtxt(file, delimiter=",", skiprows=1) for clip, file in files.items()}
    return score(_tracked(film, scene, folder / "tracks.csv"), thrown, truths)


def _tracked(film: Path, scene: Path, tracks: Path) -> list[Trajectory]:
    """Track a film with the user's command, on one core."""
    one_core = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
    words = [sys.executable, "-m", "curling", "track", str(film), "--scene", str(scene)]
    subprocess.run(
        [*words, "-o", str(tracks), "--json"],
        env={**os.environ, **one_core},
        stdout=subprocess.DEVNULL,
        check=True,
    )
    return read_tracks(tracks)
