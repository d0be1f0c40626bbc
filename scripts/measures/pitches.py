"""Repetition of the paper's tables 3 and 4: errors of μ from one and from five pitches.

Ten uniform ices from μ = 0.00182 to 0.002, throws at 1.6 m/s seen from hog line to hog line at 30
frames a second, 1 and 5 pitches; coordinates as measured, here with 5 mm of noise. At these
frictions, five times below real ice, a stone that nothing stops slides 65 m: only the stretch
between the hog lines counts.

Source
------
The paper, section 4.2, tables 3 and 4. The last row of table 3 is missing in print; the mean of
the nine rows printed is 0.631 %, that of the ten of table 4 0.349 %.
"""

from __future__ import annotations

import numpy as np

from curling_env.ice import Ice
from curling_env.physics import slide
from curling_env.sheet import HOG_LINE_Y, PAPER_STONE
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation import estimate_ice
from friction_estimation.estimation.paper_method import estimate_by_paper

THEORETICAL = np.round(np.arange(0.00182, 0.002001, 0.00002), 5)
"""Ten frictions of the paper's tables."""
SPEED, SPIN = 1.6, 1.0
"""Speed and spin of every pitch [m/s, rad/s]; the paper does not state its rotation."""
FPS = 30.0
NOISE, HEADING_NOISE = 0.005, 0.01
"""Standard deviations of a coordinate [m] and of the heading [rad]."""


def pitch(mu: float, rng: np.random.Generator, number: int = 0) -> Trajectory:
    """Return one measured pitch of the experiment, hog line to hog line."""
    ice = Ice.uniform(mu, stone=PAPER_STONE)
    beyond = np.array([-1.0, 1.0, -HOG_LINE_Y - 1.0, HOG_LINE_Y])
    path = slide(ice, Throw(speed=SPEED, spin=SPIN).release(), bounds=beyond, fps=FPS).trajectory
    assert path is not None  # a rate was given
    return Trajectory(
        t=path.t,
        xy=path.xy + rng.normal(0.0, NOISE, path.xy.shape),
        theta=path.theta + rng.normal(0.0, HEADING_NOISE, len(path)),
        throw=number,
    )


def errors_of_table(pitches: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return the error rates of one table as the paper gives them, (10,) [%].

    Of the trajectory fit, and of the paper's own method on the same tracks.

    Parameters
    ----------
    pitches : throws per friction, 1 or 5 in the paper
    rng : source of the measurement noise
    """
    joint, averaged = np.empty(len(THEORETICAL)), np.empty(len(THEORETICAL))
    start = Ice.uniform(0.0082, stone=PAPER_STONE)
    for k, mu in enumerate(THEORETICAL.tolist()):
        tracks = [pitch(mu, rng, number) for number in range(pitches)]
        joint[k] = estimate_ice(tracks, start=start, uniform=True).mu
        averaged[k] = estimate_by_paper(tracks, start=start, uniform=True).mu
    both = [100 * np.abs(found - THEORETICAL) / THEORETICAL for found in (joint, averaged)]
    return both[0], both[1]
