"""Trained models of the package; docs/models.md describes their training and scores.

- `draw`: draws anywhere in the house, on any ice whose map is known
- `takeout`: puts a stone out of play, on any ice whose map is known
- `ends`: calls the shots of an end (``CurlingEnd-v0`` with ``actions="shots"``)
"""

from __future__ import annotations

from importlib.resources import as_file, files
from typing import TYPE_CHECKING

from curling_env.errors import InputError

if TYPE_CHECKING:
    from agents.learning.policy import TrainedPolicy
    from agents.playing.learned.network import ShotNetwork

LEARNT = ("draw", "takeout", "ends")
"""Names of the models, after their tasks."""


def load(name: str) -> TrainedPolicy | ShotNetwork:
    """Load a model, which has ``predict(observation)``.

    Parameters
    ----------
    name : one of `LEARNT`

    Raises
    ------
    InputError : unknown name
    """
    from agents.learning.policy import TrainedPolicy
    from agents.playing.learned.network import ShotNetwork

    if name not in LEARNT:
        known = ", ".join(LEARNT)
        raise InputError(f"unknown model {str(name)[:40]!r}; expected one of {known}")
    with as_file(files(__name__).joinpath(f"{name}.npz")) as path:
        return (ShotNetwork if name == "ends" else TrainedPolicy).load(path)
