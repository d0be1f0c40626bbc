"""How a game is shown: a picture of each delivery, or the delivery as it happens in a window."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from curling_env.envs.rendering import FPS, EnvRenderer, signed
from curling_env.game import GameState, PlayedShot
from curling_env.game.rules import Game, count
from curling_env.game.rules.delivery import Fault
from curling_env.game.rules.teams import STONES_PER_TEAM, Stones
from curling_env.game.simulator import direction_of, state_on_sheet
from curling_env.render import RED, YELLOW, DrawnScene, drawn_stones, playback_frames
from curling_env.render.canvas import Colour
from curling_env.sheet import Direction
from curling_env.typing import Floats, Image

Delivered = tuple[GameState, GameState, PlayedShot]
"""A delivery: the game before and after it, and the shot."""
PLAYBACK_SPEED = 4.0
"""How many times faster than it happened a window shows a delivery."""
RULED_FRAMES = FPS // 2
"""How many pictures of a film show the stones as they lie after the ruling."""
FAULT_TEXT = {
    Fault.HOG_LINE: "hogged",
    Fault.FREE_GUARD_ZONE: "free guard zone: put back",
    Fault.NO_TICK: "ticked too early",
    Fault.EARLY_TAKEOUT: "takeout too early: put back",
}


def colour_of(stone: int) -> Colour:
    """Colour of a stone's handle: red for the home team, yellow for the away team."""
    return RED if stone < STONES_PER_TEAM else YELLOW


def score_text(game: Game) -> str:
    """The score as text: ``home 3 : 2 away``."""
    home, away = game.score
    return f"home {home} : {away} away"


def facts_of(game: Game, shot: PlayedShot | None) -> list[tuple[str, str]]:
    """Labels and values of the panel."""
    facts = [("Red, home", str(game.score[0])), ("Yellow, away", str(game.score[1]))]
    end = game.end
    if end is not None:
        team, points = count(game.lines, end.stones)
        facts += [
            ("Hammer", end.hammer.label),
            ("Stones delivered", f"{end.delivered} of {game.rules.deliveries}"),
            ("Lies", "nobody" if team is None else f"{team.label} {points}"),
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
    """The stones on the sheet, with the paths of the last delivery.

    Between ends they lie as the last delivery left them.
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


class GameRenderer(EnvRenderer):
    """Draws a game."""

    def picture(self, state: GameState, shot: PlayedShot | None) -> Image:
        """The game after a delivery, (720, 1280, 3) RGB."""
        direction = _direction(state, shot)
        return self.sheet(direction).draw(scene_of(state.game, direction, shot))

    def frames(
        self, before: GameState, after: GameState, shot: PlayedShot, speed: float
    ) -> Iterator[Image]:
        """A delivery as a film, `speed` times as fast as it was, then the stones as they lie."""
        end = before.game.end
        lying = [] if end is None else [state_on_sheet(s, shot.direction) for s in end.stones]
        scene = DrawnScene(
            title=f"End {shot.end + 1}   {score_text(before.game)}",
            facts=facts_of(before.game, shot),
        )
        yield from playback_frames(
            self.sheet(shot.direction),
            scene,
            lying,
            shot.outcome,
            colour_of,
            fps=FPS,
            speed=speed,
        )
        ruled = self.picture(after, shot)
        for _ in range(RULED_FRAMES):
            yield ruled

    def film(
        self,
        deliveries: Sequence[Delivered],
        state: GameState,
        speed: float,
        last: PlayedShot | None = None,
    ) -> Iterator[Image]:
        """Deliveries as a film; where there are none, one picture of the game after the last."""
        if not deliveries:
            yield self.picture(state, last)
        for before, after, shot in deliveries:
            yield from self.frames(before, after, shot, speed)

    def show(self, before: GameState, after: GameState, shot: PlayedShot) -> None:
        """In the window: a delivery as it happened, then the stones as they lie."""
        window = self.window()
        for frame in self.frames(before, after, shot, PLAYBACK_SPEED):
            if not window.is_open:
                return
            window.show(frame)

    def show_position(self, state: GameState) -> None:
        """In the window: the stones as they lie."""
        self.window().show(self.picture(state, None))


def _direction(state: GameState, shot: PlayedShot | None) -> Direction:
    end = state.game.end
    if end is not None:
        return direction_of(end.number)
    return direction_of(0) if shot is None else shot.direction
