"""The size of a discovery to a curler: one and the same draw on the ice before and after."""

from __future__ import annotations

from dataclasses import dataclass

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics.aim import Aim
from curling_env.physics.slides import NO_BOUNDS, slide
from curling_env.physics.wear import IceInUse
from curling_env.sheet import Direction
from curling_env.throw import Throw
from curling_env.typing import Floats
from curling_env.units import Units, length, speed
from friction_estimation.discovery.discover import Discovery
from friction_estimation.discovery.model.model import Model

DRAW_SPIN = 1.5
"""Spin of the draw, counter-clockwise [rad/s]: two and a half turns on the way."""
NOTABLE_SHIFT = 0.05
"""Shift of a rest below which it is not mentioned [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawShift:
    """A draw that one model lays on the tee line, and where another lays it.

    Parameters
    ----------
    speed : speed at the hog line [m/s]
    before, after : (n, 2) paths towards the away end on the two ices, sheet frame [m]
    """

    speed: float
    before: Floats
    after: Floats

    @property
    def shift(self) -> Floats:
        """Shift of the rest to the right and beyond, as the thrower sees it, (2,) [m]."""
        return self.after[-1] - self.before[-1]

    @property
    def words(self) -> str:
        """The shift in a sentence, in metres."""
        return self.words_in(Units.METRES)

    def words_in(self, units: Units) -> str:
        """The shift in a sentence."""
        right, further = self.shift
        metric = units is Units.METRES
        parts = [
            f"{f'{abs(value):.1f} m' if metric else length(value, units)} {words[int(value > 0)]}"
            for value, words in (
                (right, ("to the left", "to the right")),
                (further, ("shorter", "further")),
            )
            if abs(value) > NOTABLE_SHIFT
        ]
        where = " and ".join(parts) if parts else "in the same place"
        return (
            f"The draw of {speed(self.speed, units)}, turning counter-clockwise, that the model as "
            f"it was lays on the tee line rests {where} with what was found."
        )


def draw_shift(found: Discovery) -> DrawShift | None:
    """A draw before and after; None where a model cannot lay one on the tee line."""
    if not found.effects:
        return None
    session = found.session

    def as_it_was_left(model: Model) -> Ice:
        in_use = IceInUse(model.improved_ice({}))
        for ran in session.wear_tracks.paths:
            in_use.ran(ran)
        return in_use.now

    before, after = as_it_was_left(found.final_base.model), as_it_was_left(found.final.model)
    clock, order = float(session.clocks.max()) + 60.0, int(session.orders.max()) + 1

    def path(ice: Ice, speed: float) -> Floats:
        throw = Throw(speed=speed, angle=0.0, spin=DRAW_SPIN, x=0.0)
        release = throw.release(
            Direction.AWAY, stone=int(session.stones[-1]), clock=clock, order=order
        )
        run = slide(ice, release, bounds=NO_BOUNDS, fps=20.0).trajectory
        assert run is not None  # a rate was given
        return run.xy

    aim = Aim(before, clock=clock, order=order, stone=int(session.stones[-1]))
    speed = aim.draw_weight(DRAW_SPIN)
    if speed is None:
        return None
    try:
        return DrawShift(speed=speed, before=path(before, speed), after=path(after, speed))
    except InputError:
        return None  # ice on which the stone never stops
