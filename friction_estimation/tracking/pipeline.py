"""From film to track: background, detection, a fit in every frame, and a smoother over all of them.

The steps follow figure 1 of the paper (calibration, grey, top view, region of interest, flow) with
three changes. Points are undistorted, not frames. The stone is measured in the raw picture by a fit
of its whole image, which does not drift as optical flow does; flow predicts and gates. And a
smoother that knows the uncertainty of each place joins them to a track.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from curling_env.errors import InputError, NoThrowError
from curling_env.typing import Floats, Progress, no_progress, with_progress
from friction_estimation.appearance import (
    Appearance,
    Crop,
    StoneFit,
    learn_appearance,
    measure_occluded,
    those_explained,
    unexplained_share,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.refinement import RefinedCamera
from friction_estimation.camera.scene import Scene
from friction_estimation.film.frame import Frame
from friction_estimation.film.video import Film
from friction_estimation.tracking import tuning
from friction_estimation.tracking.cutting.throws import shows_several
from friction_estimation.tracking.detection.known_look import left_unexplained
from friction_estimation.tracking.detection.thrown_stone import RoughPath
from friction_estimation.tracking.films.film_track import FilmTrack, TrackingOptions
from friction_estimation.tracking.films.steady_film import SteadyFilm, camera_of, empty_ice
from friction_estimation.tracking.found_stone import (
    FoundStone,
    focal_from_stones,
    found_or_misplaced,
)
from friction_estimation.tracking.joint.heading import HeadingCurve
from friction_estimation.tracking.path.assembly import Measurements, assemble_track
from friction_estimation.tracking.path.prediction import Predictor
from friction_estimation.tracking.scene_context import SceneContext, find_scene_context
from friction_estimation.tracking.several.collisions import assemble_tracks
from friction_estimation.tracking.several.moving_stones import MovingStone, StoneFollower
from friction_estimation.tracking.several.unexplained import strange_ways


def track_film(
    film: str | Path | Film | SteadyFilm,
    scene: Scene,
    *,
    throw: int = 0,
    options: TrackingOptions | None = None,
    camera: RefinedCamera | None = None,
    judged: Callable[[RoughPath], object] = lambda path: None,
    progress: Progress = no_progress,
) -> FilmTrack:
    """Track the thrown stone of one film, and all other stones on the sheet.

    Parameters
    ----------
    film : path of the film, or the film itself, which may be a part of a longer one or be sampled
        already
    scene : its camera's view of the sheet
    throw : number of the throw, for the tracks
    options : what may be chosen; the defaults if None
    camera : the scene's camera, if it was solved before, see `solve_camera`; where the paint is not
        where it sees it, the camera has moved and is solved again for this film
    judged : called with roughly where the stone is, before it is measured in every frame; raises
        what is to be raised where that is no throw
    progress : called with the number of frames done and the expected number of all

    Raises
    ------
    InputError : no film, points that do not fit it, a camera that moves, or no thrown stone
    """
    options = options or TrackingOptions()
    if isinstance(film, str | Path):
        film = Film.open(film, scene.fps, options.slow)
    steady = film if isinstance(film, SteadyFilm) else SteadyFilm(film)
    background = empty_ice(steady, scene)
    refined, moved_px = camera_of(steady, scene, background, camera, options.refine)
    stone = found_or_misplaced(steady, scene, refined, background, options.refine)
    if refined is not camera:
        refined = focal_from_stones(refined, scene, [stone])
    judged(stone.path)
    learnt = _learn(steady, scene, refined.camera, stone)

    def frames() -> Iterable[tuple[float, Frame]]:
        label = f"track {steady.path.name}"
        return with_progress(steady.frames(), label, progress, steady.frame_count)

    track = _track_alone if learnt.context is None else _track_several
    found = track(frames, learnt, refined, options)
    if found is None:
        raise InputError("the thrown stone is seen in fewer than five frames", source=film.path)
    found = replace(
        found,
        stabiliser=steady.stabiliser,
        moved_px=moved_px,
        shows_several=shows_several(stone.sightings),
        unexplained=(*found.unexplained, *steady.remarks),
    )
    return found.numbered(throw)


# --- before the frames are followed -------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, eq=False)
class _Learnt:
    """All that is known before the frames are followed one by one.

    Parameters
    ----------
    stone, appearance : the thrown stone
    heading : its heading, as the pictures that taught the appearance agree on it; None where they
        do not show it
    context : the other stones; None without others
    sample_times : times of the sampled frames [s]
    """

    stone: FoundStone
    appearance: Appearance
    heading: HeadingCurve | None
    context: SceneContext | None
    sample_times: Sequence[float]


def _learn(film: SteadyFilm, scene: Scene, camera: Camera, stone: FoundStone) -> _Learnt:
    """Learn the look of the thrown stone, and what else lies on the sheet."""
    shown = _shown(stone, camera)
    if stone.by_look is not None and (shown is None or shown.unexplained > tuning.SOMETHING_BESIDE):
        # A person is in its pictures, though not in its way: the clearest may show more.
        looks = [look for look in (shown, _shown(stone.by_look, camera)) if look is not None]
        shown = min(looks, key=lambda look: look.unexplained, default=None)
    if shown is None:
        raise InputError("the thrown stone is nowhere wholly in the image", source=film.path)
    stone, crops, appearance = shown.stone, shown.crops, shown.appearance
    if shown.unexplained > tuning.MAX_UNEXPLAINED:
        raise NoThrowError(
            "no thrown stone found: what slides along the ice does not look like a stone",
            source=film.path,
        )

    def context_of(stone: FoundStone, appearance: Appearance) -> SceneContext | None:
        return find_scene_context(
            film.sample,
            stone.background,
            camera,
            appearance,
            scene.sheet,
            stone.path,
            stone.pictures,
            film.sample_until,
        )

    context = context_of(stone, appearance)
    if context is not None and context.path is not stone.path:
        # The first path may have gone over to a stone that was hit: all is learnt again.
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
        heading=_heading_of(crops, stone.path) if appearance.has_handle else None,
        context=context,
        sample_times=[t for t, _ in film.sample],
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Shown:
    """A stone as its pictures show it.

    Parameters
    ----------
    stone : without the sightings that do not show it
    crops : those of its pictures that show it
    appearance : learnt from these
    unexplained : share of them that it does not explain
    """

    stone: FoundStone
    crops: Sequence[Crop]
    appearance: Appearance
    unexplained: float


def _shown(stone: FoundStone, camera: Camera) -> _Shown | None:
    """Return what the pictures of a stone show; None where it is nowhere wholly in the image."""
    crops = stone.crops(camera)
    if not crops:
        return None
    appearance = learn_appearance(crops, stone.model, stone.background.noise)
    like = those_explained(crops, appearance)
    if len(like) < len(crops):
        # The others show something else: the path may have gone over to a stone that was hit.
        stone = stone.seen_in(like, crops)
        crops = like
        appearance = learn_appearance(crops, stone.model, stone.background.noise)
    grain = stone.background.grain if stone.background.noise > tuning.NOISY else 0.0
    unexplained = unexplained_share(crops, appearance, grain)
    if stone.path.measured:  # as it was judged when it was found
        unexplained = min(unexplained, left_unexplained(crops, appearance))
    return _Shown(stone=stone, crops=crops, appearance=appearance, unexplained=unexplained)


def _heading_of(crops: Sequence[Crop], path: RoughPath) -> HeadingCurve | None:
    """The heading of a stone; None where hardly any pictures show it.

    Where it was followed by its look, that tells its heading; else the pictures that taught it.
    """
    t, theta = path.headings
    if len(t) >= tuning.MIN_HEADING_VIEWS:
        return HeadingCurve.through(t, theta)
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
) -> FilmTrack | None:
    """The track of the thrown stone on a sheet without other stones; None where it is not seen."""

    def follow(heading: HeadingCurve | None) -> Measurements:
        return _follow_alone(frames(), learnt, refined.camera, options, heading)

    measured = follow(learnt.heading)
    better = _better_heading(measured, learnt.heading)
    if better is not None:
        measured = follow(better)
    found = assemble_track(measured, learnt.appearance, refined)
    if found is None:
        return None
    return replace(found, unexplained=strange_ways(refined.camera, measured))


def _follow_alone(
    frames: Iterable[tuple[float, Frame]],
    learnt: _Learnt,
    camera: Camera,
    options: TrackingOptions,
    heading: HeadingCurve | None,
) -> Measurements:
    background, appearance = learnt.stone.background, learnt.appearance
    people = learnt.stone.path.measured
    measured = Measurements()
    predictor = Predictor(
        path=learnt.stone.path,
        camera=camera,
        appearance=appearance,
        options=options,
        heading=heading,
        alone=True,
    )
    for t, frame in frames:

        def fit_at(pose: Floats, frame: Frame = frame) -> StoneFit | None:
            origin = background.origin_px
            return measure_occluded(
                frame, background.channels, origin, camera, appearance, pose, people=people
            )

        fit = predictor.find(t, predictor.predict(t, frame), fit_at)
        predictor.update(t, fit)
        measured.add(t, fit, frame, background, camera, appearance)
    return measured


def _track_several(
    frames: Callable[[], Iterable[tuple[float, Frame]]],
    learnt: _Learnt,
    refined: RefinedCamera,
    options: TrackingOptions,
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
