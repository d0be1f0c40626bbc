"""A page for each package: the public names that it offers at its top."""

from __future__ import annotations

import importlib
import inspect
import types
from typing import Any

PACKAGES = {
    "curling_env": "the sheet, its ice, the physics, the rules, and the environments",
    "friction_estimation": "from film to tracks, from tracks to ice",
    "agents": "planning, learning, and playing",
    "agents.coaching": "what a coach asks of an evening",
    "curling_env.physics.effects": "the catalogue of effects, and their cards",
    "curling_env.game": "players, calls, and games on ice",
}


def pages() -> dict[str, str]:
    """A page in reStructuredText for each package, which autodoc fills."""
    texts = {f"reference/python/{name}.rst": page(name) for name in PACKAGES}
    listed = [f"- [`{name}`]({name}.rst): {words}" for name, words in PACKAGES.items()]
    texts["reference/python/index.md"] = "\n".join(
        [
            "# Python",
            "",
            "The names that the packages offer at their top are public, and change by the rules of"
            " [versions](../../versioning.md). Positions are in metres, times in seconds, angles in"
            " radians; [files](../../files.md) explains the frames.",
            "",
            *listed,
            "",
            "```{toctree}",
            ":hidden:",
            "",
            *PACKAGES,
            "```",
            "",
        ]
    )
    return texts


def page(package: str) -> str:
    module = importlib.import_module(package)
    lines = [package, "=" * len(package), "", f".. automodule:: {package}", "   :no-members:", ""]
    lines += [f".. currentmodule:: {package}", ""]
    for name in sorted(module.__all__, key=str.lower):
        value = getattr(module, name)
        kind = _kind(value)
        if kind:
            lines += [f".. {kind}:: {package}.{name}", *_options(value), ""]
    return "\n".join(lines)


def _kind(value: Any) -> str:
    if inspect.isclass(value):
        return "autoclass"
    if callable(value) and hasattr(value, "__name__"):
        return "autofunction"
    return "" if isinstance(value, types.ModuleType) else "autodata"


def _options(value: Any) -> list[str]:
    return ["   :members:"] if inspect.isclass(value) else []
