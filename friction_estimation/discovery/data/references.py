"""Known lengths and known times: what decides whether the tracks' scale and frame rate are right.

No set of throws can: with all lengths or all times off by a factor the same paths result on other
ice (with x′ = λx and t′ = κt friction becomes μ·λ/κ², and every effect changes likewise). One
length on the ice, or one interval by a clock, settles it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import ActiveEffect, Ice
from curling_env.trajectory import Trajectory

Quantity = Literal["scale_error", "frame_rate_error"]

LENGTH_ERROR = 0.02
"""Standard error of a length read off the tracks, if none is given [m]: a line's width."""
CLOCK_ERROR = 0.2
"""Standard error of an interval by a stopwatch, if none is given [s]."""
CLEARLY_OFF = 3.0
"""Standard errors by which a factor must differ from one to be named."""
PLAUSIBLE = (0.5, 2.0)
"""Factors outside this are a slip of the pen."""


@dataclass(frozen=True, kw_only=True)
class Reference:
    """Something whose true size is known.

    Parameters
    ----------
    measured : as the tracks have it [m] or [s]
    true : as it is
    error : standard error of the measured one
    """

    measured: float
    true: float
    error: float


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """What references say of all lengths, or of all times.

    Parameters
    ----------
    name : of the effect
    factor, stderr : measured over true
    references : it rests on
    """

    name: Quantity
    factor: float
    stderr: float
    references: tuple[Reference, ...] = ()

    @property
    def clearly_off(self) -> bool:
        return abs(self.factor - 1.0) > CLEARLY_OFF * self.stderr


def read_reference(text: str, quantity: Quantity) -> Reference:
    """A reference as it is typed: ``MEASURED,TRUE`` or ``MEASURED,TRUE,ERROR``.

    Raises
    ------
    InputError : not two or three positive numbers, or two that cannot be the same thing
    """
    option = "--known-length" if quantity == "scale_error" else "--clock"
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not all(np.isfinite(n) and n > 0 for n in numbers):
        raise InputError(f"{option} wants MEASURED,TRUE[,ERROR], positive numbers, got {text!r}")
    ratio = numbers[0] / numbers[1]
    if not PLAUSIBLE[0] < ratio < PLAUSIBLE[1]:
        raise InputError(f"{option} {text}: {numbers[0]:g} cannot be {numbers[1]:g} mismeasured")
    usual = LENGTH_ERROR if quantity == "scale_error" else CLOCK_ERROR
    error = numbers[2] if len(numbers) == 3 else usual
    return Reference(measured=numbers[0], true=numbers[1], error=error)


def calibrate(name: Quantity, references: Sequence[Reference]) -> Calibration:
    """The factor on which references agree, weighted by how well each is known.

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
            f"the references for {name} contradict one another: {odd.measured:g} for {odd.true:g} "
            f"is a factor of {odd.measured / odd.true:.3f}, together they say {factor:.3f}"
        )
    stderr = float(1.0 / np.sqrt((sigma**-2).sum()))
    return Calibration(name=name, factor=factor, stderr=stderr, references=tuple(references))


def calibrations_of(ice: Ice | None) -> tuple[Calibration, ...]:
    """What an ice file says of the tracks' scale and frame rate."""
    found: list[Calibration] = []
    for name in ("scale_error", "frame_rate_error"):
        effect = ice.effect(name) if ice is not None else None
        if effect is not None and "factor" in effect.parameters:
            sigma = effect.sigma.get("factor", 0.0)
            found.append(Calibration(name=name, factor=effect.parameters["factor"], stderr=sigma))
    return tuple(found)


def corrected(
    tracks: Sequence[Trajectory], calibrations: Sequence[Calibration]
) -> list[Trajectory]:
    """Tracks with true lengths and times, as far as they are known."""
    factors = {c.name: c.factor for c in calibrations}
    scale, rate = factors.get("scale_error", 1.0), factors.get("frame_rate_error", 1.0)
    return [replace(track, xy=track.xy / scale, t=track.t / rate) for track in tracks]


def as_effect(calibration: Calibration) -> ActiveEffect:
    """As it stands in an ice file."""
    return ActiveEffect(
        name=calibration.name,
        parameters={"factor": calibration.factor},
        sigma={"factor": calibration.stderr},
    )
