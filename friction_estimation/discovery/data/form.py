"""The form of what may be missing: an effect of the ice, or of the camera."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from curling_env.physics.effects import EffectCard, Parameter
from curling_env.typing import Floats

Kind = Literal["physics", "measurement"]
Displacement = Callable[[Floats, Floats, Mapping[str, float]], Floats]
"""How a measured position differs from the true one: (xy, theta, parameters) -> (rows, 2)."""


@dataclass(frozen=True, kw_only=True)
class Form:
    """The form of a candidate.

    Parameters
    ----------
    name : in reports and ice files
    kind : of the ice, or of the measurement
    parameters : cards
    card : of an effect of the ice
    displacement : of an effect of the measurement
    sign : one line: what to look for in tracks
    """

    name: str
    kind: Kind
    parameters: tuple[Parameter, ...]
    sign: str = ""
    card: EffectCard | None = field(default=None, repr=False)
    displacement: Displacement | None = field(default=None, repr=False)

    def parameter(self, name: str) -> Parameter:
        return next(p for p in self.parameters if p.name == name)

    @property
    def switches(self) -> tuple[str, ...]:
        """Parameters that switch the effect off at their neutral value."""
        return tuple(p.name for p in self.parameters if p.neutral is not None)


def form_of(card: EffectCard) -> Form:
    """A candidate's form from the card of an effect."""
    return Form(
        name=card.name,
        kind="physics",
        parameters=card.parameters,
        sign=card.evidence,
        card=card,
    )
