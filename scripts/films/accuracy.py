"""Tracks of films compared with the truth, and coarse copies of films.

Each film FOLDER/NAME-K.mp4 has its truth in NAME-K.truth.csv, and that of its camera in
NAME.scene.json and NAME.truth.json. Only the scoring reads the truth.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import av
import cv2
import numpy as np

from curling_env.errors import CurlingError
from curling_env.infrastructure.files.reading import read_json
from curling_env.infrastructure.files.table import read_table
from curling_env.typing import Floats
from films.render import COARSE, stream_of
from friction_estimation import estimate_ice
from friction_estimation.camera.scene import Scene, load_scene, save_scene
from friction_estimation.tracking import track_film

OUT_OF_HAND = 1.0
"""Time after the release from which rows are scored: before it the thrower is in the way [s]."""
LEAST_SLIDE = 8.0
"""Minimum duration of a track whose friction is scored [s]."""
RESTS = 0.02
"""Maximum speed of a stone at rest [m/s]."""
CLICK_PX = 3.0
"""Error of a marked point in each coordinate."""
NORMAL_95 = 1.96
TRUTH = ("t", "x", "y", "theta")


@dataclass(frozen=True, kw_only=True)
class Score:
    """Track of a film compared with the truth; NaN without a track.

    Parameters
    ----------
    camera : name of the camera
    rms_mm : root mean square distance from the truth [mm]
    within_95 : share of coordinates within their 95 % intervals
    rms_sigmas : root mean square of error over standard error
    heading : root mean square error of the heading [rad]
    mu_error_percent : error of the friction of this one throw [%]
    short_s : time by which the track ends before the stone rests [s]
    """

    camera: str
    rms_mm: float = np.nan
    within_95: float = np.nan
    rms_sigmas: float = np.nan
    heading: float = np.nan
    mu_error_percent: float = np.nan
    short_s: float = np.nan


def score(film: Path, *, lens: bool = True) -> Score:
    """Track a film, and compare the track with the truth.

    Parameters
    ----------
    film : FOLDER/NAME-K.mp4
    lens : give the lens and exact points; otherwise the lens is unknown and points are 3 px off
    """
    cv2.setNumThreads(1)
    camera = film.stem.rpartition("-")[0]
    try:
        path = track_film(film, _scene(film, camera, lens=lens)).trajectory
    except CurlingError:
        return Score(camera=camera)
    table = read_table(film.with_suffix(".truth.csv"), required=TRUTH)
    truth = {name: table.numbers(name) for name in TRUTH}
    about = read_json(film.with_name(f"{camera}.truth.json"))
    released = about.get("released_at_s", about.get("throws", [{}])[0].get("released_at_s", 0.0))
    scored = path.t >= released + OUT_OF_HAND
    if not scored.any():
        return Score(camera=camera)
    t = path.t[scored]
    there = np.column_stack([np.interp(t, truth["t"], truth[axis]) for axis in ("x", "y")])
    off, sigma = path.xy[scored] - there, path.sigma_xy[scored]
    turned = path.theta[scored] - np.interp(t, truth["t"], truth["theta"])
    miss = np.angle(np.exp(1j * turned[np.isfinite(turned)]))
    mu = np.nan
    if t[-1] - t[0] >= LEAST_SLIDE:
        mu = 100 * (estimate_ice([path], uniform=True).mu / about["mu"] - 1)
    return Score(
        camera=camera,
        rms_mm=1e3 * float(np.sqrt(np.mean(np.linalg.norm(off, axis=1) ** 2))),
        within_95=float(np.mean(np.abs(off) <= NORMAL_95 * sigma[:, None])),
        rms_sigmas=float(np.sqrt(np.mean((off / sigma[:, None]) ** 2))),
        heading=float(np.sqrt(np.mean(miss**2))) if len(miss) else np.nan,
        mu_error_percent=mu,
        short_s=max(_rest_of(truth) - float(t[-1]), 0.0),
    )


def _scene(film: Path, camera: str, *, lens: bool) -> Scene:
    """Return the user's part of a scene."""
    scene = load_scene(film.with_name(f"{camera}.scene.json"))
    if lens:
        return scene
    px = scene.points_px
    px = px + np.random.default_rng([0, len(px)]).normal(0.0, CLICK_PX, px.shape)
    reader = cv2.VideoCapture(str(film))
    size = [reader.get(c) for c in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)]
    reader.release()
    px = np.clip(px, 0.0, np.array(size) - 1.0)
    return replace(scene, points_px=px, camera_matrix=None, distortion=None)


def _rest_of(truth: dict[str, Floats]) -> float:
    """Return the time from which the stone is at rest, or that of the last frame [s]."""
    speeds = np.hypot(np.diff(truth["x"]), np.diff(truth["y"])) / np.diff(truth["t"])
    return float(truth["t"][1:][speeds > RESTS].max(initial=truth["t"][0]))


# --- copies -------------------------------------------------------------------------------------


def coarse_copy(film: Path, folder: Path, lines: int) -> Path:
    """Write a copy like those of messengers: smaller, and compressed again.

    Parameters
    ----------
    film : FOLDER/NAME-K.mp4
    folder : folder of the copy, with a matching scene and its truth
    lines : height of the copy's picture
    """
    camera = film.stem.rpartition("-")[0]
    size, copied = _copied(film, folder / film.name, lines)
    scene = load_scene(film.with_name(f"{camera}.scene.json"))
    scene = replace(scene, picture_size=size, image_size=size).for_size(copied)
    save_scene(scene, folder / f"{camera}.scene.json")
    for truth in (f"{camera}.truth.json", f"{film.stem}.truth.csv"):
        shutil.copyfile(film.parent / truth, folder / truth)
    return folder / film.name


def _copied(film: Path, copy: Path, lines: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Write the copy of a film, and return width and height of its pictures and of the copy's."""
    with av.open(str(film)) as source, av.open(str(copy), "w") as target:
        seen = source.streams.video[0]
        height = lines // 2 * 2
        width = round(seen.width * height / seen.height / 2) * 2
        assert seen.average_rate is not None
        stream = stream_of(target, seen.average_rate, (width, height), COARSE, "medium")
        for frame in source.decode(seen):
            picture = frame.to_ndarray(format="bgr24")
            small = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
            shown = av.VideoFrame.from_ndarray(small.astype(np.uint8), format="bgr24")
            target.mux(stream.encode(shown))
        target.mux(stream.encode(None))
        return (seen.width, seen.height), (width, height)
