"""Measurements of one stone, frame by frame, with the headings of its pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from friction_estimation.appearance import (
    Appearance,
    PosedStone,
    StoneFit,
    heading_costs,
    heading_crop,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame
from friction_estimation.tracking import tuning
from friction_estimation.tracking.detection.background import Background
from friction_estimation.tracking.measuring.compression import PixelAges
from friction_estimation.tracking.measuring.heading import HeadingViews


@dataclass(eq=False)
class Measurements:
    """Measurements of a stone, frame by frame.

    Parameters
    ----------
    t : (n,) times of the frames [s]
    fits : (n,) measurements; None where the stone was not seen
    views : what pictures show of its heading
    ages : how old the pixels of its pictures are
    """

    t: list[float] = field(default_factory=list)
    fits: list[StoneFit | None] = field(default_factory=list)
    views: HeadingViews = field(default_factory=HeadingViews)
    ages: PixelAges = field(default_factory=PixelAges)

    @property
    def seen(self) -> int:
        """The number of frames in which the stone was measured."""
        return sum(fit is not None for fit in self.fits)

    def add(
        self,
        t: float,
        fit: StoneFit | None,
        frame: Frame,
        background: Background,
        camera: Camera,
        appearance: Appearance,
        others: Sequence[PosedStone] = (),
    ) -> None:
        """Add a frame: its time, the measurement, and for some frames the view of the handle.

        Parameters
        ----------
        others : the stones around it, where they are in this frame
        """
        self.t.append(t)
        self.fits.append(fit)
        if fit is None:
            return
        self.ages.add(t, fit.xy, frame, background, camera, appearance.model)
        if not appearance.has_handle:
            return
        if self.views.t and t < self.views.t[-1] + tuning.HEADING_VIEW_INTERVAL:
            return
        crop = heading_crop(
            frame, fit.xy, background.channels, background.origin_px, camera, appearance, others
        )
        if crop is not None:
            self.views.add(t, heading_costs(crop, appearance))
