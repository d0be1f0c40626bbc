"""Batches of throws: lone stones by the thousand, or throws into positions of up to 16 stones.

The law and the steps are those of a single stone, called from compiled loops. Throws do not depend
on each other, so the result is the same bit for bit on any number of threads.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.ice import FrictionMap, Ice
from curling_env.physics.compiled import compiled, inlined
from curling_env.physics.contacts import GONE, ContactLaw, contact_law
from curling_env.physics.events import MOVING, REST, PlayWorkspace, new_play_workspace, play
from curling_env.physics.integrator import ThrowTimes, integrate
from curling_env.physics.law import Law, Laws, compile_law, law_among
from curling_env.physics.map_path import sample_path
from curling_env.physics.motion import MOTION_SIZE, ORDER, STONE
from curling_env.physics.refusals import refuse_impossible_positions
from curling_env.physics.slides import USUAL_NODES, SlideEnd, edge_bounds
from curling_env.physics.state import NODE_SIZE, State
from curling_env.physics.step import Workspace, new_workspace
from curling_env.physics.surroundings import NO_OBSTACLES, Limits
from curling_env.physics.tuning import MAX_TIME, QUICK_TOLERANCE
from curling_env.throw import FROM_HOG_LINE, Delivery, Release, velocity_of
from curling_env.typing import Flags, Floats

RELEASE_FIELDS = (
    *("x", "y", "vx", "vy", "theta", "omega", "stone", "clock", "order"),
    *("sweep_start", "sweep_end"),
)
"""Columns of a table of releases; the fields of `Release` that move a stone, its state first."""
RELEASE_DTYPE = np.dtype([(name, np.float64) for name in RELEASE_FIELDS])
"""One release as an element of a structured array, numbers only."""
_STONE, _CLOCK, _ORDER, _SWEEP, _SWEEP_END = range(6, 11)
MIN_CHUNK = 256
"""Minimum number of throws per thread and turn."""
MOST_STONES = 16


class IceFamily:
    """Ices like one of them, with separate maps and an effect of another strength.

    Parameters
    ----------
    base : ice with everything in common
    effect : name of the effect; if the base lacks it, only maps differ
    """

    def __init__(self, base: Ice, effect: str) -> None:
        self.base, self.effect = base, effect

    def __reduce__(self) -> tuple[Any, ...]:
        # The law contains addresses of this process.
        return IceFamily, (self.base, self.effect)

    def at(self, factor: float) -> Ice:
        """Return the base with the effect's strength multiplied by a factor."""
        effects = tuple(
            replace(one, parameters={**one.parameters, "strength": factor * strength})
            if one.name == self.effect and (strength := one.parameters.get("strength"))
            else one
            for one in self.base.effects
        )
        return replace(self.base, effects=effects)

    @cached_property
    def law(self) -> Law:
        """Return the law of the base."""
        return compile_law(self.base)

    @cached_property
    def of_effect(self) -> Flags:
        """Return the mask of the law's parameters that are strengths of the effect."""
        return compile_law(self.at(0.5)).theta != self.law.theta


class IceVariants(NamedTuple):
    """Ices of one family, on which throws are simulated together.

    Parameters
    ----------
    family : their common family
    mu : (n, rows, columns) friction of each
    factors : (n,) strength of the effect on each, over that on the base
    """

    family: IceFamily
    mu: Floats
    factors: Floats

    def ice(self, k: int) -> Ice:
        """Return the k-th ice."""
        mu = self.mu[k].copy()
        observed = np.ones(mu.shape, dtype=np.bool_)
        friction = FrictionMap(mu=mu, sigma=np.zeros_like(mu), observed=observed)
        return replace(self.family.at(float(self.factors[k])), friction=friction)

    @property
    def laws(self) -> Laws:
        """Return the law of each."""
        law, mu = self.family.law, self.mu
        patterned = bool((mu != mu[:, :1, :1]).any())
        theta = np.where(self.family.of_effect, law.theta * self.factors[:, None], law.theta)
        return Laws(law._replace(patterned=patterned, bilinear=True), mu, theta)


def _laws_of(ice: Ice, *, tabulated: bool = False) -> Laws:
    law = compile_law(ice, tabulated=tabulated)
    return Laws(law, law.mu[None], law.theta[None])


@dataclass(frozen=True, kw_only=True)
class Rests:
    """Ends of lone throws.

    Parameters
    ----------
    x, y, theta : (n,) final place and heading, sheet frame [m, rad]
    time : (n,) time from release to the end [s]
    end : (n,) `SlideEnd` of each throw
    paths : (n, m, 3) x, y, theta every 1/fps seconds, NaN after the end; None without fps
    """

    x: Floats
    y: Floats
    theta: Floats
    time: Floats
    end: NDArray[np.int8]
    paths: Floats | None = None


@dataclass(frozen=True, kw_only=True)
class Positions:
    """Positions after throws among other stones.

    Parameters
    ----------
    xy : (n, k + 1, 2) centres afterwards, the thrown stone last; NaN for a stone that left play or
        was absent [m]
    last : (n, k + 1, 2) the same, but with the place where a stone left play [m]
    theta : (n, k + 1) headings [rad]
    time : (n,) time from release until all rest [s]
    collisions : (n,) number of contacts that pushed; -1 if the stones do not come to rest
    """

    xy: Floats
    last: Floats
    theta: Floats
    time: Floats
    collisions: NDArray[np.int32]


def release_table(releases: Sequence[Release]) -> NDArray[Any]:
    """Return releases as a structured array of RELEASE_DTYPE, (n,)."""
    rows = [tuple(getattr(release, name) for name in RELEASE_FIELDS) for release in releases]
    return np.array(rows, dtype=RELEASE_DTYPE)


def releases_of(
    throws: Floats, direction: Any, delivery: Delivery = FROM_HOG_LINE, **more: Any
) -> NDArray[Any]:
    """Return the releases of throws towards an end, a structured array of RELEASE_DTYPE.

    Parameters
    ----------
    throws : (n, 3) speed [m/s], angle [rad], spin [rad/s]; then perhaps the lateral offset at the
        start [m], and the start and the end of the sweeping, after the release [s]
    direction : the end played to, 1 or -1; one for all throws or (n,)
    delivery : start of the throws
    more : further columns, a number for all throws or (n,)
    """
    names = ("speed", "angle", "omega", "x", *RELEASE_FIELDS[-2:])
    columns = dict(zip(names, throws.T, strict=False))
    speed, angle = columns.pop("speed"), columns.pop("angle")
    vx, vy = velocity_of(speed, angle, direction)
    columns |= {"x": direction * columns.get("x", 0.0), "y": -direction * delivery.line_y}
    columns |= {"vx": vx, "vy": vy, **more}
    table = np.zeros(len(throws), dtype=RELEASE_DTYPE)
    for name, values in columns.items():
        table[name] = values
    return table


def _as_rows(releases: NDArray[Any] | Sequence[Release]) -> Floats:
    """Return an (n, 11) view of a table of releases; refuse other dtypes and infinite numbers or
    NaN.
    """
    table = releases if isinstance(releases, np.ndarray) else release_table(releases)
    if table.dtype != RELEASE_DTYPE or table.ndim != 1:
        raise InputError(
            f"expected releases as a structured array of {', '.join(RELEASE_FIELDS)}, "
            f"got {table.dtype} of shape {table.shape}"
        )
    rows = np.ascontiguousarray(table).view(np.float64).reshape(-1, len(RELEASE_FIELDS))
    if not np.isfinite(rows).all():
        bad = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
        raise InputError("a release must have finite numbers", where=f"release {bad}")
    return rows


@inlined
def _release(row: Any, state: Any, motion: Any) -> ThrowTimes:
    """Set the state and the order of a stone from a release; return the times of the throw."""
    for c in range(6):
        state[c] = row[c]
    motion[ORDER] = row[_ORDER]
    return ThrowTimes(row[_CLOCK], row[_SWEEP], row[_SWEEP_END])


@compiled
def _slide_all(
    laws: Laws,
    which: Any,
    rows: Any,
    chosen: Any,
    limits: Limits,
    dt: float,
    rests: Any,
    motion: Any,
    nodes: Any,
    work: Workspace,
) -> int:
    """Slide a stone for each chosen row, by law `which`; fill in its place in `Rests`' arrays.

    Returns
    -------
    largest number of nodes of a path; if it exceeds `nodes`, the paths must be filled again
    """
    most = 0
    x, y, theta, time, end, paths = rests
    state = work.states[2]
    for i in chosen:
        delivery = _release(rows[i], state, motion)
        motion[STONE] = rows[i, _STONE]
        law = law_among(laws, which[i])
        end[i], time[i], length = integrate(law, motion, delivery, limits, nodes, 0.0, work)
        x[i] = state[State.X]
        y[i] = state[State.Y]
        theta[i] = state[State.THETA]
        if paths.shape[1] > 0:
            most = max(most, length)
            count = 0
            if 0 < length <= nodes.shape[0]:
                count = sample_path(nodes, length, dt, 0, time[i], work.probe, paths[i])
            for k in range(count, paths.shape[1]):
                for c in range(3):
                    paths[i, k, c] = np.nan
    return most


def throw_batch(
    ice: Ice | IceVariants | Sequence[Ice],
    releases: NDArray[Any] | Sequence[Release],
    *,
    which: NDArray[np.intp] | None = None,
    bounds: Floats | None = None,
    fps: float | None = None,
    longest: float = 40.0,
    tolerance: float = QUICK_TOLERANCE,
    workers: int = 1,
) -> Rests:
    """Slide many lone stones.

    Parameters
    ----------
    ice : one ice for all throws, or several; `IceVariants` are simulated together
    releases : structured array of RELEASE_DTYPE, or `Release`s
    which : (n,) index of the ice of each throw, if several are given. To throw all on every ice,
        give ``np.repeat(np.arange(len(ices)), n)`` and tiled releases
    bounds : (4,) x_min, x_max, y_min, y_max of centres that end a throw; the edges of the ice by
        default
    fps : samples per second of the paths; without it no paths are kept
    longest : maximum duration of the kept paths [s]
    tolerance : maximum error of a rest on the roughest ice, as in `slide` [m]
    workers : number of threads

    Raises
    ------
    InputError : invalid releases, or an index without an ice
    """
    rows = _as_rows(releases)
    n = len(rows)
    ices = [ice] if isinstance(ice, Ice) else ice
    count = len(ices.mu) if isinstance(ices, IceVariants) else len(ices)
    index = np.zeros(n, dtype=np.intp) if which is None else np.asarray(which)
    if index.shape != (n,) or (n and not 0 <= index.min() <= index.max() < count):
        raise InputError(f"expected the index of one of {count} ices for each of {n} releases")
    x, y, theta, time = (np.empty(n) for _ in range(4))
    end = np.empty(n, dtype=np.int8)
    paths = np.empty((n, int(min(longest, MAX_TIME) * fps) + 1 if fps else 0, 3))

    def slide_some(
        laws: Laws,
        of_law: NDArray[np.intp],
        limits: Limits,
        chosen: NDArray[np.intp],
        part: slice,
    ) -> None:
        room, most = -1, USUAL_NODES if fps else 0
        while most > room:
            room = most
            most = _slide_all(
                laws,
                of_law,
                rows,
                chosen[part],
                limits,
                1.0 / fps if fps else 1.0,
                (x, y, theta, time, end, paths),
                np.zeros(MOTION_SIZE),
                np.empty((room, NODE_SIZE)),
                new_workspace(tolerance),
            )

    def slide(base: Ice, laws: Laws, of_law: NDArray[np.intp], chosen: NDArray[np.intp]) -> None:
        limits = Limits(edge_bounds(base) if bounds is None else bounds, NO_OBSTACLES, 0.0)
        _share(partial(slide_some, laws, of_law, limits, chosen), len(chosen), workers)

    if isinstance(ices, IceVariants):
        slide(ices.family.base, ices.laws, index, np.arange(n))
    else:
        first = index if len(ices) == 1 else np.zeros_like(index)
        for k, surface in enumerate(ices):
            slide(surface, _laws_of(surface), first, np.flatnonzero(index == k))
    return Rests(x=x, y=y, theta=theta, time=time, end=end, paths=paths if fps else None)


def _share(work: Callable[[slice], None], n: int, workers: int) -> None:
    """Run the work on slices that cover n items, on a number of threads."""
    if workers <= 1:
        if n:
            work(slice(0, n))
        return
    chunk = max(MIN_CHUNK, n // (8 * workers))
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(work, [slice(start, start + chunk) for start in range(0, n, chunk)]))


@compiled
def _play_all(
    laws: Laws,
    which: Any,
    contact: ContactLaw,
    rows: Any,
    before: Any,
    bounds: Any,
    workspaces: Any,
    results: Any,
) -> None:
    """Play each row; fill in `results`, the arrays of `Positions`."""
    position, usual, approach = workspaces
    after, last, theta, time, collisions = results
    k = before.shape[1]
    for i in range(rows.shape[0]):
        for s in range(k):
            for c in range(6):
                position.stones[s, c] = before[i, s, c] if c < 2 else 0.0
            position.status[s] = REST if before[i, s, 0] == before[i, s, 0] else GONE
        delivery = _release(rows[i], position.stones[k], position.motion)
        position.status[k] = MOVING
        position.identity[k] = rows[i, _STONE]
        law = law_among(laws, which[i])
        time[i], collisions[i] = play(law, contact, position, usual, approach, delivery, bounds)
        for s in range(k + 1):
            stone, here = position.stones[s], position.status[s] != GONE
            for c in range(2):
                last[i, s, c] = stone[c]
                after[i, s, c] = stone[c] if here else np.nan
            theta[i, s] = stone[State.THETA] if here else np.nan


class BatchEngine:
    """Engine that throws a stone into each of many positions. Each thread needs its own.

    Parameters
    ----------
    ice : the ice of all throws, or `IceVariants`
    tolerance : maximum error of a lone stone's rest on the roughest ice [m]
    tabulated : read the law from a table, for thousands of throws on one ice; see
        `physics.law_table`

    Raises
    ------
    InputError : an effect that is not in the catalogue, or parameters its card does not allow
    """

    def __init__(
        self,
        ice: Ice | IceVariants,
        *,
        tolerance: float = QUICK_TOLERANCE,
        tabulated: bool = False,
    ) -> None:
        varied = isinstance(ice, IceVariants)
        self.ice, self._given = ice.family.base if varied else ice, ice
        self._settings: dict[str, Any] = {"tolerance": tolerance, "tabulated": tabulated}
        self._contact = contact_law(self.ice.stone)
        self._workspaces: dict[int, tuple[PlayWorkspace, Workspace, Workspace]] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        # The law contains addresses of this process.
        return partial(BatchEngine, self._given, **self._settings), ()

    @cached_property
    def _laws(self) -> Laws:
        given = self._given
        if isinstance(given, IceVariants):
            return given.laws
        return _laws_of(given, tabulated=self._settings["tabulated"])

    def play(
        self,
        stones: Floats,
        releases: NDArray[Any] | Sequence[Release],
        *,
        which: NDArray[np.intp] | None = None,
        identity: Sequence[int] | None = None,
        bounds: Floats | None = None,
        workers: int = 1,
    ) -> Positions:
        """Throw a stone into each of many positions; parameters and errors as in `play_batch`.

        Parameters
        ----------
        which : (n,) index of the ice of each throw among `IceVariants`
        """
        rows = _as_rows(releases)
        of_law = np.zeros(len(rows), dtype=np.intp) if which is None else np.asarray(which)
        # For arrays that cannot be written to, the kernel would be compiled a second time.
        stones = np.require(stones, np.float64, ["C", "W"])
        n = len(rows)
        if stones.ndim != 3 or stones.shape[0] != n or stones.shape[2] != 2:
            raise InputError(f"expected stones of shape ({n}, k, 2), got {stones.shape}")
        k = stones.shape[1]
        if k == 0 and not self._settings["tabulated"]:
            return self._alone(releases, which, bounds, workers)
        if k + 1 > MOST_STONES:
            raise InputError(
                f"expected at most {MOST_STONES} stones in a position, got {k} and the thrown one"
            )
        limits = edge_bounds(self.ice) if bounds is None else bounds
        all_stones = np.concatenate([stones, rows[:, None, : State.Y + 1]], axis=1)
        inside = "the bounds of the ice"
        refuse_impossible_positions(all_stones, self.ice.stone.radius, limits, inside, bounded=k)
        after, last, theta = (np.empty((n, k + 1, *pair)) for pair in ((2,), (2,), ()))
        time, collisions = np.empty(n), np.empty(n, dtype=np.int32)

        def play_some(part: slice) -> None:
            # A thread that finds the cached arrays in use makes its own.
            kept = self._workspaces.pop(k + 1, None)
            if kept is None:
                kept = new_play_workspace(self.ice, k + 1, self._settings["tolerance"])
            kept[0].identity[:k] = 0.0 if identity is None else identity
            _play_all(
                self._laws,
                of_law[part],
                self._contact,
                rows[part],
                stones[part],
                limits,
                kept,
                (after[part], last[part], theta[part], time[part], collisions[part]),
            )
            self._workspaces[k + 1] = kept

        _share(play_some, n, workers)
        return Positions(xy=after, last=last, theta=theta, time=time, collisions=collisions)

    def _alone(
        self,
        releases: NDArray[Any] | Sequence[Release],
        which: NDArray[np.intp] | None,
        bounds: Floats | None,
        workers: int,
    ) -> Positions:
        """Throw on the empty sheet; the code of contacts is then not even compiled."""
        tolerance = self._settings["tolerance"]
        alone = throw_batch(
            self._given,
            releases,
            which=which,
            bounds=bounds,
            tolerance=tolerance,
            workers=workers,
        )
        last = np.stack([alone.x, alone.y], axis=-1)[:, None]
        gone = (alone.end == SlideEnd.LEFT_BOUNDS)[:, None]
        return Positions(
            xy=np.where(gone[..., None], np.nan, last),
            last=last,
            theta=np.where(gone, np.nan, alone.theta[:, None]),
            time=alone.time,
            collisions=np.where(alone.end == SlideEnd.NEVER_STOPS, -1, 0).astype(np.int32),
        )


def play_batch(
    ice: Ice,
    stones: Floats,
    releases: NDArray[Any] | Sequence[Release],
    *,
    identity: Sequence[int] | None = None,
    bounds: Floats | None = None,
    tolerance: float = QUICK_TOLERANCE,
    tabulated: bool = False,
    workers: int = 1,
) -> Positions:
    """Throw a stone into each of many positions, once; use `BatchEngine` for repeated calls.

    Parameters
    ----------
    ice, tolerance, tabulated : as in `BatchEngine`
    stones : (n, k, 2) centres of resting stones, sheet frame; NaN if a position has fewer [m]
    releases : n releases, as in `throw_batch`
    identity : (k,) identifiers of the resting stones, for effects that depend on them; 0 by default
    bounds : (4,) x_min, x_max, y_min, y_max of centres in play; the edges of the ice by default
    workers : number of threads

    Raises
    ------
    InputError : shapes that do not fit, more than sixteen stones, stones outside the bounds or
        overlapping, a release that is not finite or within a stone
    """
    engine = BatchEngine(ice, tolerance=tolerance, tabulated=tabulated)
    return engine.play(stones, releases, identity=identity, bounds=bounds, workers=workers)
