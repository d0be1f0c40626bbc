"""Sessions that are really filmed: what discovery makes of tracks that come from films.

    python scripts/film_sessions.py film -o runs/film_sessions
    python scripts/film_sessions.py judge -o runs/film_sessions

`film` draws sessions with something hidden or nothing (by `blind/`, which has formulas and an
integrator of its own), films every throw, tracks the films with the scene as it is and, of some,
with one that knows half of the lens's distortion. Tracks that are there are not made again. `judge`
runs discovery on the tracks, without a scene and with it, and only then opens what was hidden.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from blind.hidden import SCATTER, draw_map, has_map, hidden_numbers, hide, log_map
from blind.law import HOG, MU, SQUARES, STEP, run_over, throw_path
from tqdm import tqdm

from curling_env.infrastructure.files.storage import make_directory, write_json
from curling_env.infrastructure.workers import begin_worker
from curling_env.trajectory import Trajectory, read_tracks, write_tracks
from friction_estimation.camera.lens import TERMS
from friction_estimation.camera.scene import load_scene, save_scene
from friction_estimation.discovery.discover import discover
from friction_estimation.discovery.report import document
from friction_estimation.synthetic import FilmSpec, render_film, scene_of
from friction_estimation.synthetic.cameras import named_camera
from friction_estimation.tracking import track_film

THROWS = 12
FPS = 12.0
SAMPLES = 60.0
"""Of the true path that is filmed [1/s]."""
LENS_SHARE = 0.5
"""Part of the distortion that a wrong scene believes in."""


@dataclass(frozen=True, kw_only=True)
class FilmedSession:
    """A session to film: what is hidden in it, from where it is seen, and its seed."""

    hidden: tuple[str, ...]
    camera: str
    seed: int

    @property
    def name(self) -> str:
        return f"{'+'.join(self.hidden) or 'none'}-{self.camera}-{self.seed}"


SESSIONS = (
    FilmedSession(hidden=("curl",), camera="gantry", seed=1),
    FilmedSession(hidden=(), camera="gantry", seed=2),
    FilmedSession(hidden=("slope",), camera="gantry", seed=3),
    FilmedSession(hidden=(), camera="end", seed=4),
    FilmedSession(hidden=("curl",), camera="end", seed=5),
    FilmedSession(hidden=("friction_map", "curl", "slope"), camera="gantry", seed=6),
    FilmedSession(hidden=("friction_map", "curl", "spin_drag"), camera="end", seed=7),
    FilmedSession(hidden=("friction_map", "curl", "spin_drag"), camera="gantry", seed=8),
    FilmedSession(hidden=("friction_map", "curl", "slope"), camera="end", seed=9),
)


def play(session: FilmedSession) -> tuple[list[Trajectory], dict[str, Any]]:
    """True paths of the session's throws, and what was hidden."""
    rng = np.random.default_rng([session.seed, 77])
    q = hidden_numbers(rng)
    truth = {name: hide(name, q, {}, rng) for name in session.hidden}
    pattern = draw_map(q, np.random.default_rng([session.seed, 78]))
    mu = float(q[MU])
    speeds = rng.permutation(np.linspace(1.5, 2.7, THROWS))
    paths: list[Trajectory] = []
    passes = np.zeros(SQUARES)
    for k in range(THROWS):
        way = 1.0 if k % 2 == 0 else -1.0
        line = rng.normal(0.0, 0.01)
        start = np.array(
            [
                rng.uniform(-0.9, 0.9),
                -way * HOG,
                -way * speeds[k] * np.sin(line),
                way * speeds[k] * np.cos(line),
                rng.uniform(-np.pi, np.pi),
                (1.0 if k % 4 < 2 else -1.0) * rng.uniform(0.8, 2.2),
            ]
        )
        q[MU] = mu * np.exp(rng.normal(0.0, SCATTER))
        path = np.empty((int(70 / STEP), 6))
        clock = 60.0 * k
        n = throw_path(q, pattern, passes, start, clock, float(k), 0.0, np.zeros(2), path)
        run_over(passes, path[:n])
        rows = np.unique(np.append(np.arange(0, n, round(1 / SAMPLES / STEP)), n - 1))
        inside = np.abs(path[rows, 0]) < 2.1  # a stone at the boards is taken off
        rows = rows[: int(np.argmin(inside)) if not inside.all() else len(rows)]
        paths.append(
            Trajectory(t=rows * STEP, xy=path[rows, :2], theta=path[rows, 4], throw=k, clock=clock)
        )
    sealed: dict[str, Any] = {"effects": truth, "mu": mu}
    if has_map(q):
        sealed["map"] = log_map(q, pattern).tolist()
    return paths, sealed


WRONG_TOO = (1, 2, 4, 6, 7)
"""Seeds of the sessions that are tracked with a wrong lens as well."""


def film_one(session: FilmedSession, folder: Path, k: int) -> list[str]:
    """Film a throw, and track it with the right lens and with a wrong one; how long that took."""
    told: list[str] = []
    cv2.setNumThreads(1)
    path = play(session)[0][k]
    rests = np.hypot(*(path.xy[-1] - path.xy[-2])) / (path.t[-1] - path.t[-2]) < 0.02
    spec = FilmSpec(
        camera=session.camera, fps=FPS, seed=session.seed, people=False, tail=1.0 if rests else 0.0
    )
    film = folder / f"{k}.mp4"
    right = scene_of(spec.resolved())
    wrong = replace(right, distortion=LENS_SHARE * np.asarray(right.distortion))
    for name, scene in (("right", right), ("wrong", wrong)):
        save_scene(scene, folder / f"{name}.scene.json")
        if name == "wrong" and session.seed not in WRONG_TOO:
            continue
        tracks = folder / f"{k}.{name}.csv"
        if tracks.exists():
            continue
        begun = time.process_time()
        if not film.exists():
            render_film(film, path, spec)
        rendered = time.process_time()
        seen = load_scene(folder / f"{name}.scene.json")
        found = track_film(film, seen, throw=k).trajectory
        write_tracks(tracks, [replace(found, clock=path.clock - spec.lead_in)])
        told.append(
            f"{session.name} {k} {name}: {rendered - begun:.1f} s to film, "
            f"{time.process_time() - rendered:.1f} s to track, {len(found)} rows"
        )
    return told


def make_films(folder: Path, workers: int) -> None:
    """Film and track all sessions, throw by throw."""
    pending: list[Future[list[str]]] = []
    context = get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context, initializer=begin_worker) as pool:
        for session in SESSIONS:
            place = make_directory(folder / session.name)
            paths, truth = play(session)
            write_tracks(place / "truth.csv", paths)
            write_json(place / "truth.json", json.loads(json.dumps(truth, default=float)))
            pending += [pool.submit(film_one, session, place, k) for k in range(THROWS)]
        for job in tqdm(pending):
            for line in job.result():
                tqdm.write(line)


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Discovery of one session's tracks, beside the truth.

    Parameters
    ----------
    session : name of the session
    lens : right or wrong
    with_scene : whether discovery knew the scene
    named, hidden : effects that were named, and those that are there
    sizes : parameter, value, standard error, and error in standard errors
    map_error, map_size : error of ln μ in the crossed cells, and its standard deviation; NaN
        without a map
    seconds : processor time [s]
    """

    session: str
    lens: str
    with_scene: bool
    named: tuple[str, ...]
    hidden: tuple[str, ...]
    sizes: tuple[tuple[str, float, float, float], ...]
    map_error: float
    map_size: float
    seconds: float

    @property
    def row(self) -> str:
        """Row of a table in Markdown."""
        found = [f"{k} {v:.4g} ± {sd:.1g} ({off:+.1f} σ)" for k, v, sd, off in self.sizes]
        if not np.isnan(self.map_error):
            found.append(f"map off by {100 * self.map_error:.2f} % of {100 * self.map_size:.1f} %")
        cells = (
            self.session,
            self.lens,
            "yes" if self.with_scene else "no",
            ", ".join(self.named) or "nothing",
            "; ".join(found),
            f"{self.seconds:.1f}",
        )
        return "| " + " | ".join(cells) + " |"


def verdict_on(place: Path, lens: str, *, with_scene: bool) -> Verdict | None:
    """Discover one session's tracks; None where they are not complete."""
    files = [place / f"{k}.{lens}.csv" for k in range(THROWS)]
    if not all(file.exists() for file in files):
        return None
    tracks = [track for file in files for track in read_tracks(file)]
    scene = load_scene(place / f"{lens}.scene.json") if with_scene else None
    begun = time.process_time()
    found = discover(tracks, scene=scene)
    seconds = time.process_time() - begun
    report = document(found)
    sealed = json.loads((place / "truth.json").read_text())
    hidden = sealed["effects"]
    sizes: list[tuple[str, float, float, float]] = []
    for effect in report["effects"]:
        for name, got in effect["parameters"].items():
            true = hidden.get(effect["name"], {}).get(name)
            if name.startswith("lens_"):
                own = named_camera(place.name.split("-")[1], FilmSpec().resolved().size)
                true = (1.0 - LENS_SHARE) * own.lens.distortion[TERMS.index(name[5:])]
            if true is not None and got["stderr"] > 0.0:
                off = (got["value"] - true) / got["stderr"]
                sizes.append((name, got["value"], got["stderr"], off))
    map_error = map_size = np.nan
    if "map" in sealed and found.final.model.map_field is not None:
        friction = found.improved_ice().friction
        true_map = np.array(sealed["map"])[friction.observed]
        map_error = float((np.log(friction.mu)[friction.observed] - true_map).std())
        map_size = float(true_map.std())
    return Verdict(
        session=place.name,
        lens=lens,
        with_scene=with_scene,
        named=tuple(effect["name"] for effect in report["effects"]),
        hidden=tuple(sorted(hidden) + ["lens_distortion"] * (lens == "wrong")),
        sizes=tuple(sizes),
        map_error=map_error,
        map_size=map_size,
        seconds=seconds,
    )


def judged(folder: Path) -> Iterator[Verdict]:
    """Discover all sessions that are filmed: right and wrong lens, with the scene and without."""
    for session in SESSIONS:
        for lens in ("right", "wrong"):
            for with_scene in (False, True):
                verdict = verdict_on(folder / session.name, lens, with_scene=with_scene)
                if verdict is not None:
                    yield verdict


def judge(folder: Path) -> None:
    """Print the verdicts on every session's tracks, as Markdown."""
    print("| hidden, camera, seed | lens | scene given | named | found (off by) | CPU s |")
    print("|---|---|---|---|---|---|")
    for verdict in judged(folder):
        print(verdict.row, flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("step", choices=("film", "judge"))
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/film_sessions"))
    arguments = parser.parse_args()
    if arguments.step == "film":
        make_films(arguments.output, arguments.workers)
    else:
        judge(arguments.output)
