"""Display of a game: a picture of each delivery, or its animation in a window."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from curling_env.envs.rendering import FPS, ClipRenderer, signed
from curling_env.errors import InputError
from curling_env.game import GameState, PlayedShot
from curling_env.game.rules import Game, count
from curling_env.game.rules.delivery import Fault
from curling_env.game.rules.teams import STONES_PER_TEAM, Stones
from curling_env.game.simulator import direction_of, state_on_sheet
from curling_env.ice import Ice
from curling_env.render import RED, YELLOW, DrawnScene, drawn_stones, playback_frames
from curling_env.render.canvas import Colour
from curling_env.sheet import Direction
from curling_env.typing import Floats, Image

PLAYBACK_SPEED = 4.0
"""Playback speed of a delivery in a window."""
RULED_FRAMES = FPS // 2
"""Number of frames of a film with the stones after the ruling."""
FAULT_TEXT = {
    Fault.HOG_LINE: "hogged",
    Fault.FREE_GUARD_ZONE: "free guard zone: put back",
    Fault.NO_TICK: "ticked too early",
    Fault.EARLY_TAKEOUT: "takeout too early: put back",
}


class GameClip(NamedTuple):
    """Delivery with the game before and after it, or a position, in which `shot` is None."""

    ice: Ice
    before: GameState
    after: GameState
    shot: PlayedShot | None


def colour_of(stone: int) -> Colour:
    """Return the colour of a stone's handle: red for the home team, yellow for the away team."""
    return RED if stone < STONES_PER_TEAM else YELLOW


def score_text(game: Game) -> str:
    """Return the score as text: ``home 3 : 2 away``."""
    home, away = game.score
    return f"home {home} : {away} away"


def facts_of(game: Game, shot: PlayedShot | None) -> list[tuple[str, str]]:
    """Return labels and values of the panel."""
    facts = [("Red, home", str(game.score[0])), ("Yellow, away", str(game.score[1]))]
    end = game.end
    if end is not None:
        team, points = count(game.lines, end.stones)
        facts += [
            ("Hammer", end.hammer.label),
            ("Stones delivered", f"{end.delivered} of {game.rules.deliveries}"),
            ("Lies", "none" if team is None else f"{team.label} {points}"),
        ]
    elif game.line_score:
        home, away = game.line_score[-1]
        facts.append(("This end", "blank" if home == away else f"{home} : {away}"))
    if shot is not None:
        facts += [
            ("Thrown by", shot.team.label),
            ("Speed", f"{shot.thrown.speed:.2f} m/s"),
            ("Line", signed(np.degrees(shot.thrown.angle), "°")),
            ("Spin", signed(shot.thrown.spin, " rad/s")),
        ]
    return facts


def scene_of(game: Game, direction: Direction, shot: PlayedShot | None) -> DrawnScene:
    """Return the stones on the sheet, with the paths of the last delivery.

    Between ends they are those after the last delivery.
    """
    number = max(len(game.line_score) - 1, 0) if game.end is None else game.end.number
    title = f"End {number + 1}   {score_text(game)}"
    lying: Stones = () if game.end is None else game.end.stones
    paths: list[tuple[Floats, Colour]] = []
    if shot is not None and shot.end == number:
        if shot.ruling.fault is not None:
            title += f"   ·   {FAULT_TEXT[shot.ruling.fault]}"
        if game.end is None:
            lying = shot.stones_after
        paths = [(path.xy, colour_of(path.stone)) for path in shot.outcome.trajectories]
    return DrawnScene(
        stones=drawn_stones([state_on_sheet(stone, direction) for stone in lying], colour_of),
        paths=paths,
        title=title,
        facts=facts_of(game, shot),
    )


class GameRenderer(ClipRenderer[GameClip]):
    """Renderer of a game.

    Parameters
    ----------
    title : title of the window
    """

    def __init__(self, title: str) -> None:
        super().__init__()
        self.title, self.window_speed = title, PLAYBACK_SPEED

    def picture(self, clip: GameClip) -> Image:
        """Return the game after a delivery, (720, 1280, 3) RGB."""
        direction = _direction(clip.after, clip.shot)
        scene = scene_of(clip.after.game, direction, clip.shot)
        return self.sheet(clip.ice, direction).draw(scene)

    def frames(self, clip: GameClip, speed: float) -> Iterator[Image]:
        """Yield the frames of a delivery at `speed` times the true speed, then the stones at
        rest.
        """
        ruled, shot = self.picture(clip), clip.shot
        if shot is None:
            yield ruled
            return
        game = clip.before.game
        lying = [] if game.end is None else [
            state_on_sheet(stone, shot.direction) for stone in game.end.stones
        ]  # fmt: skip
        yield from playback_frames(
            self.sheet(clip.ice, shot.direction),
            DrawnScene(
                title=f"End {shot.end + 1}   {score_text(game)}", facts=facts_of(game, shot)
            ),
            lying,
            shot.outcome,
            colour_of,
            fps=FPS,
            speed=speed,
        )
        for _ in range(RULED_FRAMES):
            yield ruled


def clips_of(ice: Ice, states: Sequence[GameState], shots: Sequence[PlayedShot]) -> list[GameClip]:
    """Return deliveries as clips, or without deliveries the position.

    Parameters
    ----------
    ice : the ice under the lines
    states : the game before each delivery, and after the last
    shots : the deliveries
    """
    if len(states) == 1:
        return [GameClip(ice, states[0], states[0], None)]
    return [GameClip(ice, *one) for one in zip(states, states[1:], shots, strict=False)]


def check_paths(render_mode: str | None) -> None:
    """Refuse a film if paths were not kept.

    Raises
    ------
    InputError : there is no render mode
    """
    if render_mode is None:
        raise InputError("a film needs a render_mode: render_mode='rgb_array'")


def _direction(state: GameState, shot: PlayedShot | None) -> Direction:
    end = state.game.end
    if end is not None:
        return direction_of(end.number)
    return direction_of(0) if shot is None else shot.direction
