"""Film in, track out: background, acquisition, a fit in every frame, and a smoother over all."""

from friction_estimation.tracking.film_track import FilmTrack, TrackingOptions
from friction_estimation.tracking.pipeline import track_film

__all__ = ["FilmTrack", "TrackingOptions", "track_film"]
