"""Sessions that are really filmed: what discovery makes of tracks that come from films.

    python scripts/film_sessions.py film -o runs/film_sessions
    python scripts/film_sessions.py judge -o runs/film_sessions

`film` draws sessions with something hidden or nothing (`blind_sessions.py`: its own formulas and
integrator), films every throw, tracks the films with the right scene and with one whose lens is
wrong, and keeps the tracks; what is there already is not made again. `judge` runs discovery on the
tracks and only then opens what was hidden.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from blind_sessions import HOG, MU, SCATTER, STEP, hidden_numbers, hide, throw_path
from numpy.typing import NDArray
from tqdm import tqdm

from curling_env.storage import make_directory, write_json
from curling_env.trajectory import Trajectory, write_tracks

Floats = NDArray[np.float64]

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
    FilmedSession(hidden=("speed_dependent_friction",), camera="gantry", seed=6),
    FilmedSession(hidden=(), camera="side", seed=7),
    FilmedSession(hidden=("curl", "speed_dependent_friction"), camera="gantry", seed=8),
    FilmedSession(hidden=(), camera="gantry", seed=9),
)


def play(session: FilmedSession) -> tuple[list[Trajectory], dict[str, Any]]:
    """True paths of the session's throws, and what was hidden."""
    rng = np.random.default_rng([session.seed, 77])
    q = hidden_numbers(rng)
    truth = {name: hide(name, q, {}, rng) for name in session.hidden}
    mu = float(q[MU])
    speeds = rng.permutation(np.linspace(1.5, 2.7, THROWS))
    paths: list[Trajectory] = []
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
        n = throw_path(q, start, clock, float(k), 0.0, np.zeros(2), path)
        rows = np.unique(np.append(np.arange(0, n, round(1 / SAMPLES / STEP)), n - 1))
        inside = np.abs(path[rows, 0]) < 2.1  # a stone at the boards is taken off
        rows = rows[: int(np.argmin(inside)) if not inside.all() else len(rows)]
        paths.append(
            Trajectory(t=rows * STEP, xy=path[rows, :2], theta=path[rows, 4], throw=k, clock=clock)
        )
    return paths, {"effects": truth, "mu": mu}


def film_one(session: FilmedSession, folder: Path, k: int) -> None:
    """Film a throw, and track it with the right lens and with a wrong one."""
    import cv2

    from friction_estimation.scene import load_scene, save_scene
    from friction_estimation.synthetic import FilmSpec, render_film, scene_of
    from friction_estimation.tracking import track_film

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
        print(
            f"{session.name} {k} {name}: {rendered - begun:.1f} s to film, "
            f"{time.process_time() - rendered:.1f} s to track, {len(found)} rows",
            flush=True,
        )


WRONG_TOO = (1, 2, 4)


def make_films(folder: Path, workers: int) -> None:
    pending = []
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for session in SESSIONS:
            place = make_directory(folder / session.name)
            paths, truth = play(session)
            write_tracks(place / "truth.csv", paths)
            write_json(place / "truth.json", json.loads(json.dumps(truth, default=float)))
            pending += [pool.submit(film_one, session, place, k) for k in range(THROWS)]
        for job in tqdm(pending):
            job.result()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("step", choices=("film", "judge"))
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/film_sessions"))
    a = parser.parse_args()
    make_films(a.output, a.workers)
