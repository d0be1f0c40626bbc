"""The linear response of paths to small pushes, such as a little more friction at some places.

A push f(t) changes the state of a stone by δ(t) = Ψ(t) ∫ Ψ(s)⁻¹ f(s) ds, where Ψ is the derivative
of the state by that at release. Ψ comes from seven paths of every throw and serves any number of
pushes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curling_env.physics.state import State
from curling_env.typing import Floats, Indices
from friction_estimation.discovery.data.session import Session

INSTANT_SPACING = 0.1
"""Time between the instants at which responses are integrated [s]: a quarter of a metre at most."""
NEARLY_AT_REST = 0.03
"""Speed below which pushes no longer count [m/s]: the stone has millimetres to go."""
MEASURED = [State.X, State.Y, State.THETA]
"""Quantities of a state that are measured."""


class Instants(NamedTuple):
    """Regular times of every throw; as `times` and `starts` of `Session`."""

    times: Floats
    starts: Indices


def instants_of(session: Session) -> Instants:
    """Times from release to the last row of every throw, at most `INSTANT_SPACING` apart."""
    last = session.times[session.starts[1:] - 1]
    counts = np.ceil(last / INSTANT_SPACING).astype(np.intp) + 1
    times = [np.linspace(0.0, end, max(n, 2)) for end, n in zip(last, counts, strict=True)]
    starts = np.concatenate([[0], np.cumsum(np.maximum(counts, 2))])
    return Instants(np.concatenate(times), starts.astype(np.intp))


class LinearisedPaths(NamedTuple):
    """Paths of a session with their derivatives by the release, at instants.

    Parameters
    ----------
    session : throws
    instants : times
    path : (n, 6) states
    transition : (n, 6, 6) Ψ, derivatives of the state by that at release
    friction : (n, 3) part of the accelerations along x, along y and of the spin that is
        proportional to the friction of the map
    """

    session: Session
    instants: Instants
    path: Floats
    transition: Floats
    friction: Floats

    @property
    def xy(self) -> Floats:
        """Positions at the instants, (n, 2) [m]."""
        return self.path[:, :2]

    def responses_to_friction(self, patterns: Floats) -> Floats:
        """Change of x, y and heading of every row by a change of ln μ.

        Parameters
        ----------
        patterns : (n, r) change of ln μ at the instants

        Returns
        -------
        (rows, 3, r)
        """
        return self.responses(self.friction, patterns)

    def responses(self, pushes: Floats, sizes: Floats) -> Floats:
        """Change of x, y and heading of every row by pushes.

        Parameters
        ----------
        pushes : (n, 3) accelerations along x, along y and of the spin
        sizes : (n, r) factors on them

        Returns
        -------
        (rows, 3, r)
        """
        session, (times, starts) = self.session, self.instants
        out = np.empty((len(session.times), 3, sizes.shape[1]))
        speed = np.hypot(self.path[:, State.VX], self.path[:, State.VY])
        for i in range(len(session)):
            own = slice(int(starts[i]), int(starts[i + 1]))
            rows, t = session.rows(i), times[own]
            moving = np.flatnonzero(speed[own] > NEARLY_AT_REST)
            # A stone at rest has lost the memory of its release, and Ψ its inverse.
            count = int(moving[-1]) + 1 if len(moving) else 1
            push = np.zeros((count, 6, 1))
            push[:, [State.VX, State.VY, State.OMEGA], 0] = pushes[own][:count]
            transition = self.transition[own]
            initial = _solve(transition[:count], push)[:, :, 0]
            rate = initial[:, :, None] * sizes[own][:count, None, :]
            step = np.diff(t[:count])[:, None, None]
            held = np.zeros((len(t), 6, sizes.shape[1]))
            held[1:count] = np.cumsum(0.5 * step * (rate[1:] + rate[:-1]), axis=0)
            held[count:] = held[count - 1]
            change = np.einsum("nij,njr->nir", transition[:, MEASURED], held)
            place = np.interp(session.times[rows], t, np.arange(len(t)))
            before = np.minimum(place.astype(np.intp), len(t) - 2)
            share = (place - before)[:, None, None]
            out[rows] = (1.0 - share) * change[before] + share * change[before + 1]
        return out


def _solve(transition: Floats, push: Floats) -> Floats:
    """Ψ⁻¹ f, (n, 6, 1); of least size where Ψ has no inverse, for a stone about to stop."""
    try:
        solved = np.linalg.solve(transition, push)
    except np.linalg.LinAlgError:
        solved = np.linalg.pinv(transition, rcond=1e-9) @ push
    return np.asarray(solved, dtype=np.float64)
