"""Stabilised and evenly lit film, its empty ice, and its camera from the paint."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from curling_env.errors import InputError
from curling_env.typing import Image
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.camera.refined import RefinedCamera, unrefined
from friction_estimation.camera.refinement import displacement, refine
from friction_estimation.camera.scene import Scene
from friction_estimation.film.deflicker import deflicker_for
from friction_estimation.film.frame import Frame, LazyFrame
from friction_estimation.film.stabilisation import STILL_PX, stabiliser_for
from friction_estimation.film.video import Film
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.background import (
    Background,
    find_background,
    sheet_region,
)


class SteadyFilm:
    """Film with evenly lit and stabilised frames.

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
        # One by one, so that no frame of a large film is in memory twice.
        if self._deflicker is not None:
            for k, (t, frame) in enumerate(sample):
                sample[k] = t, self._deflicker.corrected(frame)
        self.stabiliser = stabiliser_for(sample, film.path)
        if self.stabiliser is not None:
            for k, (t, frame) in enumerate(sample):
                sample[k] = t, self.stabiliser.stabilised(frame)
        self.sample = sample
        """Times [s] and frames, spread over the whole film."""
        self.remarks: tuple[str, ...] = ()
        """Remarks on the film itself from the frames that were read, in words."""

    @property
    def size(self) -> tuple[int, int]:
        return self.film.size

    @property
    def frame_count(self) -> int:
        return self.film.frame_count

    def frames(self) -> Iterable[tuple[float, Frame]]:
        """Yield all frames of the film's size; others are reported.

        Without corrections, colours are decoded only where needed.
        """
        fitting = self._fitting()
        if self._deflicker is None and self.stabiliser is None:
            return fitting
        return self._corrected((t, frame.whole()) for t, frame in fitting)

    def _fitting(self) -> Iterator[tuple[float, LazyFrame]]:
        """Yield the frames of the film's size; the first other one is reported."""
        others, first = 0, ""
        for number, (t, frame) in enumerate(self.film.lazy_frames()):
            size = (frame.shape[1], frame.shape[0])
            if size == self.size:
                yield t, frame
                continue
            if not others:
                first = (
                    f"frame {self.film.first + number} ({t:.1f} s) has {size[0]} × {size[1]} pixels"
                )
            others += 1
            self.remarks = (
                f"{first}, where the film has {self.size[0]} × {self.size[1]}: {others} such "
                f"frame{'s' * (others != 1)} ignored",
            )

    def between(self, low: float, high: float, step: float) -> Iterator[tuple[float, Image]]:
        """Return the frames from one time to another, a step apart [s]."""
        return self._corrected(self.film.between(low, high, step))

    def _corrected(self, frames: Iterable[tuple[float, Image]]) -> Iterator[tuple[float, Image]]:
        for t, frame in frames:
            if self._deflicker is not None:
                frame = self._deflicker.corrected(frame)
            if self.stabiliser is not None:
                frame = self.stabiliser.stabilised(frame)
            yield t, frame


def sample_size(size: tuple[int, int]) -> int:
    """Return the number of sampled frames of a film."""
    fitting = tuning.SAMPLE_BYTES // max(3 * size[0] * size[1], 1)
    return min(tuning.SAMPLE_FRAMES, max(fitting, tuning.LEAST_SAMPLE))


def empty_ice(film: SteadyFilm, scene: Scene) -> Background:
    """Empty ice."""
    camera = camera_from_scene(scene, film.size)
    # An unknown lens may displace the sheet by tens of pixels.
    known = scene.camera_matrix is not None and scene.distortion is not None
    margin = tuning.KNOWN_LENS_MARGIN_PX if known else tuning.UNKNOWN_LENS_MARGIN_PX
    region = sheet_region(camera, scene.sheet, margin)
    every = max(1, -(-len(film.sample) // tuning.BACKGROUND_FRAMES))
    return find_background([frame for _, frame in film.sample[::every]], region)


def camera_of(
    film: SteadyFilm,
    scene: Scene,
    background: Background,
    known: RefinedCamera | None,
    refine_camera: bool,
) -> tuple[RefinedCamera, float]:
    """Return the camera of a film, and its movement since it was solved [px].

    Parameters
    ----------
    known : the scene's camera, if it was solved before; where the paint is not where it sees it,
        the camera has moved and is solved again
    refine_camera : whether the paint corrects the camera

    Raises
    ------
    InputError : a camera that has moved too far
    """
    if known is None:
        return refined_by_paint(film, scene, background, refine_camera), 0.0
    moved_px = displacement(known, scene, background.image, background.origin_px)
    if moved_px <= max(STILL_PX, 3 * known.rms_px):
        return known, 0.0
    refined = refined_by_paint(film, scene, background, refine_camera)
    if refine_camera and not refined.measured:
        raise InputError(
            "the camera has moved too far: the paint is not near the marks; "
            "mark the sheet again in this film",
            source=film.path,
        )
    return refined, moved_px


def scene_mismatch_error(refined: RefinedCamera, film: Path) -> InputError:
    """Return the error of a film without a thrown stone whose paint contradicts the scene."""
    wrong = ", ".join(refined.disagreeing)
    seen = f" ({wrong} elsewhere)" if wrong else ""
    return InputError(
        f"the paint is not where this scene says{seen}, and no thrown stone is found; "
        "mark the sheet again in this film",
        source=film,
    )


def refined_by_paint(
    film: SteadyFilm, scene: Scene, background: Background, refine_camera: bool
) -> RefinedCamera:
    """Return the camera, corrected by the paint on request."""
    camera = camera_from_scene(scene, film.size)
    if not refine_camera:
        return unrefined(camera)
    return refine(camera, scene, background.image, background.origin_px)
