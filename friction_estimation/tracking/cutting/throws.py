"""Where in a film stones are thrown: practice is one long film with empty ice between throws.

First the film is looked through for motion on the ice. Where something moves, blobs of a stone's
size are joined to paths; a path along which something slows down as a stone does on ice is a throw.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Image, Progress, no_progress
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.scene import Scene
from friction_estimation.film.video import Film
from friction_estimation.tracking import tuning as tracking
from friction_estimation.tracking.cutting import tuning
from friction_estimation.tracking.cutting.looks import looks, parts_for, smaller
from friction_estimation.tracking.cutting.motion import MotionDetector
from friction_estimation.tracking.detection.background import (
    Blob,
    find_background,
    moving_blobs,
    sheet_region,
)
from friction_estimation.tracking.detection.people import distance, is_larger
from friction_estimation.tracking.detection.thrown_stone import (
    RoughPath,
    Sighting,
    likeliest_path,
    sightings_in,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmedThrow:
    """A throw in a film.

    Parameters
    ----------
    begin, end : the part of the film that shows it, since the film began [s]
    path : roughly where its stone is, on the same clock
    """

    begin: float
    end: float
    path: RoughPath


@dataclass(frozen=True, kw_only=True, eq=False)
class LostPath:
    """Where a stone was seen, and what may have become of it.

    Parameters
    ----------
    path : where it was seen
    until : until when it is looked for: longer than it was seen where people may hide it [s]
    slides : until when it may have slid on [s]
    """

    path: RoughPath
    until: float
    slides: float

    @property
    def begin(self) -> float:
        """When it was first seen [s]."""
        return self.path.sightings[0].t

    @property
    def end(self) -> float:
        """When it was last seen [s]."""
        return self.path.sightings[-1].t


def find_throws(
    film: Film, scene: Scene, camera: Camera, *, progress: Progress = no_progress
) -> list[FilmedThrow]:
    """The throws in a film, in order.

    Parameters
    ----------
    film : of one camera that stands still; any number of throws, or none
    scene : sizes of sheet and stone
    camera : its view of the sheet
    progress : called with the number of frames passed and the expected number of all
    """
    finder = _ThrowFinder(film, scene, camera, progress)
    paths: list[LostPath] = []
    for low, high in _stretches(_motion(film, scene, camera, progress), film.duration):
        paths += finder.paths_between(low, high)
    return _apart(list(_without_returns(_whole(paths))), film.duration)


def _motion(film: Film, scene: Scene, camera: Camera, progress: Progress) -> Iterator[float]:
    """The times at which something has moved on the ice [s]."""
    motion = MotionDetector.for_camera(camera, scene)
    label, count = f"look through {film.path.name}", film.frame_count
    for look in looks(film, high=film.duration):
        progress(label, min(round(look.t * film.fps), count), count)
        if motion.detects(look.t, look.grey):
            yield look.t


def _stretches(moving: Iterator[float], end: float) -> list[tuple[float, float]]:
    """Stretches of film around the times at which something moves [s]."""
    found: list[tuple[float, float]] = []
    margin = tuning.STRETCH_MARGIN
    for t in moving:
        low, high = max(t - tuning.COMPARED_AFTER - margin, 0.0), min(t + margin, end)
        if found and low <= found[-1][1]:
            found[-1] = found[-1][0], high
        else:
            found.append((low, high))
    return found


class _ThrowFinder:
    """Finds the paths of thrown stones in a film that moves here and there."""

    def __init__(self, film: Film, scene: Scene, camera: Camera, progress: Progress) -> None:
        self._film, self._sheet, self._progress = film, scene.sheet, progress
        self._parts = parts_for(film.size)
        self._camera = smaller(camera, self._parts)
        self._region = sheet_region(self._camera, scene.sheet)
        self._model = StoneModel(radius=scene.stone_radius, height=scene.stone_height)

    def paths_between(self, low: float, high: float) -> list[LostPath]:
        """The paths of thrown stones from one time to another [s], in order."""
        found: list[LostPath] = []
        begin = low
        while begin < high:
            end = begin + tuning.WINDOW
            last = end >= high
            paths = self._paths_in(begin, min(end, high))
            sure = [k for k in paths if last or k.end < end - tuning.WINDOW_MARGIN]
            found += sure
            if last:
                break
            open_ = [k.begin for k in paths if k not in sure]
            following = min(open_, default=end - tuning.WINDOW_MARGIN) - tuning.STRETCH_MARGIN
            after = sure[-1].end if sure else begin
            # A path longer than a piece would be begun again and again.
            begin = max(following, after, begin + tuning.WINDOW / 4)
        return found

    def _paths_in(self, low: float, high: float) -> list[LostPath]:
        pictures: list[tuple[float, Image]] = []
        label, count = f"find throws in {self._film.path.name}", self._film.frame_count
        for look in looks(self._film, low, high):
            self._progress(label, min(round(look.t * self._film.fps), count), count)
            pictures.append((look.t, look.picture(self._parts)))
        if not pictures:
            return []
        every = max(1, -(-len(pictures) // tuning.BACKGROUND_LOOKS))
        background = find_background([picture for _, picture in pictures[::every]], self._region)
        blobs = [(t, moving_blobs(picture, background)) for t, picture in pictures]
        sightings = [
            sighting
            for i, (t, seen) in enumerate(blobs)
            for sighting in sightings_in(seen, i, t, self._camera, self._model, self._sheet)
        ]
        paths = sorted(thrown_paths(without_resting(sightings)), key=lambda k: k.sightings[0].t)
        return [self._lost(path, blobs) for path in paths]

    def _lost(self, path: RoughPath, blobs: Sequence[tuple[float, Sequence[Blob]]]) -> LostPath:
        """A path with what may have become of the stone after its last sighting."""
        last = path.sightings[-1]
        after = [seen for t, seen in blobs if last.t < t <= last.t + tuning.MAX_UNSEEN]
        lost = any(
            is_larger(blob, self._camera, self._model)
            and distance(blob, last.xy, self._camera) < tracking.PEOPLE_NEAR
            for seen in after[: tuning.LOOKS_AFTER]
            for blob in seen
        )
        slides = slides_until(path, self._sheet.length / 2)
        return LostPath(path=path, until=slides if lost else last.t, slides=slides)


def thrown_paths(sightings: Sequence[Sighting]) -> list[RoughPath]:
    """The paths of thrown stones through sightings, one after the other.

    What moves while a stone is thrown belongs to that throw.
    """
    left = list(sightings)
    for _ in range(tuning.MAX_TRIES):
        path = likeliest_path(left, tuning.MAX_UNSEEN, tuning.MAX_GAIN)
        if path is None:
            return []
        if not is_thrown(path):
            taken = set(map(id, path.sightings))
            left = [s for s in left if id(s) not in taken]
            continue
        begin, end = path.sightings[0].t, path.sightings[-1].t
        before = [s for s in left if s.t < begin]
        after = [s for s in left if s.t > end]
        return [*thrown_paths(before), path, *thrown_paths(after)]
    return []


def shows_several(sightings: Sequence[Sighting]) -> bool:
    """Whether frames spread over a film seem to show more than one throw."""
    paths = thrown_paths(without_resting(sightings))
    found = [LostPath(path=path, until=path.sightings[-1].t, slides=0.0) for path in paths]
    return len(list(_without_returns(sorted(found, key=lambda path: path.begin)))) > 1


def without_resting(sightings: Sequence[Sighting]) -> list[Sighting]:
    """The sightings without those of stones, or of anything else, that lie still."""
    if not sightings:
        return []
    t = np.array([s.t for s in sightings])
    xy = np.array([s.xy for s in sightings])
    looked = np.unique(t)
    still = np.zeros(len(t), dtype=bool)
    for k, place in enumerate(xy):
        there = np.unique(t[np.linalg.norm(xy - place, axis=1) < tuning.REST_DISTANCE])
        for low, high in ((t[k] - tuning.REST_SECONDS, t[k]), (t[k], t[k] + tuning.REST_SECONDS)):
            looks_then = np.count_nonzero((looked >= low) & (looked <= high))
            seen = np.count_nonzero((there >= low) & (there <= high))
            whole = low >= looked[0] and high <= looked[-1]
            still[k] |= whole and seen >= tuning.REST_SHARE * looks_then
    return [s for s, lies in zip(sightings, still, strict=True) if not lies]


def is_thrown(path: RoughPath) -> bool:
    """Whether something moves as a stone does that slides along the ice.

    It goes some way, and it slows down; who carries a stone walks at one pace.
    """
    t = np.array([s.t for s in path.sightings])
    along = np.abs(np.array([s.xy[1] for s in path.sightings]) - path.sightings[0].xy[1])
    if along[-1] < tuning.MIN_PATH:
        return False
    moving = np.flatnonzero(along >= tuning.MOVING_SHARE * along[-1])[0] + 1
    t, along = t[:moving], along[:moving]
    if len(t) < 4:
        return True  # too few to tell
    slowing, sigma = _slowing(t, along)
    lasted = t[-1] - t[0]
    speed = (along[-1] - along[0]) / lasted
    share = (slowing + 2 * sigma) * lasted / speed
    return bool(speed > tuning.WALKING_SPEED or share > tuning.MIN_SLOWING)


def _slowing(t: Floats, along: Floats) -> tuple[float, float]:
    """How fast something slows down by its way (n,) at four or more times [m/s²]; its error."""
    design = np.column_stack([np.ones_like(t), t - t[0], -0.5 * (t - t[0]) ** 2])
    fit, *_ = np.linalg.lstsq(design, along, rcond=None)
    rest = along - design @ fit
    variance = float(rest @ rest) / max(len(t) - 3, 1)
    return float(fit[2]), float(np.sqrt(variance * np.linalg.inv(design.T @ design)[2, 2]))


def slides_freely(track: Trajectory) -> bool:
    """The same of a measured track."""
    every = max(1, len(track) // tuning.JUDGED_ROWS)
    rows = zip(track.t[::every], track.xy[::every], strict=True)
    sightings = (Sighting(frame=k, t=t, xy=xy, likeness=1.0) for k, (t, xy) in enumerate(rows))
    return is_thrown(RoughPath(sightings=tuple(sightings)))


def stops_before_its_hog_line(track: Trajectory) -> bool:
    """Whether something comes to rest before the hog line of the end that it comes from.

    Then it was not thrown: somebody walks there, or a stone is moved.
    """
    y = track.xy[:, 1]
    late = track.xy[track.t >= track.t[-1] - tuning.RESTED_SECONDS]
    rests = np.linalg.norm(late[0] - late[-1]) < 2 * tuning.REST_DISTANCE
    return bool(rests and np.sign(y[-1] - y[0]) * y[-1] < -HOG_LINE_Y)


def _without_returns(paths: Sequence[LostPath]) -> Iterator[LostPath]:
    """The paths without those of stones that are slid back from where they came to rest.

    What goes on at once from where a stone came to rest was hit by it.
    """
    before: RoughPath | None = None
    for one in paths:
        path = one.path
        if before is not None:
            begin, end = path.sightings[0].xy, path.sightings[-1].xy
            came = before.sightings[-1].xy - before.sightings[0].xy
            near = np.linalg.norm(begin - before.sightings[-1].xy) < tuning.RETURN_DISTANCE
            at_once = path.sightings[0].t < before.sightings[-1].t + tuning.STRUCK_SECONDS
            if near and ((end - begin)[1] * came[1] < 0 or at_once):
                continue
        before = path
        yield one


def _whole(paths: Sequence[LostPath]) -> list[LostPath]:
    """The paths, those of a stone that was lost between sweepers joined with what goes on."""
    whole: list[LostPath] = []
    for path in paths:
        before = whole[-1] if whole else None
        if before is not None and _goes_on(before, path):
            joined = (*before.path.sightings, *path.path.sightings)
            whole[-1] = replace(path, path=RoughPath(sightings=joined))
        else:
            whole.append(path)
    return whole


def _goes_on(before: LostPath, path: LostPath) -> bool:
    """Whether a path sets out ahead of a stone that may still slide, and the same way."""
    if path.begin > before.slides:
        return False
    y = [s.xy[1] for s in before.path.sightings]
    own = [s.xy[1] for s in path.path.sightings]
    way = y[-1] - y[0]
    return bool((own[0] - y[-1]) * way > 0 and (own[-1] - own[0]) * way > 0)


def slides_until(path: RoughPath, far: float) -> float:
    """How long a stone may slide on from where it was last seen [s].

    Parameters
    ----------
    far : where the ice ends, from the middle of the sheet [m]
    """
    t = np.array([s.t for s in path.sightings])
    y = np.array([s.xy[1] for s in path.sightings])
    recent = t >= t[-1] - tuning.LAST_PACE_SECONDS
    if len(t) < 4 or np.count_nonzero(recent) < 2:
        return float(t[-1])
    pace = float(np.polyfit(t[recent], np.abs(y[recent] - y[0]), 1)[0])
    if pace < tuning.CREEPING:
        return float(t[-1])
    found, sigma = _slowing(t, np.abs(y - y[0]))
    slowing = float(np.clip(found - 2 * sigma, *tuning.SLOWING))  # pushed, it was faster at first
    left = max(far - y[-1] * np.sign(y[-1] - y[0]), 0.0)
    # It stops, or leaves the ice before.
    at_end = max(pace**2 - 2 * slowing * left, 0.0)
    return float(t[-1] + (pace - np.sqrt(at_end)) / slowing)


def _apart(paths: Sequence[LostPath], duration: float) -> list[FilmedThrow]:
    """Throws with what is before and after them, as far as no other throw is shown there."""
    begins = [path.begin for path in paths]
    ends = [path.until for path in paths]
    found: list[FilmedThrow] = []
    free = 0.0
    for k, path in enumerate(paths):
        following = begins[k + 1] if k + 1 < len(paths) else np.inf
        begin = min(max(begins[k] - tuning.LEAD_SECONDS, free), begins[k])
        latest = max(following - tuning.APART_SECONDS, path.end)
        end = min(ends[k] + tuning.TAIL_SECONDS, latest, duration)
        found.append(FilmedThrow(begin=begin, end=end, path=path.path))
        free = end
    return found
