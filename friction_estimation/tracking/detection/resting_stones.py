"""The other stones on the sheet: what they look like, and where and when they lie.

A stone at rest is part of a film's background, where nothing that moves gives it away. So what the
detector finds is fitted with the appearance that was learnt from the thrown stone, over ice that is
filled in from around it.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.sheet import Sheet
from curling_env.typing import Flags, Floats, Image
from friction_estimation.appearance import (
    Appearance,
    PictureChannels,
    PosedStone,
    crops_at,
    measure,
    measure_occluded,
)
from friction_estimation.appearance.occlusion import set_among
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.background import Background, median_picture
from friction_estimation.tracking.detection.ice_beneath import ice_without_stones
from friction_estimation.tracking.detection.thrown_stone import RoughPath
from friction_estimation.tracking.detector import Detector, OnIce, detected_sigma
from friction_estimation.tracking.joint.own_look import own_look


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmedRestingStone:
    """A stone that lay on the sheet when the film began, or when it ended.

    Parameters
    ----------
    posed : its appearance and pose
    sigma : standard error of each coordinate due to noise alone [m]
    heading : heading of its handle [rad]; NaN where front and rear of the handle look alike
    seen : (n,) whether it lay there in each of the sampled frames
    """

    posed: PosedStone
    sigma: float
    heading: float
    seen: Flags

    @property
    def xy(self) -> Floats:
        """Where it lies, (2,) [m]."""
        return self.posed.pose[:2]

    @property
    def last_seen(self) -> int:
        """Index of the last sampled frame in which it lay there."""
        return int(np.flatnonzero(self.seen)[-1])

    @property
    def stays(self) -> bool:
        """Whether it lay there from the beginning to the end."""
        return self._at_first and self._at_last

    @property
    def leaves(self) -> bool:
        """Whether it lay there at the beginning and not at the end."""
        return self._at_first and not self._at_last

    @property
    def comes(self) -> bool:
        """Whether it lay there at the end and not at the beginning."""
        return self._at_last and not self._at_first

    @property
    def _at_first(self) -> bool:
        return bool(self.seen[: tuning.END_FRAMES].any())

    @property
    def _at_last(self) -> bool:
        return bool(self.seen[-tuning.END_FRAMES :].any())


def find_resting_stones(
    sample: Sequence[tuple[float, Image]],
    background: Background,
    camera: Camera,
    appearance: Appearance,
    sheet: Sheet,
    rough: RoughPath,
) -> list[FilmedRestingStone]:
    """Find the stones that lie on the sheet at the beginning or the end of the film.

    Parameters
    ----------
    sample : sampled frames and their times
    appearance : what the thrown stone looks like; others have the same shape, and may have another
        colour of the handle
    rough : the thrown stone's path; a stone that lies only at its end is the thrown one

    Returns
    -------
    The stones; none where nothing lies on the sheet but the thrown stone at its end.
    """
    frames = [frame for _, frame in sample]
    cuts = [
        [f[background.slices] for f in part]
        for part in (frames[: tuning.END_FRAMES], frames[-tuning.END_FRAMES :])
    ]
    pictures = [median_picture(part) for part in cuts]
    pictures.insert(1, np.clip(np.rint(background.image), 0, 255).astype(np.uint8))
    detector = OnIce(Detector(), camera, appearance.model, sheet)
    wholes = [_whole(picture, background, camera) for picture in pictures]
    spots = [
        [one.xy for one in detector.detect(whole) if one.is_sure and one.in_play]
        for whole in wholes
    ]
    bare = ice_without_stones(pictures, spots, background, camera, appearance.model, sheet)
    ice = PictureChannels(bare)
    places: list[Floats] = []
    for frame, found in zip(wholes, spots, strict=True):
        new = [
            xy for xy in found if all(np.linalg.norm(xy - k) > tuning.SAME_PLACE for k in places)
        ]
        places += [_fitted_place(xy, frame, ice, background, camera, appearance) for xy in new]
    end = rough.sightings[-1].xy
    if all(np.linalg.norm(xy - end) < 2 * tuning.SAME_PLACE for xy in places):
        return []
    lying: list[_Lying] = []
    for xy in places:
        if all(np.linalg.norm(xy - other.xy) > tuning.SAME_PLACE for other in lying):
            one = _lying_at(xy, frames, detector, ice, background, appearance)
            lying += [] if one is None else [one]
    body = replace(appearance, has_handle=False)
    known: list[FilmedRestingStone] = []
    for one in lying:
        beside = [
            PosedStone(look=body, pose=np.array([*other.xy, 0.0]))
            for other in lying
            if other is not one and other.is_beside(one)
        ]
        stone = _resting_stone(one, frames, ice, background, camera, appearance, beside)
        if all(np.linalg.norm(stone.xy - k.xy) > tuning.SAME_PLACE for k in known):
            known.append(stone)
    return known


@dataclass(frozen=True, kw_only=True, eq=False)
class _Lying:
    """A place where a body like a stone's lies in some frames.

    Parameters
    ----------
    xy : (2,) the place [m]
    frames : indices of the sampled frames
    """

    xy: Floats
    frames: Sequence[int]

    @property
    def chosen(self) -> Sequence[int]:
        """About nine of the frames."""
        return self.frames[:: max(1, len(self.frames) // 9)]

    def is_beside(self, other: _Lying) -> bool:
        """Whether it lies near enough to another to overlap with it in most of its pictures."""
        near = np.linalg.norm(self.xy - other.xy) < tuning.NEIGHBOURS
        return bool(near and np.mean([i in self.frames for i in other.chosen]) > 0.5)


def _whole(picture: Image, background: Background, camera: Camera) -> Image:
    """A frame of which the background's part is known."""
    frame = np.zeros((camera.size[1], camera.size[0], 3), dtype=np.uint8)
    frame[background.slices] = picture
    return frame


def _fitted_place(
    xy: Floats,
    frame: Image,
    ice: PictureChannels,
    background: Background,
    camera: Camera,
    appearance: Appearance,
) -> Floats:
    """The place at which the body of a stone explains a frame best, near where one was detected."""
    body = replace(appearance, has_handle=False)
    fit = measure(frame, ice, background.origin_px, camera, body, np.array([*xy, 0.0]))
    if fit is None or np.linalg.norm(fit.xy - xy) > tuning.SAME_PLACE / 2:
        return xy
    return fit.xy


def _lying_at(
    xy: Floats,
    frames: Sequence[Image],
    detector: OnIce,
    ice: PictureChannels,
    background: Background,
    appearance: Appearance,
) -> _Lying | None:
    """The frames in which a stone lies at a place; None if it is hardly seen there."""
    camera = detector.camera
    tolerance = tuning.REST_TOLERANCE + 1.0 / np.linalg.norm(camera.px_per_metre(xy, 0.0), -2)
    found: list[tuple[int, Floats]] = []
    for i, frame in enumerate(frames):
        seen = detector.detect_at(frame, xy)
        if seen is None:
            continue
        place = _fitted_place(seen.xy, frame, ice, background, camera, appearance)
        if np.linalg.norm(place - xy) < tolerance:
            found.append((i, place))
    found = _before_it_moved(found, xy)
    if not found:
        return None
    lying = [i for i, _ in found]
    span = lying[-1] - lying[0] + 1
    if len(lying) < max(tuning.END_FRAMES, tuning.MIN_PRESENCE * span):
        return None
    return _Lying(xy=np.median([place for _, place in found], axis=0), frames=lying)


def _before_it_moved(found: list[tuple[int, Floats]], xy: Floats) -> list[tuple[int, Floats]]:
    """Those of the frames that show the same stone at a place, where another one took its place.

    A stone that is hit full on is replaced by the one that hit it, a hand's breadth away.

    Parameters
    ----------
    found : indices of frames, in order, and the places (2,) at which a stone was measured [m]
    xy : (2,) the place [m]
    """
    least = tuning.END_FRAMES
    places = np.array([place for _, place in found]).reshape(-1, 2)
    best, split = 0.0, 0
    for k in range(least, len(found) - least + 1):
        one, two = places[:k], places[k:]
        apart = one.mean(axis=0) - two.mean(axis=0)
        spread = np.hypot(one.std(axis=0), two.std(axis=0)) * np.sqrt(1 / k + 1 / len(two)) + 1e-4
        clear = float(np.abs(apart / spread).max())
        if clear > best and np.linalg.norm(apart) > tuning.REST_TOLERANCE:
            best, split = clear, k
    if best < tuning.CLEARLY_MOVED:
        return found
    first, last = (np.linalg.norm(part.mean(axis=0) - xy) for part in np.split(places, [split]))
    return found[:split] if first < last else found[split:]


def _resting_stone(
    lying: _Lying,
    frames: Sequence[Image],
    ice: PictureChannels,
    background: Background,
    camera: Camera,
    appearance: Appearance,
    beside: Sequence[PosedStone],
) -> FilmedRestingStone:
    """The stone at a place, with its own appearance.

    Where its picture cannot be fitted, as at the edge of the view, it has the thrown stone's body
    and the place that was detected.

    Parameters
    ----------
    beside : stones around it, as far as they are known
    """
    seen = np.zeros(len(frames), dtype=bool)
    seen[list(lying.frames)] = True
    body = replace(appearance, has_handle=False)
    unfitted = FilmedRestingStone(
        posed=PosedStone(look=body, pose=np.array([*lying.xy, 0.0])),
        sigma=detected_sigma(camera, lying.xy, appearance.model),
        heading=np.nan,
        seen=seen,
    )
    origin = background.origin_px
    start = np.array([*lying.xy, 0.0])
    still = np.median([frames[i][background.slices] for i in lying.chosen], axis=0)
    whole = _whole(np.clip(np.rint(still), 0, 255).astype(np.uint8), background, camera)
    crops = crops_at([whole], [0.0], [start[:2]], ice, origin, camera, appearance.model)
    if not crops:
        return unfitted
    crop = crops[0]
    crop.pose = start
    hidden = set_among(crop, beside, camera)
    found = own_look(crop, appearance, hidden)
    own = found.look
    start = np.array([*start[:2], found.heading])
    fit = measure_occluded(whole, ice, origin, camera, own, start, beside)
    if fit is None or np.linalg.norm(fit.xy - lying.xy) > tuning.SAME_PLACE / 2:
        return unfitted
    pose = np.array([*fit.xy, fit.theta if own.has_handle else 0.0])
    return replace(
        unfitted,
        posed=PosedStone(look=own, pose=pose),
        sigma=float(np.sqrt(np.trace(fit.covariance[:2, :2]) / 2)),
        heading=float(pose[2]) if found.clear else np.nan,
    )
