"""The thrown stone beside people: found where it is alone, then followed by its look.

Where a broom or a sweeper touches the stone in the picture, the blob is no stone's, and a head may
pass for one. But for a second somewhere nobody is in its way, mostly after the release. There it is
found as something of a stone's size that slides steadily, and its look is learnt. From there it is
followed both ways: where it should be by its motion so far, its look is fitted to those pixels
that show it. What is not where it should be, or does not look like it, is not the stone.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from curling_env.sheet import Sheet
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
from friction_estimation.tracking.detection.background import (
    Background,
    moving_blobs,
    parts_of_blobs,
)
from friction_estimation.tracking.detection.expected_motion import ExpectedMotion
from friction_estimation.tracking.detection.steady_slides import resolution, steadiest_slide
from friction_estimation.tracking.detection.thrown_stone import (
    RoughPath,
    Sighting,
    ThrownStone,
    sightings_in,
)


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
    """A stone followed by its look.

    Parameters
    ----------
    poses : by index of the frame: x, y [m] and heading
    clear : frames that show it clearly, spread over its path
    unexplained : share of the pictures that taught the look which it does not explain
    """

    poses: dict[int, Floats]
    clear: Sequence[int]
    unexplained: float

    @property
    def score(self) -> float:
        return len(self.poses) * (1 - self.unexplained / tuning.MAX_SLIDE_UNEXPLAINED)

    def is_at(self, sighting: Sighting) -> bool:
        pose = self.poses.get(sighting.frame)
        near = tuning.SAME_PLACE
        return pose is not None and float(np.linalg.norm(pose[:2] - sighting.xy)) < near


def find_by_look(
    frames: Iterable[tuple[float, Frame]],
    background: Background,
    camera: Camera,
    model: StoneModel,
    sheet: Sheet,
) -> ThrownStone | None:
    """The thrown stone in frames a fraction of a second apart; None where it is never alone.

    Its path has the places that were measured by its look. Only sightings that show it clearly are
    to be learnt from.
    """
    pictures = [(t, CutFrame(frame, background.slices)) for t, frame in frames]
    seen = _Seen(pictures=pictures, background=background, camera=camera, model=model, sheet=sheet)
    found: _Followed | None = None
    for in_parts in (False, True):
        for one in _stones(seen, seen.sightings(in_parts=in_parts), filled=in_parts):
            if found is None or one.score > found.score:
                found = one
            if one.unexplained < tuning.CLEARLY_EXPLAINED:
                break
        if found is not None and found.unexplained < tuning.CLEARLY_EXPLAINED:
            break
    if found is None:
        return None
    clear = {k: place for place, k in enumerate(found.clear)}
    path = tuple(
        Sighting(frame=clear.get(k, 0), t=pictures[k][0], xy=pose[:2], likeness=float(k in clear))
        for k, pose in sorted(found.poses.items())
    )
    return ThrownStone(
        path=RoughPath(sightings=path, measured=True),
        pictures=[pictures[k] for k in found.clear],
    )


def _stones(seen: _Seen, sightings: Sequence[Sighting], *, filled: bool) -> Iterator[_Followed]:
    """What slides steadily and looks like a stone, the steadiest first."""
    left = list(sightings)
    for _ in range(tuning.SLIDES_TRIED):
        slide = steadiest_slide(left, seen.camera)
        if slide is None:
            return
        own = set(map(id, slide))
        left = [s for s in left if id(s) not in own]
        found = _followed(seen, slide, filled=filled)
        if found is not None:
            left = [s for s in left if not found.is_at(s)]
            yield found


def _followed(seen: _Seen, slide: Sequence[Sighting], *, filled: bool) -> _Followed | None:
    """The stone that is sighted for about a second, as far as it can be followed.

    None where that looks like no stone.

    Parameters
    ----------
    filled : whether what touches it all the time may be left out. What is learnt then may be a
        foot without its leg, unless it is seen alone elsewhere
    """
    crops = seen.crops([(s.frame, s.xy) for s in slide])
    if len(crops) < tuning.SLIDE_SIGHTINGS:
        return None
    look = learn_appearance(crops, seen.model, seen.background.noise, doubted=False)
    share = unexplained_share(crops, look)
    touched = share > tuning.MAX_SLIDE_UNEXPLAINED
    if touched:
        if not filled or share > tuning.MAX_TOUCHED:
            return None
        for crop in crops:
            fill_hidden(crop, look)
        look = learn_appearance(crops, seen.model, seen.background.noise, doubted=False)
    turned = {crop.t: crop.pose for crop in crops}
    known = {s.frame: turned[s.t] for s in slide if s.t in turned}
    ahead = range(min(known), len(seen.pictures))
    poses = _way(seen, look, known, ahead) | _way(seen, look, known, range(max(known), -1, -1))
    if len(poses) < tuning.SLIDE_SIGHTINGS:
        return None
    unclear = _unclear(seen, look, poses)
    if touched:
        share = float(np.mean(sorted(unclear.values())[: tuning.SLIDE_SIGHTINGS]))
    if share > tuning.MAX_SLIDE_UNEXPLAINED:
        return None
    return _Followed(poses=poses, clear=_clearest(unclear), unexplained=share)


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
        unclear[k] = unexplained_share([crop], look)
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
