"""Pictures of the sheet: from above for windows and films, and figures for reports."""

from curling_env.infrastructure.lazy_names import lazy_names
from curling_env.render.playback import drawn_stones, playback_frames, scene_at
from curling_env.render.renderer import BLUE, RED, YELLOW, DrawnScene, DrawnStone, SheetRenderer

__all__ = [
    "BLUE",
    "RED",
    "YELLOW",
    "DrawnScene",
    "DrawnStone",
    "SheetRenderer",
    "drawn_stones",
    "playback_frames",
    "scene_at",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "figures": ("save_figure",),
    },
)
