"""Film of a recorded game, seen from above as in a broadcast."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from curling_env.envs.game.rendering import FAULT_TEXT, colour_of
from curling_env.errors import InputError
from curling_env.game.rules.delivery import Fault
from curling_env.ice import Ice
from curling_env.physics.engine import Outcome, Status, StoneState
from curling_env.render import DrawnScene, SheetRenderer, drawn_stones, playback_frames
from curling_env.sheet import HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import handles
from curling_env.trajectory import Trajectory
from curling_env.typing import Image, Progress, no_progress
from curling_env.units import Units, side
from curling_env.units import speed as speed_in

FPS = 30.0
"""Frame rate of a film [1/s]."""
SPEED = 8.0
"""Playback speed: the 25 s of a draw take three."""
HOLD = 0.8
"""Display time of a position after a ruling, or at the end of an end [s]."""


def deliveries_of(
    lines: Sequence[dict[str, Any]], ends: Collection[int] | None = None
) -> list[dict[str, Any]]:
    """Return the recorded deliveries of some ends, or of all.

    Parameters
    ----------
    lines : lines of the game, from `record.read_record`
    ends : numbers of the ends, from 1; None for all

    Raises
    ------
    InputError : an end that was not played
    """
    deliveries = list(lines[1:-1])
    if ends is None:
        return deliveries
    played = {int(line["end"]) for line in deliveries}
    missing = sorted(set(ends) - played)
    if missing:
        raise InputError(f"end {missing[0]} was not played; expected 1 to {max(played, default=0)}")
    return [line for line in deliveries if line["end"] in ends]


def frames_of(
    lines: Sequence[dict[str, Any]],
    ice: Ice,
    *,
    ends: Collection[int] | None = None,
    speed: float = SPEED,
    fps: float = FPS,
    units: Units = Units.METRES,
) -> Iterator[tuple[int, Image]]:
    """Yield the frames of a recorded game, each with the number of its delivery among those shown.

    Parameters
    ----------
    lines : lines of the game, from `record.read_record`
    ice : ice whose friction is painted under the lines
    ends : numbers of the ends to show, from 1; None for all
    speed : playback speed over real time
    fps : frame rate of the film [1/s]
    units : units of displayed lengths

    Yields
    ------
    the number of the delivery from 0, and an RGB frame (720, 1280, 3)
    """
    if not speed > 0 or not fps > 0:
        raise InputError(f"speed and fps must be above 0, got {speed:g} and {fps:g}")
    pictures: dict[Direction, SheetRenderer] = {}
    for number, (line, headings) in enumerate(_with_headings(deliveries_of(lines, ends))):
        direction = Direction[line["direction"].upper()]
        if direction not in pictures:
            pictures[direction] = SheetRenderer(ice, direction)
        picture = pictures[direction]
        scene = _scene(lines, line, units)
        before = _stones(line["before"], headings)
        outcome = _outcome(line, before)
        frames = playback_frames(picture, scene, before, outcome, colour_of, fps=fps, speed=speed)
        for frame in frames:
            yield number, frame
        if line["fault"] is not None or "score_of_end" in line:
            lying = _stones(line["lying"], _turned(headings, line))
            after = picture.draw(
                replace(_after(lines, line, units), stones=drawn_stones(lying, colour_of))
            )
            for _ in range(round(HOLD * fps)):
                yield number, after


def write_film(
    path: str | Path,
    lines: Sequence[dict[str, Any]],
    ice: Ice,
    *,
    ends: Collection[int] | None = None,
    speed: float = SPEED,
    units: Units = Units.METRES,
    progress: Progress = no_progress,
) -> None:
    """Write a recorded game as a film, completely or not at all.

    Parameters
    ----------
    path : film file to write
    lines, ice, ends, speed, units : see `frames_of`
    progress : called with the number of written deliveries

    Raises
    ------
    InputError : an end that was not played, or a speed that is not above 0
    """
    from friction_estimation.film.writer import film_writer

    total = len(deliveries_of(lines, ends))
    with film_writer(path, SheetRenderer.size, FPS) as film:
        for number, frame in frames_of(lines, ice, ends=ends, speed=speed, units=units):
            progress("filming", number, total)
            film.write(np.ascontiguousarray(frame[..., ::-1]))  # OpenCV films are BGR


# --- from the record to the renderer --------------------------------------------------------------


def _with_headings(
    deliveries: Sequence[dict[str, Any]],
) -> Iterator[tuple[dict[str, Any], dict[int, float]]]:
    """Add the headings of the resting stones, which a record does not contain, to each delivery."""
    headings: dict[int, float] = {}
    end = None
    for line in deliveries:
        if line["end"] != end:
            headings, end = {}, line["end"]
        yield line, headings
        headings = _turned(headings, line)


def _turned(headings: dict[int, float], line: dict[str, Any]) -> dict[int, float]:
    """Return the headings after a delivery; the headings of a path begin at 0."""
    if line["fault"] is not None:
        return headings
    turned = {path["stone"]: path["theta"][-1] for path in line["paths"]}
    return headings | {k: headings.get(k, 0.0) + theta for k, theta in turned.items()}


def _stones(lying: Sequence[dict[str, Any]], headings: dict[int, float]) -> list[StoneState]:
    return [
        StoneState(x=s["x"], y=s["y"], stone=s["stone"], theta=headings.get(s["stone"], 0.0))
        for s in lying
    ]


def _outcome(line: dict[str, Any], before: Sequence[StoneState]) -> Outcome:
    """Return the outcome of a delivery, with the resting stones first and the delivered one last.

    Raises
    ------
    InputError : the delivered stone has no path
    """
    paths = {path["stone"]: path for path in line["paths"]}
    new = sorted(paths.keys() - {stone.stone for stone in before})
    if len(new) != 1:
        raise InputError(
            f"end {line['end']}, stone {line['stone']} has no path of the delivered stone"
        )
    thrown = StoneState(x=0.0, y=0.0, stone=new[0])
    stones: list[StoneState] = []
    status: list[Status] = []
    ends: list[float] = []
    for stone in (*before, thrown):
        path = paths.get(stone.stone)
        if path is None:
            stones.append(stone)
            status.append(Status.REST)
            ends.append(0.0)
            continue
        x, y, theta = (float(path[name][-1]) for name in ("x", "y", "theta"))
        stones.append(StoneState(x=x, y=y, theta=stone.theta + theta, stone=stone.stone))
        status.append(Status(path["status"]))
        ends.append(float(path["t"][-1]))
    lay = (*before, thrown)
    moved = [stone for stone, end in zip(lay, ends, strict=True) if end > 0]
    return Outcome(
        stones=tuple(stones),
        status=tuple(status),
        time=float(line["time"]),
        ends=tuple(ends),
        contacts=(),
        trajectories=tuple(_trajectory(paths[stone.stone], stone.theta) for stone in moved),
    )


def _trajectory(path: dict[str, Any], heading: float) -> Trajectory:
    return Trajectory(
        t=np.array(path["t"], dtype=np.float64),
        xy=np.column_stack([path["x"], path["y"]]).astype(np.float64),
        theta=np.array(path["theta"], dtype=np.float64) + heading,
        stone=int(path["stone"]),
    )


def _scene(
    lines: Sequence[dict[str, Any]], line: dict[str, Any], units: Units, end: int | None = None
) -> DrawnScene:
    """Return title and facts of a delivery, with the score before an end: by default before its
    own.
    """
    head, thrown = lines[0], line["thrown"]
    home, away = _score_before(lines, int(line["end"]) if end is None else end)
    facts = [
        (f"Red: {_name(head, 'home')}", str(home)),
        (f"Yellow: {_name(head, 'away')}", str(away)),
        ("Hammer", _name(head, line["hammer"])),
        ("Stone", str(line["stone"])),
        ("To throw", _name(head, line["team"])),
        ("Shot", line["shot"] or "a throw"),
        ("Weight", _weight(line, units)),
        ("Broom", side(_broom(line), units)),
        ("Handle", handles(thrown["spin"])[0]),
    ]
    score = f"{_name(head, 'home')} {home} : {away} {_name(head, 'away')}"
    return DrawnScene(title=f"End {line['end']}   {score}", facts=facts)


def _after(lines: Sequence[dict[str, Any]], line: dict[str, Any], units: Units) -> DrawnScene:
    """Return the same after it, with the ruling, or with the points of an end counted."""
    ended = "score_of_end" in line
    scene = _scene(lines, line, units, int(line["end"]) + 1 if ended else None)
    title = scene.title
    if line["fault"] is not None:
        title += f"   ·   {FAULT_TEXT[Fault(line['fault'])]}"
    if ended:
        home, away = line["score_of_end"]
        scorer = _name(lines[0], "home" if home else "away")
        title += "   ·   " + ("blank end" if home == away else f"{scorer} scores {home or away}")
    return replace(scene, title=title)


def _name(head: dict[str, Any], team: str) -> str:
    """Return a team's label: the player's name and its side."""
    return f"{head[team]} ({team})"


def _weight(line: dict[str, Any], units: Units) -> str:
    """Return the hog-to-hog time, or the speed of a stone that stops or hits before."""
    thrown = line["thrown"]
    path = max(line["paths"], key=lambda path: path["t"][-1] - path["t"][0], default=None)
    lain = {stone["stone"] for stone in line["before"]}
    path = next((path for path in line["paths"] if path["stone"] not in lain), path)
    if path is not None:
        way = Direction[line["direction"].upper()]
        ahead = way * np.array(path["y"], dtype=np.float64)
        past = np.flatnonzero(ahead >= HOG_LINE_Y)
        if past.size and past[0] > 0 and ahead[0] < HOG_LINE_Y:
            t = np.array(path["t"], dtype=np.float64)
            k = int(past[0]) + 1
            near, far = np.interp([-HOG_LINE_Y, HOG_LINE_Y], ahead[:k], t[:k])
            return f"{far - near:.1f} s hog to hog"
    return speed_in(thrown["speed"], units)


def _broom(line: dict[str, Any]) -> float:
    """Return the position of the broom on the far tee line, right of the centre line [m]."""
    thrown, lain = line["thrown"], {stone["stone"] for stone in line["before"]}
    start = next((abs(p["y"][0]) for p in line["paths"] if p["stone"] not in lain), HOG_LINE_Y)
    return float(thrown.get("x", 0.0) - (start + TEE_Y) * np.tan(thrown["angle"]))


def _score_before(lines: Sequence[dict[str, Any]], end: int) -> tuple[int, int]:
    scores = lines[-1]["line_score"][: end - 1]
    return sum(home for home, _ in scores), sum(away for _, away in scores)
