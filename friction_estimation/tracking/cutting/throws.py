"""Where in a film stones are thrown: practice is one long film with empty ice between throws.

First the film is looked through for motion on the ice. Where something moves, blobs of a stone's
size are joined to paths; a path along which something slows down as a stone does on ice is a throw.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from curling_env.typing import Image, Progress, no_progress
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.scene import Scene
from friction_estimation.film.video import Film
from friction_estimation.tracking import tuning as tracking
from friction_estimation.tracking.background import (
    Blob,
    find_background,
    moving_blobs,
    sheet_region,
)
from friction_estimation.tracking.cutting import tuning
from friction_estimation.tracking.cutting.looks import Look, looks, parts_for, smaller
from friction_estimation.tracking.cutting.motion import MotionDetector
from friction_estimation.tracking.cutting.pace import (
    is_beside_a_stone,
    is_thrown,
    slides_until,
    without_resting,
    without_walkers,
)
from friction_estimation.tracking.cutting.paths import (
    LostPath,
    joined,
    vanishes_behind_its_hog_line,
    with_groups,
    without_returns,
)
from friction_estimation.tracking.detection.people import distance
from friction_estimation.tracking.detection.thrown_stone import (
    RoughPath,
    Sighting,
    likeliest_path,
    sightings_in,
)
from friction_estimation.tracking.joint.sightings import is_larger


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


def find_throws(
    film: Film,
    scene: Scene,
    camera: Camera,
    *,
    slid_back: Callable[[float, float], object] = lambda begin, end: None,
    progress: Progress = no_progress,
) -> list[FilmedThrow]:
    """The throws in a film, in order.

    Parameters
    ----------
    film : of one camera that stands still; any number of throws, or none
    scene : sizes of sheet and stone
    camera : its view of the sheet
    slid_back : called with when a stone is slid back, from and to [s], which is no throw
    progress : called with the number of frames passed and the expected number of all
    """
    finder = _ThrowFinder(film, scene, camera)
    motion = MotionDetector.for_camera(camera, scene)
    label, count = f"look through {film.path.name}", film.frame_count

    def moving() -> Iterator[tuple[Look, bool]]:
        for look in looks(film, high=film.duration):
            progress(label, min(round(look.t * film.fps), count), count)
            yield look, motion.detects(look.t, look.grey)

    paths = [path for stretch in stretches(moving()) for path in finder.paths_in(stretch)]
    whole = [path for path in joined(paths) if not vanishes_behind_its_hog_line(path, camera)]
    return _apart(list(without_returns(whole, slid_back)), film.duration)


def stretches(moving: Iterable[tuple[Look, bool]]) -> Iterator[Iterator[Look]]:
    """Stretches of film around the times at which something moves, each with its looks.

    A stretch must be taken to its end before the next one.

    Parameters
    ----------
    moving : looks in order, and whether something has moved shortly before each
    """
    ahead, after = tuning.COMPARED_AFTER + tuning.STRETCH_MARGIN, tuning.STRETCH_MARGIN
    coming = iter(moving)
    waiting: deque[Look] = deque()

    def stretch(until: float) -> Iterator[Look]:
        yield from take_until(until)
        for look, moves in coming:
            waiting.append(look)
            if moves:
                until = look.t + after
            yield from take_until(until)
            if look.t > until + ahead:
                return

    def take_until(until: float) -> Iterator[Look]:
        while waiting and waiting[0].t <= until:
            yield waiting.popleft()

    for look, moves in coming:
        waiting.append(look)
        while waiting[0].t < look.t - ahead:
            waiting.popleft()
        if moves:
            yield stretch(look.t + after)


class _ThrowFinder:
    """Finds the paths of thrown stones in a film that moves here and there."""

    def __init__(self, film: Film, scene: Scene, camera: Camera) -> None:
        self._sheet = scene.sheet
        self._parts = parts_for(film.size)
        self._camera = smaller(camera, self._parts)
        self._region = sheet_region(self._camera, scene.sheet)
        self._model = StoneModel(radius=scene.stone_radius, height=scene.stone_height)

    def paths_in(self, stretch: Iterator[Look]) -> list[LostPath]:
        """The paths of thrown stones in a stretch of film, in order."""
        found: list[LostPath] = []
        pictures: list[tuple[float, Image]] = []
        while True:
            last = True
            for look in stretch:
                pictures.append((look.t, look.picture(self._parts)))
                if look.t >= pictures[0][0] + tuning.WINDOW:
                    last = False
                    break
            paths = self._paths_in(pictures)
            if last:
                return found + paths
            begin, end = pictures[0][0], pictures[-1][0]
            sure = [k for k in paths if k.end < end - tuning.WINDOW_MARGIN]
            found += sure
            open_ = [k.begin for k in paths if k not in sure]
            following = min(open_, default=end - tuning.WINDOW_MARGIN) - tuning.STRETCH_MARGIN
            after = sure[-1].end if sure else begin
            # A path longer than a piece would be begun again and again.
            begin = max(following, after, begin + tuning.WINDOW / 4)
            pictures = [picture for picture in pictures if picture[0] >= begin]

    def _paths_in(self, pictures: Sequence[tuple[float, Image]]) -> list[LostPath]:
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
        people = [s for i, (t, seen) in enumerate(blobs) for s in self._people(seen, i, t)]
        looked = np.array([t for t, _ in blobs])
        moving = [without_resting(seen, looked) for seen in (sightings, people)]
        free = set(map(id, without_walkers([*moving[0], *moving[1]], self._camera)))
        stones, groups = ([s for s in seen if id(s) in free] for seen in moving)
        paths = sorted(thrown_paths(stones), key=lambda k: k.sightings[0].t)
        beside = thrown_paths(groups, judged=is_beside_a_stone)
        lost = [self._lost(path, blobs) for path in paths]
        return with_groups(lost, beside, self._sheet.length / 2)

    def _people(self, blobs: Sequence[Blob], frame: int, t: float) -> Iterator[Sighting]:
        """What is much larger than a stone in one frame, as sightings."""
        half = np.array([self._sheet.width, self._sheet.length]) / 2 + tracking.PEOPLE_NEAR
        for blob in blobs:
            if is_larger(blob, self._camera, self._model):
                middle = (blob.low_px + blob.high_px) / 2
                xy = self._camera.on_plane(middle[None], tuning.PEOPLE_MIDDLE)[0]
                if (np.abs(xy) < half).all():
                    yield Sighting(frame=frame, t=t, xy=xy, likeness=1.0)

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
        return LostPath.of(path, slides, hidden=lost)


def thrown_paths(
    sightings: Sequence[Sighting], judged: Callable[[RoughPath], bool] = is_thrown
) -> list[RoughPath]:
    """The paths of thrown stones through sightings, one after the other.

    What moves while a stone is thrown belongs to that throw.

    Parameters
    ----------
    judged : whether a path is that of a thrown stone
    """
    left = list(sightings)
    for _ in range(tuning.MAX_TRIES):
        path = likeliest_path(left, tuning.MAX_UNSEEN, tuning.MAX_GAIN)
        if path is None:
            return []
        if not judged(path):
            taken = set(map(id, path.sightings))
            left = [s for s in left if id(s) not in taken]
            continue
        begin, end = path.sightings[0].t, path.sightings[-1].t
        before = [s for s in left if s.t < begin]
        after = [s for s in left if s.t > end]
        return [*thrown_paths(before, judged), path, *thrown_paths(after, judged)]
    return []


def shows_several(sightings: Sequence[Sighting]) -> bool:
    """Whether frames spread over a film seem to show more than one throw."""
    paths = thrown_paths(without_resting(sightings))
    found = [LostPath.of(path) for path in paths]
    return len(list(without_returns(sorted(found, key=lambda path: path.begin)))) > 1


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
