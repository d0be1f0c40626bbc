"""Overlay on a film: outline, path and speed of the stone, and a map of the sheet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import ArrayLike

from curling_env.errors import InputError
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, RING_RADII, TEE_Y
from curling_env.typing import Floats, Image, Progress, no_progress, with_progress
from curling_env.units import Units
from friction_estimation.camera.scene import Scene
from friction_estimation.camera.top_view import TopView
from friction_estimation.film.video import Film
from friction_estimation.film.writer import film_writer
from friction_estimation.tracking.films.film_track import FilmTrack
from friction_estimation.tracking.overlay.numbers import RunningNumbers

# Colours, blue-green-red.
PATH = (40, 170, 255)
OUTLINE = (80, 230, 120)
OTHERS = ((255, 170, 60), (230, 90, 220), (70, 220, 255), (160, 255, 160), (120, 120, 255))
"""Outlines of the other stones, by their number."""
TEXT = (255, 255, 255)
PANEL = (46, 38, 32)
ICE = (246, 243, 238)
BLUE, RED, LINE = (190, 120, 50), (60, 60, 205), (150, 150, 150)

LARGEST_PX = 1920
"""Maximum width or height of an overlay; larger films are reduced."""
STILLS = 3
"""Maximum number of pictures of a track."""


def write_overlay(
    film_path: str | Path | Film,
    scene: Scene,
    track: FilmTrack,
    output: str | Path,
    *,
    units: Units = Units.METRES,
    progress: Progress = no_progress,
) -> None:
    """Draw a track into a copy of its film.

    Parameters
    ----------
    film_path, scene, track : what was tracked, and what was found
    output : the film that is written
    units : units of displayed lengths
    progress : called with the number of frames done and the expected number of all

    Raises
    ------
    InputError : the picture changes its size within the film
    OutputError : `output` cannot be written as a film
    """
    film = film_path if isinstance(film_path, Film) else Film.open(film_path, scene.fps)
    picture = _Overlay(track, scene, film.size, LARGEST_PX, units)
    frames = with_progress(film.frames(), "overlay", progress, film.frame_count)
    with film_writer(output, picture.size, film.fps) as writer:
        for index, (t, frame) in enumerate(frames):
            width, height = frame.shape[1], frame.shape[0]
            if (width, height) != film.size:
                raise InputError(
                    f"an overlay needs pictures of one size; {film.size[0]} × {film.size[1]} px "
                    f"become {width} × {height} px",
                    source=film.path,
                    where=f"frame {film.first + index}",
                )
            writer.write(picture.draw(frame, index, t), t)


def draw_stills(
    film_path: str | Path | Film,
    scene: Scene,
    track: FilmTrack,
) -> list[tuple[float, Image]]:
    """Draw a track into a few frames, spread over the slide of the stone.

    Parameters
    ----------
    film_path, scene, track : what was tracked, and what was found

    Returns
    -------
    Time since the first frame [s] and picture (height, width, 3), BGR, of each.
    """
    film = film_path if isinstance(film_path, Film) else Film.open(film_path, scene.fps)
    picture = _Overlay(track, scene, film.size, max(film.size), Units.METRES)
    rows = np.linspace(0, len(track.frame) - 1, STILLS + 2).round().astype(int)[1:-1]
    wanted = np.unique(track.frame[rows]).tolist()
    found = film.pick(wanted)
    return [(t, picture.draw(frame, i, t)) for i, (t, frame) in zip(wanted, found, strict=False)]


class _Overlay:
    """Overlay of a track on the frames of its film, in order."""

    def __init__(
        self,
        track: FilmTrack,
        scene: Scene,
        film_size: tuple[int, int],
        largest: int,
        units: Units,
    ) -> None:
        self._track, self._scene = track, scene
        self._numbers = RunningNumbers(track, units)
        self._scale = min(1.0, largest / max(film_size))
        size = film_size
        if self._scale < 1:  # codecs require even sides
            width, height = (2 * round(self._scale * side / 2) for side in film_size)
            size = (width, height)
        self.size = size
        self._unit = max(size[1] / 1080, 0.35)
        self._row_of = {int(frame): row for row, frame in enumerate(track.frame)}
        xy = track.trajectory.xy
        flat = np.column_stack([xy, np.zeros(len(xy))])
        self._path_px = self._projected(track, flat)
        x, y = scene.sheet.width / 2, scene.sheet.length / 2
        edge = np.array([[a * x, b * y, 0.0] for a in (-1, 1) for b in np.linspace(-1, 1, 40)])
        seen = track.camera.sees(edge)
        self._sheet_px = self._projected(track, edge)[seen] if seen.any() else self._path_px
        self._inset, self._view = self._map(size)
        self._path_view = self._view.to_view(xy)
        self._until = 0

    def draw(self, frame: Image, index: int, t: float) -> Image:
        """Draw everything into a stabilised frame."""
        if self._track.stabiliser is not None:
            frame = self._track.stabiliser.stabilised(frame)
        if self._scale < 1:
            frame = np.asarray(cv2.resize(frame, self.size), dtype=np.uint8)
        row = self._row_of.get(index)
        until = int(np.searchsorted(self._track.frame, index, side="right"))
        self._polyline(frame, self._path_px[:until], PATH, 3)
        seen = [(other, _row_at(other, index)) for other in self._track.others]
        for other, other_row in seen:
            if other_row is not None:
                path = other.trajectory.xy[: other_row + 1]
                flat = np.column_stack([path, np.zeros(len(path))])
                self._polyline(frame, self._projected(other, flat), _colour_of(other), 2)
                self._stone(frame, other, other_row, _colour_of(other))
        if row is not None:
            self._stone(frame, self._track, row, OUTLINE)
        self._draw_map(frame, until, row, seen)
        self._draw_numbers(frame, row, until, t)
        return frame

    def _projected(self, track: FilmTrack, points: ArrayLike) -> Floats:
        """Project points (n, 3) [m] into the picture that is drawn, (n, 2) [px]."""
        return self._scaled(track.camera.project(points))

    def _scaled(self, px: Floats) -> Floats:
        return self._scale * (px + 0.5) - 0.5

    def _stone(
        self, frame: Image, track: FilmTrack, row: int, colour: tuple[int, int, int]
    ) -> None:
        xy, theta = track.trajectory.xy[row], track.trajectory.theta[row]
        outline = self._scaled(track.appearance.model.outline_px(track.camera, xy))
        self._polyline(frame, np.concatenate([outline, outline[:1]]), colour, 2)
        if np.isfinite(theta):
            z = track.appearance.model.height + track.appearance.model.handle_rise
            ahead = xy + 2.2 * track.appearance.model.radius * np.array(
                [np.cos(theta), np.sin(theta)]
            )
            line = self._projected(track, [[*xy, z], [*ahead, z]])
            self._polyline(frame, line, colour, 2)

    def _map(self, size: tuple[int, int]) -> tuple[Image, TopView]:
        sheet = self._scene.sheet
        view = TopView.of(sheet, px_per_m=max(0.72 * size[1] / sheet.length, 4.0))
        image = np.full((view.size[1], view.size[0], 3), ICE, dtype=np.uint8)

        def at(x: float, y: float) -> tuple[int, int]:
            u, v = np.round(16 * view.to_view(np.array([[x, y]]))[0]).astype(int)
            return int(u), int(v)

        for side in (-1, 1):
            for radius, colour in zip(RING_RADII, (BLUE, ICE, RED, ICE), strict=True):
                r = round(16 * radius * view.px_per_m)
                cv2.circle(image, at(0, side * TEE_Y), r, colour, -1, cv2.LINE_AA, 4)
            for y, colour, width in (
                (HOG_LINE_Y, RED, 2),
                (TEE_Y, LINE, 1),
                (BACK_LINE_Y, LINE, 1),
            ):
                ends = at(-sheet.width, side * y), at(sheet.width, side * y)
                cv2.line(image, *ends, colour, width, cv2.LINE_AA, 4)
        cv2.line(image, at(0, -sheet.length), at(0, sheet.length), LINE, 1, cv2.LINE_AA, 4)
        return image, view

    def _draw_map(
        self,
        frame: Image,
        until: int,
        row: int | None,
        others: Sequence[tuple[FilmTrack, int | None]],
    ) -> None:
        # The path stays in the map; only its new part is drawn.
        self._polyline(self._inset, self._path_view[max(self._until - 1, 0) : until], PATH, 2)
        self._until = until
        image = self._inset.copy()
        for other, other_row in others:
            if other_row is not None:
                places = self._view.to_view(other.trajectory.xy[: other_row + 1])
                self._polyline(image, places, _colour_of(other), 1)
                self._disc(image, places[-1], _colour_of(other))
        if row is not None:
            self._disc(image, self._path_view[row], OUTLINE)
        if self._map_lies_flat(frame.shape):
            image = cv2.rotate(image, cv2.ROTATE_90_CLOCKWISE)
        edge = round(8 * self._unit)
        margin = round(28 * self._unit)
        rows, columns = image.shape[:2]
        top = (frame.shape[0] - rows) // 2
        left = frame.shape[1] - margin - columns
        if self._map_lies_flat(frame.shape):
            top, left = frame.shape[0] - margin - rows, (frame.shape[1] - columns) // 2
        if top < edge or left < edge:
            return
        frame[top - edge : top + rows + edge, left - edge : left + columns + edge] = PANEL
        frame[top : top + rows, left : left + columns] = image

    def _disc(self, image: Image, place: Floats, colour: tuple[int, int, int]) -> None:
        """Draw a stone into the map."""
        radius = max(self._track.appearance.model.radius * self._view.px_per_m, 3.5)
        u, v = np.round(16 * place).astype(int)
        centre = int(u), int(v)
        cv2.circle(image, centre, round(16 * radius), PANEL, -1, cv2.LINE_AA, 4)
        cv2.circle(image, centre, round(16 * radius), colour, 2, cv2.LINE_AA, 4)

    def _map_lies_flat(self, shape: tuple[int, ...]) -> bool:
        """Return whether the map is at the lower edge, because at the right it would cover the
        ice.
        """
        return bool(np.nanmax(self._sheet_px[:, 0]) > 0.9 * shape[1])

    def _draw_numbers(self, frame: Image, row: int | None, until: int, t: float) -> None:
        track = self._track
        lines = [f"{t:.2f} s"]
        if row is not None:
            lines += self._numbers.at(row)
        elif until == len(track.frame):
            lines.append("out of view")
        else:
            lines += self._numbers.before(until > 0)
        unit, font = self._unit, cv2.FONT_HERSHEY_DUPLEX
        step, left, top = round(40 * unit), round(28 * unit), round(28 * unit)
        widest = max(cv2.getTextSize(text, font, 0.95 * unit, 1)[0][0] for text in lines)
        width = max(round(350 * unit), widest + round(36 * unit))
        height = step * len(lines) + round(24 * unit)
        panel = frame[top : top + height, left : left + width]
        tint = np.full_like(panel, PANEL)
        panel[:] = cv2.addWeighted(panel, 0.25, tint, 0.75, 0.0)
        for i, text in enumerate(lines):
            origin = (left + round(18 * unit), top + round(10 * unit) + step * (i + 1) - 8)
            cv2.putText(
                frame,
                text,
                origin,
                font,
                0.95 * unit,
                TEXT,
                max(1, round(unit)),
                cv2.LINE_AA,
            )

    def _polyline(
        self, image: Image, px: Floats, colour: tuple[int, int, int], width: float
    ) -> None:
        px = px[np.isfinite(px).all(axis=1)]
        if len(px) < 2:
            return
        points = np.round(px * 16).astype(np.int32).reshape(-1, 1, 2)
        thickness = max(1, round(width * self._unit))
        cv2.polylines(image, [points], False, colour, thickness, cv2.LINE_AA, 4)


def _row_at(track: FilmTrack, index: int) -> int | None:
    """Return the row of a frame, or of the last one before it; None before the first."""
    row = int(np.searchsorted(track.frame, index, side="right")) - 1
    return row if row >= 0 else None


def _colour_of(track: FilmTrack) -> tuple[int, int, int]:
    return OTHERS[(track.trajectory.stone - 1) % len(OTHERS)]
