"""All stones of a film, from its sampled frames: thrown, resting, and hit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from curling_env.errors import NoThrowError
from curling_env.typing import Floats
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.scene import Scene
from friction_estimation.tracking import tuning
from friction_estimation.tracking.association.coarse import coarse_path
from friction_estimation.tracking.association.linking import RestingPlace, link, vacated_near
from friction_estimation.tracking.association.paths import RESTING, Path, most_likely_paths
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.detection.detections import Detections, Detector
from friction_estimation.tracking.detection.detector import StoneFinder
from friction_estimation.tracking.films.steady_film import SteadyFilm
from friction_estimation.tracking.measuring.looks import SeenStone, crowded
from friction_estimation.tracking.measuring.others import RestingStone

_CANDIDATES = 3
"""Most paths of a film that are tried as the thrown stone's."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmStones:
    """The stones of a film.

    Parameters
    ----------
    thrown : the thrown stone
    resting : those that rest when the film begins, with their paths where they were hit
    arrived : where others rest when it ends, each (2,) [m]
    """

    thrown: SeenStone
    resting: tuple[RestingStone, ...]
    arrived: tuple[Floats, ...]


def find_stones(
    film: SteadyFilm,
    scene: Scene,
    camera: Camera,
    background: Background,
) -> Iterator[FilmStones]:
    """Find all stones in the sampled frames, and in more around the contacts.

    Returns
    -------
    One answer for each path that may be the thrown stone's, the most likely first: people beside
    the stone move as smoothly as it does

    Raises
    ------
    NoThrowError : nothing slides along the ice
    """
    model = StoneModel(radius=scene.stone_radius, height=scene.stone_height)
    finder = StoneFinder(camera, model, scene.sheet)
    detector = Detector(background, camera, model, scene.sheet, finder)
    seen = detector.detect(film.sample)
    paths = most_likely_paths(seen, scene.sheet.width * scene.sheet.length)
    candidates = thrown_paths(paths, seen, 2 * model.radius)[:_CANDIDATES]
    if not candidates:
        raise NoThrowError(
            "no thrown stone found: nothing of a stone's size slides along the ice",
            source=film.path,
        )
    return (_stones_of(one, paths, seen, detector, film) for one in candidates)


def _stones_of(
    thrown: Path, paths: Sequence[Path], seen: Detections, detector: Detector, film: SteadyFilm
) -> FilmStones:
    """All stones of a film, if one path is the thrown stone's."""
    model, touching = detector.model, 2 * detector.model.radius
    left = vacated_near(thrown, _places(detector.at_rest, paths, seen), seen, touching)
    if left:
        known = set(seen.times.tolist())
        denser = seen
        for low, high in _spans([place.until for place in left]):
            dense = film.between(low, high, tuning.DENSE_STEP)
            denser = denser.joined(detector.detect(one for one in dense if one[0] not in known))
        all_paths = most_likely_paths(denser, detector.sheet.width * detector.sheet.length)
        again = found_again(
            thrown, seen, thrown_paths(all_paths, denser, touching), denser, touching
        )
        if again is not None:
            thrown, seen, paths = again, denser, all_paths
    places = _places(detector.at_rest, paths, seen)
    movers = link(thrown, places, seen, touching)
    last = float(film.sample[-1][0]) + 1.0
    way, *hit = (
        coarse_path(np.array(one.at), np.array(one.mode), seen, last, one.contacts)
        for one in movers
    )
    own = {id(one.rested): path for path, one in zip(hit, movers[1:], strict=True)}
    resting = [
        RestingStone(xy=place.xy, until=place.until, path=own.get(id(place))) for place in places
    ]
    stone = SeenStone(
        path=way,
        sample=dict(film.sample),
        background=detector.background,
        found_by=detector.camera,
        model=model,
        people=crowded(way, seen, detector.camera),
    )
    return FilmStones(
        thrown=stone,
        resting=tuple(resting),
        arrived=tuple(_arrived(paths, seen)),
    )


def found_again(
    path: Path, seen: Detections, others: Sequence[Path], denser: Detections, touching: float
) -> Path | None:
    """Return the path of the same object in denser detections.

    Parameters
    ----------
    path, seen : path, and the detections of which it consists
    others, denser : paths of the denser detections
    touching : distance of the centres of two stones that touch [m]

    Returns
    -------
    None if all others are elsewhere, such as those of people
    """
    t, xy = seen.t[path.at], seen.xy[path.at]
    away = [_apart(t, xy, denser.t[one.at], denser.xy[one.at]) for one in others]
    if min(away, default=np.inf) > touching:
        return None
    return others[int(np.argmin(away))]


def _apart(t: Floats, xy: Floats, other_t: Floats, other_xy: Floats) -> float:
    """Median distance of a path from places (n, 2) at times t [m]; another path's where it ends."""
    there = np.column_stack([np.interp(t, other_t, axis) for axis in other_xy.T])
    return float(np.median(np.hypot(*(xy - there).T)))


def _arrived(paths: Sequence[Path], seen: Detections) -> list[Floats]:
    """Return final resting places (2,) of stones that moved [m]."""
    end = seen.times[-tuning.END_FRAMES :][0]
    found: list[Floats] = []
    for path in paths:
        rests = path.mode == RESTING
        if rests[-1] and not rests.all() and seen.t[path.at[-1]] >= end:
            last = np.flatnonzero(~rests)[-1] + 1
            found.append(np.median(seen.xy[path.at[last:]], axis=0))
    return found


def thrown_paths(paths: Sequence[Path], seen: Detections, touching: float) -> list[Path]:
    """Return the paths that slide over some distance and were not hit, the most likely first.

    A stone that was not hit does not start from rest: the one that rested there is another stone. A
    stone that came to rest and moves again is moved by someone.

    Parameters
    ----------
    touching : distance of the centres of two stones that touch [m]
    """
    found: list[Path] = []
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
        if np.hypot(*way) > tuning.SAME_PLACE:
            found.append(path.part(begin, end))
    return found


def _may_hit(one: Path, path: Path, begin: int, seen: Detections, touching: float) -> bool:
    """Return whether another path passes near a resting place when it is left."""
    last = path.at[begin - 1]
    place = RestingPlace(xy=seen.xy[last], until=float(seen.t[last]), at=path.at[:begin])
    return bool(vacated_near(one, [place], seen, touching))


def _spans(moments: Sequence[float]) -> list[tuple[float, float]]:
    """Return spans of time around moments [s], joined if they overlap."""
    spans: list[tuple[float, float]] = []
    for moment in sorted(moments):
        low = max(moment - tuning.DENSE_BEFORE, 0.0)
        high = moment + tuning.DENSE_AFTER
        if spans and low <= spans[-1][1]:
            spans[-1] = spans[-1][0], high
        else:
            spans.append((low, high))
    return spans


def _places(
    at_rest: Sequence[Floats], paths: Sequence[Path], seen: Detections
) -> list[RestingPlace]:
    """Return the initial resting places of stones: on still ice, or at the beginning of a path."""
    near = [np.hypot(*(seen.xy - xy).T) < tuning.SAME_PLACE for xy in at_rest]
    rests = [np.flatnonzero(one & seen.still) for one in near]
    for path in paths:
        moves = np.flatnonzero(path.mode != RESTING)
        at = path.at[: moves[0]] if len(moves) else path.at
        if len(at) > 1 and not seen.still[at].any():
            rests.append(at)
    begin, end = seen.times[: tuning.END_FRAMES][-1], seen.times[-tuning.END_FRAMES :][0]
    places: list[RestingPlace] = []
    for at in sorted(rests, key=lambda at: seen.t[at].min(initial=np.inf)):
        if not len(at):
            continue
        xy = np.median(seen.xy[at], axis=0)
        same = [k for k, one in enumerate(places) if np.hypot(*(one.xy - xy)) < tuning.SAME_PLACE]
        if same:
            at = np.union1d(places[same[0]].at, at)
        elif seen.t[at[0]] > begin:  # it came to rest there
            continue
        until = float(seen.t[at[-1]])
        place = RestingPlace(xy=xy, until=until if until < end else np.inf, at=at)
        places = [one for k, one in enumerate(places) if k not in same] + [place]
    return places
