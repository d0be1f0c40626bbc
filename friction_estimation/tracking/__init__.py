"""Film in, track out: detections, their association, a fit in every frame, and a smoother."""

from curling_env.infrastructure.lazy_names import lazy_names
from friction_estimation.tracking.built_in import track_film
from friction_estimation.tracking.films.film_track import FilmTrack, TrackingOptions
from friction_estimation.tracking.films.run import track_each, track_films
from friction_estimation.tracking.films.tracked_film import TrackedFilm
from friction_estimation.tracking.tracker import Tracker, load_tracker

__all__ = [
    "FilmTrack",
    "TrackedFilm",
    "Tracker",
    "TrackingOptions",
    "load_tracker",
    "track_each",
    "track_film",
    "track_films",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "detection.single_image": ("find_stones_in_image",),
        "films.motion_detector": ("MotionDetector",),
        "tuning": ("COMPARED_AFTER",),
        "films.resume": ("Checkpoints",),
        "films.shared_cameras": ("SharedCameras", "camera_from"),
        "overlay.numbers": ("RunningNumbers",),
        "optical_flow": ("lucas_kanade",),
        "stone_numbers": ("StoneNumbers",),
    },
)
