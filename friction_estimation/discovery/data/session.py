"""A session for discovery: the free slides of all throws, laid out for the forward model.

Tracks from films are smoothed and state their standard errors, including errors that all frames
share. If neighbouring rows carry the same information, only rows at some distance are kept.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.effects import EffectCard
from curling_env.physics.state import State
from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Flags, Floats, Indices
from friction_estimation.camera.scene import Scene
from friction_estimation.discovery.data.gates import (
    GateErrors,
    gate_errors,
    gate_slides,
    row_noise,
)
from friction_estimation.discovery.data.measurement import (
    measurement_effects,
    measurement_effects_through,
)
from friction_estimation.discovery.data.outliers import (
    fast_series,
    robust_deviation,
    without_outliers,
)
from friction_estimation.discovery.data.wear_tracks import WearTracks, smoothed_path
from friction_estimation.discovery.tuning import (
    FORECAST_SECONDS,
    HIGHEST_FRAME_RATE,
    LEAST_HEADINGS,
    LEAST_THROWS,
    SMOOTHED_JITTER,
    SMOOTHED_SPACING,
    USUAL_SPIN,
)
from friction_estimation.tracks.contacts import contacts_of
from friction_estimation.tracks.free_slide import FreeSlide, free_slides

MAX_SESSION_THROWS = 1000
"""Maximum number of throws of a session: more are not made between two floodings; a game has
160."""
MAX_THROW_ROWS = 20_000
"""Maximum number of rows of one throw: 80 s at 240 frames per second."""
MAX_THROW_SECONDS = 900.0
"""Maximum duration of a track, including the time before and after the slide [s]; a slide takes
30."""
MAX_MAP_CELLS = 25_000
"""Maximum number of cells of the initial map; a stone's band is wider than such a cell."""
FURTHEST_ACROSS, FURTHEST_ALONG = 2.6, 24.0
"""Limits of the middle of a track [m]: a little beyond the ice of the widest sheet."""
LEAST_TIMES = 4
"""Maximum number of gate times of a throw that needs all but the last for a forecast."""
AT_HOG_LINE = 0.05
"""A stone this close to the hog line counts as at it [m]: tracks begin with noise."""


OF_THROWS = ("throws", "orders", "stones", "clocks", "usual_spins")
OF_ROWS = ("times", "xy", "theta", "swept", "sigma")
"""Columns of a session with an entry for each throw, and for each row."""


class UnknownPushes(NamedTuple):
    """Pushes at regular times of every throw, from its release on, interpolated linearly.

    Parameters
    ----------
    sizes : (n, 4) change of ln μ; acceleration to the left of the travel and along the sheet's x
        [m/s²]; acceleration of the spin [rad/s²]
    starts : (k + 1,) where each throw begins; none has fewer than two times
    spacing : (k,) time between two of them [s]
    """

    sizes: Floats
    starts: Indices
    spacing: Floats

    def only(self, chosen: Indices) -> UnknownPushes:
        """Those of some throws."""
        parts = [self.sizes[self.starts[i] : self.starts[i + 1]] for i in chosen.tolist()]
        counts = np.diff(self.starts)[chosen]
        return UnknownPushes(
            np.concatenate([*parts, self.sizes[:0]]),
            np.concatenate([[0], np.cumsum(counts)]).astype(np.intp),
            self.spacing[chosen],
        )

    def at(self, i: int, times: Floats) -> Floats:
        """Return the pushes of the i-th throw at some times, (n, 4)."""
        own = self.sizes[self.starts[i] : self.starts[i + 1]]
        known = self.spacing[i] * np.arange(len(own))
        return np.column_stack([np.interp(times, known, column) for column in own.T])


def no_pushes(throws: int) -> UnknownPushes:
    """Return pushes of zero for a number of throws."""
    starts = np.zeros(throws + 1, dtype=np.intp)
    return UnknownPushes(np.zeros((0, 4)), starts, np.ones(throws))


@dataclass(frozen=True, kw_only=True, eq=False)
class Session:
    """Throws in order of play.

    Parameters
    ----------
    throws : (k,) numbers of the throws in the file
    orders : (k,) for each throw, how many were played before it
    stones : (k,) identifiers of the stones
    clocks : (k,) session time of each release [s]
    times : (rows,) time since the release of the throw [s]
    xy : (rows, 2) positions, sheet frame [m]
    theta : (rows,) headings [rad]; NaN where unknown
    swept : (rows,) 1 where the stone was swept, else 0
    sigma : (rows, 2) relative noise of position and heading of the rows, of mean 1
    starts : (k+1,) first row of each throw, then the number of rows
    usual_spins : (k,) spin taken where no heading was measured [rad/s]
    claimed : median standard error of a coordinate by the tracks' own columns [m]; 0 without them,
        and where they are no more than the noise of single rows
    claimed_turn : the same of the heading [rad]
    left_out : for each throw that is not here, the reason
    measurements : effects that the camera may have on the tracks
    wear_tracks : tracks of the stones in all throws of the session; throws that are not searched
        wear the ice too
    pushes : what something unknown does to the stones; None for nothing
    gates : errors of light gates that timed the throws, whose x are not known; None for cameras
    """

    throws: Indices
    orders: Indices
    stones: Indices
    clocks: Floats
    times: Floats
    xy: Floats
    theta: Floats
    swept: Floats
    sigma: Floats
    starts: Indices
    usual_spins: Floats
    claimed: float = 0.0
    claimed_turn: float = 0.0
    left_out: tuple[str, ...] = ()
    measurements: tuple[EffectCard, ...] = field(default_factory=measurement_effects)
    wear_tracks: WearTracks = field(default_factory=WearTracks)
    pushes: UnknownPushes | None = None
    gates: GateErrors | None = None

    def __len__(self) -> int:
        return len(self.throws)

    @property
    def slides(self) -> list[tuple[int, int, float]]:
        """Throw, stone and session time of the release of each slide, which identify it.

        The stones of a throw share its number, and a stone that was hit slides again.
        """
        columns = (self.throws.tolist(), self.stones.tolist(), self.clocks.tolist())
        return list(zip(*columns, strict=True))

    @property
    def smoothed(self) -> bool:
        """Return whether the tracks are smoothed and state their errors.

        Their errors may then last for seconds and depend on the place.
        """
        return self.claimed > 0.0

    def rows(self, i: int) -> slice:
        """Rows of the i-th throw."""
        return slice(int(self.starts[i]), int(self.starts[i + 1]))

    @property
    def paths(self) -> list[Floats]:
        """Measured positions of every throw, (n, 2) each."""
        return np.split(self.xy, self.starts[1:-1])

    @cached_property
    def owner(self) -> Indices:
        """Index of the throw of each row, (rows,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.starts))

    @cached_property
    def early(self) -> Flags:
        """Rows from which throws are forecast: the first seconds, or all gates except the last.

        Throws of two gates are forecast from all times except the last.
        """
        if self.gates is None:
            return self.times <= FORECAST_SECONDS
        to_come = self.starts[1:][self.owner] - np.arange(len(self.times))
        return to_come > np.where(np.diff(self.starts) > LEAST_TIMES, 2, 1)[self.owner]

    @cached_property
    def observed(self) -> Floats:
        """Measured x, y and heading, (rows, 3); NaN where not measured."""
        out = np.column_stack([self.xy, self.theta])
        if self.gates is not None:
            out[:, 0] = np.nan
        return out

    @cached_property
    def sweeps(self) -> tuple[Floats, Indices, Floats]:
        """Times at which sweeping begins and ends.

        Returns
        -------
        switches : times at which it does [s]
        firsts : (k+1,) index of the first switch of each throw
        initially : (k,) whether the stone is swept at first, 0 or 1
        """
        switches: list[float] = []
        firsts = [0]
        initially: list[float] = []
        for i in range(len(self)):
            rows = self.rows(i)
            swept, t = self.swept[rows] > 0.5, self.times[rows]
            at = np.flatnonzero(np.diff(swept.astype(int)))
            switches += (0.5 * (t[at] + t[at + 1])).tolist()
            firsts.append(len(switches))
            initially.append(float(swept[0]))
        return np.array(switches), np.array(firsts, dtype=np.intp), np.array(initially)

    @cached_property
    def first_states(self) -> Floats:
        """Release states x, y, vx, vy, theta, omega by quadratics through two seconds, (k, 6)."""
        states = np.zeros((len(self), 6))
        for i in range(len(self)):
            rows = self.rows(i)
            t = self.times[rows]
            early = t <= max(2.0, t[min(len(t) - 1, 20)])
            fit = np.polyfit(t[early], self.xy[rows][early], 2)
            states[i, 0:2], states[i, 2:4] = fit[2], fit[1]
            heading = self.theta[rows]
            known = early & np.isfinite(heading)
            states[i, State.OMEGA] = self.usual_spins[i]
            if known.sum() > 10:
                states[i, State.OMEGA], states[i, State.THETA] = np.polyfit(
                    t[known], heading[known], 1
                )
        return states

    @cached_property
    def turns(self) -> Flags:
        """Return whether the heading of each throw was measured, (k,)."""
        known = np.isfinite(self.theta).astype(int)
        return np.add.reduceat(known, self.starts[:-1]) > LEAST_HEADINGS

    def with_spins_from_curvature(self) -> Session:
        """Return the session with stones assumed to turn to the side to which their paths bend.

        This is for throws without headings on ice that is known to curl.
        """
        bends = np.zeros(len(self))
        for i, rows in enumerate(map(self.rows, range(len(self)))):
            t, xy = self.times[rows], self.xy[rows]
            x, y = xy[-1] - xy[0]
            bends[i] = np.polyfit(t, xy @ np.array([-y, x]), 2)[0]
        return replace(self, usual_spins=np.where(bends < 0, -USUAL_SPIN, USUAL_SPIN))

    def without_rows(self, dropped: Flags) -> Session:
        """Return the session without some rows; the first row of a throw must stay."""
        keep = ~dropped
        counts = np.add.reduceat(keep.astype(int), self.starts[:-1])
        return self._with_rows(keep, counts)

    def only(self, chosen: Sequence[int] | Indices) -> Session:
        """Return the session of the throws with these indices."""
        chosen = np.asarray(chosen, dtype=np.intp)
        rows = np.concatenate([np.arange(*self.starts[i : i + 2]) for i in chosen.tolist()])
        whole = self._with_rows(rows, np.diff(self.starts)[chosen])
        pushes = self.pushes and self.pushes.only(chosen)
        return replace(whole, pushes=pushes, **{n: getattr(self, n)[chosen] for n in OF_THROWS})

    def _with_rows(self, rows: Flags | Indices, counts: Indices) -> Session:
        """Return the session with some of its rows, and the number of rows of each throw."""
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.intp)
        return replace(self, starts=starts, **{n: getattr(self, n)[rows] for n in OF_ROWS})


def _refuse_beyond_a_session(tracks: Sequence[Trajectory]) -> None:
    """Refuse sessions that would take hours or exhaust the memory."""
    count = len({track.throw for track in tracks})
    if count > MAX_SESSION_THROWS:
        raise InputError(f"{count} throws are too many; expected at most {MAX_SESSION_THROWS}")
    for track in tracks:
        if len(track) > MAX_THROW_ROWS:
            raise InputError(
                f"throw {track.throw} has {len(track)} rows; expected at most {MAX_THROW_ROWS} "
                "(keep every second one)"
            )
        if track.duration > MAX_THROW_SECONDS:
            raise InputError(
                f"throw {track.throw} lasts {track.duration:.0f} s; expected at most "
                f"{MAX_THROW_SECONDS:.0f} s"
            )


def _refuse_repeated_throws(tracks: Sequence[Trajectory]) -> None:
    """Refuse two tracks with the same throw and stone."""
    known: set[tuple[int, int]] = set()
    for track in tracks:
        key = int(track.throw), int(track.stone)
        if key in known:
            raise InputError(
                f"two tracks have throw {key[0]} and stone {key[1]}; expected a number for each "
                "throw (dataclasses.replace(track, throw=k))"
            )
        known.add(key)


def refuse_too_many_cells(ice: Ice | None) -> None:
    """Refuse an ice whose map is too fine to be fitted.

    Raises
    ------
    InputError : it has more cells than `MAX_MAP_CELLS`
    """
    if ice is not None and ice.friction.mu.size > MAX_MAP_CELLS:
        raise InputError(
            f"an ice of {ice.friction.mu.size} cells is too fine to be fitted; expected at most "
            f"{MAX_MAP_CELLS} cells (of 0.1 m)"
        )


def open_session(tracks: Sequence[Trajectory], scene: Scene | None = None) -> Session:
    """Return the free slides of measured tracks.

    Parameters
    ----------
    tracks : measured throws, in order of play
    scene : scene of the camera that saw them, where it is known

    Raises
    ------
    InputError : no throw lies on the sheet, two tracks are of the same throw and stone, or more is
        given than a session can hold
    TrackTooShortError : no throw slides freely
    """
    _refuse_beyond_a_session(tracks)
    _refuse_repeated_throws(tracks)
    if any(track.by_gates for track in tracks):
        return _session_of_gates(tracks)
    contacts = contacts_of(tracks)
    cleaned = [
        without_outliers(track, times) for track, times in zip(tracks, contacts, strict=True)
    ]
    elsewhere = [_elsewhere(track) for track in cleaned]
    on_sheet = [track for track, reason in zip(cleaned, elsewhere, strict=True) if not reason]
    contacts = [times for times, reason in zip(contacts, elsewhere, strict=True) if not reason]
    off_sheet = [reason for reason in elsewhere if reason]
    if not on_sheet and off_sheet:
        raise InputError(f"no throw lies on the sheet: {off_sheet[0]}")
    slides, reasons = free_slides(on_sheet, contacts)
    claims = [s.track.sigma_xy[s.rows] for s in slides if s.track.sigma_xy.size]
    claimed = float(np.nanmedian(np.concatenate(claims))) if claims else 0.0
    if claimed > 0.0 and _jitter_over_claims(slides) > SMOOTHED_JITTER:
        claimed = 0.0
    turns = [s.track.sigma_theta[s.rows] for s in slides if s.track.sigma_theta.size]
    known_turns = np.concatenate([turn[np.isfinite(turn)] for turn in turns] or [np.empty(0)])
    claimed_turn = float(np.median(known_turns)) if claimed and len(known_turns) else 0.0
    spacing = SMOOTHED_SPACING if claimed else 0.0
    pairs, blind = _with_heading([(slide, _thinned(slide, spacing)) for slide in slides])
    order_of = _orders(tracks)
    return replace(
        _laid_out(pairs, order_of),
        sigma=np.column_stack(
            [
                _relative([_rows_of(s.track.sigma_xy, rows) for s, rows in pairs]),
                _relative([_rows_of(s.track.sigma_theta, rows) for s, rows in pairs]),
            ]
        ),
        claimed=claimed,
        claimed_turn=claimed_turn,
        left_out=(*off_sheet, *reasons, *blind),
        measurements=measurement_effects() if scene is None else measurement_effects_through(scene),
        wear_tracks=WearTracks.of(
            (order_of[track.throw], smoothed_path(track.t, track.xy)) for track in on_sheet
        ),
    )


def _orders(tracks: Sequence[Trajectory]) -> dict[int, int]:
    """Return the number of earlier throws, for each throw."""
    return {throw: k for k, throw in enumerate(sorted({track.throw for track in tracks}))}


def _rows_of(column: Floats, rows: Indices) -> Floats:
    """Rows of a column of a track; NaN where it has none."""
    return column[rows] if column.size else np.full(len(rows), np.nan)


def _laid_out(pairs: Sequence[tuple[FreeSlide, Indices]], order_of: Mapping[int, int]) -> Session:
    """Return the session of rows of slides with uniform noise."""
    counts = [len(rows) for _, rows in pairs]
    return Session(
        throws=np.array([s.track.throw for s, _ in pairs], dtype=np.intp),
        orders=np.array([order_of[s.track.throw] for s, _ in pairs], dtype=np.intp),
        stones=np.array([s.track.stone for s, _ in pairs], dtype=np.intp),
        clocks=np.array([s.track.clock + s.track.t[rows[0]] for s, rows in pairs]),
        times=np.concatenate([s.track.t[rows] - s.track.t[rows[0]] for s, rows in pairs]),
        xy=np.concatenate([s.track.xy[rows] for s, rows in pairs]),
        theta=np.concatenate([s.track.theta[rows] for s, rows in pairs]),
        swept=np.concatenate([s.track.swept[rows] for s, rows in pairs]),
        sigma=np.ones((sum(counts), 2)),
        usual_spins=np.full(len(pairs), USUAL_SPIN),
        starts=np.concatenate([[0], np.cumsum(counts)]).astype(np.intp),
    )


def _session_of_gates(tracks: Sequence[Trajectory]) -> Session:
    """Return the session of throws timed by light gates.

    Raises
    ------
    InputError : a camera saw some of the throws
    TrackTooShortError : no throw has enough times
    """
    seen = next((track.throw for track in tracks if not track.by_gates), None)
    if seen is not None:
        raise InputError(
            f"throw {seen} was seen by a camera, and others were timed by light gates; expected "
            "one of the two in a session"
        )
    slides, reasons = gate_slides(tracks)
    errors = gate_errors(slides)
    noise = np.concatenate([row_noise(slide.track)[slide.rows] for slide in slides])
    return replace(
        _laid_out([(slide, slide.rows) for slide in slides], _orders(tracks)),
        theta=np.full(len(noise), np.nan),
        sigma=np.column_stack([noise / errors.noise, np.ones(len(noise))]),
        left_out=tuple(reasons),
        measurements=(),
        gates=errors,
    )


def _with_heading(
    pairs: list[tuple[FreeSlide, Indices]],
) -> tuple[list[tuple[FreeSlide, Indices]], list[str]]:
    """Return the slides whose heading was measured, if enough, and why others are dropped.

    The rotation of a stone determines the side of its curl. If it is unknown, a guess would be
    wrong in half of the cases.
    """
    seen = [pair for pair in pairs if _turns(*pair)]
    if len(seen) < LEAST_THROWS:
        return pairs, []
    blind = [slide.track.throw for slide, rows in pairs if not _turns(slide, rows)]
    return seen, [f"throw {k}: neither heading nor rotation was measured" for k in blind]


def _turns(slide: FreeSlide, rows: Indices) -> bool:
    return bool(np.isfinite(slide.track.theta[rows]).sum() > LEAST_HEADINGS)


def _elsewhere(track: Trajectory) -> str:
    """Return the reason why a track cannot be of this sheet; empty if it can."""
    if len(track) == 0:
        return ""
    x, y = np.abs(np.median(track.xy, axis=0))
    if x > FURTHEST_ACROSS or y > FURTHEST_ALONG:
        place = f"around x = {np.median(track.xy[:, 0]):.1f}, y = {np.median(track.xy[:, 1]):.1f} m"
        return f"throw {track.throw} lies off the sheet, {place}; check its scene and sheet"
    return ""


def _relative(claims: Sequence[Floats]) -> Floats:
    """Return stated standard errors over their mean, 1 without a stated one."""
    values = np.concatenate(claims)
    known = np.isfinite(values) & (values > 0)
    mean = float(values[known].mean()) if known.any() else 1.0
    return np.where(known, values / mean, 1.0)


def _jitter_over_claims(slides: Sequence[FreeSlide]) -> float:
    """Return the jitter of rows about their neighbours, over their stated standard errors."""
    found: list[float] = []
    for slide in slides:
        track, rows = slide.track, slide.rows
        if not track.sigma_xy.size:
            continue
        sigma = track.sigma_xy[rows]
        for axis in range(2):
            fast = fast_series(track.t[rows], track.xy[rows, axis]) / sigma
            found.append(robust_deviation(fast[np.isfinite(fast)]))
    return float(np.median(found)) if found else 0.0


def _thinned(slide: FreeSlide, spacing: float) -> Indices:
    """Return the necessary rows of a slide, at least `spacing` seconds apart."""
    rows = _from_hog_line(slide)
    t = slide.track.t[rows]
    step = (t[-1] - t[0]) / max(len(t) - 1, 1)
    every = max(
        1, round(1.0 / max(step, 1e-9) / HIGHEST_FRAME_RATE), int(spacing / max(step, 1e-9) + 0.5)
    )
    return rows[::every]


def _from_hog_line(slide: FreeSlide) -> Indices:
    """Rows of a slide, and those before it back to the delivery hog line.

    The rules require the release before that line. A push that seems to end later has another
    cause, such as a tracked point that winds about the centre, which discovery must see.
    """
    xy, rows = slide.track.xy, slide.rows
    direction = 1.0 if xy[rows[-1], 1] >= xy[rows[0], 1] else -1.0
    first = slide.stretch[0]
    beyond = np.flatnonzero(direction * xy[first : rows[0], 1] >= -HOG_LINE_Y - AT_HOG_LINE)
    return np.concatenate([first + beyond, rows]).astype(np.intp)
