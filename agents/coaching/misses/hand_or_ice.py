"""Hand or ice: how much of a miss was the release, how much ice that was read wrong.

Two throws are compared on two ices. The throw that was meant does what was called on the ice that
the team believed in. The throw that was made runs on the ice that the session's tracks show. From
the one to the other the weight, the line, the rotation and the ice change. What each of them does
to the place of rest depends on the order in which they change; the parts are the means over all
orders (Shapley's value), so that they add up. What the throw that was made, run on the session's
ice, leaves of the measured rest, none of them explains.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import factorial

import numpy as np

from agents.coaching.misses.causes import (
    Cause,
    HandError,
    Part,
    SessionCauses,
    ThrowCauses,
    part_of,
    pattern_of,
)
from agents.coaching.misses.habits import Habits, habits_of
from agents.coaching.misses.intended import intend
from agents.coaching.misses.released import Released, read_release
from agents.coaching.misses.session_ice import IceBefore, SessionIce
from agents.coaching.misses.shared_ice import Parts, agree
from agents.coaching.runs import ANGLE, HOG_TO_FAR_TEE, SPEED, SPIN, X, hog_times, outcomes
from agents.coaching.throw_sheet import ALL_RIGHT, Hands, ThrowSheet, sheet_of, spin_sign
from agents.coaching.tuning import DRAWS, MAX_REACH
from curling_env.errors import InputError, TrackTooShortError
from curling_env.ice import Ice
from curling_env.physics.ice_remarks import NO_CURL, UNKNOWN, is_marked_unknown, lacks_curl
from curling_env.sheet import to_delivery
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory
from curling_env.typing import Flags, Floats, Progress, no_progress
from friction_estimation.tracks.free_slide import free_slide
from friction_estimation.tracks.throw_list import NO_NOTES, ThrowNote
from friction_estimation.tracks.throw_table import (
    Measured,
    measure_throw,
    rows_until,
    thrown_stones,
)

NOT_GIVEN = (
    "the ice that the team believed in was not given: misses are laid to the hand against the "
    "session's ice, and to ice that was read wrong only where a broom or a time was called"
)


def hand_or_ice(
    tracks: Sequence[Trajectory],
    ice: Ice,
    notes: Mapping[int, ThrowNote] = NO_NOTES,
    *,
    believed: Ice | None = None,
    hands: Hands = ALL_RIGHT,
    seed: int = 0,
    progress: Progress = no_progress,
) -> SessionCauses:
    """Tell for each throw with a called target why it missed.

    Parameters
    ----------
    tracks : of one session, in order of play
    ice : the ice as the session's tracks show it, with its standard errors
    notes : who threw what, and what was called (`throws_beside`)
    believed : the ice that the team planned with; None if it is not known
    hands : of the athletes
    seed : seed of the errors drawn
    progress : called with the number of throws done

    Raises
    ------
    InputError : an ice with an effect that is not in the catalogue
    """
    rng = np.random.default_rng(seed)
    read, left_out = _read(tracks, ice, notes, hands, rng, progress)
    habits = habits_of([(one.sheet, one.released) for one in read])
    told: list[_Causes] = []
    parts: list[Parts] = []
    for one in read:
        try:
            causes = _Causes(one, believed, habits, rng)
            parts.append(causes.parts())
            told.append(causes)
        except InputError as error:
            left_out[one.sheet.throw] = error.problem
    together = agree(parts, rng)
    found = [causes.result(one) for causes, one in zip(told, together.parts, strict=True)]
    return SessionCauses(
        throws=tuple(found),
        left_out=dict(sorted(left_out.items())),
        pattern=pattern_of(found),
        athletes=tuple(
            pattern
            for name in dict.fromkeys(one.athlete for one in found)
            if name and (pattern := pattern_of(found, name)) is not None
        ),
        believed=believed is not None,
        remarks=_remarks(ice, believed, found, together.remark),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Read:
    """A throw whose causes can be told.

    Parameters
    ----------
    sheet : what is known of it
    released : what left the hand
    ended, sigma : where it came to rest, or crossed the line of its target, (2,) [m]
    ices : the ice that it found
    """

    sheet: ThrowSheet
    released: Released
    ended: Floats
    sigma: Floats
    ices: IceBefore


def _read(
    tracks: Sequence[Trajectory],
    ice: Ice,
    notes: Mapping[int, ThrowNote],
    hands: Hands,
    rng: np.random.Generator,
    progress: Progress,
) -> tuple[list[_Read], dict[int, str]]:
    """The throws whose causes can be told, and why others have none."""
    session = SessionIce(ice, rng)
    read: list[_Read] = []
    left_out: dict[int, str] = {}
    thrown = list(thrown_stones(tracks))
    for order, (track, contacts) in enumerate(thrown):
        progress("throws", order, len(thrown))
        try:
            sheet = sheet_of(measure_throw(track, contacts), notes, hands)
            why = _why_not(sheet)
            if why is None:
                released = read_release(
                    track,
                    session.now.ice,
                    contacts=contacts,
                    order=order,
                    others=session.now.others,
                )
                ended, sigma = _ending(sheet, track, contacts)
                read.append(
                    _Read(
                        sheet=sheet, released=released, ended=ended, sigma=sigma, ices=session.now
                    )
                )
            else:
                left_out[track.throw] = why
        except TrackTooShortError as error:
            left_out[track.throw] = error.problem.removeprefix(f"throw {track.throw}: ")
        session.ran(track.xy)
    progress("throws", len(thrown), len(thrown))
    return read, left_out


def _why_not(sheet: ThrowSheet) -> str | None:
    """Why a throw's miss cannot be told; None where it can."""
    call, one = sheet.call, sheet.measures
    if call is None:
        return "nothing was called that is read as a call" if sheet.note.called else "no call"
    if call.target is None:
        return "the call names no target"
    if call.rests and one.touched:
        return "it touched another stone"
    if call.rests and (one.right is None or one.past is None):
        return "it was not seen to come to rest"
    return None


def _ending(
    sheet: ThrowSheet, track: Trajectory, contacts: Sequence[float]
) -> tuple[Floats, Floats]:
    """Where a throw rested, or crossed the line of its target, and standard errors (2,) [m]."""
    call, one = sheet.call, sheet.measures
    assert call is not None  # see _why_not
    assert call.target is not None
    if call.rests:
        assert one.right is not None
        assert one.past is not None
        ends = [one.right, one.past]
        return (
            np.array([end.value for end in ends]),
            np.array([end.sigma or 0.0 for end in ends]),
        )
    line = call.target[1]
    first = rows_until(track, min((t for t in contacts if t > track.t[0]), default=np.inf))
    slide = free_slide(first)
    xy = to_delivery(slide.xy, one.direction)
    past = np.flatnonzero(xy[:, 1] >= line)
    last = int(past[0]) if past.size else len(xy) - 1
    if line - xy[last, 1] > MAX_REACH:
        raise TrackTooShortError("it was not seen to come near its target")
    near = slice(max(0, last - 15), last + 1)
    across = np.polynomial.polynomial.polyfit(xy[near, 1] - line, xy[near, 0], 1)
    stated = track.sigma_xy[slide.rows[last]] if track.sigma_xy.size else slide.noise
    return np.array([float(across[0]), line]), np.array([float(np.nan_to_num(stated)), 0.0])


class _Causes:
    """The causes of one throw's miss."""

    def __init__(
        self, read: _Read, believed: Ice | None, habits: Habits, rng: np.random.Generator
    ) -> None:
        assert read.sheet.call is not None  # see _why_not
        self._read, self._call, self._rng = read, read.sheet.call, rng
        self._is_believed = believed is not None
        self._believed = read.ices.ice if believed is None else believed
        self._place, made = read.released.place, read.released.throw
        handle = self._call.handle
        sign = float(np.sign(made[SPIN])) or 1.0
        sign = sign if handle is None else spin_sign(handle, read.sheet.hand)
        usual = habits.spin(read.sheet.athlete)
        self._spin_sigma = 0.0 if usual is None else usual.sigma or 0.0
        self._sign = sign
        speed = habits.speed(read.sheet.athlete, self._call)
        self._speed = float(made[SPEED]) if speed is None else speed.value
        self._speed_meant = (
            self._call.rests or speed is not None or self._call.hog_to_hog is not None
        )
        self._spin_meant = usual is not None or self._call.turns is not None
        self._meant = intend(
            self._call,
            self._believed,
            self._place,
            spin=sign * (abs(float(made[SPIN])) if usual is None else usual.value),
            x=float(made[X]),
            speed=self._speed,
        )
        self._line = None if self._call.rests else float(np.array(self._call.target)[1])
        swept = read.released.sweep[1] > read.released.sweep[0]
        self._swept = swept and read.ices.ice.effect("sweeping") is not None
        self._names: list[Cause] = ["weight", "line", "rotation", "ice"]
        if self._swept:
            self._names.append("sweeping")

    def parts(self) -> Parts:
        """What each cause adds to the miss, and what none explains.

        Raises
        ------
        TrackTooShortError : a throw like it does not get to the target
        """
        read, target = self._read, np.array(self._call.target)
        made, meant = read.released.throw, self._meant.throw
        value = self._parts(made[None], meant[None], [read.ices.ice])[0]
        value = np.vstack([value, read.ended - target - value.sum(axis=0)])
        if not np.isfinite(value).all():
            raise TrackTooShortError("a throw like it does not get to the target on these ices")
        draws = self._draws()
        return Parts(value=value, draws=np.where(np.isfinite(draws), draws, value))

    def result(self, parts: Parts) -> ThrowCauses:
        """All of it, from the parts."""
        read, target = self._read, np.array(self._call.target)
        miss = read.ended - target
        names: list[Cause] = [*self._names, "neither"]
        found: dict[Cause, Part] = {
            name: part_of(parts.value[k], parts.draws[:, k], miss) for k, name in enumerate(names)
        }
        return ThrowCauses(
            sheet=read.sheet,
            target=target,
            rest=read.ended,
            miss=miss,
            parts=found,
            errors=self._errors(),
            intended=_throw(self._meant.throw),
            released=_throw(read.released.throw),
            draws=parts.draws,
        )

    def _draws(self) -> Floats:
        """Parts under errors of the release, of the rest, of the ice and of what was meant."""
        read, n = self._read, DRAWS
        made = _paired(self._rng, read.released.covariance, n)
        others = list(read.ices.others)
        chosen = [others[k % len(others)] for k in range(n)]
        # What was meant follows from where the stone crossed the line, and from the usual turn.
        wander = np.column_stack(
            [self._sign * self._spin_sigma * self._rng.standard_normal(n), made[:, X]]
        )
        meant = self._meant.throw + wander @ self._meant.slopes.T
        value = self._parts(read.released.throw + made, meant, chosen)
        ended = read.ended + read.sigma * self._rng.standard_normal((n, 2))
        target = np.array(self._call.target)
        neither = ended - target - value.sum(axis=1)
        return np.concatenate([value, neither[:, None]], axis=1)

    def _parts(self, made: Floats, meant: Floats, ices: Sequence[Ice]) -> Floats:
        """What each cause adds, (n, causes, 2), for n throws that were made and meant (n, 4).

        Parameters
        ----------
        ices : n ices of the session
        """
        n, causes = len(made), len(self._names)
        chosen = _subsets(causes)
        weights = _shapley(causes)
        throws = np.repeat(meant[:, None], len(chosen), axis=1)
        for k, column in enumerate((SPEED, ANGLE, SPIN)):
            throws[:, chosen[:, k], column] = made[:, None, column]
        throws[:, :, X] = made[:, None, X]
        kinds = list(dict.fromkeys(map(id, ices)))
        by_id = {id(ice): ice for ice in ices}
        surfaces = [self._believed, *(by_id[kind] for kind in kinds)]
        index = np.array([1 + kinds.index(id(ice)) for ice in ices])
        # Without another ice the team is taken to know the session's, whichever that is.
        on_session = chosen[None, :, 3] | (not self._is_believed)
        which = np.where(on_session, index[:, None], 0)
        sweeps = np.zeros((n, len(chosen), 2))
        if self._swept:
            sweeps[:, chosen[:, 4]] = self._read.released.sweep
        ends = outcomes(
            surfaces,
            throws.reshape(-1, 4),
            self._place,
            self._line,
            which=which.ravel(),
            sweeps=sweeps.reshape(-1, 2),
        ).reshape(n, len(chosen), 2)
        parts = np.einsum("cs,nsk->nck", weights, ends)
        off = ends[:, 0] - np.array(self._call.target)
        # A broom or a time that does not do on the believed ice what was called was read wrong too.
        line, weight = 3, 3
        if not self._is_believed:
            # Else on other ice another throw would have been meant: the hand is held against that.
            line = 3 if self._call.broom is not None else 1
            weight = 3 if self._call.hog_to_hog is not None else 0
        parts[:, line, 0] += off[:, 0]
        parts[:, weight, 1] += off[:, 1]
        return parts

    def _errors(self) -> HandError:
        read, made, meant = self._read, self._read.released.throw, self._meant
        # Speed, line and spin that were made less those that were meant, by the throw made.
        cos = np.cos(made[ANGLE])
        of_made = np.zeros((3, 4))
        of_made[0, SPEED], of_made[2, SPIN] = 1.0, self._sign
        of_made[1, ANGLE] = -HOG_TO_FAR_TEE / cos**2
        of_meant = of_made.copy()
        by_x = of_meant @ meant.slopes[:, 1]
        slopes = of_made.copy()
        slopes[:, X] -= by_x
        covariance = slopes @ read.released.covariance @ slopes.T
        by_spin = of_meant @ meant.slopes[:, 0] * self._spin_sigma
        covariance = covariance + np.outer(by_spin, by_spin)
        apart = made - meant.throw
        value = np.array(
            [
                apart[SPEED],
                -HOG_TO_FAR_TEE * (np.tan(made[ANGLE]) - np.tan(meant.throw[ANGLE])),
                self._sign * apart[SPIN],
            ]
        )
        sigma = np.sqrt(np.diag(covariance))
        measured = [Measured(float(v), float(s)) for v, s in zip(value, sigma, strict=True)]
        seconds = None
        if self._speed_meant:
            both = np.vstack([made, made])
            both[1, SPEED] = meant.throw[SPEED]
            took = hog_times(read.ices.ice, both, self._place)
            if np.isfinite(took).all() and abs(apart[SPEED]) > 1e-6:
                change = float(took[0] - took[1])
                per_speed = change / float(apart[SPEED])
                seconds = Measured(change, abs(per_speed) * float(sigma[0]))
        return HandError(
            speed=measured[0] if self._speed_meant else None,
            seconds=seconds,
            line=measured[1],
            spin=measured[2] if self._spin_meant and read.released.spin_seen else None,
            covariance=np.asarray(covariance, dtype=np.float64),
        )


def _paired(rng: np.random.Generator, covariance: Floats, n: int) -> Floats:
    """Errors (n, 4) of this covariance; the second half is the first with the other sign."""
    values, vectors = np.linalg.eigh(covariance)
    half = rng.standard_normal((n // 2, 4)) * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
    return np.concatenate([half, -half])


@lru_cache(maxsize=4)
def _subsets(count: int) -> Flags:
    """All choices of `count` causes, (2^count, count); the first has none."""
    return (np.arange(2**count)[:, None] >> np.arange(count)) % 2 == 1


@lru_cache(maxsize=4)
def _shapley(count: int) -> Floats:
    """Weights (count, 2^count) that give from the outcomes of all choices each cause's part."""
    chosen = _subsets(count)
    weights = np.zeros((count, len(chosen)))
    for row, others in enumerate(chosen):
        for cause in np.flatnonzero(~others):
            size = int(others.sum())
            share = factorial(size) * factorial(count - size - 1) / factorial(count)
            weights[cause, row] -= share
            weights[cause, row | (1 << int(cause))] += share
    return weights


def _throw(row: Floats) -> Throw:
    return Throw(
        speed=float(row[SPEED]), angle=float(row[ANGLE]), spin=float(row[SPIN]), x=float(row[X])
    )


def _remarks(
    ice: Ice, believed: Ice | None, found: Sequence[ThrowCauses], shared: str | None
) -> tuple[str, ...]:
    """What a reader should know."""
    remarks = [NOT_GIVEN] if believed is None else []
    if lacks_curl(ice):
        remarks.append(NO_CURL)
    if is_marked_unknown(ice):
        remarks.append(UNKNOWN)
    if shared is not None:
        remarks.append(shared)
    if not found:
        remarks.append("no throw has a called target and was seen from the hog line to its rest")
    return tuple(remarks)
