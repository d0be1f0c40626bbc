"""Throws whose misses can be explained: release, ending, and ice of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agents.coaching.misses.ices import IceBefore, SessionIce
from agents.coaching.misses.released import Released, read_release
from agents.coaching.throw_sheet import Hands, ThrowSheet, sheet_of
from agents.coaching.tuning import MAX_REACH
from curling_env.errors import TrackTooShortError
from curling_env.ice import Ice
from curling_env.sheet import to_delivery
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Progress
from friction_estimation.tracks.free_slide import free_slide
from friction_estimation.tracks.throw_list import ThrowNote
from friction_estimation.tracks.throw_table import measure_throw, rows_until, thrown_stones


@dataclass(frozen=True, kw_only=True, eq=False)
class SeenThrow:
    """Throw whose miss can be explained.

    Parameters
    ----------
    sheet : its measures and notes
    released : its release
    ended, sigma : its place of rest, or crossing of its target's line, and standard errors, (2,)
        [m]
    ices : the ice before it
    """

    sheet: ThrowSheet
    released: Released
    ended: Floats
    sigma: Floats
    ices: IceBefore


def see_throws(
    tracks: Sequence[Trajectory],
    ice: Ice,
    notes: Mapping[int, ThrowNote],
    hands: Hands,
    rng: np.random.Generator,
    progress: Progress,
) -> tuple[list[SeenThrow], dict[int, str]]:
    """Return the throws whose misses can be explained, and why others cannot."""
    session = SessionIce(ice, rng)
    read: list[SeenThrow] = []
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
                    SeenThrow(
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
    """Return the reason why a throw's miss cannot be explained; None if it can."""
    call, one = sheet.call, sheet.measures
    if call is None:
        return "its call cannot be read" if sheet.note.called else "no call"
    if call.target is None:
        return "the call names no target"
    if call.rests and one.touched:
        return "it touched another stone"
    if call.rests and (one.right is None or one.past is None):
        return "its place of rest was not seen"
    return None


def _ending(
    sheet: ThrowSheet, track: Trajectory, contacts: Sequence[float]
) -> tuple[Floats, Floats]:
    """Return a throw's place of rest, or crossing of its target's line, and standard errors (2,)
    [m].
    """
    call, one = sheet.call, sheet.measures
    assert call is not None  # checked by _why_not
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
    slide = free_slide(first, ())
    xy = to_delivery(slide.xy, one.direction)
    past = np.flatnonzero(xy[:, 1] >= line)
    last = int(past[0]) if past.size else len(xy) - 1
    if line - xy[last, 1] > MAX_REACH:
        raise TrackTooShortError("it was not seen near its target")
    near = slice(max(0, last - 15), last + 1)
    across = np.polynomial.polynomial.polyfit(xy[near, 1] - line, xy[near, 0], 1)
    stated = track.sigma_xy[slide.rows[last]] if track.sigma_xy.size else slide.noise
    return np.array([float(across[0]), line]), np.array([float(np.nan_to_num(stated)), 0.0])
