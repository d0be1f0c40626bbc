"""Core of an environment for any number of episodes, shared by single and vector environments.

A core has the options of an environment and its rules: the start of episodes, the effect of a step,
the agent's observation and the entries of `info`. It has no episodes. Episodes are values that
never change; a step makes new ones. A single environment holds one episode, a vector environment
many, and both are played by the same rules.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from typing import Any, Generic, TypeVar, cast

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from curling_env.typing import Flags, Floats, Indices

Episodes = TypeVar("Episodes")
"""The episodes of one kind of environment: n of them, as an immutable value."""
Facts = dict[str, Any]
"""Entries of `info`: by name an array or a list with a row for each episode, or a dictionary."""
DETAILS = frozenset({"throw", "outcome", "trajectory", "shots"})
"""Entries of `info` that are objects of the physics and the game; the others have fixed shapes."""
PART = "reward_"
"""Prefix of the names of the parts of the reward in flat `info`."""
Part = tuple[Indices, Facts]
"""Entries of `info` of some episodes, by their indices."""


class Core(ABC, Generic[Episodes]):
    """The rules of an environment, for any number of episodes.

    Parameters
    ----------
    observation_space, action_space : of one episode
    render_mode : how one episode is shown; None for not at all
    """

    details: bool = False
    """True if `info` also has `DETAILS`."""

    def __init__(
        self,
        observation_space: spaces.Space[Any],
        action_space: spaces.Space[Any],
        render_mode: str | None,
    ) -> None:
        self.single_observation_space = observation_space
        self.single_action_space = action_space
        self.render_mode = render_mode

    @abstractmethod
    def blank(self, count: int) -> Episodes:
        """Return finished episodes, as placeholders before the first reset."""

    @abstractmethod
    def asked(self, options: Any, count: int) -> Any:
        """Check the options of a reset, and return them in the form of `begun`.

        Raises
        ------
        InputError : an unknown option, or an invalid value
        """

    @abstractmethod
    def begun(
        self,
        episodes: Episodes,
        rows: Indices,
        rngs: Sequence[np.random.Generator],
        asked: Any = None,
    ) -> Episodes:
        """Begin some of the episodes, and return all.

        Parameters
        ----------
        episodes : all episodes
        rows : indices of those that begin
        rngs : the random generator of every episode
        asked : from `asked`; None for a reset without options
        """

    @abstractmethod
    def played(
        self,
        episodes: Episodes,
        rows: Indices,
        rngs: Sequence[np.random.Generator],
        actions: Sequence[Any],
    ) -> tuple[Episodes, Floats, list[Part]]:
        """Make a step in some of the episodes, and return all.

        Parameters
        ----------
        episodes : all episodes
        rows : indices of those that go on
        rngs : the random generator of every episode
        actions : one for each of these rows

        Returns
        -------
        the episodes, the rewards of these rows, and entries of `info` about the step

        Raises
        ------
        InputError : an invalid action
        """

    def returned(self, facts: Facts) -> Facts:
        """Return the entries of `info` for the caller: flat, unless details are requested."""
        if self.details:
            return facts
        flat = {name: value for name, value in facts.items() if name not in DETAILS}
        parts: Facts = flat.pop("reward_parts", {})
        return flat | {f"{PART}{name}": value for name, value in parts.items()}

    @abstractmethod
    def are_over(self, episodes: Episodes) -> Flags:
        """Return which episodes are over, (n,)."""

    @abstractmethod
    def observed(self, episodes: Episodes) -> Any:
        """Return the observations of all episodes, in the batched observation space."""

    @abstractmethod
    def reported(self, episodes: Episodes, rows: Indices) -> Facts:
        """Return the entries of `info` after a reset or a step, of some episodes."""


def gathered(parts: Iterable[Part], among: Flags) -> dict[str, Any]:
    """Return entries of `info` in Gymnasium's form: for each name an array over all episodes, and a
    mask.

    Parameters
    ----------
    parts : entries of different episodes
    among : (n,) True for the episodes to report; entries of others are dropped

    Returns
    -------
    copies: no array of the core is handed out
    """
    out: dict[str, Any] = {}
    for rows, facts in parts:
        chosen = among[rows]
        if chosen.any():
            _gather(out, len(among), rows[chosen], facts, chosen)
    return out


def _gather(out: dict[str, Any], n: int, rows: Indices, facts: Facts, chosen: Flags) -> None:
    for name, given in facts.items():
        value = _objects(cast("list[Any]", given)) if type(given) is list else given
        if name not in out:
            out[name], out[f"_{name}"] = _blank(n, value), np.zeros(n, dtype=np.bool_)
        if type(value) is dict:
            _gather(out[name], n, rows, cast("Facts", value), chosen)
        else:
            out[name][rows] = value[chosen]
        out[f"_{name}"][rows] = True


def _objects(values: Sequence[Any]) -> NDArray[Any]:
    array = np.empty(len(values), dtype=object)
    for k, value in enumerate(values):
        array[k] = value
    return array


def _blank(n: int, value: Any) -> Any:
    if isinstance(value, dict):
        return {}
    empty = np.empty if value.dtype == object else np.zeros
    return empty((n, *value.shape[1:]), dtype=value.dtype)


def alone(parts: Iterable[Part]) -> dict[str, Any]:
    """Return entries of `info` of a single episode, as Python's numbers, objects and arrays."""
    return {
        name: _first(value) for rows, facts in parts if len(rows) for name, value in facts.items()
    }


def _first(value: Any) -> Any:
    if type(value) is dict:
        return {name: _first(part) for name, part in cast("Facts", value).items()}
    if type(value) is list:
        return cast("list[Any]", value)[0]
    return value.item() if value.ndim == 1 else value[0].copy()


def row_of(observations: Any, row: int) -> Any:
    """Return the observation of one episode among those of many, as a separate array."""
    if type(observations) is dict:
        parts = cast("dict[str, Any]", observations)
        return {name: array[row].copy() for name, array in parts.items()}
    return observations[row].copy()
