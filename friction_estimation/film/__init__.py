"""Reading and writing films and pictures: frames with their times, stabilised and evenly lit."""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "deflicker": ("deflicker_for",),
        "frame": ("CutFrame", "brightness_of"),
        "stabilisation": ("stabiliser_for",),
        "video": ("Film", "films_in", "is_stream"),
        "writer": ("film_writer",),
    },
)
