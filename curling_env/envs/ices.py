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
        self._pairs: tuple[tuple[Ice, Ice], ...] = ()
        self.listed: tuple[Ice, ...] = ()
        """The ices of a list as they are known; none where they are drawn."""
        if given == "random" or isinstance(given, Mapping):
            given = dataclass_from(RandomIces, "ices", {} if given == "random" else given)
        if isinstance(given, RandomIces):
            usual, self._draw = load_ice(given.base), given.draw
            if given.pool:
                rng = np.random.default_rng(given.pool_seed)
                self._pairs = tuple(given.draw(rng) for _ in range(given.pool))
        elif hasattr(given, "draw") or callable(given):
            self._draw = getattr(given, "draw", given)
        else:
            self._pairs = _listed(given)
            self.listed = tuple(known for _, known in self._pairs)
            usual = self._pairs[0][0]
        self.usual = usual
        """An ice of the distribution, or like them."""

    def draw(self, rng: np.random.Generator) -> tuple[Ice, Ice]:
        """Draw an ice, and what is known of it.

        Raises
        ------
        InputError : a distribution that returns something else
        """
        if self._pairs:
            return self._pairs[int(rng.integers(len(self._pairs)))]
        return _pair(self._draw(rng))

    def has(self, ice: Ice) -> bool:
        """Whether an ice, as it is or as it is known, comes again in later episodes."""
        return any(ice is one for pair in self._pairs for one in pair)


def _as_known(ice: Ice) -> Ice:
    return ice


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
        told: Callable[[Ice], Ice] = _as_known,
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

    def lasts(self, ice: Ice, known: KnownIce) -> bool:
        """Whether an ice and what is known of it come again in later episodes."""
        kept = self._knowns.get(id(known.ice))
        again = ice is self._usual or (self.ices is not None and self.ices.has(ice))
        return again and kept is not None and kept[1] is known

    def known_as(self, ice: Ice) -> KnownIce:
        """What the agent is told of an ice; the same object for ices that come again."""
        kept = self._knowns.get(id(ice))
        if kept is not None and kept[0] is ice:
            return kept[1]
        known = KnownIce(ice, self._told(ice))
        lasts = self.ices is not None and self.ices.has(ice)
        if lasts or ice is self._usual or ice is self.known_ice:
            self._knowns[id(ice)] = (ice, known)
        return known


def _pair(given: Any) -> tuple[Ice, Ice]:
    """An ice and what is known of it, from that or from an ice alone."""
    if not isinstance(given, tuple):
        ice = load_ice(given)
        return ice, ice
    pair = cast("tuple[Any, ...]", given)
    if len(pair) != 2:
        raise InputError(
            "a distribution of ices must return an ice, or an ice and what is known of it, got "
            f"{brief(given)}"
        )
    return load_ice(pair[0]), load_ice(pair[1])


def _listed(given: Any) -> tuple[tuple[Ice, Ice], ...]:
    if isinstance(given, str | Path) and Path(given).is_dir():
        files = sorted(Path(given).glob("*.json"))
        if not files:
            raise InputError("has no ice file (*.json)", source=given)
        return tuple(_pair(file) for file in files)
    if isinstance(given, str | Path | Ice):
        return (_pair(given),)
    if not isinstance(given, Iterable):
        raise InputError(f"ices must be {ACCEPTED}, got {brief(given)}")
    ices = tuple(_pair(one) for one in cast("Iterable[Any]", given))
    if not ices:
        raise InputError(f"ices must be {ACCEPTED}, got none")
    return ices
