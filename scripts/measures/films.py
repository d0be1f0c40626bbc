"""Measures of tracking: errors on films of known throws, people, takeouts, copies, and speed.

Films are rendered once into runs/figures/films and kept; delete that folder after changing a
renderer.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from pathlib import Path

import cv2
import numpy as np
from figures import ROOT
from films.accuracy import Score, coarse_copy, score
from films.live import delays, draw
from films.practice import NEAR_REST, score_practice
from films.render import rendered
from films.takeouts import BARE, WITH_PEOPLE, Film, judged

from curling_env.infrastructure.files.table import read_table
from curling_env.infrastructure.files.writing import make_directory
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.expected import PLACES, expected_camera, expected_errors
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.camera.scene import Scene, load_scene
from friction_estimation.film.pictures import read_picture
from friction_estimation.film.video import Film as Decoder
from friction_estimation.synthetic import FilmSpec, render_films
from friction_estimation.tracking import find_stones_in_image, track_film

MEASURES = (
    *("cameras", "independent", "independent_unknown_lens", "sweepers"),
    *("practice", "takeouts", "all_takeouts", "copies", "speed", "live", "photos", "real_paint"),
    "expected",
)
FILMS = ROOT / "runs" / "figures" / "films"
INDEPENDENT = ROOT / "runs" / "independent" / "films"
REAL = ROOT / "runs" / "independent" / "real"
STONE = StoneModel(radius=0.145, height=0.114)
CAMERAS = ("end", "gantry", "side", "ceiling")
FEW_TAKEOUTS = (BARE[5], BARE[8])
"""One of 480 lines from the side, and one of 720 from the end."""
NEAR_PLACE = 0.6
"""Maximum distance along the sheet of rows that are compared with a place [m]."""


def cameras() -> dict[str, float]:
    """Errors by camera: lens given and points exact, or lens unknown and points 3 px off.

    Films of a renderer that shares no code with the project, 15 frames/s, no one on the ice: for
    each camera one of 720 and one of 480 lines with the lens given, and the smaller one with the
    lens unknown.
    """
    small = [rendered(FILMS / "cameras522", camera, 480, 522) for camera in CAMERAS]
    large = [rendered(FILMS / "cameras521", camera, 720, 521) for camera in CAMERAS]
    given = [score(film) for film in small + large]
    unknown = [score(film, lens=False) for film in small]
    values = {camera: _of_camera(given, camera) for camera in CAMERAS}
    values |= {f"{camera}_unknown_lens": _of_camera(unknown, camera) for camera in CAMERAS}
    values["error_over_sigma"] = _rms(row.rms_sigmas for row in given + unknown)
    values["mu"] = _rms(row.mu_error_percent for row in given + unknown)
    return values | {"heading": _rms(row.heading for row in given)}


def independent() -> dict[str, float]:
    """Errors on the six films of an independent program, lens given, points exact."""
    rows = _independent(lens=True)
    return {"middle": float(np.nanmedian([row.rms_mm for row in rows])), "worst": _worst(rows)}


def independent_unknown_lens() -> dict[str, float]:
    """Errors on the same six films, lens unknown, points 3 px off."""
    return {"worst": _worst(_independent(lens=False))}


def sweepers() -> dict[str, float]:
    """Errors beside sweepers at work: one film each from the end, the gantry and the side.

    A thrower, a skip and two sweepers, whose brooms work 5 to 15 cm ahead of the stone.
    """
    seen_by = {"end": 720, "gantry": 480, "side": 480}
    films = [rendered(FILMS / "swept", *view, 63, people=True) for view in seen_by.items()]
    rows = [score(film) for film in films]
    to_rest = sum(row.short_s < NEAR_REST for row in rows)
    return {"to_rest": to_rest, "worst": _worst(rows)}


def practice() -> dict[str, float]:
    """Throws of an hour of practice, 480 lines from the gantry, with sweepers and passers-by."""
    found = score_practice(FILMS / "practice")
    return {
        "to_rest": found.to_rest,
        "cut_joined_invented": found.split + found.joined + found.invented,
        "worst": 1e3 * max(track.error for track in found.tracks),
    }


def takeouts() -> dict[str, float]:
    """Stones of two takeouts, in which five are hit: found or not, and errors after a contact."""
    return _takeouts("takeouts", [(film, False) for film in FEW_TAKEOUTS])


def all_takeouts() -> dict[str, float]:
    """Stones of 17 takeouts, six of them with sweepers at work."""
    bare, with_people = ([(film, k == 1) for film in (BARE, WITH_PEOPLE)[k]] for k in (0, 1))
    return _takeouts("all_takeouts", [*bare, *with_people])


def photos() -> dict[str, float]:
    """Stones in pictures from two clubs' ceilings; their names contain the true numbers."""
    found, total, invented = 0, 0, 0
    for path in sorted((REAL / "photos").glob("club_[ab]_*.png")):
        scene = load_scene(path.with_name(f"{path.stem[:6]}.scene.json"))
        picture = read_picture(path)
        camera = camera_from_scene(scene, (picture.shape[1], picture.shape[0]))
        stones = find_stones_in_image(picture, camera, STONE, scene.sheet)
        sure = sum(not stone.doubtful for stone in stones)
        count = 0 if path.stem.endswith("empty") else int(path.stem.split("_")[2])
        found, total = found + min(sure, count), total + count
        invented += max(sure - count, 0)
    return {"found": 100 * found / total, "invented": invented}


def real_paint() -> dict[str, float]:
    """Stones at rest in films made of real pictures: a house with letters, and six stones."""
    seen = {}
    for name, scene in (("club_a_empty_ice", "club_a"), ("broadcast", "broadcast")):
        folder = REAL / "half_real"
        track = track_film(folder / f"{name}.mp4", load_scene(folder / f"{scene}.scene.json"))
        seen[name] = len(track.others)
    return {"invented": seen["club_a_empty_ice"], "found": seen["broadcast"]}


def copies() -> dict[str, float]:
    """Errors on coarse copies: 480 lines at quality 28, as messengers make them; lens given."""
    folder = make_directory(FILMS / "copies")
    both = ("end", "side")
    films = [rendered(FILMS / "originals", camera, 720, 521) for camera in both]
    rows = [score(coarse_copy(film, folder, lines=480)) for film in films]
    within = 100 * float(np.mean([row.within_95 for row in rows]))
    return {camera: _of_camera(rows, camera) for camera in both} | {"within_95": within}


def expected() -> dict[str, float]:
    """Reported and true errors over those that `curling place-camera` expects, by camera.

    A draw seen by a phone behind the hack, from a gallery window and by ceiling cameras over both
    houses: films of 720 lines, lens given. The renderer paints rings and lines exactly.
    """
    cv2.setNumThreads(1)
    values: dict[str, float] = {}
    for camera in ("phone", "gallery", "ceiling", "ceiling_home"):
        spec = FilmSpec(camera=camera, size=(1280, 720), fps=15.0, people=False)
        film, scene = _draw_on_film("expected", spec)
        path = track_film(film, scene).trajectory
        table = read_table(film.with_suffix(".truth.csv"), required=("t", "x", "y"))
        t, x, y = (table.numbers(column) for column in ("t", "x", "y"))
        off = path.xy - np.column_stack([np.interp(path.t, t, axis) for axis in (x, y)])
        known = expected_camera(
            spec.resolved(), scene.sheet, lens_known=True, paint=0.0, depth_sigma=0.0
        )
        ratios: list[tuple[float, float]] = []
        for place in expected_errors([known]):
            near = np.abs(path.xy[:, 1] - PLACES[place.place]) < NEAR_PLACE
            if place.along is not None and place.across is not None and near.any():
                both = _rms([place.along, place.across])
                ratios.append((_rms(path.sigma_xy[near]) / both, _rms(off[near].ravel()) / both))
        sigma, error = zip(*ratios, strict=True)
        values |= {f"{camera}_sigma": float(np.median(sigma)), f"{camera}_error": _rms(error)}
    return values


def speed() -> dict[str, float]:
    """Processor time of tracking over that of decoding, for a draw in 1080p50 from the end."""
    cv2.setNumThreads(1)
    spec = FilmSpec(camera="end", size=(1920, 1080), fps=50.0, people=False)
    film, scene = _draw_on_film("speed", spec)
    frames = track_film(film, scene).frame_count  # also compiles
    decoding: list[float] = []
    tracking: list[float] = []
    for _ in range(2):
        began = time.process_time()
        for _ in Decoder.open(film).frames():
            pass
        decoded = time.process_time()
        track_film(film, scene)
        decoding.append(decoded - began)
        tracking.append(time.process_time() - decoded)
    return {
        "over_decoding": min(tracking) / min(decoding),
        "frames_per_s": frames / min(tracking),
    }


def live() -> dict[str, float]:
    """Delays of live tracking of three draws in 1080p50, sent in real time."""
    after, missing = delays(make_directory(FILMS / "live"))
    return {"after": float(np.median(after)), "missing": missing}


# --- scores -------------------------------------------------------------------------------------


def _draw_on_film(folder: str, spec: FilmSpec) -> tuple[Path, Scene]:
    """Render a draw unless its film exists, and return the film and its scene."""
    place = make_directory(FILMS / folder)
    film = place / f"{spec.name}-0.mp4"
    if not film.with_suffix(".truth.csv").exists():
        render_films(place, [draw(2.15)], spec)
    return film, load_scene(place / f"{spec.name}.scene.json")


def _independent(*, lens: bool) -> list[Score]:
    films = [film for camera in CAMERAS for film in sorted(INDEPENDENT.glob(f"{camera}-*.mp4"))]
    return [score(film, lens=lens) for film in films]


def _of_camera(rows: Sequence[Score], camera: str) -> float:
    """Return the root mean square error of a camera's films [mm]."""
    return _rms(row.rms_mm for row in rows if row.camera.startswith(camera))


def _rms(values: Iterable[float]) -> float:
    """Return the root mean square of the known values."""
    return float(np.sqrt(np.nanmean(np.square(list(values)))))


def _worst(rows: Sequence[Score]) -> float:
    return float(np.nanmax([row.rms_mm for row in rows]))


def _takeouts(name: str, films: Sequence[tuple[Film, bool]]) -> dict[str, float]:
    """Return found stones [%], worst errors after a contact: positions [mm], headings [rad]."""
    cv2.setNumThreads(1)
    folder = make_directory(FILMS / name)
    results = [judged(film, folder, people=people) for film, people in films]
    right = [one for result in results for one in result.seen if one.right]
    return {
        "hit_found": 100 * sum(k.hit_found for k in results) / sum(k.hit for k in results),
        "resting_found": 100
        * sum(k.resting_found for k in results)
        / sum(k.resting for k in results),
        "wrong": sum(result.wrong for result in results),
        "after_contact": 1e3 * float(np.nanmax([one.after for one in right])),
        "heading": float(np.nanmax([one.turned for one in right])),
    }
