"""Takeouts with known truth: filmed, tracked, and every stone compared with its true path.

A stone is thrown at one to three others in or before the house, which are hit one after the other
or by each other; two more are at rest there. The films are rendered by the package.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from curling_env.errors import CurlingError
from curling_env.ice import Ice
from curling_env.infrastructure.files.reading import read_json
from curling_env.infrastructure.files.storage import write_json
from curling_env.physics import Engine, Outcome, StoneState
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.camera.scene import load_scene, save_scene
from friction_estimation.synthetic import (
    FilmRenderer,
    FilmSpec,
    StoneOnIce,
    all_on_film,
    scene_of,
    write_film,
)
from friction_estimation.synthetic.tuning import HANDLE_COLOURS
from friction_estimation.tracking import track_film

FPS = 15.0
SIZES = {480: (854, 480), 720: (1280, 720), 1080: (1920, 1080)}
OUT_OF_HAND = 1.5
"""Time after the film's beginning from which rows are scored [s]."""
EDGE = 19.3
"""Distance from the middle at which a stone leaves [m]; it is scored until shortly before."""
SAME = 0.1
"""Maximum distance between places of the same stone [m]."""


class Film(NamedTuple):
    """Specification of a film.

    Parameters
    ----------
    seed : seed of ice, throw and stones
    camera : its name
    lines : lines of the picture
    towards : throw the stone towards a camera at one end
    hit : number of stones that are hit
    """

    seed: int
    camera: str
    lines: int
    towards: bool
    hit: int

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"{self.camera}{self.lines}{'-towards' if self.towards else ''}-{self.seed}"


BARE = (
    Film(90, "end", 480, False, 1), Film(91, "end", 720, False, 2), Film(92, "end", 480, True, 2),
    Film(93, "end", 720, True, 3), Film(94, "gantry", 480, False, 2),
    Film(95, "side", 480, False, 2), Film(96, "gantry", 720, True, 3),
    Film(97, "side", 720, True, 1), Film(98, "end", 720, False, 3),
    Film(99, "end", 1080, False, 2), Film(100, "end", 1080, True, 1),
)  # fmt: skip
WITH_PEOPLE = (
    Film(110, "gantry", 720, False, 1), Film(111, "side", 480, False, 2),
    Film(112, "end", 720, False, 1), Film(113, "end", 480, True, 1),
    Film(114, "gantry", 480, True, 2), Film(115, "end", 720, True, 1),
)  # fmt: skip


# --- what is thrown ------------------------------------------------------------------------------


def takeout(rng: np.random.Generator, hit: int) -> tuple[Outcome, Sequence[StoneState]]:
    """Return a throw that hits a number of stones, which all stay in play, and the resting
    stones.
    """
    ice = Ice.uniform(rng.uniform(0.0105, 0.0125))
    for _ in range(900):
        throw = Throw(
            speed=rng.uniform(2.45, 3.2),
            angle=rng.uniform(-0.012, 0.012),
            spin=rng.choice([-1, 1]) * rng.uniform(0.8, 2.2),
        )
        alone = Engine(ice).play(throw.release(), [], fps=120).trajectories[-1].xy
        y = rng.uniform(13.5, 18.0)
        if alone[-1, 1] < y + 1:
            continue
        x = float(np.interp(y, alone[:, 1], alone[:, 0]))
        places = [(x + rng.uniform(-0.2, 0.2), y)]
        for _ in range(hit + 1):
            for _ in range(50):
                if len(places) < hit:  # behind the first one, or beside it
                    first_x, first_y = places[0]
                    place = first_x + rng.uniform(-0.35, 0.35), first_y + rng.uniform(0.32, 1.6)
                else:
                    place = rng.uniform(-1.7, 1.7), rng.uniform(11.5, 19)
                if all(np.hypot(place[0] - a, place[1] - b) > 0.31 for a, b in places):
                    places.append(place)
                    break
        if not all(abs(b) < 19.2 for _, b in places):
            continue
        lying = [
            StoneState(x=a, y=b, theta=rng.uniform(-3, 3), stone=1 + k % 3)
            for k, (a, b) in enumerate(places)
        ]
        played = Engine(ice).play(throw.release(), lying, fps=240)
        *struck, thrown = played.trajectories
        within = all(
            (np.abs(path.xy[:, 0]) < 2.05).all() and abs(path.xy[-1, 1]) < EDGE
            for path in played.trajectories
        )
        if len(struck) != hit or not within or thrown.xy[-1, 1] <= y - 1.5:
            continue
        if min(np.hypot(*(path.xy[-1] - path.xy[0])) for path in struck) > 0.3:
            return played, lying
    raise SystemExit(f"no throw of 900 hits {hit} stones")


def film(one: Film, folder: Path, *, people: bool) -> None:
    """Write a film, the scene of its camera, and the truth."""
    played, lying = takeout(np.random.default_rng(one.seed), one.hit)
    *struck, thrown = played.trajectories
    first = min(contact.time for contact in played.contacts)
    swept = (thrown.t > 2.0) & (thrown.t < first - 0.4) & people
    thrown = replace(thrown, swept=swept.astype(float))
    way, turn = (-1, np.pi) if one.towards else (1, 0.0)
    paths = [replace(p, xy=way * p.xy, theta=p.theta + turn) for p in (thrown, *struck)]
    resting = [
        StoneOnIce(x=way * s.x, y=way * s.y, theta=s.theta + turn, colour=HANDLE_COLOURS[s.stone])
        for k, s in enumerate(lying)
        if k not in played.moved
    ]
    spec = FilmSpec(
        camera=one.camera, size=SIZES[one.lines], people=people, fps=FPS, tail=0.8, seed=one.seed
    )
    renderer = FilmRenderer(spec, resting=resting)
    frames = renderer.frames(paths[0], others=paths[1:], seed=one.seed)
    write_film(folder / f"{one.name}.mp4", frames, FPS)
    save_scene(scene_of(renderer.camera), folder / f"{one.name}.scene.json")
    truth = {
        "paths": [
            {"t": p.t.tolist(), "xy": p.xy.tolist(), "theta": p.theta.tolist()}
            for p in all_on_film(paths, spec)
        ],
        "contact": first + spec.lead_in,
        "resting": [[stone.x, stone.y] for stone in resting],
    }
    write_json(folder / f"{one.name}.truth.json", truth)


# --- its tracks ----------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Seen:
    """Track compared with the nearest true path.

    Parameters
    ----------
    stone : 0 for the thrown one, then the hit ones
    thrown : true if the track is reported as that of the thrown stone
    before, after : root mean square error before and after the first contact; NaN without rows [m]
    turned : root mean square error of the heading after the contact; NaN without headings [rad]
    """

    stone: int
    thrown: bool
    before: float
    after: float
    turned: float

    @property
    def right(self) -> bool:
        """Return whether the track is that of the reported stone."""
        near = bool(np.fmax(self.before, self.after) < SAME)
        return near and self.thrown == (self.stone == 0)


def seen_of(track: Trajectory, truth: dict[str, Any]) -> Seen:
    """Compare the track of a stone that moved with the truth."""
    paths, contact = truth["paths"], truth["contact"]

    def off(path: dict[str, Any]) -> Floats:
        there = [np.interp(track.t, path["t"], np.array(path["xy"])[:, k]) for k in range(2)]
        return track.xy - np.column_stack(there)

    stone = min(range(len(paths)), key=lambda k: float(np.median(np.hypot(*off(paths[k]).T))))
    path = paths[stone]
    scored = track.t > OUT_OF_HAND
    away, xy = off(path), np.array(path["xy"])
    if abs(xy[-1, 1]) > EDGE:
        gone = np.argmax(np.hypot(*(xy - xy[-1]).T) < 1e-4)
        scored &= track.t < path["t"][gone] - 0.4
    before, after = (scored & part for part in (track.t < contact - 0.05, track.t >= contact))
    turned = np.array([np.nan])
    if len(track.theta):
        miss = track.theta - np.interp(track.t, path["t"], path["theta"])
        turned = np.angle(np.exp(1j * miss[after & np.isfinite(miss)]))

    def root_mean_square(values: Floats) -> float:
        return float(np.sqrt(np.mean(values**2))) if len(values) else np.nan

    return Seen(
        stone=stone,
        thrown=track.stone == 0,
        before=root_mean_square(np.hypot(*away[before].T)),
        after=root_mean_square(np.hypot(*away[after].T)),
        turned=root_mean_square(turned),
    )


@dataclass(frozen=True, kw_only=True)
class Result:
    """Stones of one film compared with their tracks.

    Parameters
    ----------
    hit, resting : number of hit and of untouched stones
    seen : tracks of the stones that moved
    resting_found : number of untouched stones with a track
    """

    hit: int
    resting: int
    seen: tuple[Seen, ...] = ()
    resting_found: int = 0

    @property
    def hit_found(self) -> int:
        """Number of stones that were hit and have their own track."""
        return len({one.stone for one in self.seen if one.right and not one.thrown})

    @property
    def wrong(self) -> bool:
        """Return whether the track of the thrown stone is on another stone or far from its own."""
        return any(one.thrown and not one.right for one in self.seen)


def judged(one: Film, folder: Path, *, people: bool) -> Result:
    """Render a film unless it exists in the folder, track it, and score all its stones."""
    files = {end: folder / f"{one.name}.{end}" for end in ("mp4", "scene.json", "truth.json")}
    if not files["truth.json"].exists():
        film(one, folder, people=people)
    truth = read_json(files["truth.json"])
    result = Result(hit=len(truth["paths"]) - 1, resting=len(truth["resting"]))
    try:
        found = track_film(files["mp4"], load_scene(files["scene.json"]))
    except CurlingError:
        return result
    seen = [seen_of(track, truth) for track in found.trajectories if len(track) > 2]
    still = np.array([t.xy[0] for t in found.trajectories if len(t) == 2]).reshape(-1, 2)
    near = [np.hypot(*(still - xy).T).min(initial=np.inf) < SAME for xy in truth["resting"]]
    return replace(result, seen=tuple(seen), resting_found=int(np.sum(near)))
