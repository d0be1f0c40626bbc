"""Films of throws on known ice: the truth that trackers, tests, demos and users share.

A film shows what a camera before a sheet would see (perspective, a distorting lens, stones with
height and a turning handle, light, noise, people), and beside it lies where the stone truly was in
every frame. Nothing here knows how films are tracked; only the camera's geometry is shared.

    spec = FilmSpec(camera="gantry", people=False)
    films = render_films("runs/films", [slide(ice, release, fps=120).trajectory], spec)
"""

from friction_estimation.synthetic.cameras import CAMERAS, CameraPlacement, named_camera, scene_of
from friction_estimation.synthetic.film_spec import FilmSpec, all_on_film, on_film
from friction_estimation.synthetic.films import render_film, render_films, write_film
from friction_estimation.synthetic.people import Cast, Person
from friction_estimation.synthetic.ray_tracing import StoneOnIce, StoneShape
from friction_estimation.synthetic.renderer import FilmRenderer, frames
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
    "frames",
    "named_camera",
    "on_film",
    "render_film",
    "render_films",
    "scene_of",
    "write_film",
]
