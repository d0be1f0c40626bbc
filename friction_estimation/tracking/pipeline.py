"""From film to track: background, detection, a fit in every frame, and a smoother over all of them.

The steps follow figure 1 of the paper (calibration, grey, top view, region of interest, flow) with
three changes. Points are undistorted, not frames. The stone is measured in the raw picture by a fit
of its whole image, which does not drift as optical flow does; flow predicts and gates. And a
smoother that knows the uncertainty of each place joins them to a track.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from curling_env.errors import InputError
from curling_env.typing import Floats, Image, Progress, no_progress, with_progress
from friction_estimation.appearance import (
    CROPS_TO_LEARN_FROM,
    Appearance,
    Crop,
    StoneFit,
    StoneModel,
    crops_at,
    learn_appearance,
    measure,
    unexplained_share,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.camera.refinement import (
    RefinedCamera,
    refine,
    refine_at_focal,
    unrefined,
)
from friction_estimation.camera.scene import Scene
from friction_estimation.film.deflicker import deflicker_for
from friction_estimation.film.frame import Frame
from friction_estimation.film.stabilisation import stabiliser_for
from friction_estimation.film.video import Film
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.background import (
    Background,
    find_background,
    sheet_region,
)
from friction_estimation.tracking.detection.compression import CompressionMonitor
from friction_estimation.tracking.detection.thrown_stone import RoughPath, find_thrown_stone
from friction_estimation.tracking.film_track import FilmTrack, TrackingOptions
from friction_estimation.tracking.focal_from_stone import focal_from_stone
from friction_estimation.tracking.path.assembly import Measurements, assemble_track
from friction_estimation.tracking.path.heading import HeadingCurve
from friction_estimation.tracking.path.prediction import Predictor
from friction_estimation.tracking.scene_context import SceneContext, find_scene_context
from friction_estimation.tracking.several.collisions import assemble_tracks
from friction_estimation.tracking.several.moving_stones import MovingStone, StoneFollower


def track_film(
    film: str | Path | Film,
    scene: Scene,
    *,
    throw: int = 0,
    options: TrackingOptions | None = None,
    progress: Progress = no_progress,
) -> FilmTrack:
    """Track the thrown stone of one film, and all other stones on the sheet.

    Parameters
    ----------
    film : path of the film, or the film itself, which may be a part of a longer one
    scene : its camera's view of the sheet
    throw : number of the throw, for the tracks
    options : what may be chosen; the defaults if None
    progress : called with the number of frames done and the expected number of all

    Raises
    ------
    InputError : no film, points that do not fit it, a camera that moves, or no thrown stone
    """
    options = options or TrackingOptions()
    if not isinstance(film, Film):
        film = Film.open(film, scene.fps, options.slow)
    steady = _SteadyFilm(film)
    refined, background = _empty_ice(steady, scene, options.refine)
    stone = _find_stone(steady, scene, refined.camera, background)
    if refined.log_focal_sigma > tuning.OPEN_FOCAL_SIGMA and stone.crops(refined.camera):
        refined = _focal_from_stone(refined, scene, stone)
    learnt = _learn(steady, scene, refined.camera, stone)
    compression = CompressionMonitor(learnt.stone.background)

    def frames() -> Iterable[tuple[float, Frame]]:
        watched = compression.watch(steady.frames())
        return with_progress(watched, f"track {steady.path.name}", progress, steady.frame_count)

    track = _track_alone if learnt.context is None else _track_several
    found = track(frames, learnt, refined, options, compression)
    if found is None:
        raise InputError("the thrown stone is seen in fewer than five frames", source=film.path)
    return replace(found, stabiliser=steady.stabiliser).numbered(throw)


# --- the film ----------------------------------------------------------------------------------


class _SteadyFilm:
    """A film whose frames are evenly lit and do not sway.

    Parameters
    ----------
    film : as it was taken
    """

    def __init__(self, film: Film) -> None:
        self.path = film.path
        self._film = film
        sample = film.sample(tuning.SAMPLE_FRAMES)
        self._deflicker = deflicker_for(sample)
        if self._deflicker is not None:
            sample = [(t, self._deflicker.corrected(frame)) for t, frame in sample]
        self.stabiliser = stabiliser_for(sample, film.path)
        if self.stabiliser is not None:
            sample = [(t, self.stabiliser.stabilised(frame)) for t, frame in sample]
        self.sample = sample
        """Times [s] and frames, spread over the whole film."""

    @property
    def size(self) -> tuple[int, int]:
        return self._film.size

    @property
    def frame_count(self) -> int:
        return self._film.frame_count

    def frames(self) -> Iterable[tuple[float, Frame]]:
        """All frames; where nothing is to be corrected, colours are decoded only where needed."""
        if self._deflicker is None and self.stabiliser is None:
            return self._film.lazy_frames()
        return self._corrected(self._film.frames())

    def between(self, low: float, high: float, step: float) -> Iterator[tuple[float, Image]]:
        """The frames from one time to another, a step apart [s]."""
        return self._corrected(self._film.between(low, high, step))

    def sample_until(self, t: float) -> list[tuple[float, Image]]:
        """As many frames as `sample` has, between the beginning and a time [s]."""
        last = self._film.index_at(t)
        wanted = np.linspace(0, last, tuning.SAMPLE_FRAMES).round().astype(int).tolist()
        return list(self._corrected(self._film.pick(wanted)))

    def _corrected(self, frames: Iterable[tuple[float, Image]]) -> Iterator[tuple[float, Image]]:
        for t, frame in frames:
            if self._deflicker is not None:
                frame = self._deflicker.corrected(frame)
            if self.stabiliser is not None:
                frame = self.stabiliser.stabilised(frame)
            yield t, frame


def _empty_ice(
    film: _SteadyFilm, scene: Scene, refine_camera: bool
) -> tuple[RefinedCamera, Background]:
    """The camera, corrected by the paint on the ice if wanted, and the ice without what moved."""
    camera = camera_from_scene(scene, film.size)
    # A lens that is not known yet may misplace the sheet by tens of pixels.
    known = scene.camera_matrix is not None and scene.distortion is not None
    margin = tuning.KNOWN_LENS_MARGIN_PX if known else tuning.UNKNOWN_LENS_MARGIN_PX
    region = sheet_region(camera, scene.sheet, margin)
    every = max(1, -(-len(film.sample) // tuning.BACKGROUND_FRAMES))
    background = find_background([frame for _, frame in film.sample[::every]], region)
    if not refine_camera:
        return unrefined(camera), background
    return refine(camera, scene, background.image, background.origin_px), background


# --- the stone before it is followed -----------------------------------------------------------


@dataclass(frozen=True, kw_only=True, eq=False)
class _FoundStone:
    """The thrown stone, found but not yet measured.

    Parameters
    ----------
    path : roughly where it is
    pictures : times [s] and frames in which it was sighted
    background : the ice behind it
    found_by : the camera with which it was found
    model : its shape
    """

    path: RoughPath
    pictures: Sequence[tuple[float, Image]]
    background: Background
    found_by: Camera
    model: StoneModel

    def crops(self, camera: Camera) -> list[Crop]:
        """Clear pictures of the stone, placed as another camera sees them."""
        clear = [s for s in self.path.sightings if s.likeness >= tuning.MIN_LEARNING_LIKENESS]
        clear = clear[:: max(1, -(-len(clear) // CROPS_TO_LEARN_FROM))]
        middle = self.model.height / 2
        places = np.array([s.xy for s in clear]).reshape(-1, 2)
        if camera is not self.found_by:
            px = self.found_by.project(np.column_stack([places, np.full(len(places), middle)]))
            places = camera.on_plane(px, middle)
        return crops_at(
            [self.pictures[s.frame][1] for s in clear],
            [s.t for s in clear],
            list(places),
            self.background.channels,
            self.background.origin_px,
            camera,
            self.model,
        )


def _find_stone(
    film: _SteadyFilm, scene: Scene, camera: Camera, background: Background
) -> _FoundStone:
    model = StoneModel(radius=scene.stone_radius, height=scene.stone_height)
    found = find_thrown_stone(film.sample, background, camera, model, scene.sheet, film.between)
    if found is None:
        raise InputError(
            "no thrown stone found: nothing of a stone's size slides along the ice",
            source=film.path,
        )
    return _FoundStone(
        path=found.path,
        pictures=found.pictures,
        background=background,
        found_by=camera,
        model=model,
    )


def _focal_from_stone(refined: RefinedCamera, scene: Scene, stone: _FoundStone) -> RefinedCamera:
    """The camera with the focal length that the paint leaves open, from the stone's pictures."""
    background = stone.background

    def at_focal(change: float) -> RefinedCamera | None:
        return refine_at_focal(refined, scene, background.image, background.origin_px, change)

    return focal_from_stone(refined, at_focal, stone.crops, stone.model, background.noise)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Learnt:
    """All that is known before the frames are followed one by one.

    Parameters
    ----------
    stone, appearance : the thrown stone
    heading : its heading, as the pictures that taught the appearance agree on it; None where they
        do not show it
    context : the other stones; None where there are none
    sample_times : times of the sampled frames [s]
    """

    stone: _FoundStone
    appearance: Appearance
    heading: HeadingCurve | None
    context: SceneContext | None
    sample_times: Sequence[float]


def _learn(film: _SteadyFilm, scene: Scene, camera: Camera, stone: _FoundStone) -> _Learnt:
    """What the thrown stone looks like, and what else lies on the sheet."""
    crops = stone.crops(camera)
    if not crops:
        raise InputError("the thrown stone is nowhere wholly in the image", source=film.path)
    appearance = learn_appearance(crops, stone.model, stone.background.noise)
    if unexplained_share(crops, appearance) > tuning.MAX_UNEXPLAINED:
        raise InputError(
            "no thrown stone found: what slides along the ice does not look like a stone",
            source=film.path,
        )

    def context_of(stone: _FoundStone, appearance: Appearance) -> SceneContext | None:
        return find_scene_context(
            film.sample,
            stone.background,
            camera,
            appearance,
            scene.sheet,
            stone.path,
            film.sample_until,
        )

    context = context_of(stone, appearance)
    if context is not None and context.path is not stone.path:
        # The first path may have gone over to a stone that was hit: all is learnt anew.
        stone = replace(
            stone,
            path=context.path,
            pictures=context.pictures,
            background=context.background,
            found_by=camera,
        )
        crops = stone.crops(camera) or crops
        appearance = learn_appearance(crops, stone.model, stone.background.noise)
        context = context_of(stone, appearance) or context
    return _Learnt(
        stone=stone,
        appearance=appearance,
        heading=_heading_of(crops) if appearance.has_handle else None,
        context=context,
        sample_times=[t for t, _ in film.sample],
    )


def _heading_of(crops: Sequence[Crop]) -> HeadingCurve | None:
    """The heading through the pictures of a stone; None where there are hardly any."""
    ordered = sorted(crops, key=lambda crop: crop.t)
    if len(ordered) < 4:
        return None
    return HeadingCurve([e.t for e in ordered], [float(e.pose[2]) for e in ordered])


# --- frame by frame ----------------------------------------------------------------------------


def _track_alone(
    frames: Callable[[], Iterable[tuple[float, Frame]]],
    learnt: _Learnt,
    refined: RefinedCamera,
    options: TrackingOptions,
    compression: CompressionMonitor,
) -> FilmTrack | None:
    """The track of the thrown stone on a sheet without other stones; None where it is not seen."""

    def follow(heading: HeadingCurve | None) -> Measurements:
        return _follow_alone(frames(), learnt, refined.camera, options, heading)

    measured = follow(learnt.heading)
    better = _better_heading(measured, learnt.heading)
    if better is not None:
        measured = follow(better)
    measured.lag_px = compression.lag_px
    return assemble_track(measured, learnt.appearance, refined)


def _follow_alone(
    frames: Iterable[tuple[float, Frame]],
    learnt: _Learnt,
    camera: Camera,
    options: TrackingOptions,
    heading: HeadingCurve | None,
) -> Measurements:
    background, appearance = learnt.stone.background, learnt.appearance
    measured = Measurements()
    predictor = Predictor(
        path=learnt.stone.path,
        camera=camera,
        appearance=appearance,
        options=options,
        heading=heading,
    )
    for t, frame in frames:

        def fit_at(pose: Floats, frame: Frame = frame) -> StoneFit | None:
            origin = background.origin_px
            return measure(frame, background.channels, origin, camera, appearance, pose)

        fit = predictor.find(t, predictor.predict(t, frame), fit_at)
        predictor.update(t, fit)
        measured.add(t, fit, frame, background, camera, appearance)
    return measured


def _track_several(
    frames: Callable[[], Iterable[tuple[float, Frame]]],
    learnt: _Learnt,
    refined: RefinedCamera,
    options: TrackingOptions,
    compression: CompressionMonitor,
) -> FilmTrack | None:
    """The tracks of the thrown stone and all others; None where the thrown one is not seen."""
    resting = () if learnt.context is None else learnt.context.resting
    follower = StoneFollower(learnt.stone.background, refined.camera, options, resting)

    def follow(heading: HeadingCurve | None) -> list[MovingStone]:
        return follower.follow(
            frames(), learnt.stone.path, learnt.appearance, heading, learnt.sample_times
        )

    stones = follow(learnt.heading)
    first_hit = min(stones[0].hits, default=np.inf)
    better = _better_heading(stones[0].measured, learnt.heading, first_hit)
    if better is not None:
        stones = follow(better)
    for stone in stones:
        stone.measured.lag_px = compression.lag_px
    return assemble_tracks(stones, resting, refined)


def _better_heading(
    measured: Measurements, heading: HeadingCurve | None, until: float = np.inf
) -> HeadingCurve | None:
    """The heading that all frames show, where it is not the one they were measured with.

    A fit that starts at a wrong heading does not find the handle, and the stone's place is off.

    Parameters
    ----------
    until : when the stone hits another one [s]
    """
    seen = measured.heading_curve(until)
    if seen is None or (heading is not None and not heading.differs(seen)):
        return None
    return seen
