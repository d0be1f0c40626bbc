"""What an athlete usually does where a call leaves it open: the rotation, the speed of a hit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agents.coaching.calls import Call
from agents.coaching.misses.released import Released
from agents.coaching.runs import SPEED, SPIN
from agents.coaching.throw_sheet import ThrowSheet
from agents.coaching.tuning import HABIT_THROWS
from friction_estimation.tracks.measured import Measured


@dataclass(frozen=True, kw_only=True)
class Habits:
    """What athletes usually do.

    Parameters
    ----------
    spins : |spin| of throws, by athlete [rad/s]; under the empty name those of everybody
    speeds : speeds of hits by athlete and named weight [m/s]; the same
    """

    spins: Mapping[str, Sequence[float]]
    speeds: Mapping[tuple[str, str], Sequence[float]]

    def spin(self, athlete: str) -> Measured | None:
        """The usual rotation, without sign; None where too few throws tell it."""
        return _usual(self.spins.get(athlete, ())) or _usual(self.spins.get("", ()))

    def speed(self, athlete: str, call: Call) -> Measured | None:
        """The usual speed of a hit of this weight; None where too few throws tell it."""
        if call.weight is None:
            return None
        return _usual(self.speeds.get((athlete, call.weight), ())) or _usual(
            self.speeds.get(("", call.weight), ())
        )


def habits_of(throws: Sequence[tuple[ThrowSheet, Released]]) -> Habits:
    """What the throws of a session show of everybody's habits."""
    spins: dict[str, list[float]] = {"": []}
    speeds: dict[tuple[str, str], list[float]] = {}
    for sheet, released in throws:
        names = {sheet.athlete, ""}
        for name in names:
            if released.spin_seen:
                spins.setdefault(name, []).append(abs(float(released.throw[SPIN])))
            if sheet.call is not None and sheet.call.weight is not None:
                speed = float(released.throw[SPEED])
                speeds.setdefault((name, sheet.call.weight), []).append(speed)
    return Habits(spins=spins, speeds=speeds)


def _usual(values: Sequence[float]) -> Measured | None:
    """The median of enough values, and its standard error."""
    if len(values) < HABIT_THROWS:
        return None
    array = np.array(values)
    count = len(array)
    # The median's error for Gaussian values, and what the spread of so few is not known to.
    wider = 1.25 * ((count - 1) / max(count - 3, 1)) ** 0.5
    return Measured(float(np.median(array)), wider * float(array.std(ddof=1)) / count**0.5)
