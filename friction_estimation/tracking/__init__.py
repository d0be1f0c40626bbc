"""Film in, track out: background, detection, a fit in every frame, and a smoother over all."""

from friction_estimation.tracking.films.film_track import FilmTrack, TrackingOptions
from friction_estimation.tracking.films.run import track_each, track_films
from friction_estimation.tracking.films.tracked_film import TrackedFilm
from friction_estimation.tracking.pipeline import track_film
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
