"""The form of an ice file: what stands in it, and within which limits."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from curling_env.infrastructure.files.schema import Document, Short, within

MAX_PARAMETER = 1e9
"""Largest parameter of an effect accepted, in the units of its card."""
MOST_COMMON_ERRORS = 200
"""Of an ice: one for each uncertain parameter is enough."""

Interpolation = Literal["bilinear", "cell"]


class SheetDocument(Document):
    """The size of the ice."""

    length: Annotated[float, within(1.0, 1000.0, "m")]
    width: Annotated[float, within(1.0, 1000.0, "m")]


class StoneDocument(Document):
    """The stone of an ice; what is not given is the rule book's."""

    mass: Annotated[float, within(0.1, 1000.0, "kg")] | None = None
    radius: Annotated[float, within(0.01, 1.0, "m")] | None = None
    height: Annotated[float, within(0.001, 1.0, "m")] | None = None
    band_radius: Annotated[float, within(0.0, 1.0, "m")] | None = None
    inertia: Annotated[float, within(1e-6, 1000.0, "kg m²")] | None = None
    restitution: Annotated[float, within(0.0, 1.0)] | None = None
    stone_friction: Annotated[float, within(0.0, 100.0)] | None = None


CommonParts = Annotated[
    tuple[Annotated[float, within(-1.0, 1.0)], ...], Meta(max_length=MOST_COMMON_ERRORS)
]
"""Parts of an error that others of the ice share, error by error."""


class LevelDocument(Document):
    """The error that all cells have in common: σ of its logarithm, and what is shared of it."""

    sigma: Annotated[float, within(0.0, MAX_PARAMETER)]
    common: CommonParts = ()


class FrictionDocument(Document):
    """The friction of every cell, as rows from y=-L/2 upward, or one number for all."""

    cell_size: Annotated[float, within(1e-3, 100.0, "m")]
    mu: float | list[list[float]]
    sigma: float | list[list[float]] = 0.0
    observed: bool | float | list[list[bool | float]] = 1.0
    interpolation: Interpolation = "bilinear"
    level: LevelDocument | None = None


Strength = Annotated[float, within(-MAX_PARAMETER, MAX_PARAMETER)]
"""A parameter of an effect, in the units of its card."""


class EffectDocument(Document):
    """An effect with its parameters, in the units of its card."""

    name: Short
    parameters: dict[Short, Strength] = msgspec.field(default_factory=dict[str, float])
    sigma: dict[Short, Strength | None] = msgspec.field(default_factory=dict[str, float | None])
    believed: tuple[Short, ...] = ()
    common: dict[Short, CommonParts] = msgspec.field(default_factory=dict[str, tuple[float, ...]])


class IceDocument(Document):
    """An ice file."""

    format: Short
    sheet: SheetDocument
    friction: FrictionDocument
    stone: StoneDocument = msgspec.field(default_factory=StoneDocument)
    effects: Annotated[list[EffectDocument], Meta(max_length=200)] = msgspec.field(
        default_factory=list[EffectDocument]
    )
    provenance: dict[str, Any] = msgspec.field(default_factory=dict[str, Any])
