"""The catalogue of effects: every file of this folder that holds a CARD, and what users register.

To add an effect of the project, put one file here. To add one from outside, call `register` with
a card, or declare a function that returns one under the entry-point group ``curling.effects``.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import iter_modules

from curling_env.errors import InputError
from curling_env.physics.effects.card import EffectCard, Parameter

__all__ = ["EffectCard", "Parameter", "catalogue", "register"]


@cache
def _cards() -> dict[str, EffectCard]:
    modules = (import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__))
    cards = [module.CARD for module in modules if hasattr(module, "CARD")]
    cards += [point.load()() for point in entry_points(group="curling.effects")]
    return {card.name: card for card in cards}


def catalogue() -> dict[str, EffectCard]:
    """Every known effect by name."""
    return dict(_cards())


def register(card: EffectCard) -> EffectCard:
    """Make an effect known to engines, ice files and discovery.

    Raises
    ------
    InputError : another effect already has that name
    """
    known = _cards().get(card.name)
    if known is not None and known is not card:
        raise InputError(f"an effect named {card.name!r} is already registered")
    _cards()[card.name] = card
    return card
