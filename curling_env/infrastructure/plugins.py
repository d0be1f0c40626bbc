"""How tasks, players and trackers of other packages, or of a user's own module, are found by name.

A package declares its objects as entry points of a group, such as `curling.tasks`. What is not
installed can be given as ``module:object``; the module may lie in the current folder.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import sys
from collections.abc import Iterable
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
        raise InputError(
            f"the {kind} {name[:60]!r} cannot be loaded: {str(error)[:120]} (known by name are "
            f"{names})"
        ) from error


def _let_the_current_folder_be_imported() -> None:
    """Python does so for scripts, but not for an installed command such as `curling`."""
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.append(here)  # at the end, so that nothing else is hidden
