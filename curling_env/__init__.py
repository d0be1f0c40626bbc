"""Curling: the sheet, its ice, the physics of the stones, and environments for learning to throw.

Importing this package registers the environments with Gymnasium, if Gymnasium is installed.
"""

from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any

from curling_env.errors import CurlingError, InputError, OutOfRangeError, OutputError
from curling_env.ice import ActiveEffect, FrictionMap, Ice, load_ice, save_ice
from curling_env.sheet import (
    PAPER_SHEET,
    PAPER_STONE,
    RULE_BOOK_STONE,
    WORLD_CURLING_SHEET,
    Direction,
    Sheet,
    Stone,
)
from curling_env.throw import Release, Throw, read_releases, write_releases
from curling_env.trajectory import Trajectory, read_tracks, write_tracks

if TYPE_CHECKING:
    from curling_env.envs.game import curling_v0
    from curling_env.physics.session import simulate

__version__ = "0.2.0"
__all__ = [
    "PAPER_SHEET",
    "PAPER_STONE",
    "RULE_BOOK_STONE",
    "WORLD_CURLING_SHEET",
    "ActiveEffect",
    "CurlingError",
    "Direction",
    "FrictionMap",
    "Ice",
    "InputError",
    "OutOfRangeError",
    "OutputError",
    "Release",
    "Sheet",
    "Stone",
    "Throw",
    "Trajectory",
    "curling_v0",
    "load_ice",
    "read_releases",
    "read_tracks",
    "save_ice",
    "simulate",
    "write_releases",
    "write_tracks",
]


def __getattr__(name: str) -> Any:
    """Load names that need a compiler or PettingZoo only on request."""
    if name == "simulate":
        return import_module("curling_env.physics.session").simulate
    if name == "curling_v0":
        try:
            return import_module("curling_env.envs.game.curling_v0")
        except ModuleNotFoundError as error:
            if error.name != "pettingzoo":
                raise
            raise ModuleNotFoundError(
                "the two-team game needs PettingZoo: pip install 'curling-sheet[game]'",
                name="pettingzoo",
            ) from error
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


with suppress(ImportError):  # ice, physics and files work without Gymnasium
    import_module("curling_env.envs.registration").register()
