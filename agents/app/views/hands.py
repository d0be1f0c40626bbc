"""How athletes throw, in words and in pictures that a page draws itself; and bars of intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from agents.app.club import Club, Session
from agents.app.views.coached import errors_of
from agents.app.work.causes import ComingError
from agents.coaching import AthleteErrors, ErrorSummary
from agents.coaching.athletes import Interval
from agents.planning.description import seconds_per_speed
from curling_env.ice import Ice, load_ice
from curling_env.physics.aim import Aim
from curling_env.sheet import Direction
from curling_env.throw import Throw
from curling_env.typing import Floats

WIDTH, HEIGHT = 360, 288
"""Size of a picture of a hand; the page scales it."""
MARGIN = 34
"""Around it, for the names of its axes."""


def interval_bar(value: float, low: float, high: float, reach: float) -> dict[str, float]:
    """A number with its interval on a bar from -reach to reach, as parts of a hundred."""

    def at(one: float) -> float:
        return round(50 + 47 * float(np.clip(one / reach, -1, 1)), 2)

    return {"value": at(value), "low": at(low), "high": at(high)}


def reach_of(hands: Sequence[tuple[Floats, ErrorSummary]]) -> tuple[float, float]:
    """Half the width [m] and height [m/s] of pictures that show several hands on one scale."""
    line, speed = [0.1], [0.01]
    for errors, overall in hands:
        seen = errors[np.isfinite(errors[:, :2]).all(axis=1)]
        ellipse = _half(seen, overall)
        line += [*np.abs(ellipse[:, 0]), *np.abs(seen[:, 1])]
        speed += [*np.abs(ellipse[:, 1]), *np.abs(seen[:, 0])]
    return 1.1 * float(max(line)), 1.1 * float(max(speed))


def hand_picture(
    errors: Floats, overall: ErrorSummary, reach: tuple[float, float]
) -> dict[str, Any]:
    """Errors of throws, and the ellipse that holds half of them, in places of a picture.

    Parameters
    ----------
    errors : (n, 3) of speed [m/s], line [m] and spin [rad/s]; NaN where one was not measured
    overall : their summary
    reach : see `reach_of`

    Returns
    -------
    points to draw: right of the broom to the right, faster upwards, and the ends of both axes
    """
    seen = errors[np.isfinite(errors[:, :2]).all(axis=1)]

    def placed(pairs: Floats) -> list[list[float]]:
        x = WIDTH / 2 + pairs[:, 0] / reach[0] * (WIDTH / 2 - MARGIN)
        y = HEIGHT / 2 - pairs[:, 1] / reach[1] * (HEIGHT / 2 - MARGIN)
        return np.column_stack([x, y]).round(1).tolist()

    return {
        "width": WIDTH,
        "height": HEIGHT,
        "margin": MARGIN,
        "dots": placed(seen[:, [1, 0]]),
        "half": " ".join(f"{x},{y}" for x, y in placed(_half(seen, overall))),
        "line": f"{100 * reach[0]:.0f} cm",
        "speed": reach[1],
    }


def _half(seen: Floats, overall: ErrorSummary) -> Floats:
    """The ellipse of a hand's spread, of the size that holds half of the throws seen, (m, 2)."""
    ellipse = overall.ellipse()
    centre = ellipse.mean(axis=0)
    shape = np.linalg.inv(2 * np.cov((ellipse - centre).T, bias=True))
    off = seen[:, [1, 0]] - centre
    size = float(np.sqrt(np.median(np.einsum("ni,ij,nj->n", off, shape, off)))) if len(seen) else 1
    return centre + size * (ellipse - centre)


def furthest(ends: Sequence[float], least: float) -> float:
    """The reach of bars that hold all these ends."""
    return max([least, *(abs(one) for one in ends)])


def hands_of(
    club: Club, sessions: list[Session], errors: Sequence[AthleteErrors]
) -> list[dict[str, Any]]:
    """How athletes throw, for a page: sentence, picture on one scale, tables.

    Parameters
    ----------
    sessions : those that the errors are of, the latest first
    """
    slope = _seconds_per_speed(load_ice(club.ice_of(sessions[0])))
    reach = reach_of([(one.errors, one.overall) for one in errors])
    ids = {one.name: one.id for one in club.athletes()}
    return [
        {
            "name": one.name,
            "id": ids.get(one.name),
            "seconds": slope is not None,
            "rows": [_row(group, slope) for group in (one.overall, *one.groups)],
            "sentence": _sentence(one, slope),
            "picture": _picture_of(one, slope, reach),
            "over": _over_sessions(club, one.name, sessions, slope),
        }
        for one in errors
    ]


def _seconds_per_speed(ice: Ice) -> float | None:
    """Change of the hog-to-hog time per unit of speed, at draw weight [s per m/s]."""
    speed = Aim(ice, Direction.AWAY).draw_weight()
    return None if speed is None else seconds_per_speed(ice, Throw(speed=speed), Direction.AWAY)


def _row(group: ErrorSummary, slope: float | None) -> dict[str, Any]:
    kind = " ".join(filter(None, (group.handle, group.weight))) or "all throws"
    return {
        "kind": kind,
        "throws": group.throws,
        "weight_bias": _weight(group.bias[0], slope, ("light", "heavy")),
        "weight_spread": _weight(group.spread[0], slope, None),
        "line_bias": _told(group.bias[1], 100, "cm", ("left", "right")),
        "line_spread": _told(group.spread[1], 100, "cm", None),
        "spin_bias": _told(group.bias[2], 1, "rad/s", ("less", "more"), digits=2),
        "spin_spread": _told(group.spread[2], 1, "rad/s", None, digits=2),
    }


def _weight(one: Interval, slope: float | None, words: tuple[str, str] | None) -> tuple[str, str]:
    """A speed as a time from hog line to hog line where that is known."""
    if slope is None:
        return _told(one, 100, "cm/s", words, digits=1)
    return _told(one, abs(slope), "s", words, digits=2)


def _told(
    one: Interval,
    factor: float,
    unit: str,
    words: tuple[str, str] | None,
    *,
    digits: int = 0,
) -> tuple[str, str]:
    """A number in words, and its 95 % interval."""
    value, low, high = (factor * end for end in one)
    if words is None:
        return f"{value:.{digits}f} {unit}", f"{low:.{digits}f} to {high:.{digits}f}"
    told = f"{abs(value):.{digits}f} {unit} {words[int(value > 0)]}"
    if low < 0 < high:
        told = "none seen"
    return told, f"{low:+.{digits}f} to {high:+.{digits}f}".replace("-", "−")


def _sentence(one: AthleteErrors, slope: float | None) -> str:
    """Summary of an athlete's throws, in one sentence."""
    group = _row(one.overall, slope)
    biases = [group[name][0] for name in ("weight_bias", "line_bias")]
    seen = [bias for bias in biases if bias != "none seen"]
    usual = " and ".join(seen) if seen else "neither light nor heavy, neither left nor right"
    return (
        f"On average {usual}; two of three throws within {group['weight_spread'][0]} of that weight"
        f" and {group['line_spread'][0]} of that line."
    )


def _picture_of(
    one: AthleteErrors, slope: float | None, reach: tuple[float, float]
) -> dict[str, Any]:
    made = hand_picture(one.errors, one.overall, reach)
    speed = float(made["speed"])
    faster = f"{100 * speed:.0f} cm/s" if slope is None else f"{abs(slope) * speed:.2f} s"
    return {**made, "faster": faster}


def _over_sessions(
    club: Club, name: str, sessions: list[Session], slope: float | None
) -> list[dict[str, Any]]:
    """Return the spread of an athlete's weight and line in each session, the latest first."""
    if len(sessions) < 2:
        return []
    rows: list[dict[str, Any]] = []
    for session in sessions:
        try:
            errors, _ = errors_of(club, [session], only_kept=True)
        except ComingError:
            continue
        found = next((one for one in errors if one.name == name), None)
        if found is not None:
            rows.append({"session": f"{session.name}, {session.day}"} | _row(found.overall, slope))
    return rows
