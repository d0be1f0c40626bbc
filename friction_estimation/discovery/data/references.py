"""Known lengths and times, which check the scale and frame rate of the tracks.

Throws alone cannot: with all lengths or all times off by a factor the same paths result on other
ice (with x′ = λx and t′ = κt friction becomes μ·λ/κ², and every effect changes likewise). One
length on the ice, or one interval by a clock, determines the factor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice
from curling_env.trajectory import Trajectory
from friction_estimation.discovery.tuning import CLEARLY_OFF, CLOCK_ERROR, LENGTH_ERROR

QuantityError = Literal["scale_error", "frame_rate_error"]


class Quantity(NamedTuple):
    """A quantity of the tracks that throws alone cannot check.

    Parameters
    ----------
    singular, plural : what it is called
    option : option of `curling discover` that gives a reference for it
    check : what a user may give, in words
    usual_error : standard error of a reference whose own is not given [m or s]
    """

    singular: str
    plural: str
    option: str
    check: str
    usual_error: float


QUANTITIES: Mapping[QuantityError, Quantity] = {
    "scale_error": Quantity(
        "length",
        "all lengths",
        "--known-length",
        "a known length (--known-length; hog line to hog line is 21.945 m, tee to tee 34.747 m)",
        LENGTH_ERROR,
    ),
    "frame_rate_error": Quantity(
        "time", "all times", "--clock", "an interval by a clock (--clock)", CLOCK_ERROR
    ),
}


@dataclass(frozen=True, kw_only=True)
class Reference:
    """Length or interval whose true size is known.

    Parameters
    ----------
    measured : its size in the tracks [m] or [s]
    true : its true size
    error : standard error of the measured size
    """

    measured: float
    true: float
    error: float


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Factor by which all lengths, or all times, of the tracks are off.

    Parameters
    ----------
    name : effect of that name
    factor, stderr : measured size over the true one
    references : what the factor rests on
    """

    name: QuantityError
    factor: float
    stderr: float
    references: tuple[Reference, ...] = ()

    @property
    def clearly_off(self) -> bool:
        """Return whether the factor differs from one by more than its error allows."""
        return abs(self.factor - 1.0) > CLEARLY_OFF * self.stderr

    def as_effect(self) -> ActiveEffect:
        """Return the calibration as an effect of an ice file."""
        return ActiveEffect(
            name=self.name, parameters={"factor": self.factor}, sigma={"factor": self.stderr}
        )


def read_reference(text: str, name: QuantityError) -> Reference:
    """Parse a reference: ``MEASURED,TRUE`` or ``MEASURED,TRUE,ERROR``.

    Raises
    ------
    InputError : not two or three positive numbers, or two that cannot be the same thing
    """
    quantity = QUANTITIES[name]
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not all(np.isfinite(n) and n > 0 for n in numbers):
        raise InputError(
            f"{quantity.option}: expected positive numbers MEASURED,TRUE[,ERROR], got {text!r}"
        )
    if not 0.5 < numbers[0] / numbers[1] < 2.0:
        raise InputError(
            f"{quantity.option} {text}: expected a measured value within a factor of two of the "
            "true one"
        )
    error = numbers[2] if len(numbers) == 3 else quantity.usual_error
    return Reference(measured=numbers[0], true=numbers[1], error=error)


def calibrate(name: QuantityError, references: Sequence[Reference]) -> Calibration:
    """Return the factor from several references, weighted by their precision.

    Raises
    ------
    InputError : references that contradict one another
    """
    factors = np.array([r.measured / r.true for r in references])
    sigma = np.array([r.error / r.true for r in references])
    weight = sigma**-2 / (sigma**-2).sum()
    factor = float(weight @ factors)
    far = np.abs(factors - factor) / sigma
    if len(references) > 1 and far.max() > 4.0:
        odd = references[int(np.argmax(far))]
        raise InputError(
            f"the references for {name} contradict each other: {odd.measured:g} for {odd.true:g} "
            f"is a factor of {odd.measured / odd.true:.3f}, all together give {factor:.3f}"
        )
    stderr = float(1.0 / np.sqrt((sigma**-2).sum()))
    return Calibration(name=name, factor=factor, stderr=stderr, references=tuple(references))


def calibrations_of(ice: Ice | None) -> tuple[Calibration, ...]:
    """Return the calibrations in an ice file."""
    found: list[Calibration] = []
    for name in QUANTITIES:
        effect = ice.effect(name) if ice is not None else None
        if effect is not None and "factor" in effect.parameters:
            sigma = effect.sigma.get("factor", 0.0)
            found.append(Calibration(name=name, factor=effect.parameters["factor"], stderr=sigma))
    return tuple(found)


def corrected(
    tracks: Sequence[Trajectory], calibrations: Sequence[Calibration]
) -> list[Trajectory]:
    """Return tracks with corrected lengths and times."""
    factors = {c.name: c.factor for c in calibrations}
    scale, rate = factors.get("scale_error", 1.0), factors.get("frame_rate_error", 1.0)
    return [replace(track, xy=track.xy / scale, t=track.t / rate) for track in tracks]
