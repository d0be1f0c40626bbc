"""Public names of a package that are loaded when they are first used.

Importing a package then costs nothing, and its modules may import each other by way of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any


def lazy_names(
    package: str, modules: Mapping[str, Sequence[str]]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` for a package's `__init__`.

    Parameters
    ----------
    package : its `__name__`
    modules : module, relative to the package with a leading dot -> public names defined there
    """
    where = {name: module for module, names in modules.items() for name in names}

    def get(name: str) -> Any:
        if name not in where:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(f".{where[name]}", package), name)

    def names() -> list[str]:
        return sorted({*vars(import_module(package)), *where})

    return get, names
