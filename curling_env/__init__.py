"""Curling: the sheet, its ice, the physics of the stones, and environments to throw in.

Importing this package registers the environments with Gymnasium; everything else is loaded when
its name is first used, so that a program pays only for what it touches.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import gymnasium

if TYPE_CHECKING:
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

__version__ = "0.1.0"

_HOME_OF = {
    "CurlingError": "errors",
    "InputError": "errors",
    "OutOfRangeError": "errors",
    "OutputError": "errors",
    "ActiveEffect": "ice",
    "FrictionMap": "ice",
    "Ice": "ice",
    "load_ice": "ice",
    "save_ice": "ice",
    "PAPER_SHEET": "sheet",
    "WORLD_CURLING_SHEET": "sheet",
    "Direction": "sheet",
    "Sheet": "sheet",
    "PAPER_STONE": "sheet",
    "RULE_BOOK_STONE": "sheet",
    "Stone": "sheet",
    "Release": "throw",
    "Throw": "throw",
    "read_releases": "throw",
    "write_releases": "throw",
    "Trajectory": "trajectory",
    "read_tracks": "trajectory",
    "write_tracks": "trajectory",
}
"""Public name -> the module it lives in."""

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
    "load_ice",
    "read_releases",
    "read_tracks",
    "save_ice",
    "write_releases",
    "write_tracks",
]


def __getattr__(name: str) -> Any:
    if name == "curling_v0":  # the module, as PettingZoo's own games are reached
        return importlib.import_module(f"{__name__}.envs.game.curling_v0")
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOME_OF[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


if "CurlingSheet-v0" not in gymnasium.registry:  # once, also when the module is reloaded
    gymnasium.register(  # pyright: ignore[reportUnknownMemberType]  (its kwargs: a bare dict)
        "CurlingSheet-v0",
        entry_point="curling_env.envs.sheet.env:CurlingSheetEnv",
        vector_entry_point="curling_env.envs.sheet.vector_env:CurlingSheetVectorEnv",
    )
if "CurlingEnd-v0" not in gymnasium.registry:
    gymnasium.register(  # pyright: ignore[reportUnknownMemberType]
        "CurlingEnd-v0",
        entry_point="curling_env.envs.game.end:CurlingEndEnv",
        vector_entry_point="curling_env.envs.game.end_vector:CurlingEndVectorEnv",
    )
