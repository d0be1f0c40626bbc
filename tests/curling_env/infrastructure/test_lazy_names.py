"""Every package's public names load, and an unknown name is refused."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
ROOMS = [
    f"{package}.{init.parent.name}"
    for package in ("curling_env", "friction_estimation", "agents")
    for init in sorted((ROOT / package).glob("*/__init__.py"))
    if "lazy_names" in init.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("room", ROOMS)
def test_every_public_name_of_a_room_loads(room):
    package = import_module(room)
    for name in dir(package):
        getattr(package, name)
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = package.no_such_name


@pytest.mark.parametrize("room", ROOMS)
def test_no_public_name_equals_a_submodule_which_would_replace_it_once_imported(room):
    package = import_module(room)
    folder = ROOT / room.replace(".", "/")
    modules = {path.stem for path in folder.iterdir() if path.suffix == ".py" or path.is_dir()}
    for name in modules - {"__init__", "__pycache__"}:
        with pytest.raises(AttributeError):
            package.__getattr__(name)
