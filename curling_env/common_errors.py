"""Errors that numbers of an ice have in common."""

from __future__ import annotations

import math
from dataclasses import dataclass

from curling_env.errors import InputError
from curling_env.ice_form import MAX_PARAMETER, MOST_COMMON_ERRORS

COMMON_ROUNDING = 1e-4
"""By which the common parts of an error may exceed the whole: they are rounded numbers."""


@dataclass(frozen=True, kw_only=True)
class LevelError:
    """The error that all cells of a friction map have in common: a factor on the whole.

    Parameters
    ----------
    sigma : standard error of its logarithm
    common : what of it stems from each common error, as of `ActiveEffect`

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
    """Refuse parts whose squares add up to more than one: they would exceed the sigma."""
    whole = math.hypot(*parts)
    if len(parts) > MOST_COMMON_ERRORS or not whole <= 1.0 + COMMON_ROUNDING:
        raise InputError(
            f"{what}: the squares of its common parts, at most {MOST_COMMON_ERRORS}, must add up "
            f"to 1 at most, got {len(parts)} of {whole**2:g}"
        )
