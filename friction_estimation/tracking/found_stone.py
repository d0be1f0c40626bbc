"""The thrown stone of a film, found but not yet measured, and the lens by its pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.errors import InputError, NoThrowError
from friction_estimation.appearance import (
    CROPS_TO_LEARN_FROM,
    Crop,
    PixelWindow,
    StoneModel,
    clear_surroundings,
    crops_at,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.refinement import (
    RefinedCamera,
    refine_at_focal,
)
from friction_estimation.camera.scene import Scene
from friction_estimation.film.frame import Frame
from friction_estimation.tracking import tuning
from friction_estimation.tracking.background import (
    Background,
)
from friction_estimation.tracking.detection.known_look import find_by_look
from friction_estimation.tracking.detection.people import people_near
from friction_estimation.tracking.detection.thrown_stone import (
    RoughPath,
    Sighting,
    ThrownStone,
    find_thrown_stone,
)
from friction_estimation.tracking.films.steady_film import SteadyFilm, blames_scene
from friction_estimation.tracking.focal_from_stone import focal_from_stone


@dataclass(frozen=True, kw_only=True, eq=False)
class FoundStone:
    """The thrown stone, found but not yet measured.

    Parameters
    ----------
    path : roughly where it is
    pictures : times [s] and frames in which it was sighted
    background : the ice behind it
    found_by : the camera with which it was found
    model : its shape
    sightings : what else may be a thrown stone, see `ThrownStone`
    by_look : the same stone as it was followed by its look, if a person is near it
    """

    path: RoughPath
    pictures: Sequence[tuple[float, Frame]]
    background: Background
    found_by: Camera
    model: StoneModel
    sightings: tuple[Sighting, ...] = ()
    by_look: FoundStone | None = None

    def crops(
        self, camera: Camera, windows: Mapping[float, PixelWindow] | None = None
    ) -> list[Crop]:
        """Clear pictures of the stone, placed as another camera sees them; see `crops_at`."""
        clear = [s for s in self.path.sightings if s.likeness >= tuning.MIN_LEARNING_LIKENESS]
        clear = clear[:: max(1, -(-len(clear) // CROPS_TO_LEARN_FROM))]
        middle = self.model.height / 2
        places = np.array([s.xy for s in clear]).reshape(-1, 2)
        if camera is not self.found_by:
            px = self.found_by.project(np.column_stack([places, np.full(len(places), middle)]))
            places = camera.on_plane(px, middle)
        crops = crops_at(
            [self.pictures[s.frame][1] for s in clear],
            [s.t for s in clear],
            list(places),
            self.background.channels,
            self.background.origin_px,
            camera,
            self.model,
            windows,
        )
        for crop in crops if self.path.measured else ():
            clear_surroundings(crop, camera, self.model)
        return crops

    def seen_in(self, right: Sequence[Crop], crops: Sequence[Crop]) -> FoundStone:
        """Without the sightings that are nearest to one of the pictures that do not show it.

        Parameters
        ----------
        right : those of the pictures that do show it
        crops : all pictures of the stone, see `crops`
        """
        times = np.array([crop.t for crop in crops])
        kept = {crop.t for crop in right}
        shown = tuple(
            s for s in self.path.sightings if times[np.argmin(np.abs(times - s.t))] in kept
        )
        return replace(self, path=replace(self.path, sightings=shown))


def find_stone(
    film: SteadyFilm, scene: Scene, camera: Camera, background: Background
) -> FoundStone:
    model = StoneModel(radius=scene.stone_radius, height=scene.stone_height)
    found = find_thrown_stone(film.sample, background, camera, model, scene.sheet, film.between)
    path = None if found is None else found.path
    alone = found is not None and seen_throughout(found.path, film.sample, camera)
    by_look: ThrownStone | None = None
    if not alone and people_near(film.sample, path, background, camera, model):
        times = film.sample[0][0], film.sample[-1][0]
        frames = film.between(*times, look_step(film, background))
        by_look = find_by_look(frames, background, camera, model, scene.sheet)
    seen = () if found is None else found.sightings

    def stone_of(one: ThrownStone) -> FoundStone:
        return FoundStone(
            path=one.path,
            pictures=one.pictures,
            background=background,
            found_by=camera,
            model=model,
            sightings=seen,
        )

    if found is not None and by_look is None:
        return stone_of(found)
    if found is not None and by_look is not None and found.path.agrees_with(by_look.path):
        # Where both go alike nothing hides the stone, and it is shown best where it is alone.
        return replace(stone_of(found), by_look=stone_of(by_look))
    if by_look is not None:
        return stone_of(by_look)
    raise NoThrowError(
        "no thrown stone found: nothing of a stone's size slides along the ice",
        source=film.path,
    )


def seen_throughout(path: RoughPath, frames: Sequence[tuple[float, Frame]], camera: Camera) -> bool:
    """Return whether a stone is seen alone in nearly all frames that its path crosses."""
    times = np.array([t for t, _ in frames])
    places = np.array([[*path.at(t), 0.0] for t in times])
    expected = times[camera.sees(places)]
    seen = np.isin(expected, [s.t for s in path.sightings])
    return bool(seen.sum() >= tuning.AGREEING_SHARE * len(expected))


def look_step(film: SteadyFilm, background: Background) -> float:
    """Time between frames of a film of which all that is kept fits into memory [s]."""
    fitting = max(tuning.SAMPLE_BYTES // background.image[..., 0].size // 3, tuning.LEAST_SAMPLE)
    return max(tuning.LOOK_STEP, (film.sample[-1][0] - film.sample[0][0]) / fitting)


def found_or_misplaced(
    film: SteadyFilm,
    scene: Scene,
    refined: RefinedCamera,
    background: Background,
    refine_camera: bool,
) -> FoundStone:
    """Return the thrown stone; if none is found and the paint is elsewhere, blame the scene."""
    try:
        return find_stone(film, scene, refined.camera, background)
    except InputError as error:
        if refined.measured or not refine_camera:
            raise
        raise blames_scene(refined, film.path) from error


def focal_from_stones(
    refined: RefinedCamera, scene: Scene, stones: Sequence[FoundStone]
) -> RefinedCamera:
    """The camera with the focal length that the paint leaves open, from pictures of stones."""
    stones = [stone for stone in stones if stone.crops(refined.camera)]
    if refined.log_focal_sigma <= tuning.OPEN_FOCAL_SIGMA or not stones:
        return refined
    background = stones[0].background

    def at_focal(change: float) -> RefinedCamera | None:
        return refine_at_focal(refined, scene, background.image, background.origin_px, change)

    # Heights are compared on the same pixels: those in which the stone is seen from low down.
    low = at_focal(float(np.log(tuning.LOW_HEIGHT / refined.camera.position[2])))
    reach = refined.camera if low is None else low.camera
    seen = [stone.crops(reach) or stone.crops(refined.camera) for stone in stones]
    every = max(1, round(sum(map(len, seen)) / tuning.HEIGHT_CROPS))
    windows = [{crop.t: crop.window for crop in crops[::every]} for crops in seen]

    def crops(camera: Camera) -> list[list[Crop]]:
        return [s.crops(camera, own) for s, own in zip(stones, windows, strict=True)]

    return focal_from_stone(refined, at_focal, crops, stones[0].model, background.noise)
