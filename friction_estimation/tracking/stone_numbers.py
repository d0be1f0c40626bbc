"""Stones numbered in order of play, over all throws of a session.

A stone at the resting place of an earlier one is the same stone. So is a thrown stone whose handle
has the colour of an earlier one that has left the sheet: stones of one colour cannot be
distinguished otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.appearance.tuning import MIN_HANDLE_CONTRAST
from friction_estimation.film.channels import blue_and_red, channels_of_colour, green_beside
from friction_estimation.tracking import tuning


@dataclass(eq=False)
class StoneNumbers:
    """Stones of a session until now.

    Parameters
    ----------
    colours : code of the handle's colour of each stone, by its number; None where it is not seen
    lying : where stones lay when the last throw was over, by their numbers, each (2,) [m]
    thrown : numbers of the thrown stones, in order of play
    """

    colours: list[str | None] = field(default_factory=list)
    lying: dict[int, Floats] = field(default_factory=dict)
    thrown: list[int] = field(default_factory=list)

    def of(self, tracks: Sequence[Trajectory], handles: Sequence[str | None]) -> list[int]:
        """Number the stones of the next throw.

        Parameters
        ----------
        tracks : the thrown stone's, then those of the others
        handles : colour of the handle of each, as `handle_code` writes it; None where not seen
        """
        lay = [self._lay(track.xy[0]) for track in tracks[1:]]
        taken = {number for number in lay if number is not None}
        first = self._again(handles[0], taken)
        numbers = [self._new(handles[0]) if first is None else first]
        for number, handle in zip(lay, handles[1:], strict=True):
            known = number is not None and number not in numbers
            numbers.append(number if known and number is not None else self._new(handle))
        self.thrown.append(numbers[0])
        self.lying = {n: track.xy[-1] for n, track in zip(numbers, tracks, strict=True)}
        return numbers

    def _lay(self, xy: Floats) -> int | None:
        """Return the stone at a resting place [m]."""
        apart = {n: float(np.linalg.norm(xy - place)) for n, place in self.lying.items()}
        near = [n for n, distance in apart.items() if distance < tuning.SAME_PLACE]
        return min(near, key=apart.__getitem__, default=None)

    def _again(self, handle: str | None, lying: set[int]) -> int | None:
        """Return the free stone of a handle's colour whose last throw is longest ago."""
        latest = {number: k for k, number in enumerate(self.thrown)}
        for number in sorted(latest, key=latest.__getitem__):
            if number not in lying and same_handle(handle, self.colours[number]):
                self.colours[number] = clearer(handle, self.colours[number])
                return number
        return None

    def _new(self, handle: str | None) -> int:
        self.colours.append(handle)
        return len(self.colours) - 1


def same_handle(one: str | None, other: str | None) -> bool:
    """Return whether two handles may be of one colour.

    Shadows change the brightness of a handle, and compression reduces its saturation, so only its
    hue is compared. An unseen or grey handle matches any.
    """
    if one is None or other is None:
        return True
    first, second = _chroma(one), _chroma(other)
    size = np.linalg.norm(first), np.linalg.norm(second)
    if min(size) < MIN_HANDLE_CONTRAST:
        return True
    return bool(first @ second > np.cos(tuning.SAME_HUE) * size[0] * size[1])


def clearer(one: str | None, other: str | None) -> str | None:
    """Return the one of two codes of a handle with the clearer hue."""
    codes = [code for code in (one, other) if code is not None]
    return max(codes, key=lambda code: float(np.linalg.norm(_chroma(code))), default=None)


def handle_code(colour: Floats) -> str | None:
    """Return a colour in the form of web pages, ``#rrggbb``; None if unknown.

    Parameters
    ----------
    colour : (3,) brightness, and blue and red differences (ITU-R BT.601), of 255
    """
    if not np.isfinite(colour).all():
        return None
    b, r = blue_and_red(colour)
    g = green_beside(float(colour[0]), b, r)
    return "#" + "".join(f"{round(float(np.clip(value, 0, 255))):02x}" for value in (r, g, b))


def _chroma(code: str) -> Floats:
    r, g, b = (int(code[k : k + 2], 16) for k in (1, 3, 5))
    return channels_of_colour(b, g, r)[1:]
