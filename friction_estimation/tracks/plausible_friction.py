"""Friction that no curling ice has comes from a film that does not play at the speed of life."""

from __future__ import annotations

import numpy as np

from curling_env.errors import TrackTooShortError
from curling_env.physics.motion import GRAVITY
from curling_env.trajectory import Trajectory
from friction_estimation.tracks.free_slide import free_slide

FRICTION_OF_ICE = (0.004, 0.03)
"""Friction between a stone and any curling ice lies within this."""
USUAL_FRICTION = (0.006, 0.016)
"""That of ice on which games are played (Li 2022, Lubricants 10:265; Yang 2023, 11:370)."""
SLOW_MOTIONS = (2.0, 4.0, 8.0, 16.0, 0.5)
"""How many times slower than life films usually play, if they do."""
MIN_SLIDE = 3.0
"""A slide that is shorter tells nothing of the friction [m]."""


def question_about(mu: float) -> str | None:
    """What to ask about a coefficient of friction; None where ice may have it, or for NaN."""
    least, most = FRICTION_OF_ICE
    if np.isnan(mu) or least <= mu <= most:
        return None
    low, high = USUAL_FRICTION
    likely = [n for n in SLOW_MOTIONS if low <= mu * n**2 <= high]
    asked = f"μ = {mu:.4f} is {'less' if mu < least else 'more'} than curling ice has"
    if likely:
        pace = "slower" if likely[0] > 1 else "faster"
        factor = likely[0] if likely[0] > 1 else 1 / likely[0]
        return (
            f"{asked}: does the film play {factor:g} times {pace} than life? "
            f"--slow {likely[0]:g} makes it {mu * likely[0] ** 2:.4f}"
        )
    return f"{asked}: are the times of the frames and the lengths in the scene right?"


def rough_friction(track: Trajectory) -> float:
    """Friction that slows a stone down over its longest free slide.

    NaN where it slides less than `MIN_SLIDE`.
    """
    try:
        slide = free_slide(track)
    except TrackTooShortError:
        return np.nan
    if slide.travel < MIN_SLIDE:
        return np.nan
    u = slide.t - slide.t[0]
    along = slide.xy @ ((slide.xy[-1] - slide.xy[0]) / slide.travel)
    moving = along - along[0] < 0.98 * slide.travel
    curve = np.polyfit(u[moving], along[moving], 2)
    return float(-2 * curve[0] / GRAVITY)
