"""An effect's card: what it is, what its parameters mean, and what evidence would show it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from curling_env.errors import InputError

Acts = Literal["friction", "contact_friction", "motion"]
Breaks = Callable[[Mapping[str, float]], tuple[float, ...]]


def _no_breaks(_: Mapping[str, float]) -> tuple[float, ...]:
    return ()


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One parameter of an effect.

    Parameters
    ----------
    name : as in an ice file
    unit : in SI
    meaning : one line for a person
    low, high : bounds outside which the effect is not valid
    default : used when an ice file leaves it out; None makes it compulsory
    neutral : value at which the effect does nothing, if this parameter alone can switch it off
    """

    name: str
    unit: str
    meaning: str
    low: float = -math.inf
    high: float = math.inf
    default: float | None = None
    neutral: float | None = None


@dataclass(frozen=True, kw_only=True)
class EffectCard:
    """An effect of the ice, the stone or the air.

    Parameters
    ----------
    name : in ice files and reports
    title : for a person
    formula : as it would be written down
    parameters : in the order the kernel reads theta
    source : where the form comes from
    validity : where it holds
    evidence : what measured tracks would show it
    acts : ``friction``, a factor on μ that is the same for every contact of the band;
        ``contact_friction``, a factor on μ that follows the slip of each contact;
        ``motion``, an acceleration of its own or a factor on the others
    kernel : compiled by `effect_kernel`; reads and writes the places of `effects.motion`
    dissipative : whether it can only take energy out of the stone
    x_breaks, y_breaks : coordinates at which the effect is not smooth, given its parameters [m]
    """

    name: str
    title: str
    formula: str
    parameters: tuple[Parameter, ...]
    source: str
    validity: str
    evidence: str
    acts: Acts
    kernel: Any = field(repr=False)
    dissipative: bool
    x_breaks: Breaks = _no_breaks
    y_breaks: Breaks = _no_breaks

    def theta(self, given: Mapping[str, float]) -> list[float]:
        """The kernel's parameter vector from an ice file's parameters.

        Raises
        ------
        InputError : an unknown, missing or out-of-bounds parameter
        """
        unknown = sorted(given.keys() - {parameter.name for parameter in self.parameters})
        if unknown:
            names = ", ".join(parameter.name for parameter in self.parameters)
            raise InputError(f"effect {self.name} has no parameter {unknown[0]!r}; it has: {names}")
        values: list[float] = []
        for parameter in self.parameters:
            value = given.get(parameter.name, parameter.default)
            if value is None:
                raise InputError(f"effect {self.name} needs its parameter {parameter.name!r}")
            if not parameter.low <= value <= parameter.high:
                raise InputError(
                    f"effect {self.name}: {parameter.name} must lie within {parameter.low:g} and "
                    f"{parameter.high:g} {parameter.unit}, got {value:g}"
                )
            values.append(float(value))
        return values
