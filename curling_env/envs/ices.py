"""Ices that differ from episode to episode, and what the agent is told of each.

`ices` of an environment is a list of ices, a folder of ice files, the fields of `RandomIces`, or a
distribution of the user's: something with a method ``draw(rng)``, or a function of a random
generator. Either returns an ice, or an ice and what is known of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from curling_env.envs.known_ice import KnownIce
from curling_env.envs.options import brief, dataclass_from, yes_or_no
from curling_env.envs.random_ice import RandomIces
from curling_env.errors import InputError
from curling_env.ice import Ice, load_ice
from curling_env.physics.ice_uncertainty import is_uncertain, plausible_ices

IceOption = Ice | str | Path | Mapping[str, Any]
"""An ice, its file, the name of a preset, or the content of a file."""
GivenIce = tuple[Ice | None, Ice | None]
"""The ice that `reset` was asked for, and what is to be known of it."""

ACCEPTED = (
    "a list of ices (names, files, Ice), a folder of ice files, 'random', the fields of "
    "RandomIces, something with draw(rng), or a function of a random generator"
)


class Ices:
    """A distribution of ices, from which every episode draws its own.

    Parameters
    ----------
    given : see the module
    usual : an ice like them, for where the distribution names none

    Raises
    ------
    InputError : something else, or an ice that cannot be read
    """

    def __init__(self, given: Any, usual: Ice) -> None:
        self._draw: Any = None
        self.listed: tuple[Ice, ...] = ()
        if given == "random" or isinstance(given, Mapping):
            given = dataclass_from(RandomIces, "ices", {} if given == "random" else given)
        if isinstance(given, RandomIces):
            usual, self._draw = load_ice(given.base), given.draw
        elif hasattr(given, "draw") or callable(given):
            self._draw = getattr(given, "draw", given)
        else:
            self.listed = _listed(given)
            usual = self.listed[0]
        self.usual = usual
        """An ice of the distribution, or like them."""

    def draw(self, rng: np.random.Generator) -> tuple[Ice, Ice]:
        """Draw an ice, and what is known of it.

        Raises
        ------
        InputError : a distribution that returns something else
        """
        if self.listed:
            ice = self.listed[int(rng.integers(len(self.listed)))]
            return ice, ice
        drawn: Any = self._draw(rng)
        pair = cast("tuple[Any, ...]", drawn) if isinstance(drawn, tuple) else (drawn, drawn)
        if len(pair) != 2:
            raise InputError(
                "a distribution of ices must return an ice, or an ice and what is known of it, got "
                f"{brief(drawn)}"
            )
        return load_ice(pair[0]), load_ice(pair[1])


class EpisodeIces:
    """The ice of every episode of an environment, and what the agent is told of it.

    Parameters
    ----------
    ice : the ice of every episode, unless there are `ices`
    known_ice : the ice as the agent knows it in every episode; by default as it is, or as `ices`
        says
    ices : a distribution of ices; None for the same one always
    ice_sigma : whether every episode has an ice that the standard errors of `ice` allow
    told : what is told of an ice, given the ice as it is known; by default that

    Raises
    ------
    InputError : something that is no ice, a distribution of none, or both kinds of randomness
    """

    def __init__(
        self,
        ice: IceOption,
        known_ice: IceOption | None,
        ices: Any,
        *,
        ice_sigma: bool = False,
        told: Callable[[Ice], Ice] = lambda ice: ice,
    ) -> None:
        self._usual = load_ice(ice)
        self.ices = None if ices is None else Ices(ices, self._usual)
        if self.ices is not None:
            self._usual = self.ices.usual
        self.known_ice = None if known_ice is None else load_ice(known_ice)
        self.has_sigma = yes_or_no("ice_sigma", ice_sigma)
        if self.has_sigma and self.ices is not None:
            raise InputError("give either ices or ice_sigma: both draw the ice of an episode")
        if self.has_sigma and not is_uncertain(self._usual):
            raise InputError("ice_sigma draws ices from standard errors, and this ice has none")
        self._told = told
        self._knowns: dict[int, tuple[Ice, KnownIce]] = {}

    @property
    def usual(self) -> Ice:
        """The ice of every episode, or one like those of the episodes."""
        return self._usual

    @usual.setter
    def usual(self, ice: IceOption) -> None:
        if self.ices is not None:
            raise InputError("this environment draws its ice from ices; set none besides")
        self._usual = load_ice(ice)

    @property
    def are_drawn(self) -> bool:
        """Whether every episode has an ice of its own."""
        return self.ices is not None or self.has_sigma

    @property
    def known(self) -> tuple[Ice, ...]:
        """The ices as the agent may know them, as far as they can be told before they are drawn."""
        if self.known_ice is not None:
            return (self.known_ice,)
        return (self._usual,) if self.ices is None else self.ices.listed or (self._usual,)

    def given(self, options: dict[str, Any]) -> GivenIce:
        """Take `ice` and `known_ice` out of the options of a reset; None where they are not there.

        Raises
        ------
        InputError : an ice that cannot be read
        """
        asked = [options.pop(name, None) for name in ("ice", "known_ice")]
        ice, known = (None if one is None else load_ice(one) for one in asked)
        return ice, known

    def draw(
        self, rng: np.random.Generator, given: GivenIce = (None, None)
    ) -> tuple[Ice, KnownIce]:
        """The ice of an episode that begins, and what the agent is told of it.

        Parameters
        ----------
        rng : source of the randomness
        given : what `reset` was asked for
        """
        ice, known = given
        if ice is not None:
            known = known or self.known_ice or ice
        elif self.ices is not None:
            ice, drawn = self.ices.draw(rng)
            known = known or self.known_ice or drawn
        else:
            ice = plausible_ices(self._usual, 1, rng)[0] if self.has_sigma else self._usual
            known = known or self.known_ice or self._usual
        return ice, self.known_as(known)

    def known_as(self, ice: Ice) -> KnownIce:
        """What the agent is told of an ice; the same object for ices that come again."""
        kept = self._knowns.get(id(ice))
        if kept is not None and kept[0] is ice:
            return kept[1]
        known = KnownIce(ice, self._told(ice))
        if ice is self._usual or any(ice is one for one in self.known):
            self._knowns[id(ice)] = (ice, known)
        return known


def _listed(given: Any) -> tuple[Ice, ...]:
    if isinstance(given, str | Path) and Path(given).is_dir():
        files = sorted(Path(given).glob("*.json"))
        if not files:
            raise InputError("has no ice file (*.json)", source=given)
        return tuple(load_ice(file) for file in files)
    if isinstance(given, str | Path | Ice):
        return (load_ice(given),)
    if not isinstance(given, Iterable):
        raise InputError(f"ices must be {ACCEPTED}, got {brief(given)}")
    ices = tuple(load_ice(one) for one in cast("Iterable[Any]", given))
    if not ices:
        raise InputError(f"ices must be {ACCEPTED}, got none")
    return ices
