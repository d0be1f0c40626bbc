"""Page for each package, with the public names that it offers."""

from __future__ import annotations

import importlib
import types

PACKAGES = {
    "curling_env": "the sheet, its ice, the physics, the rules, and the environments",
    "friction_estimation": "from film to tracks, from tracks to ice",
    "agents": "planning, learning, and playing",
    "agents.coaching": "a coach's analysis of an evening",
    "curling_env.physics.effects": "the catalogue of effects, and their cards",
    "curling_env.game": "players, calls, and games on ice",
}
INDEX = """# Python

The top-level names of the packages are public, and change by the rules of
[versions](../../versioning.md). Positions are in metres, times in seconds, angles in radians;
[files](../../files.md) explains the frames.

{listed}

```{{toctree}}
:hidden:

{names}
```
"""


def pages() -> dict[str, str]:
    """Return a page in reStructuredText for each package, which autodoc fills, and their list."""
    listed = "\n".join(f"- [`{name}`]({name}.rst): {words}" for name, words in PACKAGES.items())
    index = INDEX.format(listed=listed, names="\n".join(PACKAGES))
    texts = {f"reference/python/{name}.rst": page(name) for name in PACKAGES}
    return {**texts, "reference/python/index.md": index}


def page(package: str) -> str:
    """Return the page of a package; autodoc finds its functions and classes, but no constants."""
    module = importlib.import_module(package)
    lines = [package, "=" * len(package), "", f".. automodule:: {package}", "   :members:", ""]
    for name in module.__all__:
        value = getattr(module, name)
        if not callable(value) and not isinstance(value, types.ModuleType):
            lines += [f".. autodata:: {package}.{name}", ""]
    return "\n".join(lines)
