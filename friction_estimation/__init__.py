"""From film to ice: track thrown stones, estimate the friction of the ice, find missing effects.

From films of throws to the ice:

    from pathlib import Path
    from curling_env import save_ice
    from friction_estimation import estimate_ice, track_films

    films = sorted(Path("films").glob("*.mp4"))       # one throw each, in order of play
    tracks = track_films(films, "end.scene.json")     # the camera's view of the sheet estimate =
    estimate_ice(tracks)                   # friction per cell, curl, and the rest
    save_ice(estimate.ice, "ice.json")

Tracks that were written to a file come back with `curling_env.read_tracks`. `discover(tracks)`
looks for effects that a model of the ice lacks, such as curl, a slope or worn pebble. The commands
`curling track`, `curling estimate` and `curling discover` do the same from a terminal.

Names are loaded at first use, so that importing this package is fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from friction_estimation.camera.scene import Scene, load_scene
    from friction_estimation.discovery.discover import Discovery, discover
    from friction_estimation.estimation.estimate import Estimate
    from friction_estimation.estimation.whole_ice import estimate_ice
    from friction_estimation.tracking import FilmTrack, track_film, track_films

__all__ = [
    "Discovery",
    "Estimate",
    "FilmTrack",
    "Scene",
    "discover",
    "estimate_ice",
    "load_scene",
    "track_film",
    "track_films",
]

_MODULES = {
    "camera.scene": ("Scene", "load_scene"),
    "discovery.discover": ("Discovery", "discover"),
    "estimation.estimate": ("Estimate",),
    "estimation.whole_ice": ("estimate_ice",),
    "tracking": ("FilmTrack", "track_film", "track_films"),
}


def __getattr__(name: str) -> Any:
    """Load a public name, with its dependencies, at first use."""
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
