"""Throws that could be made next, laid out as a session that nobody has measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from curling_env.sheet import HOG_LINE_Y, Direction
from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.tuning import USUAL_SPIN

SWEPT_FROM, SWEPT_TO = 2.0, 8.0
"""When a trial throw is swept, if it is [s after its release]."""


@dataclass(frozen=True, kw_only=True)
class TrialThrow:
    """A throw that could be made, straight along the sheet.

    Parameters
    ----------
    direction : direction of play
    speed, spin : at the hog line [m/s, rad/s]
    line : x of its line of delivery, sheet frame [m]
    stone : which stone
    swept : whether it is swept
    wait : time after the last throw of the session [s]
    """

    direction: Direction
    speed: float
    spin: float
    line: float = 0.0
    stone: int = 0
    swept: bool = False
    wait: float = 60.0


def lay_out(
    session: Session, throws: Sequence[TrialThrow], times: Floats
) -> tuple[Session, Floats]:
    """The throws as a session after another one, each as the very next throw.

    Parameters
    ----------
    session : the session after which they are thrown
    throws : the throws
    times : (n,) times at which each is seen [s]

    Returns
    -------
    session : its places are empty
    states : (k, 6) releases
    """
    k, n = len(throws), len(times)
    states = np.array(
        [[t.line, -t.direction * HOG_LINE_Y, 0.0, t.direction * t.speed, 0.0, t.spin]
         for t in throws]
    )  # fmt: skip
    sweeping = ((times > SWEPT_FROM) & (times < SWEPT_TO)).astype(np.float64)
    return Session(
        throws=np.arange(k),
        orders=np.full(k, int(session.orders.max()) + 1),
        stones=np.array([t.stone for t in throws], dtype=np.intp),
        clocks=np.array([session.clocks.max() + t.wait for t in throws]),
        rests=np.zeros(k, dtype=bool),
        usual_spins=np.full(k, USUAL_SPIN),
        times=np.tile(times, k),
        xy=np.zeros((k * n, 2)),
        theta=np.zeros(k * n),
        swept=np.concatenate([sweeping * t.swept for t in throws]),
        sigma=np.ones((k * n, 2)),
        starts=np.arange(k + 1) * n,
        wear_tracks=session.wear_tracks,
    ), states
