"""Possible pushes of an unknown effect on a stone, each a function of one variable.

They act along the travel, to its left, on the rotation, and fixed in the sheet.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from curling_env.physics.effects.card import Push
from curling_env.physics.state import State
from curling_env.typing import Floats
from friction_estimation.discovery.data.session import UnknownPushes
from friction_estimation.discovery.model.response import LinearisedPaths
from friction_estimation.discovery.tuning import LARGEST_LN_FACTOR

PUSHES: tuple[Push, ...] = ("along", "left", "turn", "along the sheet", "across the sheet")


def variables(paths: LinearisedPaths, off: Floats | float = 0.0) -> dict[str, Floats]:
    """Functions of each variable at every instant, (n, b) each, by name.

    They are evaluated on the measured paths, not on the fitted ones, which lack the missing effect.
    The first word of a name is that of the variable.
    """
    session, path = paths.session, paths.path + off
    times, starts = paths.instants
    owner = np.repeat(np.arange(len(session)), np.diff(starts))
    speed = np.hypot(path[:, State.VX], path[:, State.VY])
    spin, theta = path[:, State.OMEGA], path[:, State.THETA]
    functions: dict[str, Floats] = {
        "speed": _tents(speed, 5),
        "t": _tents(times, 5),
        "y": _tents(path[:, State.Y], 21),
        "x": path[:, State.X, None] ** np.arange(1, 4),
        "spin": _powers(np.abs(spin), 2),
        "spin side": np.column_stack([np.tanh(spin / 0.1), spin]),
        "theta": np.column_stack([np.sin(theta), np.cos(theta)]),
        "clock": _powers((session.clocks[owner]), 2),
        "order": _powers(session.orders[owner].astype(float), 2),
        "swept": _swept(paths)[:, None],
    }
    stones = np.unique(session.stones)
    if len(stones) > 1:
        functions["stone"] = (session.stones[owner][:, None] == stones[:-1]).astype(float)
    if not session.turns.any():
        functions.pop("theta")
        functions.pop("spin")
        functions.pop("spin side")
    if session.gates is not None:
        functions.pop("x")
    return {k: v for k, v in functions.items() if np.ptp(v, axis=0).max() > 1e-9}


def _swept(paths: LinearisedPaths) -> Floats:
    """Return for every instant whether the stone was swept, 0 or 1."""
    session, (times, starts) = paths.session, paths.instants
    swept = np.empty(len(times))
    for i in range(len(session)):
        rows, own = session.rows(i), slice(int(starts[i]), int(starts[i + 1]))
        swept[own] = np.interp(times[own], session.times[rows], session.swept[rows])
    return swept


def _powers(values: Floats, degree: int) -> Floats:
    scaled = (values - values.mean()) / max(float(values.std()), 1e-9)
    return np.column_stack([scaled**k for k in range(1, degree + 1)])


def _tents(values: Floats, count: int) -> Floats:
    """Piecewise linear functions on evenly spaced knots."""
    place = (values - values.min()) / max(float(np.ptp(values)), 1e-9) * (count - 1)
    return np.maximum(1.0 - np.abs(place[:, None] - np.arange(count)), 0.0)


def directions(paths: LinearisedPaths) -> dict[Push, Floats]:
    """Return the (n, 3) accelerations along x, along y and of the spin by a unit of each push.

    The pushes are those of `PUSHES`.

    A push along the travel is a relative increase of friction; so is one along the sheet, which is
    a decrease towards the home end; the others are in m/s² and rad/s².
    """
    velocity = paths.path[:, State.VX : State.VY + 1]
    travel = velocity / np.maximum(np.hypot(*velocity.T), 1e-6)[:, None]
    zero, one = np.zeros(len(travel)), np.ones(len(travel))
    return {
        "along": paths.friction,
        "left": np.column_stack([-travel[:, 1], travel[:, 0], zero]),
        "turn": np.column_stack([zero, zero, one]),
        "along the sheet": ways(paths)[:, None] * paths.friction,
        "across the sheet": np.column_stack([one, zero, zero]),
    }


def ways(paths: LinearisedPaths) -> Floats:
    """Return the direction of play at every instant, 1 or -1, (n,)."""
    starts = paths.instants.starts
    return np.repeat(np.sign(paths.path[starts[:-1], State.VY]), np.diff(starts))


def responses(paths: LinearisedPaths, functions: Floats) -> Floats:
    """Change of x, y and heading for pushes that follow functions, (rows, 3, 5 b).

    Parameters
    ----------
    paths : how the paths of the session respond
    functions : (n, b) functions at the instants of the paths

    Returns
    -------
    for each of `PUSHES` the b functions
    """
    acts = directions(paths)
    return np.concatenate([paths.responses(acts[push], functions) for push in PUSHES], axis=2)


def pushes_over_time(paths: LinearisedPaths, sizes: Mapping[Push, Floats]) -> UnknownPushes:
    """Pushes as a session holds them.

    Parameters
    ----------
    paths : paths of the session
    sizes : (n,) size of each push at the instants
    """
    none = np.zeros(len(paths.path))
    along = sizes.get("along", none) + ways(paths) * sizes.get("along the sheet", none)
    columns = [
        np.clip(along, -LARGEST_LN_FACTOR, LARGEST_LN_FACTOR),
        sizes.get("left", none),
        sizes.get("across the sheet", none),
        sizes.get("turn", none),
    ]
    times, starts = paths.instants
    return UnknownPushes(np.column_stack(columns), starts, times[starts[:-1] + 1])


def response_to(paths: LinearisedPaths, pushes: UnknownPushes) -> Floats:
    """Change of x, y and heading of every row by the pushes of a session, (rows, 3)."""
    acts = directions(paths)
    times, _ = paths.instants
    out = np.zeros((len(paths.session.times), 3))
    for i in range(len(paths.session)):
        own = paths.instants_of_throw(i)
        sizes = pushes.at(i, times[own])
        for k, push in enumerate(("along", "left", "across the sheet", "turn")):
            if sizes[:, k].any():
                response = paths.responses_of_throw(i, acts[push][own], sizes[:, k, None])
                out[paths.session.rows(i)] += response[:, :, 0]
    return out
