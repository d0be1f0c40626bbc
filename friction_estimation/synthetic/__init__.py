"""Rendered films of throws with known paths, for testing trackers and for demonstrations.

A film shows a sheet as a camera would see it: in perspective, through a lens with distortion, with
solid stones and turning handles, light, noise and people. The true position of the stone in every
frame is stored next to the film. Rendering shares the camera's geometry with tracking, and nothing
else.

    spec = FilmSpec(camera="gantry", people=False)
    films = render_films("runs/films", [slide(ice, release, fps=120).trajectory], spec)
"""

from curling_env.infrastructure.lazy_names import lazy_names
from friction_estimation.synthetic.cameras import CAMERAS, CameraPlacement, named_camera, scene_of
from friction_estimation.synthetic.film_spec import FilmSpec, all_on_film, on_film
from friction_estimation.synthetic.films import render_film, render_films, write_film
from friction_estimation.synthetic.people import Cast, Person
from friction_estimation.synthetic.ray_tracing import StoneOnIce, StoneShape
from friction_estimation.synthetic.renderer import FilmRenderer
from friction_estimation.synthetic.sheet_drawing import Light, Palette

__all__ = [
    "CAMERAS",
    "CameraPlacement",
    "Cast",
    "FilmRenderer",
    "FilmSpec",
    "Light",
    "Palette",
    "Person",
    "StoneOnIce",
    "StoneShape",
    "all_on_film",
    "named_camera",
    "on_film",
    "render_film",
    "render_films",
    "scene_of",
    "write_film",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "tuning": ("HANDLE_COLOURS",),
    },
)
