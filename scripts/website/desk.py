"""Input files of the pages' examples: films, scenes, tracks, ices, notes of an evening."""

from __future__ import annotations

import csv
import shutil
from dataclasses import fields, replace
from pathlib import Path

import av
import numpy as np
import simulated_club as club
from simulated_ice import random_ice

from curling_env import Direction, Ice, Throw, Trajectory, load_ice, save_ice, write_tracks
from curling_env.physics import slide
from friction_estimation.synthetic import FilmSpec, render_films

SIZE, FPS = (960, 540), 10.0
ROWS = 5
"""Interval of the kept rows of a track."""


def lay_out(folder: Path) -> Path:
    """Make every file that an example names but no example makes, and return the folder."""
    rng = np.random.default_rng(0)
    athletes = (club.Athlete(name="Ada"), club.Athlete(name="Bo", spin=1.7))
    ice = random_ice(rng)
    for place, throws in ((".", 8), ("mon", 6), ("fri", 6)):
        stones = {k: (1.0 + 0.01 * k, 1.0) for k in range(4)} if place == "." else None
        evening = club.evening(rng, athletes=athletes, throws=throws, stones=stones, ice=ice)
        _keep(folder / place, evening, evening.ice.as_ice(rng, sigma=0.01, curl_sigma=2e-4))
        save_ice(evening.believed.as_ice(), folder / place / "morning.json")
    save_ice(ice.as_ice(rng, sigma=0.01, curl_sigma=2e-4), folder / "club.json")
    _films(folder)
    return folder


def _keep(folder: Path, evening: club.Evening, ice: Ice) -> None:
    folder.mkdir(exist_ok=True)
    write_tracks(folder / "tracks.csv", [_thinned(track) for track in evening.tracks])
    save_ice(ice, folder / "ice.json")
    with (folder / "throws.csv").open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["throw", "athlete", "stone", "called"])
        for throw, note in sorted(evening.notes.items()):
            table.writerow([throw, note.athlete, note.stone, note.called])


def _thinned(track: Trajectory) -> Trajectory:
    """Return a track with few rows a second, so that its fit is quick."""
    columns = {field.name: getattr(track, field.name) for field in fields(track)}
    kept = {name: x[::ROWS] for name, x in columns.items() if isinstance(x, np.ndarray)}
    return replace(track, **kept)


def _films(folder: Path) -> None:
    """Make two throws from above under the names in the pages, and one by a ceiling camera."""
    ice = load_ice("standard")
    throws = [
        (Throw(speed=1.5, angle=0.02, spin=1.2), Direction.AWAY),
        (Throw(speed=1.6, angle=-0.01, spin=-1.0), Direction.HOME),
    ]
    paths = [_path(ice, throw, way) for throw, way in throws]
    above = FilmSpec(camera="gantry", size=SIZE, fps=FPS, people=False)
    films = render_films(folder / "rendered", paths, above)
    for film, names in zip(films, (("end-0", "film", "practice"), ("end-1",)), strict=True):
        for name in names:
            shutil.copy(film, folder / f"{name}.mp4")
    (folder / "evening").mkdir()
    shutil.copy(films[1], folder / "evening")
    for name in ("end.scene.json", "scene.json", "SCENE.json"):
        shutil.copy(folder / "rendered" / "gantry.scene.json", folder / name)
    draw = _path(ice, Throw(speed=2.1, spin=1.5), Direction.AWAY)
    ceiling = FilmSpec(camera="ceiling", size=(1280, 960), fps=2.0, people=False)
    (film,) = render_films(folder / "rendered", [draw], ceiling)
    shutil.copy(folder / "rendered" / "ceiling.scene.json", folder / "ceiling.scene.json")
    _first_and_last(film, folder / "ice.png", folder / "house.png")


def _path(ice: Ice, throw: Throw, direction: Direction) -> Trajectory:
    path = slide(ice, throw.release(direction), fps=60).trajectory
    assert path is not None  # requested by `fps`
    return path


def _first_and_last(film: Path, first: Path, last: Path) -> None:
    with av.open(str(film)) as container:
        pictures = list(container.decode(video=0))
    pictures[0].to_image().save(first)
    pictures[-1].to_image().save(last)
