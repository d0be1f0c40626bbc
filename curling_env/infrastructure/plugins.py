"""How tasks, players and trackers of other packages, or of a user's own module, are found by name.

A package declares its objects as entry points of a group, such as `curling.tasks`. What is not
installed can be given as ``module:object``; the module may lie in the current folder.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import sys
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from curling_env.errors import InputError


def plugin_names(group: str) -> list[str]:
    """Names that installed packages declare in an entry-point group, in alphabetical order."""
    return sorted({entry.name for entry in importlib.metadata.entry_points(group=group)})


def load_plugin(
    kind: str,
    group: str,
    name: str,
    *,
    built_in: Iterable[str] = (),
    form: str = "module:Class",
) -> Any:
    """The object that a name stands for.

    Parameters
    ----------
    kind : what is looked for, in one word for error messages, such as ``task``
    group : the entry-point group in which packages declare such objects
    name : a declared name, or ``module:object``
    built_in : further names that the caller knows, to be listed in the message
    form : how ``module:object`` is written in the message

    Raises
    ------
    InputError : an unknown name, or an object that cannot be imported
    """
    declared = {entry.name: entry for entry in importlib.metadata.entry_points(group=group)}
    module, colon, attribute = name.partition(":")
    names = ", ".join(sorted({*declared, *built_in}))
    if name not in declared and not (colon and module and attribute):
        raise InputError(f"no {kind} is named {name[:60]!r}; there are {names}, or give {form}")
    try:
        if name in declared:
            return declared[name].load()
        _let_the_current_folder_be_imported()
        return getattr(importlib.import_module(module), attribute)
    except Exception as error:  # whatever a stranger's module may do
        hidden = what_hides(declared[name]) if name in declared else None
        why = hidden or f"{str(error)[:120]} (known by name are {names})"
        raise InputError(f"the {kind} {name[:60]!r} cannot be loaded: {why}") from error


def what_hides(entry: importlib.metadata.EntryPoint) -> str | None:
    """Whether something else stands where an object of this project should be, in one line.

    A module or folder of the user's may have the name of one of the project's packages, or another
    distribution may have written its files over it.

    Parameters
    ----------
    entry : the entry point of the object

    Returns
    -------
    what hides it and what to do; None if nothing does, or if it is not an object of this project
    """
    top = entry.module.partition(".")[0]
    ours = _PACKAGES / top
    if not (ours / "__init__.py").exists() and not ours.is_dir():
        return None
    loaded = sys.modules.get(top)
    spec = loaded.__spec__ if loaded is not None else find_spec(top)
    places = [] if spec is None else [spec.origin, *(spec.submodule_search_locations or [])]
    found = next((Path(place) for place in places if place), None)
    if found is not None and ours not in (found, found.parent):
        return f"{found} hides this project's package {top!r}; rename it, or start elsewhere"
    own = None if entry.dist is None else entry.dist.name
    writers = importlib.metadata.packages_distributions().get(top, [])
    other = next((name for name in writers if name != own), None)
    if other is not None:
        return (
            f"the distribution {other!r} has a package {top!r} too and was installed over this "
            "project's; give each an environment of its own"
        )
    return None


_PACKAGES = Path(__file__).parents[2]
"""Where this project's packages lie side by side, installed or not."""


def _let_the_current_folder_be_imported() -> None:
    """Python does so for scripts, but not for an installed command such as `curling`."""
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.append(here)  # at the end, so that nothing else is hidden
