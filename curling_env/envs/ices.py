"""Ices that differ from episode to episode, with the agent's knowledge of each.

`ices` of an environment is a list of ices, a folder of ice files, the fields of `RandomIces`, or a
custom distribution: an object with a method ``draw(rng)``, or a function of a random generator,
itself or as ``module:object``. It returns an ice, or a pair of an ice and the known ice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, TypeVar, cast

import numpy as np

from curling_env.analysis.ice_uncertainty import is_uncertain, plausible_ices
from curling_env.envs.known_ice import KnownIce
from curling_env.envs.options import brief, dataclass_from, yes_or_no
from curling_env.envs.random_ice import DrawnIces, RandomIces
from curling_env.errors import InputError
from curling_env.ice import Ice, load_ice
from curling_env.infrastructure.plugins import load_plugin

IceOption = Ice | str | Path | Mapping[str, Any]
"""An ice, its file, the name of a preset, or the content of a file."""
IcePair = tuple[Ice, Ice]
"""An ice and its known ice."""
GivenIce = tuple[Ice | None, Ice | None]
"""The ice and the known ice given to `reset`; None if absent."""
Made = TypeVar("Made")
"""Playing surface of an environment, made from an ice and its known ice."""

ICES_GROUP = "curling.ices"
"""The entry-point group of distributions of ices."""
BLOCK = 32
"""Number of ices that are drawn at once: more would not fit a processor's cache."""
ACCEPTED = (
    "a list of ices (names, files, Ice), a folder of ice files, 'random', the fields of "
    "RandomIces, something with draw(rng), a function of a random generator, or module:object"
)


def _as_known(ice: Ice) -> Ice:
    return ice


class EpisodeIces(Generic[Made]):
    """Ice of every episode of an environment, with the known ice.

    Parameters
    ----------
    ice : the ice of every episode, unless there are `ices`
    known_ice : the ice as the agent knows it in every episode; by default as it is, or as `ices`
        says
    ices : a distribution of ices, see the module; None for the same one always
    make : what is played on, from an ice and what is known of it; made once for a pair that recurs
    ice_sigma : whether every episode has an ice that the standard errors of `ice` allow
    make_many : the same of ices drawn at once, where that is faster
    observed : the ice from which observations are made, given the ice as it is known; by default
        that

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
        make: Callable[[Ice, KnownIce], Made],
        make_many: Callable[[RandomIces, DrawnIces], list[Made]] | None = None,
        ice_sigma: bool = False,
        observed: Callable[[Ice], Ice] = _as_known,
    ) -> None:
        self._usual = load_ice(ice)
        self._distribution: Any = None
        self._family: RandomIces | None = None
        self._pairs: tuple[IcePair, ...] = ()
        listed: tuple[Ice, ...] = ()
        if ices is not None:
            listed = self._read(ices)
        self.known_ice = None if known_ice is None else load_ice(known_ice)
        self.has_sigma = yes_or_no("ice_sigma", ice_sigma)
        if self.has_sigma and ices is not None:
            raise InputError("give either ices or ice_sigma: both draw the ice of an episode")
        if self.has_sigma and not is_uncertain(self._usual):
            raise InputError("ice_sigma draws ices from standard errors, and this ice has none")
        self._has_ices, self._listed = ices is not None, listed
        self._make, self._make_many, self._observed = make, make_many, observed
        self._knowns: dict[int, tuple[Ice, KnownIce]] = {}
        self._made: dict[tuple[int, int], tuple[Ice, Ice, Made]] = {}

    def _read(self, given: Any) -> tuple[Ice, ...]:
        """Read a distribution of ices; return the known ices of a list."""
        if given == "random" or isinstance(given, Mapping):
            given = dataclass_from(RandomIces, "ices", {} if given == "random" else given)
        if isinstance(given, RandomIces):
            self._usual, self._distribution = given.family.base, given.draw
            self._family = None if given.pool else given
            if given.pool:
                rng = np.random.default_rng(given.pool_seed)
                self._pairs = tuple(given.draw(rng) for _ in range(given.pool))
            return ()
        if isinstance(given, str) and ":" in given and not Path(given).exists():
            given = load_plugin("distribution of ices", ICES_GROUP, given, form="module:object")
        if hasattr(given, "draw") or callable(given):
            self._distribution = getattr(given, "draw", given)
            return ()
        self._pairs = _listed(given)
        self._usual = self._pairs[0][0]
        return tuple(known for _, known in self._pairs)

    @property
    def usual(self) -> Ice:
        """Ice of every episode, or a typical one."""
        return self._usual

    @usual.setter
    def usual(self, ice: IceOption) -> None:
        if self._has_ices:
            raise InputError("ice cannot be set: this environment draws its ice from ices")
        self._usual = load_ice(ice)

    @property
    def are_drawn(self) -> bool:
        """True if every episode has its own ice."""
        return self._has_ices or self.has_sigma

    @property
    def known(self) -> tuple[Ice, ...]:
        """Possible known ices, if they are fixed in advance."""
        if self.known_ice is not None:
            return (self.known_ice,)
        return self._listed or (self._usual,)

    def given(self, options: dict[str, Any]) -> GivenIce:
        """Take `ice` and `known_ice` out of the options of a reset; None if absent.

        Raises
        ------
        InputError : an ice that cannot be read
        """
        asked = [options.pop(name, None) for name in ("ice", "known_ice")]
        ice, known = (None if one is None else load_ice(one) for one in asked)
        return ice, known

    def draw(self, rng: np.random.Generator, given: GivenIce = (None, None)) -> Made:
        """Draw the playing surface of a new episode.

        Parameters
        ----------
        rng : source of the randomness
        given : the ice and the known ice given to `reset`

        Raises
        ------
        InputError : a distribution that returns something else
        """
        ice, known = given
        if ice is not None:
            return self.on(ice, known or self.known_ice or ice)
        if self._pairs:
            ice, drawn = self._pairs[int(rng.integers(len(self._pairs)))]
        elif self._distribution is not None:
            ice, drawn = _pair(self._distribution(rng))
        else:
            drawn = self._usual
            ice = plausible_ices(drawn, 1, rng)[0] if self.has_sigma else drawn
        return self.on(ice, known or self.known_ice or drawn)

    def draw_many(
        self, rngs: Sequence[np.random.Generator], given: GivenIce = (None, None)
    ) -> list[Made]:
        """Draw the playing surfaces of new episodes, as by `draw` with each generator."""
        family = self._family
        many = self._make_many
        if many is None or family is None or given != (None, None) or self.known_ice is not None:
            return [self.draw(rng, given) for rng in rngs]
        blocks = (rngs[k : k + BLOCK] for k in range(0, len(rngs), BLOCK))
        return [one for block in blocks for one in many(family, family.draw_many(block))]

    def on(self, ice: Ice, known: Ice) -> Made:
        """Return the playing surface of an ice and its known ice."""
        key = id(ice), id(known)
        kept = self._made.get(key)
        if kept is not None and kept[0] is ice and kept[1] is known:
            return kept[2]
        made = self._make(ice, self.known_as(known))
        if self._recurs(ice) and self._recurs(known):
            self._made[key] = ice, known, made
        return made

    def known_as(self, ice: Ice) -> KnownIce:
        """Return the known ice of an ice; the same object for recurring ices."""
        kept = self._knowns.get(id(ice))
        if kept is not None and kept[0] is ice:
            return kept[1]
        known = KnownIce(ice, self._observed(ice))
        if self._recurs(ice):
            self._knowns[id(ice)] = ice, known
        return known

    def _recurs(self, ice: Ice) -> bool:
        """Return whether an ice recurs in later episodes."""
        return (
            ice is self._usual
            or ice is self.known_ice
            or any(ice is one for pair in self._pairs for one in pair)
        )


def _pair(given: Any) -> IcePair:
    """Return an ice and its known ice, from a pair or from an ice alone."""
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


def _listed(given: Any) -> tuple[IcePair, ...]:
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
