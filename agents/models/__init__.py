"""Trained models that come with the package; docs/models.md says what each has learnt, and how.

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
"""Names of the models, each what it has learnt."""


def load(name: str) -> TrainedPolicy | ShotNetwork:
    """A model, which has ``predict(observation)``.

    Parameters
    ----------
    name : one of `LEARNT`

    Raises
    ------
    InputError : an unknown name
    """
    from agents.learning.policy import TrainedPolicy
    from agents.playing.learned.network import ShotNetwork

    if name not in LEARNT:
        raise InputError(f"the models are {', '.join(LEARNT)}, got {str(name)[:40]!r}")
    with as_file(files(__name__).joinpath(f"{name}.npz")) as path:
        return (ShotNetwork if name == "ends" else TrainedPolicy).load(path)
