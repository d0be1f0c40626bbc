"""Linear response of paths to small pushes, such as slightly higher friction at some places.

A push f(t) changes the state of a stone by δ(t) = Ψ(t) ∫ Ψ(s)⁻¹ f(s) ds, where Ψ is the derivative
of the state by that at release. Ψ is computed from seven paths of every throw, for any number of
pushes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from curling_env.physics.compiled import compiled
from curling_env.physics.state import State
from curling_env.typing import Floats, Indices
from friction_estimation.discovery.data.session import Session

INSTANT_SPACING = 0.1
"""Time between the instants at which responses are integrated [s]: a quarter of a metre at most."""
NEARLY_AT_REST = 0.03
"""Speed below which pushes are ignored [m/s]: the stone stops within millimetres."""
MEASURED = [State.X, State.Y, State.THETA]
"""Quantities of a state that are measured."""
MEASURED_STATES = (int(State.X), int(State.Y), int(State.THETA))
"""The same for compiled code."""


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
        out = np.empty((len(self.session.times), 3, sizes.shape[1]))
        for i in range(len(self.session)):
            own = self.instants_of_throw(i)
            out[self.session.rows(i)] = self.responses_of_throw(i, pushes[own], sizes[own])
        return out

    def at_instants(self, displacement: Floats) -> Floats:
        """Displacements of rows as displacements of the states at the instants, (n, 6).

        Parameters
        ----------
        displacement : (rows, 3) of x, y and heading
        """
        out = np.zeros_like(self.path)
        for i in range(len(self.session)):
            own, rows = self.instants_of_throw(i), self.session.rows(i)
            for k, column in enumerate(MEASURED):
                out[own, column] = np.interp(
                    self.instants.times[own], self.session.times[rows], displacement[rows, k]
                )
        return out

    def instants_of_throw(self, i: int) -> slice:
        """Instants of the i-th throw."""
        return slice(int(self.instants.starts[i]), int(self.instants.starts[i + 1]))

    def responses_of_throw(self, i: int, pushes: Floats, sizes: Floats) -> Floats:
        """Return the same for the rows of the i-th throw alone, (rows, 3, r), by pushes at its
        instants.

        Parameters
        ----------
        pushes, sizes : (n, 3), (n, r) as of `responses`, at the instants of this throw
        """
        own = self.instants_of_throw(i)
        rows, t = self.session.times[self.session.rows(i)], self.instants.times[own]
        path, transition = self.path[own], self.transition[own]
        speed = np.hypot(path[:, State.VX], path[:, State.VY])
        moving = np.flatnonzero(speed > NEARLY_AT_REST)
        # For a stone at rest Ψ is singular.
        count = int(moving[-1]) + 1 if len(moving) else 1
        push = np.zeros((count, 6, 1))
        push[:, [State.VX, State.VY, State.OMEGA], 0] = pushes[:count]
        initial = _solve(transition[:count], push)[:, :, 0]
        out = np.empty((len(rows), len(MEASURED), sizes.shape[1]))
        work = np.zeros((12, sizes.shape[1]))
        _respond(t, transition, initial, np.ascontiguousarray(sizes), rows, work, out)
        return out


@compiled
def _respond(
    t: Any, transition: Any, initial: Any, sizes: Any, rows: Any, work: Any, out: Any
) -> None:
    """Fill `out` with Ψ ∫ Ψ⁻¹ f ds at the rows' times; between instants it is linear.

    Parameters
    ----------
    t, transition : (n,), (n, 6, 6) instants, and Ψ there
    initial : (c, 6) Ψ⁻¹ f at the first c instants; after them there is no push
    sizes : (n, r) factors on it
    rows : (m,) times
    work : (12, r) zeros
    out : (m, 3, r)
    """
    width = sizes.shape[1]
    held, before, after = work[:6], work[6:9], work[9:]
    row = 0
    while row < rows.shape[0] and rows[row] <= t[0]:
        out[row, :, :] = 0.0
        row += 1
    for n in range(1, t.shape[0]):
        if n < initial.shape[0]:
            half = 0.5 * (t[n] - t[n - 1])
            for i in range(6):
                first, second = half * initial[n - 1, i], half * initial[n, i]
                for j in range(width):
                    held[i, j] += first * sizes[n - 1, j] + second * sizes[n, j]
        for k in range(3):
            measured = MEASURED_STATES[k]
            for j in range(width):
                after[k, j] = 0.0
            for i in range(6):
                share = transition[n, measured, i]
                for j in range(width):
                    after[k, j] += share * held[i, j]
        last = n == t.shape[0] - 1
        while row < rows.shape[0] and (rows[row] <= t[n] or last):
            place = min((rows[row] - t[n - 1]) / (t[n] - t[n - 1]), 1.0)
            for k in range(3):
                for j in range(width):
                    out[row, k, j] = (1.0 - place) * before[k, j] + place * after[k, j]
            row += 1
        before, after = after, before


def _solve(transition: Floats, push: Floats) -> Floats:
    """Ψ⁻¹ f, (n, 6, 1); the least-squares solution if Ψ is singular, for a stone about to stop."""
    try:
        solved = np.linalg.solve(transition, push)
    except np.linalg.LinAlgError:
        solved = np.linalg.pinv(transition, rcond=1e-9) @ push
    return np.asarray(solved, dtype=np.float64)
