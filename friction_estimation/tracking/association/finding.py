"""All stones of a film, from its sampled frames: thrown, resting, and hit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from curling_env.errors import NoThrowError
from curling_env.typing import Flags, Floats
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.scene import Scene
from friction_estimation.tracking import numbers
from friction_estimation.tracking.association.coarse import coarse_path
from friction_estimation.tracking.association.linking import RestingPlace, left_near, link
from friction_estimation.tracking.association.paths import RESTING, Path, most_likely_paths
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.detection.detections import Detections, Detector, StoneFinder
from friction_estimation.tracking.films.steady_film import SteadyFilm
from friction_estimation.tracking.measuring.looks import SeenStone, crowded
from friction_estimation.tracking.measuring.others import RestingStone


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmStones:
    """The stones of a film.

    Parameters
    ----------
    thrown : the thrown stone
    resting : those that rest when the film begins, with their paths where they were hit
    arrived : where others rest when it ends, each (2,) [m]
    seen, paths : all detections, and the paths of the association through them
    """

    thrown: SeenStone
    resting: tuple[RestingStone, ...]
    arrived: tuple[Floats, ...]
    seen: Detections
    paths: Sequence[Path]


def find_stones(
    film: SteadyFilm,
    scene: Scene,
    camera: Camera,
    background: Background,
    finder: StoneFinder | None,
) -> FilmStones:
    """Find all stones in the sampled frames, and in more around the contacts.

    Raises
    ------
    NoThrowError : nothing slides along the ice
    """
    model = StoneModel(radius=scene.stone_radius, height=scene.stone_height)
    detector = Detector(background, camera, model, scene.sheet, finder)
    area = scene.sheet.width * scene.sheet.length
    last = float(film.sample[-1][0]) + 1.0
    seen = detector.detect(film.sample)
    paths = most_likely_paths(seen, area)
    places = _places(detector.at_rest, paths, seen)
    thrown = thrown_path(paths, seen, 2 * model.radius)
    left = [] if thrown is None else left_near(thrown, places, seen, 2 * model.radius)
    if left:
        known = set(seen.times.tolist())
        for low, high in _spans([place.until for place in left]):
            dense = film.between(low, high, numbers.DENSE_STEP)
            seen = seen.joined(detector.detect(one for one in dense if one[0] not in known))
        paths = most_likely_paths(seen, area)
        places = _places(detector.at_rest, paths, seen)
        thrown = thrown_path(paths, seen, 2 * model.radius)
    if thrown is None:
        raise NoThrowError(
            "no thrown stone found: nothing of a stone's size slides along the ice",
            source=film.path,
        )
    movers = link(thrown, places, seen, 2 * model.radius)
    way, *hit = (coarse_path(one.as_path(thrown.odds), seen, last, one.contacts) for one in movers)
    own = {id(one.rested): path for path, one in zip(hit, movers[1:], strict=True)}
    resting = [
        RestingStone(xy=place.xy, until=place.until, path=own.get(id(place))) for place in places
    ]
    stone = SeenStone(
        path=way,
        sample=dict(film.sample),
        background=background,
        found_by=camera,
        model=model,
        people=crowded(way, seen, camera),
    )
    return FilmStones(
        thrown=stone,
        resting=tuple(resting),
        arrived=tuple(_arrived(paths, seen)),
        seen=seen,
        paths=paths,
    )


def _arrived(paths: Sequence[Path], seen: Detections) -> list[Floats]:
    """Return final resting places (2,) of stones that moved [m]."""
    end = seen.times[-numbers.END_FRAMES :][0]
    found: list[Floats] = []
    for path in paths:
        rests = path.mode == RESTING
        if rests[-1] and not rests.all() and seen.t[path.at[-1]] >= end:
            last = np.flatnonzero(~rests)[-1] + 1
            found.append(np.median(seen.xy[path.at[last:]], axis=0))
    return found


def thrown_path(paths: Sequence[Path], seen: Detections, touching: float) -> Path | None:
    """Return the most likely path that slides over some distance and was not hit.

    A stone that was not hit does not start from rest: the one that rested there is another stone. A
    stone that came to rest and moves again is moved by someone.

    Parameters
    ----------
    touching : distance of the centres of two stones that touch [m]
    """
    for path in paths:
        if not path.slides:
            continue
        begin = int(np.flatnonzero(path.mode != RESTING)[0])
        others = [one for one in paths if one is not path and one.slides]
        if begin and any(_may_hit(one, path, begin, seen, touching) for one in others):
            continue
        rests = path.mode[begin:] == RESTING
        again = np.flatnonzero(rests[:-1] & ~rests[1:])
        end = begin + int(again[0]) + 1 if len(again) else len(path.at)
        way = seen.xy[path.at[end - 1]] - seen.xy[path.at[begin]]
        if np.hypot(*way) > numbers.LEAST_WAY:
            return path.part(begin, end)
    return None


def _may_hit(one: Path, path: Path, begin: int, seen: Detections, touching: float) -> bool:
    """Return whether another path passes near a resting place when it is left."""
    last = path.at[begin - 1]
    place = RestingPlace(xy=seen.xy[last], until=float(seen.t[last]), at=path.at[:begin])
    return bool(left_near(one, [place], seen, touching))


def _spans(moments: Sequence[float]) -> list[tuple[float, float]]:
    """Return spans of time around moments [s], joined if they overlap."""
    spans: list[tuple[float, float]] = []
    for moment in sorted(moments):
        low = max(moment - numbers.DENSE_BEFORE, 0.0)
        high = moment + numbers.DENSE_AFTER
        if spans and low <= spans[-1][1]:
            spans[-1] = spans[-1][0], high
        else:
            spans.append((low, high))
    return spans


def _places(
    at_rest: Sequence[Floats], paths: Sequence[Path], seen: Detections
) -> list[RestingPlace]:
    """Return the initial resting places of stones: on still ice, or at the beginning of a path."""
    rests = [np.flatnonzero(_near(xy, seen) & seen.still) for xy in at_rest]
    for path in paths:
        moves = np.flatnonzero(path.mode != RESTING)
        at = path.at[: moves[0]] if len(moves) else path.at
        if len(at) > 1 and not seen.still[at].any():
            rests.append(at)
    begin, end = seen.times[: numbers.END_FRAMES][-1], seen.times[-numbers.END_FRAMES :][0]
    places: list[RestingPlace] = []
    for at in sorted(rests, key=lambda at: seen.t[at].min(initial=np.inf)):
        if not len(at):
            continue
        xy = np.median(seen.xy[at], axis=0)
        same = [k for k, one in enumerate(places) if _distance(one.xy, xy) < numbers.SAME_PLACE]
        if same:
            at = np.union1d(places[same[0]].at, at)
        elif seen.t[at[0]] > begin:  # it came to rest there
            continue
        until = float(seen.t[at[-1]])
        place = RestingPlace(xy=xy, until=until if until < end else np.inf, at=at)
        places = [one for k, one in enumerate(places) if k not in same] + [place]
    return places


def _near(xy: Floats, seen: Detections) -> Flags:
    """Return which detections are at a place, (n,)."""
    return np.hypot(*(seen.xy - xy).T) < numbers.SAME_PLACE


def _distance(one: Floats, other: Floats) -> float:
    return float(np.hypot(*(one - other)))
