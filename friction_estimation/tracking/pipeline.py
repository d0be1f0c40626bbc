"""From film to track: background, acquisition, a fit in every frame, and a smoother over all.

The order of the paper's figure 1 is kept (calibration, grey, top view, region of interest, flow)
with three changes that its own figures call for. Points are undistorted, not frames. The stone is
measured in the raw image by a fit of its whole picture, with its height, where flow alone drifts;
flow predicts and gates. And positions are joined by a smoother that knows their uncertainty.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from curling_env.errors import InputError
from curling_env.typing import Floats, Image, Progress, no_progress, with_progress
from friction_estimation.appearance import (
    LEARNING_FRAMES,
    Appearance,
    Crop,
    StoneModel,
    channels_of,
    crops_at,
    learn_appearance,
    measure,
    unexplained_share,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.camera.refinement import refine, refine_at_focal, unrefined
from friction_estimation.camera.scene import Scene
from friction_estimation.film.deflicker import deflicker_for
from friction_estimation.film.frame import Frame
from friction_estimation.film.stabilisation import stabiliser_for
from friction_estimation.film.video import Film
from friction_estimation.tracking.detection.acquisition import (
    RoughPath,
    acquire,
)
from friction_estimation.tracking.detection.background import (
    Background,
    find_background,
    sheet_region,
)
from friction_estimation.tracking.detection.compression import Copying
from friction_estimation.tracking.film_track import FilmTrack, TrackingOptions
from friction_estimation.tracking.focal_from_stone import UNDECIDED, focal_from_stone
from friction_estimation.tracking.path.assembly import Record, join_frames
from friction_estimation.tracking.path.heading import Turn
from friction_estimation.tracking.path.prediction import Pilot
from friction_estimation.tracking.scene_context import gather
from friction_estimation.tracking.several.collisions import tracks_of
from friction_estimation.tracking.several.moving_stones import Mover, follow_together

SPARSE_FRAMES = 40
"""Frames looked at before tracking: for the background, the rough path and the stone's look."""
BACKGROUND_FRAMES = 15
MOST_LEFT = 0.2
"""Of the difference from the empty ice, what a stone's picture may leave: stones leave 0.04 to
0.1, people on the ice, taken for stones, 0.3 to 0.5."""
MIN_LIKENESS = 0.3
"""Sightings less like a stone than this do not teach its look."""


def track_film(
    path: str | Path,
    scene: Scene,
    *,
    throw: int = 0,
    options: TrackingOptions | None = None,
    progress: Progress = no_progress,
) -> FilmTrack:
    """The thrown stone of one film, and beside it all other stones on the sheet.

    Parameters
    ----------
    path : of the film
    scene : of its camera
    throw : number of the throw, for the track
    progress : called with the number of frames done and the expected number of all

    Raises
    ------
    InputError : no film, points that do not fit it, a camera that moves, or no thrown stone in it
    """
    options = options or TrackingOptions()
    film = Film.open(path, scene.fps)
    camera = camera_from_scene(scene, film.size)
    sample = film.sample(SPARSE_FRAMES)
    lighting = deflicker_for(sample)
    if lighting is not None:
        sample = [(t, lighting.corrected(frame)) for t, frame in sample]
    stabiliser = stabiliser_for(sample, path)
    if stabiliser is not None:
        sample = [(t, stabiliser.stabilised(frame)) for t, frame in sample]

    def right(frame: Image) -> Image:
        even = frame if lighting is None else lighting.corrected(frame)
        return even if stabiliser is None else stabiliser.stabilised(even)

    def put_right(frames: Iterable[tuple[float, Image]]) -> Iterator[tuple[float, Image]]:
        return ((t, right(frame)) for t, frame in frames)

    # A lens that is not known yet may show the sheet tens of pixels from where it is thought.
    known = scene.camera_matrix is not None and scene.distortion is not None
    region = sheet_region(camera, scene.sheet, 12 if known else 48)
    every = max(1, -(-len(sample) // BACKGROUND_FRAMES))
    background = find_background([frame for _, frame in sample[::every]], region)
    landmarks = unrefined(camera)
    if options.refine:
        landmarks = refine(camera, scene, background.image, background.origin_px)
        camera = landmarks.camera
    model = StoneModel(radius=scene.stone_radius, height=scene.stone_height)

    def between(low: float, high: float, step: float) -> Iterator[tuple[float, Image]]:
        return put_right(film.between(low, high, step))

    acquired = acquire(sample, background, camera, model, scene.sheet, between)
    if acquired is None:
        raise InputError(
            "no thrown stone found: nothing of a stone's size slides along the ice", source=path
        )
    rough, pictures = acquired.rough, acquired.pictures
    ice = channels_of(background.image)
    seen_by = camera

    def crops_of(camera: Camera) -> list[Crop]:
        return _crops(pictures, rough, ice, background, seen_by, camera, model)

    if landmarks.log_focal_sigma > UNDECIDED and crops_of(camera):
        loose, painted = landmarks, background
        landmarks = focal_from_stone(
            loose,
            lambda change: refine_at_focal(loose, scene, painted.image, painted.origin_px, change),
            crops_of,
            model,
            background.noise,
        )
        camera = landmarks.camera
    crops = crops_of(camera)
    if not crops:
        raise InputError("the thrown stone is nowhere wholly in the image", source=path)
    look = learn_appearance(crops, model, background.noise)
    if unexplained_share(crops, look) > MOST_LEFT:
        raise InputError(
            "no thrown stone found: what slides along the ice does not look like a stone",
            source=path,
        )

    def sample_until(t: float) -> list[tuple[float, Image]]:
        wanted = np.linspace(0, film.index_at(t), SPARSE_FRAMES).round().astype(int).tolist()
        return list(put_right(film.pick(wanted)))

    company = gather(sample, background, camera, look, scene.sheet, rough, sample_until)
    if company is not None and company.rough is not rough:
        # The path may have gone over to a stone that was struck: all is learnt anew.
        rough, background, seen_by = company.rough, company.background, camera
        pictures, ice = company.sample, channels_of(background.image)
        crops = crops_of(camera) or crops
        look = learn_appearance(crops, model, background.noise)
        company = (
            gather(sample, background, camera, look, scene.sheet, rough, sample_until) or company
        )

    as_filmed = lighting is None and stabiliser is None
    copying = Copying(background)

    def shown() -> Iterable[tuple[float, Frame]]:
        frames: Iterable[tuple[float, Frame]]
        frames = film.lazy_frames() if as_filmed else put_right(film.frames())
        watched = copying.watched(frames)
        return with_progress(watched, f"track {Path(path).name}", progress, film.frame_count)

    turn = _turn_of(crops) if look.has_handle else None
    if company is None:

        def alone(turn: Turn | None) -> Record:
            return _measure_all(shown(), rough, ice, background, camera, look, turn, options)

        record = alone(turn)
        other = _other_turn(record, turn)
        if other is not None:
            record = alone(other)
        record.lag_px = copying.lag_px
        return replace(join_frames(record, look, landmarks, throw, path), stabiliser=stabiliser)
    lying, moments = company.lying, [t for t, _ in sample]

    def together(turn: Turn | None) -> list[Mover]:
        return follow_together(
            shown(), rough, look, turn, lying, moments, ice, background, camera, options
        )

    movers = together(turn)
    other = _other_turn(movers[0].record, turn, min(movers[0].strikes, default=np.inf))
    if other is not None:
        movers = together(other)
    for mover in movers:
        mover.record.lag_px = copying.lag_px
    return replace(tracks_of(movers, lying, landmarks, throw, path), stabiliser=stabiliser)


def _other_turn(record: Record, turn: Turn | None, until: float = np.inf) -> Turn | None:
    """The turn that all frames show, where it is not the one that they were measured with.

    A handle begun at a wrong heading is not found, and pulls the stone's place aside.

    Parameters
    ----------
    until : it strikes another stone [s]
    """
    seen = record.turn(until)
    return None if seen is None or (turn is not None and not turn.differs(seen)) else seen


def _crops(
    sample: Sequence[tuple[float, Image]],
    rough: RoughPath,
    ice: Floats,
    background: Background,
    seen_by: Camera,
    camera: Camera,
    model: StoneModel,
) -> list[Crop]:
    """The stone's clear pictures, found with one camera, as another places them."""
    clear = [s for s in rough.sightings if s.likeness >= MIN_LIKENESS]
    clear = clear[:: max(1, -(-len(clear) // LEARNING_FRAMES))]
    middle = model.height / 2
    places = np.array([s.xy for s in clear]).reshape(-1, 2)
    if camera is not seen_by:
        px = seen_by.project(np.column_stack([places, np.full(len(places), middle)]))
        places = camera.on_plane(px, middle)
    return crops_at(
        [sample[s.frame][1] for s in clear],
        [s.t for s in clear],
        list(places),
        ice,
        background.origin_px,
        camera,
        model,
    )


def _turn_of(crops: Sequence[Crop]) -> Turn | None:
    """The heading through the throw, as the pictures that taught the look agree on it."""
    ordered = sorted(crops, key=lambda crop: crop.t)
    if len(ordered) < 4:
        return None
    return Turn([e.t for e in ordered], [float(e.pose[2]) for e in ordered])


def _measure_all(
    frames: Iterable[tuple[float, Frame]],
    rough: RoughPath,
    ice: Floats,
    background: Background,
    camera: Camera,
    look: Appearance,
    turn: Turn | None,
    options: TrackingOptions,
) -> Record:
    record = Record()
    pilot = Pilot(
        rough=rough,
        camera=camera,
        look=look,
        options=options,
        turn=turn,
    )
    for t, frame in frames:
        start = pilot.predict(t, frame)
        fit = min(
            (
                found
                for turn in pilot.headings_to_try
                if (
                    found := measure(
                        frame,
                        ice,
                        background.origin_px,
                        camera,
                        look,
                        start + np.array([0.0, 0.0, turn]),
                    )
                )
            ),
            key=lambda found: found.misfit / max(found.visible, 1e-3),
            default=None,
        )
        if fit is None or not pilot.accepts(fit, start):
            fit = None
            again = pilot.fallback(t)
            if np.linalg.norm(again[:2] - start[:2]) > 0.02:
                second = measure(frame, ice, background.origin_px, camera, look, again)
                if second is not None and pilot.accepts(second, again):
                    fit = second
        pilot.note(t, fit)
        record.t.append(t)
        record.fits.append(fit)
        record.glimpse(frame, ice, background, camera, look)
    return record
