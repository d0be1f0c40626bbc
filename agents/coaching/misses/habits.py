"""Habits of an athlete that fill in a call: the rotation, the speed of a hit."""

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
    """Usual rotation and speeds of athletes.

    Parameters
    ----------
    spins : |spin| of throws, by athlete [rad/s]; the empty name has those of all athletes
    speeds : speeds of hits by athlete and named weight [m/s]; likewise
    """

    spins: Mapping[str, Sequence[float]]
    speeds: Mapping[tuple[str, str], Sequence[float]]

    def spin(self, athlete: str) -> Measured | None:
        """Return the usual rotation, without sign; None with too few throws."""
        return _usual(self.spins.get(athlete, ())) or _usual(self.spins.get("", ()))

    def speed(self, athlete: str, call: Call) -> Measured | None:
        """Return the usual speed of a hit of this weight; None with too few throws."""
        if call.weight is None:
            return None
        return _usual(self.speeds.get((athlete, call.weight), ())) or _usual(
            self.speeds.get(("", call.weight), ())
        )


def habits_of(throws: Sequence[tuple[ThrowSheet, Released]]) -> Habits:
    """Collect the habits of all athletes from the throws of a session."""
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
    """Return the median of enough values, and its standard error."""
    if len(values) < HABIT_THROWS:
        return None
    array = np.array(values)
    count = len(array)
    # Standard error of the median for Gaussian values, plus the uncertainty of the spread of few
    # values.
    wider = 1.25 * ((count - 1) / max(count - 3, 1)) ** 0.5
    return Measured(float(np.median(array)), wider * float(array.std(ddof=1)) / count**0.5)
