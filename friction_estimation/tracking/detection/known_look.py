"""The thrown stone beside people: found where it is alone, then followed by its look.

Where a broom or a sweeper touches the stone in the picture, the blob is no stone's, and a head may
pass for one. But for a moment somewhere nobody is in its way: after the release, or where it rests.
There it is found as something of a stone's size that slides steadily or lies still, and its look
is learnt. From there it is followed both ways: where it should be by its motion so far, its look
is fitted to those pixels that show it. What is not where it should be, or does not look like it,
is not the stone. Where somebody is in its way all the time, its look is learnt with that and
corrected by its clearest pictures. Where no second shows it so well, what slides far and slows down
as a stone does may be one: its look is learnt from its whole way.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from curling_env.sheet import HOG_LINE_Y, Sheet
from curling_env.typing import Floats
from friction_estimation.appearance import (
    Appearance,
    Crop,
    StoneModel,
    clear_surroundings,
    crops_at,
    fill_hidden,
    learn_appearance,
    measure_occluded,
    unexplained_share,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import CutFrame, Frame
from friction_estimation.tracking import tuning
from friction_estimation.tracking.background import (
    Background,
    Blob,
    grey,
    moving_blobs,
)
from friction_estimation.tracking.connected import boxes_of_parts
from friction_estimation.tracking.detection.expected_motion import ExpectedMotion
from friction_estimation.tracking.detection.steady_slides import (
    long_slides,
    resolution,
    steadiest_slide,
)
from friction_estimation.tracking.detection.thrown_stone import (
    RoughPath,
    Sighting,
    ThrownStone,
    sightings_in,
)
from friction_estimation.tracking.detection.what_rests import at_rest


@dataclass(frozen=True, kw_only=True, eq=False)
class _Seen:
    """Frames of a film, and what it takes to look for a stone in them."""

    pictures: Sequence[tuple[float, CutFrame]]
    background: Background
    camera: Camera
    model: StoneModel
    sheet: Sheet

    def sightings(self, *, in_parts: bool) -> list[Sighting]:
        """Blobs that may be a stone, or also parts of blobs."""
        blobs = parts_of_blobs if in_parts else moving_blobs
        return [
            sighting
            for k, (t, frame) in enumerate(self.pictures)
            for sighting in sightings_in(
                blobs(frame, self.background), k, t, self.camera, self.model, self.sheet
            )
        ]

    def crops(self, places: Sequence[tuple[int, Floats]]) -> list[Crop]:
        """Pictures of a stone at places (2,) [m] in frames, without what is around it."""
        crops = crops_at(
            [self.pictures[k][1] for k, _ in places],
            [self.pictures[k][0] for k, _ in places],
            [xy for _, xy in places],
            self.background.channels,
            self.background.origin_px,
            self.camera,
            self.model,
        )
        for crop in crops:
            clear_surroundings(crop, self.camera, self.model)
        return crops


@dataclass(frozen=True, kw_only=True, eq=False)
class _Followed:
    """What was followed by its look, and may be a stone.

    Parameters
    ----------
    poses : by index of the frame: x, y [m] and heading
    clear : frames that show it clearly, spread over its path
    unexplained : share of the pictures that taught the look which it does not explain
    has_handle : whether a handle shows its headings
    allowed : the share that a stone may leave unexplained
    """

    poses: dict[int, Floats]
    clear: Sequence[int]
    unexplained: float
    has_handle: bool = False
    allowed: float = tuning.MAX_SLIDE_UNEXPLAINED

    @property
    def travel(self) -> float:
        """How far along the sheet it was followed [m]."""
        return float(np.ptp([pose[1] for pose in self.poses.values()])) if self.poses else 0.0

    @property
    def is_stone(self) -> bool:
        """Whether it looks like a stone, and went so far that it may have been thrown."""
        like = self.unexplained <= self.allowed
        return like and self.travel > tuning.LEAST_FOLLOWED

    @property
    def score(self) -> float:
        return self.travel * (1 - self.unexplained / self.allowed)

    @property
    def is_clear(self) -> bool:
        """Whether it surely is a stone, and thrown: one that is hit sets out in the far house."""
        if not self.is_stone or self.unexplained > tuning.CLEARLY_EXPLAINED:
            return False
        return not sets_out_far(self.poses)

    def is_at(self, sighting: Sighting) -> bool:
        pose = self.poses.get(sighting.frame)
        near = tuning.SAME_PLACE
        return pose is not None and float(np.linalg.norm(pose[:2] - sighting.xy)) < near


def sets_out_far(poses: Mapping[int, Floats]) -> bool:
    """Whether a stone first appears beyond the far hog line, as one does that is hit there.

    Parameters
    ----------
    poses : by index of the frame: x, y [m] and heading
    """
    first, last = (poses[k][1] for k in (min(poses), max(poses)))
    return bool(np.sign(last - first) * first >= HOG_LINE_Y)


def was_hit(
    pictures: Sequence[tuple[float, object]], poses: Mapping[int, Floats], camera: Camera
) -> bool:
    """Whether a stone sets out in the far house of a film that shows where stones are released.

    Parameters
    ----------
    pictures : times [s] and frames
    poses : by index of the frame: x, y [m] and heading
    """
    first = min(poses)
    if pictures[first][0] - pictures[0][0] <= tuning.SLIDE_SECONDS[1] or not sets_out_far(poses):
        return False
    near_hog_line = -np.sign(poses[first][1]) * HOG_LINE_Y
    return bool(camera.sees(np.array([[0.0, near_hog_line, 0.0]]))[0])


def find_by_look(
    frames: Iterable[tuple[float, Frame]],
    background: Background,
    camera: Camera,
    model: StoneModel,
    sheet: Sheet,
) -> ThrownStone | None:
    """The thrown stone in frames a fraction of a second apart; None where nothing shows it.

    Its path has the places that were measured by its look. Only sightings that show it clearly are
    to be learnt from.
    """
    pictures = [(t, CutFrame(frame, background.slices)) for t, frame in frames]
    seen = _Seen(pictures=pictures, background=background, camera=camera, model=model, sheet=sheet)
    thrown = (
        one
        for one in _stones(seen)
        if not (one.poses and was_hit(seen.pictures, one.poses, camera))
    )
    found = max(thrown, key=lambda one: one.score, default=None)
    if found is None:
        return None
    clear = {k: place for place, k in enumerate(found.clear)}
    path = tuple(
        Sighting(
            frame=clear.get(k, 0),
            t=pictures[k][0],
            xy=pose[:2],
            likeness=float(k in clear),
            theta=float(pose[2]) if found.has_handle else np.nan,
        )
        for k, pose in sorted(found.poses.items())
    )
    return ThrownStone(
        path=RoughPath(sightings=path, measured=True),
        pictures=[pictures[k] for k in found.clear],
    )


def _stones(seen: _Seen) -> Iterator[_Followed]:
    """What looks like a stone, until it clearly is the thrown one.

    First what is alone as it slides, then what is where it rests, then what something touches, and
    where nothing of these is a stone, what slides far.
    """
    alone = seen.sightings(in_parts=False)
    for one in _tried(seen, alone, touched=False):
        yield one
        if one.is_clear:
            return
    for still in at_rest(alone, seen.pictures[-1][0], seen.camera):
        one = _followed(seen, still, touched=True)
        if one.is_stone:
            yield one
        if one.is_clear:
            return
    parts = seen.sightings(in_parts=True)
    any_found = False
    for one in _tried(seen, parts, touched=True):
        any_found = True
        yield one
    for slide in () if any_found else long_slides(parts, seen.camera):
        half = len(slide) // 2
        for part in (slide, slide[:half], slide[half:]):
            one = _followed_far(seen, part)
            if one.is_stone:
                yield one
                return


def _tried(seen: _Seen, sightings: Sequence[Sighting], *, touched: bool) -> Iterator[_Followed]:
    """What slides steadily and looks like a stone, the steadiest first, until one clearly does."""
    left = list(sightings)
    for _ in range(tuning.SLIDES_TRIED):
        slide = steadiest_slide(left, seen.camera)
        if slide is None:
            return
        one = _followed(seen, slide, touched=touched)
        own = set(map(id, slide))
        left = [s for s in left if id(s) not in own and not one.is_at(s)]
        if one.is_stone:
            yield one
        if one.is_clear:
            return


def _followed(seen: _Seen, slide: Sequence[Sighting], *, touched: bool) -> _Followed:
    """What is sighted for about a second, as far as it can be followed by its look there.

    Parameters
    ----------
    touched : whether something may touch it all the time. It is followed by what it looks like
        with that, which its clearest pictures then correct; these must show a stone
    """
    nothing = _Followed(poses={}, clear=(), unexplained=np.inf)
    crops = seen.crops([(s.frame, s.xy) for s in slide])
    if len(crops) < tuning.SLIDE_SIGHTINGS:
        return nothing
    look = learn_appearance(crops, seen.model, seen.background.noise, doubted=False)
    share = left_unexplained(crops, look)
    if share > (tuning.MAX_TOUCHED if touched else tuning.MAX_SLIDE_UNEXPLAINED):
        return nothing
    turned = {crop.t: crop.pose for crop in crops}
    known = {s.frame: turned[s.t] for s in slide if s.t in turned}
    poses = _both_ways(seen, look, known, min(known), max(known))
    if share > tuning.MAX_SLIDE_UNEXPLAINED:
        return _followed_again(seen, look, poses, tuning.MAX_SLIDE_UNEXPLAINED)
    clear = _clearest(_unclear(seen, look, poses))
    return _Followed(poses=poses, clear=clear, unexplained=share, has_handle=look.has_handle)


def _followed_far(seen: _Seen, slide: Sequence[Sighting]) -> _Followed:
    """What slides far, or a part of its way, followed from its clearest picture by its look."""
    nothing = _Followed(poses={}, clear=(), unexplained=np.inf)
    spread = slide[:: max(1, -(-len(slide) // tuning.LONG_PICTURES))]
    crops = seen.crops([(s.frame, s.xy) for s in spread])
    if len(crops) < tuning.SLIDE_SIGHTINGS:
        return nothing
    look = learn_appearance(crops, seen.model, seen.background.noise, doubted=False)
    unclear = {k: left_unexplained([crop], look) for k, crop in enumerate(crops)}
    if _of_clearest(unclear) > tuning.LONG_TOUCHED:
        return nothing
    times = np.array([crop.t for crop in crops])
    nearest = [crops[int(np.argmin(np.abs(times - s.t)))] for s in slide]
    known = {
        s.frame: np.array([*s.xy, crop.pose[2]]) for s, crop in zip(slide, nearest, strict=True)
    }
    clearest = crops[min(unclear, key=unclear.__getitem__)].t
    start = next(s.frame for s in slide if s.t == clearest)
    poses = _both_ways(seen, look, known, start, start)
    return _followed_again(seen, look, poses, tuning.MAX_LONG_UNEXPLAINED)


def _followed_again(
    seen: _Seen, look: Appearance, poses: dict[int, Floats], allowed: float
) -> _Followed:
    """What was followed by a look with something else in it, which its clearest pictures correct.

    Parameters
    ----------
    allowed : share of its clearest pictures that a stone may leave unexplained
    """
    found = _Followed(poses=poses, clear=(), unexplained=np.inf)
    unclear = _unclear(seen, look, poses)
    for _ in range(tuning.LOOKS_CORRECTED):
        seen_clearly = found.unexplained < tuning.HOPELESS * allowed or not found.clear
        if found.travel < tuning.LEAST_FOLLOWED or not seen_clearly:
            break
        look = _corrected(seen, look, poses, unclear)
        clearest = min(unclear, key=unclear.__getitem__)
        poses = _both_ways(seen, look, poses, clearest, clearest)
        unclear = _unclear(seen, look, poses)
        found = _Followed(
            poses=poses,
            clear=_clearest(unclear),
            unexplained=_of_clearest(unclear),
            has_handle=look.has_handle,
            allowed=allowed,
        )
    return found


def left_unexplained(crops: Sequence[Crop], look: Appearance) -> float:
    """Share of the difference from bare ice that the look leaves unexplained.

    By the noise that is learnt with a look, one that explains little would seem to leave little.
    """
    plain = replace(look, noise=np.full(3, tuning.PLAIN_NOISE))
    return unexplained_share(crops, plain)


def _of_clearest(unclear: dict[int, float]) -> float:
    """Which share the look leaves unexplained of the clearest pictures."""
    return float(np.mean(sorted(unclear.values())[: tuning.CLEAREST])) if unclear else np.inf


def _corrected(
    seen: _Seen, look: Appearance, poses: dict[int, Floats], unclear: dict[int, float]
) -> Appearance:
    """The look in the clearest pictures, those pixels left out that the present look excludes."""
    chosen = sorted(sorted(unclear, key=unclear.__getitem__)[: tuning.LEAST_CLEAR])
    index = {seen.pictures[k][0]: k for k in chosen}
    crops = seen.crops([(k, poses[k][:2]) for k in chosen])
    for crop in crops:
        crop.pose = poses[index[crop.t]].copy()
        fill_hidden(crop, look)
    return learn_appearance(crops, seen.model, seen.background.noise, doubted=False)


def _both_ways(
    seen: _Seen, look: Appearance, known: dict[int, Floats], first: int, last: int
) -> dict[int, Floats]:
    """Poses of a stone in the frames from `first` on and in those from `last` back; see `_way`."""
    ahead = _way(seen, look, known, range(first, len(seen.pictures)))
    return ahead | _way(seen, look, known, range(last, -1, -1))


def _way(
    seen: _Seen, look: Appearance, known: dict[int, Floats], frames: range
) -> dict[int, Floats]:
    """Poses of a stone in frames one after the other, or one before the other.

    Parameters
    ----------
    known : rough poses in some of the first frames
    """
    motion = ExpectedMotion()
    background, camera = seen.background, seen.camera
    poses: dict[int, Floats] = {}
    for k in frames:
        t, frame = seen.pictures[k]
        start = motion.at(t)
        if start is None:
            if k not in known:
                if k > max(known) or k < min(known):
                    break
                continue
            start = known[k]
        elif motion.unseen(t) > tuning.MAX_HIDDEN_SECONDS:
            break
        fit = measure_occluded(
            frame, background.channels, background.origin_px, camera, look, start, people=True
        )
        if fit is None or fit.visible < tuning.LEAST_SEEN or fit.inside < 1.0:
            continue
        pixel = resolution(camera, fit.xy[None])[0]
        if (np.abs(fit.xy - start[:2]) > motion.doubt(t) + pixel).any():
            continue
        pose = np.array([*fit.xy, fit.theta if look.has_handle else 0.0])
        motion.add(t, pose, (tuning.PLACE_SIGMA + tuning.PLACE_SIGMA_PX * pixel) / fit.visible)
        poses[k] = pose
    return poses


def _unclear(seen: _Seen, look: Appearance, poses: dict[int, Floats]) -> dict[int, float]:
    """By index of the frame, which share of a stone's picture its look does not explain."""
    index = {seen.pictures[k][0]: k for k in poses}
    unclear: dict[int, float] = {}
    for crop in seen.crops([(k, poses[k][:2]) for k in sorted(poses)]):
        k = index[crop.t]
        crop.pose = poses[k]
        unclear[k] = left_unexplained([crop], look)
    return unclear


def _clearest(unclear: dict[int, float]) -> list[int]:
    """The frames that show a stone most clearly in every part of its path."""
    parts = np.array_split(np.array(sorted(unclear), dtype=int), tuning.PATH_PARTS)
    chosen = {
        k
        for part in parts
        for k in sorted(part.tolist(), key=unclear.__getitem__)[: tuning.CLEAR_IN_PART]
        if unclear[k] < tuning.CLEAR_PICTURE
    }
    if len(chosen) < tuning.LEAST_CLEAR:
        chosen |= set(sorted(unclear, key=unclear.__getitem__)[: tuning.LEAST_CLEAR])
    return sorted(chosen)


def parts_of_blobs(frame: Frame, background: Background, min_area_px: float = 6.0) -> list[Blob]:
    """The connected parts of a frame that are darker than the background by about the same.

    A stone that touches a broom or a person in the picture is such a part of their blob.

    Parameters
    ----------
    min_area_px : smaller parts are left out
    """
    cut = np.ascontiguousarray(frame[background.slices])
    darker = cv2.subtract(grey(background.flat), grey(cut))
    limit = max(tuning.MIN_CONTRAST, 5 * background.noise)
    found: list[Blob] = []
    for low in np.arange(limit, 255, tuning.BAND / 2):
        band = cv2.inRange(darker, low, low + tuning.BAND)
        for left, top, width, height, area in boxes_of_parts(band).tolist():
            if area < min_area_px or area < tuning.MIN_FILL * width * height:
                continue
            corner = np.add(background.origin_px, (left, top), dtype=np.float64)
            size = np.array([width, height], dtype=np.float64)
            found.append(
                Blob(low_px=corner, high_px=corner + size - 1, area_px=float(area), whole_px=size)
            )
    return found
