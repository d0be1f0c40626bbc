"""Catalogue of effects: every file of this folder with a CARD, and effects that users register.

To add an effect of the project, put one file here. To add one from outside, call `register` with
a card, or declare a function that returns one under the entry-point group ``curling.effects``.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import walk_packages
from typing import Literal

from curling_env.errors import InputError
from curling_env.physics.effects.card import EffectCard, Parameter, Search, Variant

__all__ = [
    "EffectCard",
    "Parameter",
    "Search",
    "Variant",
    "catalogue",
    "mistaken_for",
    "register",
    "unregister",
]


@cache
def _cards() -> dict[str, EffectCard]:
    modules = [import_module(found.name) for found in walk_packages(__path__, f"{__name__}.")]
    cards = [module.CARD for module in modules if hasattr(module, "CARD")]
    cards += [point.load()() for point in entry_points(group="curling.effects")]
    return {card.name: card for card in cards}


def catalogue() -> dict[str, EffectCard]:
    """Every known effect by name, in the order of the names."""
    return dict(sorted(_cards().items()))


def mistaken_for(what: Literal["map", "camera"]) -> list[EffectCard]:
    """Return effects that a fit without them would absorb in a map of friction, or a camera error.

    Those that act on single contacts come first, as in the force law.
    """
    found = [card for card in catalogue().values() if what in card.search.mistaken_for]
    return sorted(found, key=lambda card: card.acts != "contact_friction")


def register(card: EffectCard) -> EffectCard:
    """Register an effect for ice files, engines, discovery, figures and observations.

    Raises
    ------
    InputError : another effect already has that name
    """
    known = _cards().get(card.name)
    if known is not None and known is not card:
        raise InputError(f"an effect named {card.name!r} is already registered")
    _cards()[card.name] = card
    return card


def unregister(name: str) -> EffectCard:
    """Remove an effect from the catalogue, and return its card; `register` restores it.

    Raises
    ------
    InputError : no effect has that name
    """
    if name not in _cards():
        raise InputError(f"no effect named {name!r} is registered")
    return _cards().pop(name)
