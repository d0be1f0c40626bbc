"""Sessions with rendered films, and the verdict of discovery on their tracks.

Formulas and integrator of the true paths are this folder's own; existing films and tracks in the
folder are reused.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from tqdm import tqdm

from blind.hidden import SCATTER, draw_map, hidden_numbers, hide
from blind.law import HOG, MU, SQUARES, STEP, run_over
from blind.sessions import Release
from curling_env.infrastructure.files.writing import make_directory
from curling_env.trajectory import Trajectory, read_tracks, write_tracks
from friction_estimation.camera.scene import load_scene, save_scene
from friction_estimation.discovery.discover import discover
from friction_estimation.discovery.report import document
from friction_estimation.synthetic import FilmSpec, render_film, scene_of
from friction_estimation.tracking import track_film

THROWS = 12
FPS = 12.0
SAMPLES = 60.0
"""Number of samples of the filmed true path [1/s]."""


@dataclass(frozen=True)
class FilmedSession:
    """Session to film: its hidden effects, its camera, and its seed."""

    hidden: tuple[str, ...]
    camera: str
    seed: int

    @property
    def name(self) -> str:
        """Name of its folder."""
        return f"{'+'.join(self.hidden) or 'none'}-{self.camera}-{self.seed}"


SESSIONS = (
    FilmedSession(("curl",), "gantry", 1),
    FilmedSession((), "gantry", 2),
    FilmedSession(("slope",), "gantry", 3),
    FilmedSession((), "end", 4),
    FilmedSession(("curl",), "end", 5),
    FilmedSession(("friction_map", "curl", "slope"), "gantry", 6),
    FilmedSession(("friction_map", "curl", "spin_drag"), "end", 7),
    FilmedSession(("friction_map", "curl", "spin_drag"), "gantry", 8),
    FilmedSession(("friction_map", "curl", "slope"), "end", 9),
)


class Verdict(NamedTuple):
    """Effects that discovery named in a session, and the hidden ones."""

    named: list[str]
    hidden: list[str]


def judged(folder: Path) -> Iterator[Verdict]:
    """Film and track every throw of all sessions, and discover each session's ice.

    Parameters
    ----------
    folder : folder of films and tracks
    """
    cv2.setNumThreads(1)
    for session in tqdm(SESSIONS, unit="session", disable=None):
        place = make_directory(folder / session.name)
        tracks = [_tracked(session, place, k, path) for k, path in enumerate(play(session))]
        effects: list[dict[str, Any]] = document(discover(tracks))["effects"]
        yield Verdict(sorted(effect["name"] for effect in effects), sorted(session.hidden))


def play(session: FilmedSession) -> list[Trajectory]:
    """Return the true paths of the session's throws."""
    rng = np.random.default_rng([session.seed, 77])
    q = hidden_numbers(rng)
    for name in session.hidden:
        hide(name, q, {}, rng)
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
        clock, own = 60.0 * k, mu * np.exp(rng.normal(0.0, SCATTER))
        release = Release(start=start, clock=clock, order=k, stone=0, sweep=np.zeros(2), mu=own)
        path = release.path(q, pattern, passes)
        run_over(passes, path)
        last = len(path) - 1
        rows = np.unique(np.append(np.arange(0, last + 1, round(1 / SAMPLES / STEP)), last))
        inside = np.abs(path[rows, 0]) < 2.1  # a stone at the boards is removed
        rows = rows[: int(np.argmin(inside)) if not inside.all() else len(rows)]
        paths.append(
            Trajectory(t=rows * STEP, xy=path[rows, :2], theta=path[rows, 4], throw=k, clock=clock)
        )
    return paths


def _tracked(session: FilmedSession, folder: Path, k: int, path: Trajectory) -> Trajectory:
    """Film a throw and track it, unless its track is in the folder."""
    tracks = folder / f"{k}.right.csv"
    if not tracks.exists():
        rests = np.hypot(*(path.xy[-1] - path.xy[-2])) / (path.t[-1] - path.t[-2]) < 0.02
        tail = 1.0 if rests else 0.0
        spec = FilmSpec(camera=session.camera, fps=FPS, seed=session.seed, people=False, tail=tail)
        film, scene = folder / f"{k}.mp4", folder / "right.scene.json"
        save_scene(scene_of(spec.resolved()), scene)
        if not film.exists():
            render_film(film, path, spec)
        found = track_film(film, load_scene(scene), throw=k).trajectory
        write_tracks(tracks, [replace(found, clock=path.clock - spec.lead_in)])
    return read_tracks(tracks)[0]
