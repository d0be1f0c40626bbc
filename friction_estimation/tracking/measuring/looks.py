"""Appearance of a stone in the sampled frames, and the lens from it if the paint does not determine
it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.typing import Floats, Image, Integers
from friction_estimation.appearance import (
    CROPS_TO_LEARN_FROM,
    Appearance,
    Crop,
    PixelWindow,
    StoneModel,
    clear_surroundings,
    crops_at,
    explained_crops,
    fill_hidden,
    heading_costs,
    learn_appearance,
    measure_occluded,
    unexplained_share,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.refined import RefinedCamera
from friction_estimation.camera.refinement import refine_at_focal
from friction_estimation.camera.scene import Scene
from friction_estimation.camera.tuning import STONE_HEIGHT_SIGMA
from friction_estimation.tracking import tuning
from friction_estimation.tracking.association.coarse import CoarsePath
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.detection.detections import Detections
from friction_estimation.tracking.films.steady_film import SteadyFilm
from friction_estimation.tracking.measuring.focal_from_stone import focal_from_stone
from friction_estimation.tracking.measuring.heading import (
    HeadingCurve,
    HeadingViews,
    fit_heading_curve,
)

_ROUNDS = 2
"""Maximum number of times an appearance is estimated, each without the pictures that the last one
did not explain."""
_VIEW_STEP = 0.2
"""Time between the pictures of a stone with people near it [s]."""
_PARTS, _FROM_EACH = 10, 2
"""Number of parts of a path, and of the clearest pictures from each."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SeenStone:
    """Stone in the sampled frames.

    Parameters
    ----------
    path : where it is
    sample : frames by their times [s]
    background : the ice without it
    found_by : the camera with which it was found
    model : its typical shape
    people : whether someone is near it
    """

    path: CoarsePath
    sample: Mapping[float, Image]
    background: Background
    found_by: Camera
    model: StoneModel
    people: bool

    def crops(
        self, camera: Camera, windows: Mapping[float, PixelWindow] | None = None
    ) -> list[Crop]:
        """Return clear pictures of the stone for a camera; see `crops_at`."""
        kept = np.array([t in self.sample for t in self.path.t.tolist()])
        kept &= self.path.likeness >= tuning.MIN_LEARNING_LIKENESS
        kept &= self.path.t > self.path.released  # earlier, a hand or a shoe may be mistaken for it
        clear = np.flatnonzero(kept)
        alone = np.flatnonzero(kept & self.path.alone)
        # A single position does not show the profile of a stone.
        far = len(alone) and np.hypot(*np.ptp(self.path.xy[alone], axis=0)) > tuning.LEAST_THROW
        if self.people and far:
            clear = alone
        before = clear[self.path.t[clear] < min(self.path.contacts, default=np.inf)]
        if len(before) >= tuning.LEAST_CLEAR:  # later the ice around it may have changed
            clear = before
        clear = clear[_spread(self.path.xy[clear])]
        places = self.path.seen_by(self.found_by, camera, self.model).xy
        crops = crops_at(
            [self.sample[t] for t in self.path.t[clear].tolist()],
            self.path.t[clear].tolist(),
            list(places[clear]),
            self.background.channels,
            self.background.origin_px,
            camera,
            self.model,
            windows,
        )
        for crop in crops if self.people else ():
            clear_surroundings(crop, camera, self.model)
        return crops


def _spread(xy: Floats) -> Integers:
    """Return indices of places (n, 2) for the estimation of an appearance, spread over path and
    time.

    A distant stone has few frames, and one at rest has many, whose errors are common.
    """
    if not len(xy):
        return np.arange(0)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    rank = way / max(float(way[-1]), 1e-9) + np.linspace(0.0, 1.0, len(way))
    wanted = np.linspace(rank[0], rank[-1], min(CROPS_TO_LEARN_FROM, len(way)))
    return np.unique(np.argmin(np.abs(rank[:, None] - wanted), axis=0))


def crowded(path: CoarsePath, seen: Detections, camera: Camera) -> bool:
    """Return whether a larger object is near a path whose stone is not nearly always alone.

    Parameters
    ----------
    path : of a stone
    seen : all detections
    camera : that took the frames
    """
    first_hit = min(path.contacts, default=np.inf)
    places = np.array([[*path.at(t)[0], 0.0] for t in seen.times if t < first_hit])
    expected = camera.sees(places).sum()
    if path.alone[path.t < first_hit].sum() >= tuning.NEARLY_ALL * expected:
        return False
    for t, box in seen.crowds:
        if t > first_hit:
            continue
        place = path.at(t)[0]
        px = camera.project(np.array([[*place, 0.0]]))[0]
        away = np.maximum(np.maximum(box[0] - px, px - box[1]), 0.0)
        metre = np.linalg.inv(camera.px_per_metre(place))
        if np.hypot(*(metre @ away)) < tuning.PEOPLE_NEAR:
            return True
    return False


def learn_look(
    stone: SeenStone, camera: Camera, film: SteadyFilm
) -> tuple[Appearance, Sequence[Crop]] | None:
    """Estimate the appearance of a stone, and return the crops that show it; None if it is nowhere
    completely in view.

    If people are near, the first appearance includes parts of them. The pictures that it explains
    best are then selected from more frames, and the appearance is estimated from these.

    Parameters
    ----------
    stone : as the sampled frames show it
    camera : the film's camera
    film : has more frames
    """
    crops: Sequence[Crop] = stone.crops(camera)
    if not crops:
        return None
    noise = stone.background.noise
    look = learn_appearance(crops, stone.model, noise, try_others=not stone.people)
    for _ in range(_ROUNDS):
        like = explained_crops(crops, look)
        if len(like) == len(crops):
            break
        crops = like
        look = learn_appearance(crops, stone.model, noise, try_others=not stone.people)
    if not stone.people:
        return look, crops
    path = stone.path.seen_by(stone.found_by, camera, stone.model)
    views = list(film.between(float(path.t[0]), float(path.t[-1]), _VIEW_STEP))
    for turn in range(_ROUNDS):
        heading = heading_of(crops, look, path)
        seen = _views(views, path, stone, camera, look, heading)
        if len(seen) < tuning.MIN_FITS:
            break
        crops = _clearest(seen)
        for crop in crops:
            fill_hidden(crop, look)
        look = learn_appearance(crops, stone.model, noise, try_others=turn == _ROUNDS - 1)
    return look, crops


def _views(
    frames: Sequence[tuple[float, Image]],
    path: CoarsePath,
    stone: SeenStone,
    camera: Camera,
    look: Appearance,
    heading: HeadingCurve | None,
) -> list[tuple[float, Crop]]:
    """Return crops of all frames that show a stone, with the unexplained share of each."""
    found: list[tuple[float, Crop]] = []
    channels, origin = stone.background.channels, stone.background.origin_px
    for t, frame in frames:
        theta = 0.0 if heading is None else float(heading.at(t))
        start = np.array([*path.at(t)[0], theta])
        fit = measure_occluded(frame, channels, origin, camera, look, start, people=True)
        if fit is None or fit.visible < tuning.LEAST_VISIBLE or fit.inside < 1.0:
            continue
        if np.hypot(*(fit.xy - start[:2])) > stone.model.radius:
            continue
        for crop in crops_at([frame], [t], [fit.xy], channels, origin, camera, stone.model):
            clear_surroundings(crop, camera, stone.model)
            crop.pose = np.array([*fit.xy, fit.theta if look.has_handle else 0.0])
            found.append((unexplained_by_look([crop], look, stone.background.strong_grain), crop))
    return found


def unexplained_by_look(crops: Sequence[Crop], look: Appearance, grain: float = 0.0) -> float:
    """Unexplained share of the difference from bare ice, 0 to 1.

    It does not depend on the fitted noise, with which a poor appearance would seem to leave little.

    Parameters
    ----------
    grain : see `unexplained_share`
    """
    plain = replace(look, noise=np.full(3, max(tuning.PLAIN_NOISE, grain)))
    return unexplained_share(crops, plain, grain)


def _clearest(seen: Sequence[tuple[float, Crop]]) -> list[Crop]:
    """Return the clear crops of every part of a path; the clearest of the whole path if these are
    few.
    """
    ordered = sorted(range(len(seen)), key=lambda k: seen[k][0])
    part = np.arange(len(seen)) * _PARTS // len(seen)
    count = np.zeros(_PARTS, dtype=int)
    chosen: list[int] = []
    for k in ordered:
        if seen[k][0] < tuning.CLEAR_PICTURE and count[part[k]] < _FROM_EACH:
            count[part[k]] += 1
            chosen.append(k)
    if len(chosen) < tuning.LEAST_CLEAR:
        chosen = sorted({*chosen, *ordered[: tuning.LEAST_CLEAR]})
    return [seen[k][1] for k in sorted(chosen)]


def heading_of(
    crops: Sequence[Crop], appearance: Appearance, path: CoarsePath
) -> HeadingCurve | None:
    """Return the heading of the pictures from which the appearance was estimated; None if they are
    few.

    Parameters
    ----------
    crops : the pictures, with their poses
    appearance : the look
    path : where the stone is; its speed tells how the rotation slows down
    """
    ordered = sorted(crops, key=lambda crop: crop.t)
    if not appearance.has_handle or len(ordered) < tuning.MIN_FITS:
        return None
    views = HeadingViews()
    for crop in ordered:
        views.add(crop.t, heading_costs(crop, appearance))
    speed = np.hypot(*path.smooth.velocity.T)
    curve = fit_heading_curve(views, path.smooth.t, speed)
    if curve is not None:
        return curve
    return HeadingCurve([e.t for e in ordered], [float(e.pose[2]) for e in ordered])


def with_focal(refined: RefinedCamera, scene: Scene, stones: Sequence[SeenStone]) -> RefinedCamera:
    """Return the camera with its focal length from pictures of stones, if the paint does not
    determine it.
    """
    stones = [stone for stone in stones if stone.crops(refined.camera)]
    if refined.log_focal_sigma <= STONE_HEIGHT_SIGMA or not stones:
        return refined
    background = stones[0].background

    def at_focal(change: float) -> RefinedCamera | None:
        return refine_at_focal(refined, scene, background.image, background.origin_px, change)

    # Heights are compared on the same pixels: those of the stone in the lowest view.
    low = at_focal(float(np.log(tuning.LOW_HEIGHT / refined.camera.position[2])))
    reach = refined.camera if low is None else low.camera
    seen = [stone.crops(reach) or stone.crops(refined.camera) for stone in stones]
    every = max(1, round(sum(map(len, seen)) / tuning.HEIGHT_CROPS))
    windows = [{crop.t: crop.window for crop in crops[::every]} for crops in seen]

    def crops(camera: Camera) -> list[list[Crop]]:
        return [s.crops(camera, own) for s, own in zip(stones, windows, strict=True)]

    return focal_from_stone(refined, at_focal, crops, stones[0].model, background.noise)
