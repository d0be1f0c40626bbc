"""The throws of a recording of any length: paths that slide as a stone slides, one at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from curling_env.typing import Floats, Image
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.scene import Scene
from friction_estimation.film.video import Film
from friction_estimation.tracking.background import find_background, sheet_region
from friction_estimation.tracking.joint import numbers
from friction_estimation.tracking.joint.association import RESTING, SLIDING, Path, likeliest_paths
from friction_estimation.tracking.joint.detections import Detections, Detector, StoneFinder


@dataclass(frozen=True, kw_only=True)
class ThrowInFilm:
    """A throw in a recording.

    Parameters
    ----------
    begin, end : the part of the film that shows it [s]
    odds : log odds of a stone against clutter
    """

    begin: float
    end: float
    odds: float


def find_throws(
    film: Film, scene: Scene, camera: Camera, finder: StoneFinder | None = None
) -> list[ThrowInFilm]:
    """Find the throws of a recording, in order.

    Parameters
    ----------
    film : of one throw or of many
    scene : its camera's view of the sheet
    camera : the same, solved
    finder : finds stones in pictures; None: only what moves alone is found
    """
    model = StoneModel(radius=scene.stone_radius, height=scene.stone_height)
    region = sheet_region(camera, scene.sheet)
    seen: Detections | None = None
    for frames in _windows(film):
        some = frames[:: max(1, -(-len(frames) // numbers.BACKGROUND_FRAMES))]
        background = find_background([frame for _, frame in some], region)
        detector = Detector(background, camera, model, scene.sheet, finder)
        found = detector.detect(frames)
        seen = found if seen is None else seen.joined(found)
    if seen is None:
        return []
    paths = likeliest_paths(seen, scene.sheet.width * scene.sheet.length)
    thrown = [part for path in paths for part in slides_of(path, seen) if is_throw(part, seen)]
    chosen: list[tuple[float, float, float]] = []
    for path in sorted(thrown, key=lambda path: -path.odds):
        begin, end = seen.t[path.at[[0, -1]]].tolist()
        if all(end <= first or begin >= last for first, last, _ in chosen):
            chosen.append((begin, end, path.odds))  # no two stones are thrown at once
    return [
        ThrowInFilm(
            begin=max(begin - numbers.BEFORE_THROW, 0.0),
            end=min(end + numbers.AFTER_THROW, film.duration),
            odds=odds,
        )
        for begin, end, odds in sorted(chosen)
    ]


def _windows(film: Film) -> Iterator[list[tuple[float, Image]]]:
    """Yield frames a short step apart, in windows over each of which the ice stays the same."""
    edges = np.arange(0.0, film.duration + numbers.WINDOW, numbers.WINDOW)
    for low, high in pairwise(edges.tolist()):
        if frames := list(film.between(low, min(high, film.duration), numbers.LOOK_STEP)):
            yield frames


def slides_of(path: Path, seen: Detections) -> list[Path]:
    """The parts of a path up to where it is moved again: after it rested, or by a gain of speed.

    Parameters
    ----------
    path : of one stone, or of one after the other
    seen : all detections
    """
    t, xy = seen.t[path.at], seen.xy[path.at]
    if len(t) < 3:
        return [path]
    pace = np.hypot(*np.diff(xy, axis=0).T) / np.diff(t)
    gains = np.append(pace[1:] - pace[:-1], 0.0) > numbers.PUSHED
    jumps = np.diff(path.gained) < numbers.HIT / 2
    slow = np.hypot(*(xy[2:] - xy[:-2]).T) < numbers.STANDING * (t[2:] - t[:-2])
    rests = (path.mode == RESTING) | np.append(slow, [False, False])
    again = ~rests[1:] & rests[:-1]
    cuts = 1 + np.flatnonzero(again | (jumps & (gains | np.append(False, gains[:-1]))))
    edges = [0, *cuts.tolist(), len(path.at)]
    return [path.part(low, high) for low, high in pairwise(edges)]


def is_throw(path: Path, seen: Detections) -> bool:
    """Return whether a path slides some way and slows down as a stone rather than as a walker."""
    slides = path.at[path.mode == SLIDING]
    if len(slides) < numbers.LEAST_SLIDES or path.odds < numbers.SURE:
        return False
    t, xy = seen.t[slides], seen.xy[slides]
    if np.hypot(*(xy[-1] - xy[0])) < numbers.MAX_PUSH:
        return False
    slowing, sigma = deceleration(t, xy, seen.sigma[slides])
    ice = np.hypot(numbers.DECELERATION_SIGMA, sigma)
    walk = np.hypot(numbers.WALKING_SIGMA, sigma)
    as_stone = -np.log(ice) - 0.5 * ((slowing - numbers.DECELERATION) / ice) ** 2
    as_walker = -np.log(walk) - 0.5 * (slowing / walk) ** 2
    return bool(as_stone > as_walker)


def deceleration(t: Floats, xy: Floats, sigma: Floats) -> tuple[float, float]:
    """Mean deceleration along a path and its standard error [m/s²].

    Parameters
    ----------
    t : (n,) times [s]
    xy, sigma : (n, 2) places and their standard errors [m]
    """
    way = xy[-1] - xy[0]
    along = way / np.hypot(*way)
    error = np.sqrt((sigma * along) ** 2 @ np.ones(2))
    since = t - t.mean()
    design = np.column_stack([np.ones_like(since), since, since**2]) / error[:, None]
    inverse = np.linalg.inv(design.T @ design)
    values = inverse @ design.T @ (((xy - xy[0]) @ along) / error)
    return -2 * float(values[2]), 2 * float(np.sqrt(inverse[2, 2]))
