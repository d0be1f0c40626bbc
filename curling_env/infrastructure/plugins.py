"""Lookup of tasks, players and trackers by name, in other packages or the user's own modules.

A package declares its objects as entry points of a group, such as `curling.tasks`. Others can be
given as ``module:object``; the module may be in the current folder.
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
    """Return the names that installed packages declare in an entry-point group, sorted."""
    return sorted({entry.name for entry in importlib.metadata.entry_points(group=group)})


def load_plugin(
    kind: str,
    group: str,
    name: str,
    *,
    built_in: Iterable[str] = (),
    form: str = "module:Class",
) -> Any:
    """Load the object with a name.

    Parameters
    ----------
    kind : kind of object in one word for error messages, such as ``task``
    group : entry-point group of such objects
    name : a declared name, or ``module:object``
    built_in : further names known to the caller, listed in the message
    form : notation of ``module:object`` in the message

    Raises
    ------
    InputError : an unknown name, or an object that cannot be imported
    """
    declared = {entry.name: entry for entry in importlib.metadata.entry_points(group=group)}
    module, colon, attribute = name.partition(":")
    names = ", ".join(sorted({*declared, *built_in}))
    if name not in declared and not (colon and module and attribute):
        raise InputError(f"unknown {kind} {name[:60]!r}; expected one of {names}, or {form}")
    try:
        if name in declared:
            return declared[name].load()
        _allow_imports_from_current_folder()
        return getattr(importlib.import_module(module), attribute)
    except Exception as error:  # a third-party module may raise anything
        hidden = shadowed_by(declared[name]) if name in declared else None
        why = hidden or f"{str(error)[:120]} (known names: {names})"
        raise InputError(f"the {kind} {name[:60]!r} cannot be loaded: {why}") from error


def shadowed_by(entry: importlib.metadata.EntryPoint) -> str | None:
    """Return the reason why another object shadows one of this project, in one line.

    A module or folder of the user may have the name of one of the project's packages, or another
    distribution may have overwritten its files.

    Parameters
    ----------
    entry : the entry point of the object

    Returns
    -------
    the cause and the remedy; None if nothing shadows it, or if it is not an object of this project
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
            f"the distribution {other!r} also has a package {top!r} and was installed over this "
            "project's; use separate environments"
        )
    return None


_PACKAGES = Path(__file__).parents[2]
"""Folder of this project's packages, installed or not."""


def _allow_imports_from_current_folder() -> None:
    """Add the current folder to the import path, as Python does for scripts but not for
    `curling`.
    """
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.append(here)  # at the end, so that it shadows nothing
