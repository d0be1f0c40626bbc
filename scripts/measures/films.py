"""Measures of tracking: errors on films of known throws, people, takeouts, copies, and speed.

Films are rendered once into runs/figures/films and kept; delete that folder after changing a
renderer.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from encoded_again import copied_with_truth
from figures import ROOT
from live_pace import played
from other_films import coding, rendered
from practice_film import film_practice, score_practice
from takeout_films import BARE, WITH_PEOPLE, Film, judged
from tracking_accuracy import NORMAL_95, Case, balanced, score

from curling_env.ice import load_ice
from curling_env.infrastructure.files.storage import make_directory
from curling_env.physics import slide
from curling_env.throw import Throw
from friction_estimation.camera.scene import load_scene
from friction_estimation.film.video import Film as Decoder
from friction_estimation.synthetic import FilmSpec, render_films
from friction_estimation.tracking import track_film

MEASURES = (
    "cameras",
    "all_cameras",
    "independent",
    "independent_unknown_lens",
    "sweepers",
    "practice",
    "takeouts",
    "all_takeouts",
    "copies",
    "speed",
    "live",
)
FILMS = ROOT / "runs" / "figures" / "films"
INDEPENDENT = ROOT / "runs" / "independent" / "films"
CAMERAS = ("end", "gantry", "side", "ceiling")
CLICK_PX = 3.0
"""Error of a marked point in each coordinate."""
TO_REST = 0.5
"""A track that ends no earlier before the stone rests reaches its rest [s]."""
FINE, COARSE = 23, 28
"""Qualities of H.264: of a film, and of a copy of it."""
FEW_TAKEOUTS = (BARE[5], BARE[8])
"""One of 480 lines from the side, and one of 720 from the end."""
Row = dict[str, Any]


def cameras() -> dict[str, float]:
    """Errors by camera: lens given and points exact, or lens unknown and points 3 px off.

    Films of a renderer that shares no code with the project, 15 frames/s, nobody on the ice: for
    each camera one of 720 and one of 480 lines with the lens given, and the smaller one with the
    lens unknown.
    """
    small = _rendered("cameras522", seed=522, sizes=(480,))
    given = _scores(small + _rendered("cameras521", seed=521))
    unknown = _scores(small, lens=False, click_px=CLICK_PX)
    values = {camera: _of_camera(given, camera) for camera in CAMERAS}
    values |= {f"{camera}_unknown_lens": _of_camera(unknown, camera) for camera in CAMERAS}
    return values | _honesty(given + unknown) | {"heading": _rms(given, "heading_rad")}


def all_cameras() -> dict[str, float]:
    """Errors over 48 films: four cameras, three sizes, two rates, lens given and unknown."""
    rows: list[Row] = []
    for seed in (521, 522):
        films = _rendered(f"all{seed}", seed=seed, sizes=(480, 720, 1080), rates=(15, 30))
        rows += [score(case) for case in balanced(films, CLICK_PX, seed % 4)]
    return {**_middle_and_worst(rows), **_honesty(rows)}


def independent() -> dict[str, float]:
    """Errors on the six films of an independent program, lens given, points exact."""
    rows = _scores(_independent_films())
    return {**_middle_and_worst(rows), **_honesty(rows)}


def independent_unknown_lens() -> dict[str, float]:
    """Errors on the same six films, lens unknown, points 3 px off."""
    rows = _scores(_independent_films(), lens=False, click_px=CLICK_PX)
    return {**_middle_and_worst(rows), **_honesty(rows)}


def sweepers() -> dict[str, float]:
    """Errors beside sweepers at work: one film each from the end, the gantry and the side.

    A thrower, a skip and one or two sweepers, whose brooms work 5 to 15 cm ahead of the stone.
    """
    films = _rendered("swept", seed=63, cameras=("end",), people="mixed")
    films += _rendered("swept", seed=63, cameras=("gantry", "side"), sizes=(480,), people="mixed")
    rows = _scores(films)
    to_rest = sum(row["rows"] > 0 and row["short_s"] < TO_REST for row in rows)
    return {"to_rest": to_rest, **_middle_and_worst(rows), **_honesty(rows)}


def practice() -> dict[str, float]:
    """Throws of an hour of practice, 480 lines from the gantry, with sweepers and passers-by."""
    folder = FILMS / "practice"
    film_practice(folder)
    (folder / "tracks.csv").unlink(missing_ok=True)
    found = score_practice(folder)
    errors = [1e3 * track.error for track in found.tracks]
    return {
        "to_rest": found.to_rest,
        "cut_joined_invented": found.split + found.joined + found.invented,
        "middle": float(np.median(errors)),
        "worst": max(errors),
    }


def takeouts() -> dict[str, float]:
    """Stones of two takeouts, in which five are hit: found or not, and errors after a contact."""
    return _takeouts("takeouts", [(film, False) for film in FEW_TAKEOUTS])


def all_takeouts() -> dict[str, float]:
    """Stones of 17 takeouts, six of them with sweepers at work."""
    bare, with_people = ([(film, k == 1) for film in (BARE, WITH_PEOPLE)[k]] for k in (0, 1))
    return _takeouts("all_takeouts", [*bare, *with_people])


def copies() -> dict[str, float]:
    """Errors on coarse copies: 480 lines at quality 28, as messengers make them; lens given."""
    folder = make_directory(FILMS / "copies")
    films = _rendered("originals", seed=521, cameras=("end", "side"))
    made = [copied_with_truth(film, folder, coding("h264", COARSE), lines=480) for film in films]
    rows = _scores(made)
    return {camera: _of_camera(rows, camera) for camera in ("end", "side")} | _honesty(rows)


def speed() -> dict[str, float]:
    """Processor time of tracking over that of decoding, for a draw in 1080p50 from the end."""
    cv2.setNumThreads(1)
    thrown = slide(
        load_ice("standard"), Throw(speed=2.15, angle=-0.02, spin=1.5).release(), fps=100
    )
    assert thrown.trajectory is not None  # a rate was given
    spec = FilmSpec(camera="end", size=(1920, 1080), fps=50.0, people=False)
    folder = make_directory(FILMS / "speed")
    film, scene = folder / f"{spec.name}-0.mp4", folder / f"{spec.name}.scene.json"
    if not film.with_suffix(".truth.csv").exists():
        render_films(folder, [thrown.trajectory], spec)
    frames = track_film(film, load_scene(scene)).frame_count  # also compiles
    decoding: list[float] = []
    tracking: list[float] = []
    for _ in range(2):
        began = time.process_time()
        for _ in Decoder.open(film).frames():
            pass
        decoded = time.process_time()
        track_film(film, load_scene(scene))
        decoding.append(decoded - began)
        tracking.append(time.process_time() - decoded)
    return {
        "over_decoding": min(tracking) / min(decoding),
        "frames_per_s": frames / min(tracking),
    }


def live() -> dict[str, float]:
    """Delays of live tracking of three draws in 1080p50, which are sent at their own pace."""
    folder = make_directory(FILMS / "live")
    pace = played(folder, lambda line: None)
    return {
        "after": float(np.median(pace.after)),
        "missing": pace.missing,
        "off": 1e3 * max(pace.off, default=np.nan),
    }


# --- films and scores ---------------------------------------------------------------------------


def _rendered(
    folder: str,
    *,
    seed: int,
    cameras: Sequence[str] = CAMERAS,
    sizes: Sequence[int] = (720,),
    rates: Sequence[int] = (15,),
    films: int = 1,
    people: str = "no",
) -> list[Path]:
    """Films of `other_films.py` in a folder of their own, rendered unless they are there."""
    return list(
        rendered(
            FILMS / folder,
            coding("h264", FINE, "ultrafast"),
            cameras=cameras,
            sizes=sizes,
            rates=rates,
            films=films,
            people=people,
            seed=seed,
        )
    )


def _independent_films() -> list[Path]:
    return [film for camera in CAMERAS for film in sorted(INDEPENDENT.glob(f"{camera}-*.mp4"))]


def _scores(films: Iterable[Path], *, lens: bool = True, click_px: float = 0.0) -> list[Row]:
    return [score(Case(film=film, lens=lens, click_px=click_px, seed=0)) for film in films]


def _of_camera(rows: Sequence[Row], camera: str) -> float:
    """Root mean square error of a camera's films [mm]."""
    return _rms([row for row in rows if row["camera"].startswith(camera)], "rms_mm")


def _rms(rows: Sequence[Row], column: str) -> float:
    return float(np.sqrt(np.mean([row[column] ** 2 for row in rows])))


def _middle_and_worst(rows: Sequence[Row]) -> dict[str, float]:
    """Median and largest error of the films that were tracked [mm]."""
    errors = [row["rms_mm"] for row in rows if row["rows"]]
    return {"middle": float(np.median(errors)), "worst": max(errors)}


def _honesty(rows: Sequence[Row]) -> dict[str, float]:
    """Standard errors beside errors: of places, and of the friction of one throw."""
    tracked = [row for row in rows if row["rows"]]
    mu = np.array([row["mu_sigmas"] for row in tracked])
    return {
        "error_over_sigma": _rms(tracked, "rms_sigmas"),
        "within_95": 100 * float(np.mean([row["within_95"] for row in tracked])),
        "mu_within_95": 100 * float(np.mean(np.abs(mu[np.isfinite(mu)]) <= NORMAL_95)),
        "mu": float(np.sqrt(np.nanmean([row["mu_error_percent"] ** 2 for row in tracked]))),
    }


def _takeouts(name: str, films: Sequence[tuple[Film, bool]]) -> dict[str, float]:
    """Found stones [%], and the worst errors after a contact, of places [mm] and headings [rad]."""
    cv2.setNumThreads(1)
    folder = make_directory(FILMS / name)
    results = [judged(film, folder, people=people) for film, people in films]
    right = [one for result in results for one in result.seen if one.right]
    return {
        "hit_found": 100 * sum(k.hit_found for k in results) / sum(k.hit for k in results),
        "resting_found": 100
        * sum(len(k.resting_off) for k in results)
        / sum(k.resting for k in results),
        "wrong": sum(result.wrong for result in results),
        "after_contact": 1e3 * float(np.nanmax([one.after for one in right])),
        "heading": float(np.nanmax([one.turned for one in right])),
    }
