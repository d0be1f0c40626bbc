"""A session as discovery sees it: the free slides of all throws, laid out for the forward model.

Tracks from films say how wrong they are, what all frames share included, and are smoothed. Where
they are so smooth that neighbouring rows repeat each other, only rows far enough apart to differ
are kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from curling_env.errors import InputError
from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Indices
from friction_estimation.camera.scene import Scene
from friction_estimation.discovery.data.form import Form
from friction_estimation.discovery.data.measurement import MEASUREMENTS, measurements_through
from friction_estimation.discovery.data.outliers import (
    fast_series,
    robust_deviation,
    without_wild_rows,
)
from friction_estimation.discovery.data.wear_tracks import Lanes
from friction_estimation.tracks.free_slide import FreeSlide, free_slides

FULL_RATE = 40.0
"""Frames a second that are kept of faster films [1/s]: a slide is smooth over 25 ms, its noise is
not independent, and time is spent per row."""
SMOOTHED = 0.3
"""Jitter from row to row over the claimed standard error below which a track was smoothed: a film's
has 0.01 to 0.13."""
SMOOTHED_SPACING = 1.0 / 3.0
"""Between the rows that are kept of a smoothed track [s]: those between tell nothing new."""

ENOUGH_THROWS = 8
"""Fewer throws than this name nothing (methods)."""
FEWEST_HEADINGS = 10
"""Rows with a heading, of those that are kept, from which a throw's spin is known."""
CLEARLY_BENT = 5.0
"""Standard errors from which paths are taken to bend with the turn."""
USUAL_SPIN = 1.5
"""Spin taken where no heading was measured [rad/s]; where none was in any throw its side cannot
matter, for then curl is not a candidate."""
FURTHEST_ACROSS, FURTHEST_ALONG = 2.6, 24.0
"""Where the middle of a track may lie [m]: a little beyond the ice of the widest sheet."""
AT_LINE = 0.05
"""A stone this close to the hog line counts as at it [m]: tracks begin with noise."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Session:
    """Throws in order of play.

    Parameters
    ----------
    throws : (k,) their numbers in the file
    orders : (k,) throws already played before each
    stones : (k,) identifiers
    clocks : (k,) session time at which each release was [s]
    rests : (k,) whether the stone was seen to come to rest by itself
    times : (rows,) since the release of the throw [s]
    xy : (rows, 2) [m]
    theta : (rows,) [rad]; NaN where unknown
    swept : (rows,)
    sigma : (rows, 2) relative noise of position and heading of the rows, mean 1
    usual_spins : (k,) spin taken where no heading was seen [rad/s]
    claimed : standard error of a coordinate that the tracks claim of themselves, median [m]; 0
        where they claim none
    smoothed : whether such tracks come smoothed
    starts : (k+1,) first row of each throw
    left_out : why other throws are not here
    measurements : what the camera may have done to them
    lanes : where stones ran, in all throws of the session: those not searched wear the ice as well
    """

    throws: Indices
    orders: Indices
    stones: Indices
    clocks: Floats
    rests: NDArray[np.bool_]
    times: Floats
    xy: Floats
    theta: Floats
    swept: Floats
    sigma: Floats
    starts: Indices
    usual_spins: Floats
    claimed: float = 0.0
    smoothed: bool = False
    left_out: tuple[str, ...] = ()
    measurements: tuple[Form, ...] = MEASUREMENTS
    lanes: Lanes = field(default_factory=Lanes)

    def __len__(self) -> int:
        return len(self.throws)

    @property
    def errs_slowly(self) -> bool:
        """Whether the tracks may err by what lasts for seconds and by what belongs to a place.

        Only one that says how wrong it is can count in what all its frames share.
        """
        return self.claimed > 0.0

    def rows(self, i: int) -> slice:
        """Rows of the i-th throw."""
        return slice(int(self.starts[i]), int(self.starts[i + 1]))

    @cached_property
    def owner(self) -> Indices:
        """Index of the throw of each row, (rows,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.starts))

    @cached_property
    def observed(self) -> Floats:
        """Measured x, y, theta, (rows, 3)."""
        return np.column_stack([self.xy, self.theta])

    @cached_property
    def sweeps(self) -> tuple[Floats, Indices, Floats]:
        """Times at which sweeping switches, where each throw's begin, and whether swept first."""
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
        """Release states by quadratics through the first two seconds, (k, 6)."""
        states = np.zeros((len(self), 6))
        for i in range(len(self)):
            rows = self.rows(i)
            t = self.times[rows]
            early = t <= max(2.0, t[min(len(t) - 1, 20)])
            fit = np.polyfit(t[early], self.xy[rows][early], 2)
            states[i, 0:2], states[i, 2:4] = fit[2], fit[1]
            heading = self.theta[rows]
            known = early & np.isfinite(heading)
            states[i, 5] = self.usual_spins[i]
            if known.sum() > 10:
                states[i, 5], states[i, 4] = np.polyfit(t[known], heading[known], 1)
        return states

    @cached_property
    def turns(self) -> NDArray[np.bool_]:
        """Whether the heading of each throw was measured, (k,)."""
        known = np.isfinite(self.theta).astype(int)
        return np.add.reduceat(known, self.starts[:-1]) > FEWEST_HEADINGS

    def with_usual_spins(self) -> Session:
        """The session with the spins that are taken where no heading was seen.

        To the side to which its path bends, if the throws whose turn was seen clearly bend with it.
        """
        bends, sides = np.zeros(len(self)), np.zeros(len(self))
        for i in range(len(self)):
            rows = self.rows(i)
            t, xy, theta = self.times[rows], self.xy[rows], self.theta[rows]
            way = (xy[-1] - xy[0]) / max(float(np.hypot(*(xy[-1] - xy[0]))), 1e-9)
            bends[i] = np.polyfit(t, xy @ np.array([-way[1], way[0]]), 2)[0]
            known = np.flatnonzero(np.isfinite(theta))
            sides[i] = np.sign(theta[known[-1]] - theta[known[0]]) if len(known) > 1 else 0.0
        with_turn = (bends * sides)[self.turns]
        spins = np.full(len(self), USUAL_SPIN)
        if len(with_turn) > 2:
            error = float(with_turn.std()) / np.sqrt(len(with_turn))
            if abs(with_turn.mean()) > CLEARLY_BENT * error:
                spins = np.where(bends * with_turn.mean() < 0, -USUAL_SPIN, USUAL_SPIN)
        return replace(self, usual_spins=spins)

    def without_rows(self, wild: NDArray[np.bool_]) -> Session:
        """The session without some rows; the first of each throw stays, as does its release."""
        keep = ~wild
        counts = np.add.reduceat(keep.astype(int), self.starts[:-1])
        return replace(
            self,
            times=self.times[keep],
            xy=self.xy[keep],
            theta=self.theta[keep],
            swept=self.swept[keep],
            sigma=self.sigma[keep],
            starts=np.concatenate([[0], np.cumsum(counts)]).astype(np.intp),
        )

    def only(self, chosen: Sequence[int] | Indices) -> Session:
        """The session of some of its throws, by index; they keep their order of play."""
        chosen = np.asarray(chosen, dtype=np.intp)
        rows = np.concatenate(
            [np.arange(self.rows(i).start, self.rows(i).stop) for i in chosen.tolist()]
        )
        counts = np.diff(self.starts)[chosen]
        return replace(
            self,
            throws=self.throws[chosen],
            orders=self.orders[chosen],
            stones=self.stones[chosen],
            clocks=self.clocks[chosen],
            rests=self.rests[chosen],
            usual_spins=self.usual_spins[chosen],
            times=self.times[rows],
            xy=self.xy[rows],
            theta=self.theta[rows],
            swept=self.swept[rows],
            sigma=self.sigma[rows],
            starts=np.concatenate([[0], np.cumsum(counts)]).astype(np.intp),
        )


def open_session(tracks: Sequence[Trajectory], scene: Scene | None = None) -> Session:
    """The free slides of measured tracks.

    Parameters
    ----------
    scene : of the camera that saw them, where it is known

    Raises
    ------
    InputError : no throw lies on the sheet
    TrackTooShortError : no throw slides freely
    """
    cleaned = [without_wild_rows(track) for track in tracks]
    elsewhere = [_elsewhere(track) for track in cleaned]
    on_sheet = [track for track, reason in zip(cleaned, elsewhere, strict=True) if not reason]
    off_sheet = [reason for reason in elsewhere if reason]
    if not on_sheet and off_sheet:
        raise InputError(f"no throw lies on the sheet: {off_sheet[0]}")
    slides, reasons = free_slides(on_sheet)
    order_of = {throw: k for k, throw in enumerate(sorted({track.throw for track in tracks}))}
    claims = [s.track.sigma_xy[s.rows] for s in slides if s.track.sigma_xy.size]
    claimed = float(np.nanmedian(np.concatenate(claims))) if claims else 0.0
    smoothed = claimed > 0.0 and _are_smoothed(slides, claimed)
    spacing = SMOOTHED_SPACING if smoothed else 0.0
    pairs, blind = _with_heading([(slide, _thinned(slide, spacing)) for slide in slides])
    counts = [len(rows) for _, rows in pairs]
    sigma = [
        _relative(
            [column[rows] if column.size else np.full(len(rows), np.nan) for column, rows in c]
        )
        for c in (
            [(s.track.sigma_xy, rows) for s, rows in pairs],
            [(s.track.sigma_theta, rows) for s, rows in pairs],
        )
    ]
    return Session(
        throws=np.array([s.track.throw for s, _ in pairs], dtype=np.intp),
        orders=np.array([order_of[s.track.throw] for s, _ in pairs], dtype=np.intp),
        stones=np.array([s.track.stone for s, _ in pairs], dtype=np.intp),
        clocks=np.array([s.track.clock + s.track.t[rows[0]] for s, rows in pairs]),
        rests=np.array([s.rests for s, _ in pairs]),
        times=np.concatenate([s.track.t[rows] - s.track.t[rows[0]] for s, rows in pairs]),
        xy=np.concatenate([s.track.xy[rows] for s, rows in pairs]),
        theta=np.concatenate([s.track.theta[rows] for s, rows in pairs]),
        swept=np.concatenate([s.track.swept[rows] for s, rows in pairs]),
        sigma=np.column_stack(sigma),
        usual_spins=np.full(len(pairs), USUAL_SPIN),
        claimed=claimed,
        smoothed=smoothed,
        starts=np.concatenate([[0], np.cumsum(counts)]).astype(np.intp),
        left_out=(*off_sheet, *reasons, *blind),
        measurements=MEASUREMENTS if scene is None else measurements_through(scene),
        lanes=Lanes.of((order_of[track.throw], track.xy) for track in on_sheet),
    ).with_usual_spins()


def _with_heading(
    pairs: list[tuple[FreeSlide, Indices]],
) -> tuple[list[tuple[FreeSlide, Indices]], list[str]]:
    """Slides whose heading was seen, if these are enough, and why the others are left out.

    Which way a stone turned says which way it curls. Beside throws that show a curl, one of which
    this is not known would have to be wrong every other time.
    """
    seen = [pair for pair in pairs if _turns(*pair)]
    if len(seen) < ENOUGH_THROWS:
        return pairs, []
    blind = [slide.track.throw for slide, rows in pairs if not _turns(slide, rows)]
    return seen, [f"throw {k}: no heading was seen, nor which way it turned" for k in blind]


def _turns(slide: FreeSlide, rows: Indices) -> bool:
    return bool(np.isfinite(slide.track.theta[rows]).sum() > FEWEST_HEADINGS)


def _elsewhere(track: Trajectory) -> str:
    """Why a track cannot be of this sheet; empty if it can."""
    if len(track) == 0:
        return ""
    x, y = np.abs(np.median(track.xy, axis=0))
    if x > FURTHEST_ACROSS or y > FURTHEST_ALONG:
        place = f"around x = {np.median(track.xy[:, 0]):.1f}, y = {np.median(track.xy[:, 1]):.1f} m"
        return (
            f"throw {track.throw} runs off the sheet, {place}: of another sheet or another scene?"
        )
    return ""


def _relative(claims: Sequence[Floats]) -> Floats:
    """Claimed standard errors over their mean, 1 where there is none."""
    values = np.concatenate(claims)
    known = np.isfinite(values) & (values > 0)
    mean = float(values[known].mean()) if known.any() else 1.0
    return np.where(known, values / mean, 1.0)


def _are_smoothed(slides: Sequence[FreeSlide], claimed: float) -> bool:
    """Whether tracks jitter so much less from row to row than they claim to err."""
    jitter = [
        robust_deviation(fast_series(slide.track.t[slide.rows], slide.track.xy[slide.rows, axis]))
        for slide in slides
        for axis in range(2)
    ]
    return float(np.median(jitter)) < SMOOTHED * claimed


def _thinned(slide: FreeSlide, spacing: float) -> Indices:
    """Rows of a slide at least `spacing` apart, and no more than are needed."""
    rows = _from_hog_line(slide)
    t = slide.track.t[rows]
    step = (t[-1] - t[0]) / max(len(t) - 1, 1)
    every = max(1, round(1.0 / max(step, 1e-9) / FULL_RATE), int(spacing / max(step, 1e-9) + 0.5))
    return rows[::every]


def _from_hog_line(slide: FreeSlide) -> Indices:
    """Rows of a slide, from the delivery hog line on at the latest.

    The rules want the stone released before that line. A push that seems to end later is something
    else, such as a tracked point that winds about the centre, and is what is looked for here.
    """
    xy, rows = slide.track.xy, slide.rows
    way = 1.0 if xy[rows[-1], 1] >= xy[rows[0], 1] else -1.0
    beyond = np.flatnonzero(way * xy[: rows[0], 1] >= -HOG_LINE_Y - AT_LINE)
    return np.concatenate([beyond, rows]).astype(np.intp)
