"""From film to track: background, acquisition, a fit in every frame, and a smoother over all.

The order of the paper's figure 1 is kept (calibration, grey, top view, region of interest, flow)
with three changes that its own figures call for. Points are undistorted, not frames. The stone is
measured in the raw image by a fit of its whole picture, with its height, where flow alone drifts;
flow predicts and gates. And positions are joined by a smoother that knows their uncertainty.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.trajectory import Trajectory
from friction_estimation.acquisition import RoughPath, sightings_in, thrown_stone
from friction_estimation.appearance import EXPOSURES, Exposure, exposures_at, learn_appearance
from friction_estimation.background import (
    Background,
    find_background,
    moving_blobs,
    sheet_region,
)
from friction_estimation.camera import Camera
from friction_estimation.heading import consistent_heading
from friction_estimation.optical_flow import Flow, shift_between
from friction_estimation.parallax import UNDECIDED, focal_from_stone
from friction_estimation.refinement import Refined, at_focal, refine, unrefined
from friction_estimation.scene import Scene
from friction_estimation.smoothing import smooth
from friction_estimation.stone_fit import Appearance, StoneFit, channels_of, measure
from friction_estimation.stone_model import StoneModel
from friction_estimation.uncertainty import systematic_sigma
from friction_estimation.video import Film

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]
Progress = Callable[[Iterable[tuple[float, Image]], int], Iterable[tuple[float, Image]]]

SPARSE_FRAMES = 40
"""Frames looked at before tracking: for the background, the rough path and the stone's look."""
BACKGROUND_FRAMES = 15
MAX_HEADING_MISS = 0.7
"""A heading further from where the spin leads [rad] is a misread handle, not a turn."""
HEADING_GAIN = 0.35
"""How far the expected heading gives way to each frame's; the spin by half its square."""
MIN_LIKENESS = 0.3
"""Sightings less like a stone than this do not teach its look."""


@dataclass(frozen=True, kw_only=True)
class TrackingOptions:
    """What a user may choose.

    Parameters
    ----------
    flow : Lucas-Kanade in one scale or in a pyramid
    gate : largest distance of a fit from its prediction [m], beside what the picture's scale asks
    min_visible : least share of the stone that must be seen, 0 to 1
    min_inside : least share of the stone's outline that must lie in the image, 0 to 1
    refine : let the paint on the ice correct the points that were marked, and find what is not
        known of the lens
    """

    flow: Flow = "pyramidal"
    gate: float = 0.25
    min_visible: float = 0.5
    min_inside: float = 0.98
    refine: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmTrack:
    """What one film gave.

    Parameters
    ----------
    trajectory : the smoothed track; rows only where the stone was seen
    frame : (n,) index of the frame of each row
    velocity : (n, 2) [m/s]
    spin : (n,) [rad/s], NaN without a handle
    frame_count : frames of the film
    camera, look : what the film was read with
    landmarks : how well the paint on the ice agrees with the camera
    """

    trajectory: Trajectory
    frame: NDArray[np.int64]
    velocity: Floats
    spin: Floats
    frame_count: int
    camera: Camera
    look: Appearance
    landmarks: Refined


@dataclass(eq=False)
class _Record:
    t: list[float] = field(default_factory=list)
    fits: list[StoneFit | None] = field(default_factory=list)
    theta: list[float] = field(default_factory=list)


def track_film(
    path: str | Path,
    scene: Scene,
    *,
    throw: int = 0,
    options: TrackingOptions | None = None,
    progress: Progress | None = None,
) -> FilmTrack:
    """The thrown stone of one film.

    Parameters
    ----------
    path : of the film
    scene : of its camera
    throw : number of the throw, for the track
    progress : wraps the frames, given their expected number

    Raises
    ------
    InputError : no film, points that do not fit it, or no thrown stone in it
    """
    options = options or TrackingOptions()
    film = Film.open(path, scene.fps)
    camera = Camera.from_scene(scene, film.size)
    sample = film.sample(SPARSE_FRAMES)
    # A lens that is not known yet may show the sheet tens of pixels from where it is thought.
    known = scene.camera_matrix is not None and scene.distortion is not None
    region = sheet_region(camera, scene.sheet, 12 if known else 48)
    every = max(1, len(sample) // BACKGROUND_FRAMES)
    background = find_background([frame for _, frame in sample[::every]], region)
    landmarks = unrefined(camera)
    if options.refine:
        landmarks = refine(camera, scene, background.image, background.origin_px)
        camera = landmarks.camera
    model = StoneModel(radius=scene.stone_radius, height=scene.stone_height)
    rough = _acquire(sample, background, camera, model, scene)
    if rough is None:
        raise InputError(
            "no thrown stone found: nothing of a stone's size slides along the ice", source=path
        )
    ice = channels_of(background.image)
    seen_by = camera

    def exposures_of(camera: Camera) -> list[Exposure]:
        return _exposures(sample, rough, ice, background, seen_by, camera, model)

    if landmarks.log_focal_sigma > UNDECIDED and exposures_of(camera):
        loose, painted = landmarks, background
        landmarks = focal_from_stone(
            loose,
            lambda change: at_focal(loose, scene, painted.image, painted.origin_px, change),
            exposures_of,
            model,
            background.noise,
        )
        camera = landmarks.camera
    exposures = exposures_of(camera)
    if not exposures:
        raise InputError("the thrown stone is nowhere wholly in the image", source=path)
    look = learn_appearance(exposures, model, background.noise)
    frames: Iterable[tuple[float, Image]] = film.frames()
    if progress is not None:
        frames = progress(frames, film.frame_count)
    record = _measure_all(frames, rough, ice, background, camera, look, options)
    return _joined(record, look, landmarks, throw, path)


def track_films(
    paths: Sequence[str | Path],
    scene: Scene,
    *,
    options: TrackingOptions | None = None,
    progress: Progress | None = None,
) -> list[Trajectory]:
    """One throw per film, in order of play; see `track_film`."""
    return [
        track_film(path, scene, throw=i, options=options, progress=progress).trajectory
        for i, path in enumerate(paths)
    ]


def _acquire(
    sample: Sequence[tuple[float, Image]],
    background: Background,
    camera: Camera,
    model: StoneModel,
    scene: Scene,
) -> RoughPath | None:
    sightings = [
        sighting
        for i, (t, frame) in enumerate(sample)
        for sighting in sightings_in(
            moving_blobs(frame, background), i, t, camera, model, scene.sheet
        )
    ]
    return thrown_stone(sightings)


def _exposures(
    sample: Sequence[tuple[float, Image]],
    rough: RoughPath,
    ice: Floats,
    background: Background,
    seen_by: Camera,
    camera: Camera,
    model: StoneModel,
) -> list[Exposure]:
    """The stone's clear pictures, found with one camera, as another places them."""
    clear = [s for s in rough.sightings if s.likeness >= MIN_LIKENESS]
    clear = clear[:: max(1, len(clear) // EXPOSURES)]
    middle = model.height / 2
    places = np.array([s.xy for s in clear]).reshape(-1, 2)
    if camera is not seen_by:
        px = seen_by.project(np.column_stack([places, np.full(len(places), middle)]))
        places = camera.on_plane(px, middle)
    return exposures_at(
        [sample[s.frame][1] for s in clear],
        [s.t for s in clear],
        list(places),
        ice,
        background.origin_px,
        camera,
        model,
    )


def _measure_all(
    frames: Iterable[tuple[float, Image]],
    rough: RoughPath,
    ice: Floats,
    background: Background,
    camera: Camera,
    look: Appearance,
    options: TrackingOptions,
) -> _Record:
    record = _Record()
    pilot = _Pilot(rough=rough, camera=camera, look=look, options=options, region=background.slices)
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
        record.theta.append(pilot.note(t, fit))
        record.t.append(t)
        record.fits.append(fit)
    return record


class _Pilot:
    """Says where to look next: by flow while the stone is seen, by the rough path else."""

    def __init__(
        self,
        *,
        rough: RoughPath,
        camera: Camera,
        look: Appearance,
        options: TrackingOptions,
        region: tuple[slice, slice],
    ) -> None:
        self._rough, self._camera, self._look = rough, camera, look
        self._options, self._region = options, region
        self._grey: Image | None = None
        self._last: StoneFit | None = None
        self._last_t = 0.0
        self._theta, self._spin = 0.0, 0.0
        self._headings = 0

    def predict(self, t: float, frame: Image) -> Floats:
        part = np.ascontiguousarray(frame[self._region])
        grey = np.asarray(cv2.cvtColor(part, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
        before, self._grey = self._grey, grey
        theta = self._theta + self._spin * (t - self._last_t)
        if self._last is None or before is None:
            return np.array([*self._rough.at(t), theta])
        origin = np.array([self._region[1].start, self._region[0].start], dtype=np.float64)
        outline = self._look.model.outline_px(self._camera, self._last.xy)
        shift = shift_between(before, grey, outline - origin, self._options.flow)
        if shift is None:
            return np.array([*self._rough.at(t), theta])
        middle = self._look.model.height / 2
        here = self._camera.project([[*self._last.xy, middle]])
        there = self._camera.on_plane(here + shift, middle)[0]
        return np.array([*there, theta])

    @property
    def headings_to_try(self) -> Floats:
        """Turns from the expected heading [rad] to begin a fit at; many until one is known."""
        if self._headings or not self._look.has_handle:
            return np.zeros(1)
        return np.arange(8, dtype=np.float64) * (np.pi / 4)

    def fallback(self, t: float) -> Floats:
        return np.array([*self._rough.at(t), self._theta + self._spin * (t - self._last_t)])

    def accepts(self, fit: StoneFit, start: Floats) -> bool:
        footprint = 2.0 / np.linalg.norm(self._camera.px_per_metre(fit.xy), -2)  # of two pixels [m]
        return bool(
            fit.visible >= self._options.min_visible
            and fit.inside >= self._options.min_inside
            and np.linalg.norm(fit.xy - start[:2]) <= self._options.gate + footprint
        )

    def note(self, t: float, fit: StoneFit | None) -> float:
        """Remember a frame; its unwrapped heading [rad], NaN where it is not to be trusted."""
        self._last = fit
        if fit is None or not self._look.has_handle or not np.isfinite(fit.theta):
            return np.nan
        dt = t - self._last_t
        expected = self._theta + self._spin * dt if self._headings else self._theta
        miss = float(np.angle(np.exp(1j * (fit.theta - expected))))
        trusted = abs(miss) < MAX_HEADING_MISS
        if self._headings == 0:
            self._theta = fit.theta
        else:
            gain = HEADING_GAIN if trusted else 0.0
            self._theta = expected + gain * miss
            self._spin += gain**2 / 2 * miss / max(dt, 1e-3)
        self._last_t = t
        self._headings += 1
        return expected + miss if trusted else np.nan


def _joined(
    record: _Record, look: Appearance, landmarks: Refined, throw: int, path: str | Path
) -> FilmTrack:
    """Smooth the frames' measurements, and keep the rows in which the stone was seen."""
    fitted = [i for i, fit in enumerate(record.fits) if fit is not None]
    if len(fitted) < 5:
        raise InputError("the thrown stone is seen in fewer than five frames", source=path)
    first, last = fitted[0], fitted[-1]
    t = np.array(record.t[first : last + 1])
    fits = record.fits[first : last + 1]
    xy = np.array([[np.nan, np.nan] if fit is None else fit.xy for fit in fits])
    sigma = np.array(
        [[np.nan] * 2 if f is None else np.sqrt(np.diag(f.covariance)[:2]) for f in fits]
    )
    smoothed = [smooth(t, xy[:, axis], sigma[:, axis]) for axis in range(2)]
    kept = np.isfinite(xy[:, 0])  # wild frames did not pull; their rows carry the joint estimate
    theta = spin = sigma_theta = np.full(len(t), np.nan)
    if look.has_handle:
        speed = np.hypot(smoothed[0].rate, smoothed[1].rate)
        theta, spin, sigma_theta = _heading(t, fits, speed)
    place = np.column_stack([axis.value for axis in smoothed])
    noise = np.hypot(smoothed[0].sigma, smoothed[1].sigma)[kept] / np.sqrt(2)
    common = systematic_sigma(landmarks, place[kept], look.model.height)
    trajectory = Trajectory(
        t=t[kept],
        xy=place[kept],
        theta=theta[kept],
        sigma_xy=np.hypot(noise, common),
        sigma_theta=sigma_theta[kept] if look.has_handle else np.empty(0),
        throw=throw,
    )
    return FilmTrack(
        trajectory=trajectory,
        frame=np.arange(first, last + 1)[kept],
        velocity=np.column_stack([axis.rate for axis in smoothed])[kept],
        spin=spin[kept],
        frame_count=len(record.t),
        camera=landmarks.camera,
        look=look,
        landmarks=landmarks,
    )


def _heading(
    t: Floats, fits: Sequence[StoneFit | None], speed: Floats
) -> tuple[Floats, Floats, Floats]:
    """Smoothed heading, spin and the heading's standard error, each (n,)."""
    sigma = np.array([np.nan if fit is None else np.sqrt(fit.covariance[2, 2]) for fit in fits])
    measured = np.array([np.nan if fit is None else fit.theta for fit in fits])
    theta = consistent_heading(t, measured, sigma, speed)
    if np.isfinite(theta).sum() < 5:
        nothing = np.full(len(t), np.nan)
        return nothing, nothing, nothing
    result = smooth(t, theta, np.clip(sigma, 1e-3, 1.0))
    return result.value, result.rate, result.sigma
