"""Pictures of the sheet from above: one renderer for windows, films and documents."""

from curling_env.render.picture import BLUE, RED, YELLOW, DrawnStone, Scene, SheetPicture
from curling_env.render.playback import drawn, play_back, scene_at

__all__ = [
    "BLUE",
    "RED",
    "YELLOW",
    "DrawnStone",
    "Scene",
    "SheetPicture",
    "drawn",
    "play_back",
    "scene_at",
]
