"""Hands of athletes on a page: a sentence, tables, and a picture of all on one scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from agents.app.club import Club, Session
from agents.app.work.causes import ComingError, errors_of
from agents.coaching import AthleteErrors
from agents.coaching.in_words import athletes_in_words, athletes_rows
from curling_env.typing import Floats
from curling_env.units import short_length, speed

WIDTH, HEIGHT = 360, 288
"""Size of a picture of a hand; the page scales it."""
MARGIN = 34
"""Around it, for the names of its axes."""


def hands_of(
    club: Club, sessions: Sequence[Session], errors: Sequence[AthleteErrors]
) -> list[dict[str, Any]]:
    """Describe hands of athletes for a page.

    Parameters
    ----------
    sessions : those that the errors are of, the latest first
    """
    ids = {one.name: one.id for one in club.athletes()}
    # Throws, and the ellipse that holds half of them: line [m] and speed [m/s].
    shown = [(one, np.concatenate([_seen(one), _half(one)])) for one in errors]
    reach = 1.1 * np.max([np.abs(points).max(axis=0) for _, points in shown], axis=0)
    known = [one.seconds_per_speed for one in errors if one.seconds_per_speed is not None]
    each = float(np.median(known)) if known else None
    over = [
        (f"{session.name}, {session.day}", own)
        for session in sessions
        for own in _kept_errors(club, session)
    ]
    return [
        {
            "name": one.name,
            "id": ids.get(one.name),
            "rows": athletes_rows([one]),
            "sentence": _sentence(one),
            "picture": _picture(one, points, np.maximum(reach, (0.1, 0.01)), each),
            "over": _over_sessions([(about, own) for about, own in over if own.name == one.name]),
            "charts": _charts([own for _, own in over if own.name == one.name][::-1]),
        }
        for one, points in shown
    ]


def _sentence(one: AthleteErrors) -> str:
    """Usual errors and scatter of an athlete."""
    weight, line, _ = one.overall.spread
    each = one.seconds_per_speed
    scatter = speed(weight.value) if each is None else f"{abs(each) * weight.value:.2f} s"
    return (
        f"{athletes_in_words([one])[0]} Two of three throws are within {scatter} of the usual "
        f"weight and {short_length(line.value)} of the usual line."
    )


def _seen(one: AthleteErrors) -> Floats:
    return one.errors[np.isfinite(one.errors[:, :2]).all(axis=1)][:, [1, 0]]


def _half(one: AthleteErrors) -> Floats:
    """The ellipse of a hand's spread, of the size that holds half of the throws seen, (m, 2)."""
    ellipse, seen = one.overall.ellipse(), _seen(one)
    centre = ellipse.mean(axis=0)
    shape = np.linalg.inv(2 * np.cov((ellipse - centre).T, bias=True))
    off = seen - centre
    size = float(np.sqrt(np.median(np.einsum("ni,ij,nj->n", off, shape, off)))) if len(seen) else 1
    return centre + size * (ellipse - centre)


def _picture(
    one: AthleteErrors, points: Floats, reach: Floats, each: float | None
) -> dict[str, Any]:
    """Places in a picture: right of the broom to the right, faster upwards; and its axes' ends."""
    half = np.array([WIDTH, HEIGHT]) / 2
    placed = (half + points / reach * (half - MARGIN) * [1, -1]).round(1).tolist()
    count = len(_seen(one))
    return {
        "width": WIDTH,
        "height": HEIGHT,
        "margin": MARGIN,
        "dots": placed[:count],
        "half": " ".join(f"{x},{y}" for x, y in placed[count:]),
        "line": short_length(reach[0]),
        "faster": speed(reach[1]) if each is None else f"{abs(each) * reach[1]:.2f} s",
    }


def _kept_errors(club: Club, session: Session) -> list[AthleteErrors]:
    """Return the errors of athletes in a session; nothing while they are not known."""
    try:
        return errors_of(club, [session], only_kept=True)[0]
    except ComingError:
        return []


def _charts(errors: Sequence[AthleteErrors]) -> list[dict[str, Any]]:
    """Usual error of weight and of line by session, the earliest first, with 95 % intervals."""
    charts: list[dict[str, Any]] = []
    for k, (name, up, down) in enumerate((("Weight", "heavy", "light"), ("Line", "right", "left"))):
        usual = [
            [end * (1.0 if k else abs(one.seconds_per_speed or 0.0)) for end in one.overall.bias[k]]
            for one in errors
        ]
        most = max((abs(end) for one in usual for end in one), default=0.0)
        if len(errors) > 1 and most > 0:
            far = short_length(most) if k else f"{most:.1f} s"
            points = [[round(50 - 46 * end / most, 1) for end in one] for one in usual]
            charts.append(
                {"name": name, "up": f"{far} {up}", "down": f"{far} {down}", "points": points}
            )
    return charts


def _over_sessions(errors: Sequence[tuple[str, AthleteErrors]]) -> Any:
    """Return an athlete's errors by session as rows, the latest first; None for one alone."""
    found = [replace(one, name=about, groups=()) for about, one in errors]
    return athletes_rows(found) if len(found) > 1 else None
