"""Schema of an ice file: its members and their limits, and the common errors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from curling_env.errors import InputError
from curling_env.infrastructure.files.schema import Document, Short, within

MAX_PARAMETER = 1e9
"""Largest parameter of an effect accepted, in the units of its card."""
MAX_COMMON_ERRORS = 200
"""Maximum number of common errors of an ice: one for each uncertain parameter is enough."""
COMMON_ROUNDING = 1e-4
"""Rounding tolerance for the sum of the common parts of an error."""

Interpolation = Literal["bilinear", "cell"]


class SheetDocument(Document):
    """Size of the ice."""

    length: Annotated[float, within(1.0, 1000.0, "m")]
    width: Annotated[float, within(1.0, 1000.0, "m")]


class StoneDocument(Document):
    """Stone of an ice; missing values are the rule book's."""

    mass: Annotated[float, within(0.1, 1000.0, "kg")] | None = None
    radius: Annotated[float, within(0.01, 1.0, "m")] | None = None
    height: Annotated[float, within(0.001, 1.0, "m")] | None = None
    band_radius: Annotated[float, within(0.0, 1.0, "m")] | None = None
    inertia: Annotated[float, within(1e-6, 1000.0, "kg m²")] | None = None
    restitution: Annotated[float, within(0.0, 1.0)] | None = None
    stone_friction: Annotated[float, within(0.0, 100.0)] | None = None


CommonParts = Annotated[
    tuple[Annotated[float, within(-1.0, 1.0)], ...], Meta(max_length=MAX_COMMON_ERRORS)
]
"""Parts of an error that others of the ice share, error by error."""


class LevelDocument(Document):
    """Error that all cells have in common: σ of its logarithm, and its shared parts."""

    sigma: Annotated[float, within(0.0, MAX_PARAMETER)]
    common: CommonParts = ()


class FrictionDocument(Document):
    """Friction of every cell, as rows from y=-L/2 upward, or one number for all."""

    cell_size: Annotated[float, within(1e-3, 100.0, "m")]
    mu: float | list[list[float]]
    sigma: float | list[list[float]] = 0.0
    observed: bool | float | list[list[bool | float]] = 1.0
    interpolation: Interpolation = "bilinear"
    level: LevelDocument | None = None


Strength = Annotated[float, within(-MAX_PARAMETER, MAX_PARAMETER)]
"""Parameter of an effect, in the units of its card."""


class EffectDocument(Document):
    """Effect with its parameters, in the units of its card."""

    name: Short
    parameters: dict[Short, Strength] = msgspec.field(default_factory=dict[str, float])
    sigma: dict[Short, Strength | None] = msgspec.field(default_factory=dict[str, float | None])
    believed: tuple[Short, ...] = ()
    common: dict[Short, CommonParts] = msgspec.field(default_factory=dict[str, tuple[float, ...]])


class IceDocument(Document):
    """Ice file."""

    format: Short
    sheet: SheetDocument
    friction: FrictionDocument
    stone: StoneDocument = msgspec.field(default_factory=StoneDocument)
    effects: Annotated[list[EffectDocument], Meta(max_length=200)] = msgspec.field(
        default_factory=list[EffectDocument]
    )
    provenance: dict[str, Any] = msgspec.field(default_factory=dict[str, Any])


@dataclass(frozen=True, kw_only=True)
class LevelError:
    """Error that all cells of a friction map have in common: a common factor.

    Parameters
    ----------
    sigma : standard error of its logarithm
    common : part from each common error, as in `ActiveEffect`

    Raises
    ------
    InputError : a negative sigma, or a common part of more than the whole
    """

    sigma: float
    common: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not 0 <= self.sigma <= MAX_PARAMETER:
            raise InputError(f"the level's sigma must be at least 0, got {self.sigma:g}")
        check_common(self.common, "the level")


def check_common(parts: tuple[float, ...], what: str) -> None:
    """Refuse parts whose squares add up to more than one, which would exceed the sigma."""
    whole = math.hypot(*parts)
    if len(parts) > MAX_COMMON_ERRORS or not whole <= 1.0 + COMMON_ROUNDING:
        raise InputError(
            f"{what}: the squares of its common parts, at most {MAX_COMMON_ERRORS}, must add up "
            f"to at most 1, got {len(parts)} of {whole**2:g}"
        )
