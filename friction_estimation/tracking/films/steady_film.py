"""A film held still and evenly lit, the empty ice in it, and its camera by the paint."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from curling_env.errors import InputError
from curling_env.typing import Image
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.camera.refinement import (
    RefinedCamera,
    refine,
    unrefined,
)
from friction_estimation.camera.scene import Scene
from friction_estimation.film.deflicker import deflicker_for
from friction_estimation.film.frame import Frame
from friction_estimation.film.stabilisation import stabiliser_for
from friction_estimation.film.video import Film
from friction_estimation.tracking.background import (
    Background,
    find_background,
    sheet_region,
)
from friction_estimation.tracking.joint import numbers


class SteadyFilm:
    """A film whose frames are evenly lit and do not sway.

    Parameters
    ----------
    film : as it was taken

    Raises
    ------
    InputError : no frame of the sample can be decoded without damage
    """

    def __init__(self, film: Film) -> None:
        self.path = film.path
        self.film = film
        self._count = sample_size(film.size)
        sample = film.sample(self._count)
        if not sample:
            raise InputError("no frame can be decoded without damage", source=film.path)
        self._deflicker = deflicker_for(sample)
        # One by one, so that no frame of a large film is held twice.
        if self._deflicker is not None:
            for k, (t, frame) in enumerate(sample):
                sample[k] = t, self._deflicker.corrected(frame)
        self.stabiliser = stabiliser_for(sample, film.path)
        if self.stabiliser is not None:
            for k, (t, frame) in enumerate(sample):
                sample[k] = t, self.stabiliser.stabilised(frame)
        self.sample = sample
        """Times [s] and frames, spread over the whole film."""

    @property
    def size(self) -> tuple[int, int]:
        return self.film.size

    @property
    def frame_count(self) -> int:
        return self.film.frame_count

    def frames(self) -> Iterable[tuple[float, Frame]]:
        """All frames of the film's size, where others would show the sheet elsewhere.

        Where nothing is to be corrected, colours are decoded only where needed.
        """
        if self._deflicker is None and self.stabiliser is None:
            return (one for one in self.film.lazy_frames() if one[1].shape[1::-1] == self.size)
        fitting = (one for one in self.film.frames() if one[1].shape[1::-1] == self.size)
        return self._corrected(fitting)

    def between(self, low: float, high: float, step: float) -> Iterator[tuple[float, Image]]:
        """The frames from one time to another, a step apart [s]."""
        return self._corrected(self.film.between(low, high, step))

    def sample_until(self, t: float) -> list[tuple[float, Image]]:
        """As many frames as `sample` has, between the beginning and a time [s]."""
        last = self.film.index_at(t)
        wanted = np.linspace(0, last, self._count).round().astype(int).tolist()
        return list(self._corrected(self.film.pick(wanted)))

    def _corrected(self, frames: Iterable[tuple[float, Image]]) -> Iterator[tuple[float, Image]]:
        for t, frame in frames:
            if self._deflicker is not None:
                frame = self._deflicker.corrected(frame)
            if self.stabiliser is not None:
                frame = self.stabiliser.stabilised(frame)
            yield t, frame


def sample_size(size: tuple[int, int]) -> int:
    """How many frames of a film are looked at before the stone is followed."""
    fitting = numbers.SAMPLE_BYTES // max(3 * size[0] * size[1], 1)
    return min(numbers.SAMPLE_FRAMES, max(fitting, numbers.LEAST_SAMPLE))


def empty_ice(film: SteadyFilm, scene: Scene) -> Background:
    """The ice without what moved."""
    camera = camera_from_scene(scene, film.size)
    # A lens that is not known yet may misplace the sheet by tens of pixels.
    known = scene.camera_matrix is not None and scene.distortion is not None
    margin = numbers.KNOWN_LENS_MARGIN_PX if known else numbers.UNKNOWN_LENS_MARGIN_PX
    region = sheet_region(camera, scene.sheet, margin)
    every = max(1, -(-len(film.sample) // numbers.BACKGROUND_FRAMES))
    return find_background([frame for _, frame in film.sample[::every]], region)


def refined_by_paint(
    film: SteadyFilm, scene: Scene, background: Background, refine_camera: bool
) -> RefinedCamera:
    """The camera, corrected by the paint on the ice if wanted."""
    camera = camera_from_scene(scene, film.size)
    if not refine_camera:
        return unrefined(camera)
    return refine(camera, scene, background.image, background.origin_px)
