"""Candidate effects, and terms: effects with values in a model.

Candidates are all effects of the catalogue, including registered ones, and the effects of the
measurement. An effect's card states when a session can show it, which parameters are fitted first
and which only determine its shape.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from curling_env.ice import ActiveEffect
from curling_env.physics.effects import EffectCard, Variant, catalogue
from curling_env.physics.effects.card import Need
from friction_estimation.discovery.data.measurement import measurement_effects
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.model.friction_field import CARD as MAP_CARD
from friction_estimation.discovery.model.friction_field import FrictionField
from friction_estimation.discovery.tuning import PATCH_CELL, STILL_BELIEVED


@dataclass(frozen=True, kw_only=True)
class Belief:
    """Prior of a parameter before any throw: a normal distribution."""

    mean: float
    sd: float


@dataclass(frozen=True, kw_only=True)
class Term:
    """A term of a model: an effect with values for its parameters, or the friction map.

    Parameters
    ----------
    card : card of the effect
    values : values of all its parameters
    free : names of the parameters that are fitted
    beliefs : what is known beforehand of some of these
    map_field : the friction map; None for effects
    """

    card: EffectCard
    values: Mapping[str, float] = field(default_factory=dict[str, float])
    free: tuple[str, ...] = ()
    beliefs: Mapping[str, Belief] = field(default_factory=dict[str, Belief])
    map_field: FrictionField | None = None

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.card.name

    @property
    def variant(self) -> Variant | None:
        """Fitted variant of the effect, if any."""
        return next((v for v in self.card.search.variants if self.free == (v.parameter,)), None)

    @property
    def label(self) -> str:
        """Name of the effect, with its stone and variant in brackets, if any."""
        which = [] if self.stone is None else [str(self.stone)]
        which += [self.variant.parameter] if self.variant else []
        return f"{self.name}[{', '.join(which)}]" if which else self.name

    @property
    def stone(self) -> int | None:
        """Stone of the effect, if any."""
        parameter = self.card.search.stone
        return None if parameter is None else round(self.values[parameter])

    @property
    def between_throws(self) -> bool:
        """Return whether it acts on the friction of whole throws: no single throw shows it."""
        return (self.variant or self.card).scope == "between throws"

    @property
    def wears_map(self) -> bool:
        """Return whether earlier stones change the map through it."""
        return self.variant is not None and self.variant.parameter == "along_path"

    @property
    def at_a_limit(self) -> bool:
        """Return whether a strength exceeds that of any ice, as when it absorbs another effect."""
        return any(
            bool(np.isclose(self.values[p.name], limit))
            for p in self.card.parameters
            if p.neutral is not None and p.name in self.free
            for limit in (p.low, p.high)
            if limit != p.neutral
        )

    def with_values(self, **values: float) -> Term:
        """Return the same term with other values of some parameters."""
        return replace(self, values={**self.values, **values})

    def freed(self, *names: str) -> Term:
        """Return the same term with these parameters fitted as well.

        The sides of an area have a prior around the result of the search, which matters where no
        stone ran.
        """
        more = tuple(name for name in names if name not in self.free)
        sides = {
            name: Belief(mean=self.values[name], sd=PATCH_CELL[1])
            for name in more
            if name in (self.card.search.area or ())
        }
        return replace(self, free=(*self.free, *more), beliefs={**self.beliefs, **sides})

    def effect(
        self,
        sigma: Mapping[str, float] | None = None,
        common: Mapping[str, tuple[float, ...]] | None = None,
    ) -> ActiveEffect:
        """Return the term as an effect of an ice file."""
        errors = dict(sigma or {})
        believed = tuple(
            name
            for name, belief in self.beliefs.items()
            if errors.get(name, 0.0) > STILL_BELIEVED * belief.sd
            and name not in (self.card.search.area or ())
        )
        return ActiveEffect(
            name=self.name,
            parameters=dict(self.values),
            sigma=errors,
            believed=believed,
            common=dict(common or {}),
        )


def effect_of(label: str) -> str:
    """Return the effect of a label: without its stone, but with its variant."""
    name, variant = label.partition("[")[0], variant_of(label)
    return f"{name}[{variant.parameter}]" if variant else name


def card_of(label: str) -> EffectCard | None:
    """Return the card of a label: of the friction map, or of an effect of the catalogue."""
    if label == MAP_CARD.name:
        return MAP_CARD
    return catalogue().get(label.partition("[")[0])


def variant_of(label: str) -> Variant | None:
    """Return the variant of an effect in a label, if there is one."""
    card, which = card_of(label), label.partition("[")[2].removesuffix("]").split(", ")
    return next((v for v in card.search.variants if v.parameter in which), None) if card else None


def way_of(label: str) -> Variant | EffectCard | None:
    """Return the variant of a label, or else the effect itself; None if unknown."""
    return variant_of(label) or card_of(label)


def known_effects(measurements: Sequence[EffectCard] | None = None) -> dict[str, EffectCard]:
    """Return all effects by name: those of the physics, then those of the measurement.

    Parameters
    ----------
    measurements : effects that the camera may have; by default those of any camera
    """
    cards = {name: card for name, card in catalogue().items() if card.is_physical}
    seen = measurement_effects() if measurements is None else measurements
    return cards | {card.name: card for card in seen}


def neutral_values(card: EffectCard, **given: float) -> dict[str, float]:
    """Return the values at which the effect does nothing and has its usual shape."""
    values: dict[str, float] = {}
    for p in card.parameters:
        value = given.get(p.name, p.default if p.neutral is None else p.neutral)
        values[p.name] = float(value) if value is not None else 0.5 * (p.low + p.high)
    return values


def candidates(session: Session, terms: tuple[Term, ...] = ()) -> list[Term]:
    """Return terms at their neutral values that a session could show, without those of a model.

    Effects within an area are not included: `find_patch` searches for them.

    Parameters
    ----------
    session : throws that are searched
    terms : terms that the model has
    """
    pushes = {push for term in terms for push in term.card.pushes}
    stones, counts = np.unique(session.stones, return_counts=True)
    found: list[Term] = []
    for card in known_effects(session.measurements).values():
        search = card.search
        if not card.first or search.area is not None or not _shows(session, search.needs):
            continue

        def is_felt(name: str, card: EffectCard = card) -> bool:
            # A scale of other effects' pushes cannot be measured without such effects.
            return card.parameter(name).scales in (None, *pushes)

        ways: list[tuple[str, ...]] = [
            (variant.parameter,)
            for variant in search.variants
            if _shows(session, variant.needs) and is_felt(variant.parameter)
        ]
        ways.append(tuple(name for name in card.first if is_felt(name)))
        given: list[dict[str, float]] = [{}]
        if search.stone is not None:
            given = [{search.stone: float(s)} for s, n in zip(stones, counts, strict=True) if n > 1]
        found += [
            Term(card=card, values=neutral_values(card, **values), free=free)
            for free in ways
            for values in given
        ]
    taken = {term.label for term in terms}
    fitted = {(t.name, t.stone, name) for t in terms for name in t.free if t.card.search.variants}
    return [
        term
        for term in found
        if term.label not in taken
        and not fitted & {(term.name, term.stone, name) for name in term.free}
    ]


def _shows(session: Session, needs: tuple[Need, ...]) -> bool:
    """Return whether a session has everything that an effect needs to be visible."""
    orders = session.wear_tracks.orders
    holds: dict[Need, bool] = {
        "swept": bool(session.swept.any()),
        "clocks": bool(np.ptp(session.clocks) > 60.0 and len(np.unique(session.clocks)) > 4),
        "headings": bool(session.turns.any()),
        "several stones": len(np.unique(session.stones)) > 1,
        "runs over the same ice": bool(len(orders) and session.orders.max() > orders.min()),
    }
    return all(holds[need] for need in needs)
