"""Throws of a recording of any length: paths that slide like a stone, one at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from curling_env.sheet import HACK_Y, HOG_LINE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Image, Progress, no_progress
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.scene import Scene
from friction_estimation.film.video import Film
from friction_estimation.tracking import tuning
from friction_estimation.tracking.association.paths import (
    RESTING,
    SLIDING,
    Path,
    most_likely_paths,
)
from friction_estimation.tracking.detection.background import find_background, sheet_region
from friction_estimation.tracking.detection.detections import Detections, Detector
from friction_estimation.tracking.detection.detector import StoneFinder
from friction_estimation.tracking.films.motion_detector import MotionDetector
from friction_estimation.tracking.films.quick_looks import looks, parts_for

_MOVES_AGAIN = 8
"""Maximum number of times that an object of one path is moved again."""
_STEP = 0.25
"""Time step of the search for a stone before and after its detections [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ThrowInFilm:
    """A throw in a recording.

    Parameters
    ----------
    begin, end : the part of the film that shows it [s]
    first, last : when its stone is detected sliding first and last [s]
    start, stop : (2,) where it is detected first, carried or sliding, and where it is last [m]
    rests : whether it is seen to come to rest
    from_rest : whether it is set in motion in sight, from where a stone lay
    odds : log odds of a stone against clutter, less those of the looks in which it is not seen
    """

    begin: float
    end: float
    first: float
    last: float
    start: Floats
    stop: Floats
    rests: bool
    from_rest: bool
    odds: float

    def may_continue(self, later: ThrowInFilm) -> bool:
        """Return whether a later path may be of the same stone, lost in between."""
        way = self.stop[1] - self.start[1]
        ahead = (later.start[1] - self.stop[1]) * way > 0
        return not self.rests and ahead and (later.stop[1] - later.start[1]) * way > 0


def find_throws(
    film: Film,
    scene: Scene,
    camera: Camera,
    *,
    slid_back: Callable[[float, float], object] = lambda begin, end: None,
    progress: Progress = no_progress,
) -> list[ThrowInFilm]:
    """Find the throws of a recording, in order.

    Parameters
    ----------
    film : of one camera that stands still; of any number of throws
    scene : sizes of sheet and stone
    camera : its view of the sheet
    slid_back : called with when a stone is slid back, from and to [s], which is no throw
    progress : called with the number of frames passed and the expected number of all
    """
    parts = parts_for(film.size)
    small = camera.resized(
        np.full(2, 1 / parts), (camera.size[0] // parts, camera.size[1] // parts)
    )
    model = StoneModel(radius=scene.stone_radius, height=scene.stone_height)
    region = sheet_region(small, scene.sheet)
    finder = StoneFinder(small, model, scene.sheet, quick=True)
    seen: Detections | None = None
    detector: Detector | None = None
    for frames in _windows(film, MotionDetector.for_camera(camera, scene), parts, progress):
        some = frames[:: max(1, -(-len(frames) // tuning.BACKGROUND_FRAMES))]
        background = find_background([frame for _, frame in some], region)
        detector = Detector(
            background,
            small,
            model,
            scene.sheet,
            finder,
            every=tuning.ASKED_EVERY,
            before=detector,
        )
        some_seen = detector.detect(frames)
        seen = some_seen if seen is None else seen.joined(some_seen)
    if seen is None:
        return []
    area = scene.sheet.width * scene.sheet.length
    moves = throws_among(most_likely_paths(seen, area), seen, small, area)
    found: list[ThrowInFilm] = []
    free = 0.0
    for one in without_returns(moves, slid_back):  # no two stones are thrown at once
        before = max((k.last for k in moves if k.last < one.first), default=0.0)
        after = min((k.first for k in moves if k.first > one.last), default=film.duration)
        begin = min(max(one.begin, free, before), one.first)
        end = min(one.end, film.duration, max(after - tuning.APART, one.last))
        found.append(replace(one, begin=begin, end=end))
        free = end
    return found


def _windows(
    film: Film, motion: MotionDetector, parts: int, progress: Progress
) -> Iterator[list[tuple[float, Image]]]:
    """Yield frames a short step apart, in windows over each of which the ice stays the same.

    Windows without motion are skipped.
    """
    label, count = f"look through {film.path.name}", film.frame_count
    frames: list[tuple[float, Image]] = []
    moves = False
    for look in looks(film):
        progress(label, min(round(look.t * film.fps), count), count)
        if frames and look.t > frames[0][0] + tuning.WINDOW:
            if moves:
                yield frames
            frames, moves = [], False
        moves |= motion.detects(look.t, look.grey)
        frames.append((look.t, look.picture(parts)))
    if moves:
        yield frames


def throws_among(
    paths: Sequence[Path], seen: Detections, camera: Camera, area: float
) -> list[ThrowInFilm]:
    """Return the throws among the paths of a recording, in order.

    Parameters
    ----------
    paths : of all stones, as the association finds them
    seen : all detections
    camera : that took the frames
    area : of the ice that is in view [m²]
    """
    parts = [part for part in _separate(paths, seen, area) if is_throw(part, seen)]
    if not parts:
        return []
    # All stones slide on the same ice.
    each = np.array([deceleration_of(part, seen) for part in parts])
    order = np.argsort(each)
    odds = np.cumsum(np.array([part.odds for part in parts])[order])
    ice = float(each[order][np.searchsorted(odds, odds[-1] / 2)])
    slides = [_throw(part, seen, camera) for part in parts if is_throw(part, seen, ice)]
    chosen: list[ThrowInFilm] = []
    for one in sorted(slides, key=lambda one: -one.odds):
        # No stone appears or vanishes in the middle; and no two are thrown at once.
        if one.odds < tuning.SURE:
            break
        if all(one.first > k.last or one.last < k.first for k in chosen):
            chosen.append(one)
    throws: list[ThrowInFilm] = []
    for one in sorted(chosen, key=lambda one: one.first):
        before = throws[-1] if throws else None
        if before is not None and one.begin < before.end and before.may_continue(one):
            throws[-1] = replace(
                one,
                begin=before.begin,
                first=before.first,
                start=before.start,
                odds=before.odds + one.odds,
            )
        else:
            throws.append(one)
    return throws


def _separate(paths: Sequence[Path], seen: Detections, area: float) -> list[Path]:
    """Split paths where an object is moved again, and associate the rest again.

    A path that continues from one stone to the next may have the wrong beginning of the next.
    """
    found: list[Path] = []
    for _ in range(_MOVES_AGAIN):
        parts = [slides_of(path, seen) for path in paths]
        found += [own[0] for own in parts]
        later = [part.at for own in parts for part in own[1:]]
        paths = most_likely_paths(seen, area, np.concatenate(later)) if later else []
    return found


def _throw(part: Path, seen: Detections, camera: Camera) -> ThrowInFilm:
    """Return a throw with the time during which its stone is in view, extrapolated by its
    motion.
    """
    slides = np.flatnonzero(part.mode == SLIDING)
    at = part.at[slides]
    t, xy = seen.t[at], seen.xy[at]
    held, later = part.at[: slides[0]], part.at[slides[-1] + 1 :]
    begin = t[0] - _in_view(camera, t, xy, -1.0)
    if len(held):
        begin = min(begin, float(seen.t[held[0]]))
    end = t[-1] + _in_view(camera, t, xy, 1.0)
    if len(later):
        end = float(seen.t[later[0]])
    missing = (seen.times > begin) & (seen.times < t[0])
    if not len(later):
        missing |= (seen.times > t[-1]) & (seen.times < end)
    return ThrowInFilm(
        begin=max(float(begin), float(t[0]) - tuning.HELD, 0.0),
        end=float(end) + tuning.AFTER_THROW,
        first=float(t[0]),
        last=float(t[-1]),
        start=seen.xy[part.at[0]],
        stop=xy[-1],
        rests=bool(len(later)),
        from_rest=_starts_from_rest(part, seen),
        odds=part.odds + tuning.MISSED * float(missing.sum()),
    )


def _starts_from_rest(part: Path, seen: Detections) -> bool:
    """Return whether a stone was at rest at the beginning of a path and moves slowly at first."""
    at = part.at
    t, xy = seen.t[at], seen.xy[at]
    way = (xy[-1] - xy[0]) / max(float(np.hypot(*(xy[-1] - xy[0]))), 1e-9)
    lay = (seen.t < t[0]) & (seen.t > t[0] - tuning.RESTED)
    lay &= np.hypot(*(seen.xy - xy[0]).T) < tuning.RETURNS_FROM
    lay &= (xy[0] - seen.xy) @ way > -2 * tuning.DETECTION_M
    last = np.flatnonzero(lay)[-1:]
    if not len(last):
        return False
    first = np.append(last, at[:1])
    return _mean_speed(seen.t[first], seen.xy[first]) < tuning.FROM_REST * _mean_speed(t, xy)


def _mean_speed(t: Floats, xy: Floats) -> float:
    """Mean speed from the first of some places (n, 2) to the last one [m/s]."""
    return float(np.hypot(*(xy[-1] - xy[0])) / (t[-1] - t[0]))


def _in_view(camera: Camera, t: Floats, xy: Floats, sense: float) -> float:
    """Time for which a stone is in view before its first detection or after its last one [s].

    Parameters
    ----------
    t, xy : (n,) times [s] and (n, 2) places [m] while it slides
    sense : -1 before the first one, 1 after the last one
    """
    own = slice(None, tuning.LINK_FITS) if sense < 0 else slice(-tuning.LINK_FITS, None)
    if len(t[own]) < 2:
        return 0.0
    end = 0 if sense < 0 else -1
    velocity = np.polynomial.polynomial.polyfit(t[own] - t[own].mean(), xy[own], 1)[1]
    speed = max(float(np.hypot(*velocity)), 1e-6)
    along = velocity / speed
    speed = max(speed - tuning.DECELERATION * (t[end] - t[own].mean()), 0.0)  # at that end
    longest = speed / tuning.DECELERATION if sense > 0 else tuning.LONGEST_SLIDE
    later = np.arange(0.0, longest, _STEP)
    way = sense * speed * later - 0.5 * tuning.DECELERATION * later**2
    places = xy[end] + way[:, None] * along
    there = camera.sees(np.column_stack([places, np.zeros(len(later))]))
    there &= np.abs(places[:, 1]) < HACK_Y
    gone = np.flatnonzero(~there)
    return float(later[gone[0]] if len(gone) else longest)


def without_returns(
    throws: Sequence[ThrowInFilm],
    slid_back: Callable[[float, float], object] = lambda begin, end: None,
) -> Iterator[ThrowInFilm]:
    """Return the throws without stones that are pushed back, or were hit.

    Parameters
    ----------
    slid_back : called with when each of them was slid back, from and to [s]
    """
    before: ThrowInFilm | None = None
    for one in throws:
        if before is not None:
            near = np.hypot(*(one.start - before.stop)) < tuning.RETURNS_FROM
            back = (one.stop - one.start)[1] * (before.stop - before.start)[1] < 0
            hit = one.first < before.last + tuning.CONTACT_WITHIN
            if near and (hit or (back and one.from_rest)):
                if not hit:
                    slid_back(one.first, one.last)
                continue
        before = one
        yield one


def slides_of(path: Path, seen: Detections) -> list[Path]:
    """Return the parts of a path up to where its object is moved again.

    That is after rest, or at a gain of speed or a reversal.

    Parameters
    ----------
    path : of one stone, or of one after the other
    seen : all detections
    """
    t, xy = seen.t[path.at], seen.xy[path.at]
    if len(t) < 3:
        return [path]
    speed = np.hypot(*np.diff(xy, axis=0).T) / np.diff(t)
    gains = np.append(speed[1:] - speed[:-1], 0.0) > tuning.PUSHED
    jumps = np.diff(path.gained) < tuning.HIT / 2
    slow = np.hypot(*(xy[2:] - xy[:-2]).T) < tuning.STANDING * (t[2:] - t[:-2])
    rests = (path.mode == RESTING) | np.append(slow, [False, False])
    again = ~rests[1:] & rests[:-1]
    again[_turns(xy)] = True
    cuts = 1 + np.flatnonzero(again | (jumps & (gains | np.append(False, gains[:-1]))))
    edges = [0, *cuts.tolist(), len(path.at)]
    return [path.part(low, high) for low, high in pairwise(edges)]


def _turns(xy: Floats) -> list[int]:
    """Indices of the places (n, 2) at which a path reverses."""
    turns: list[int] = []
    start = farthest = 0
    for k in range(1, len(xy)):
        way = xy[farthest] - xy[start]
        along = way / max(float(np.hypot(*way)), 1e-9)
        if farthest == start or (xy[k] - xy[farthest]) @ along > 0:
            farthest = k
        elif (xy[farthest] - xy[k]) @ along > tuning.SAME_PLACE:
            turns.append(farthest)
            start, farthest = farthest, k
    return turns


def deceleration_of(path: Path, seen: Detections) -> float:
    """Mean deceleration of a path while it slides [m/s²]."""
    slides = path.at[path.mode == SLIDING]
    return deceleration(seen.t[slides], seen.xy[slides], seen.sigma[slides])[0]


def is_throw(path: Path, seen: Detections, ice: float | None = None) -> bool:
    """Return whether a path is that of a throw: a stone slides over some distance, and past the
    near hog line.

    Parameters
    ----------
    ice : deceleration of stones on this ice, where it is known [m/s²]
    """
    slides = path.at[path.mode == SLIDING]
    if len(slides) < tuning.MIN_FITS or path.odds < tuning.SURE:
        return False
    t, xy = seen.t[slides], seen.xy[slides]
    if np.hypot(*(xy[-1] - xy[0])) < tuning.LEAST_THROW:
        return False
    if path.mode[-1] == RESTING and is_before_its_hog_line(xy):
        return False
    return slides_as_stone(t, xy, seen.sigma[slides], ice)


def is_before_its_hog_line(xy: Floats) -> bool:
    """Return whether a path (n, 2) [m] ends before the near hog line.

    Objects that stop there were not thrown: they are people, or stones that are moved.
    """
    return bool(np.sign(xy[-1, 1] - xy[0, 1]) * xy[-1, 1] < -HOG_LINE_Y)


def slides_as_stone(t: Floats, xy: Floats, sigma: Floats, ice: float | None = None) -> bool:
    """Return whether an object moves like a thrown stone rather than a walking person.

    A stone is slowed by the ice, or is hit. People keep a speed or change it at will, and are
    slower than a hard throw.

    Parameters
    ----------
    t : (n,) times while it moves, three or more [s]
    xy, sigma : (n, 2) places and their standard errors [m]
    ice : deceleration of stones on this ice, where it is known [m/s²]
    """
    rate, error = deceleration(t, xy, sigma)
    off = (_mean_speed(t, xy) - tuning.WALKING_SPEED) / tuning.WALKING_SPEED_SIGMA

    def near(mean: float, spread: float) -> float:
        spread = float(np.hypot(spread, error))
        return np.exp(-0.5 * ((rate - mean) / spread) ** 2) / spread / np.sqrt(2 * np.pi)

    least, most = tuning.ICE
    if ice is not None:
        usual = near(ice, ice * tuning.DECELERATION_SIGMA / tuning.DECELERATION)
    elif least - 2 * error < rate < most + 2 * error:
        usual = 1 / np.clip(rate, least, most) / np.log(most / least)
    else:
        usual = 0.0
    as_stone = (1 - tuning.UNUSUAL) * usual + tuning.UNUSUAL / tuning.HIT_RANGE
    as_walker = (1 - tuning.UNUSUAL) * near(0.0, tuning.WALKING_SIGMA)
    as_walker += tuning.UNUSUAL / tuning.HALT_RANGE
    likelihood = np.exp(-0.5 * off**2) / (tuning.WALKING_SPEED_SIGMA * np.sqrt(2 * np.pi))
    return bool(as_stone / tuning.FASTEST > as_walker * likelihood)


def moved(track: Trajectory) -> str:
    """Return the reason why a track shows no thrown stone, in words; empty if it shows one.

    Parameters
    ----------
    track : of a stone in a part of a recording
    """
    rows = np.arange(0, len(track), max(1, len(track) // tuning.JUDGED_ROWS))
    t, xy = track.t[rows], track.xy[rows]
    way = np.hypot(*(xy - xy[0]).T)
    moving = way < tuning.NEARLY_ALL * way[-1]
    t, xy = t[moving], xy[moving]
    error = np.full(xy.shape, tuning.DETECTION_M)
    if len(track.sigma_xy):
        error = np.maximum(error, track.sigma_xy[rows][moving][:, None])
    if way[-1] < tuning.LEAST_THROW or (len(t) > 3 and not slides_as_stone(t, xy, error)):
        return "the moving object keeps its speed, as a carried or pushed stone does"
    late = track.xy[track.t >= track.t[-1] - tuning.RESTED]
    if np.hypot(*(late[-1] - late[0])) < tuning.SAME_PLACE and is_before_its_hog_line(track.xy):
        return "the moving object stops before the near hog line, as no thrown stone does"
    return ""


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
