"""Check for friction outside that of curling ice, which indicates a film in slow motion."""

from __future__ import annotations

import numpy as np

from curling_env.errors import TrackTooShortError
from curling_env.physics.motion import GRAVITY
from curling_env.trajectory import Trajectory
from friction_estimation.tracks.free_slide import free_slide

FRICTION_OF_ICE = (0.004, 0.03)
"""Range of friction between a stone and any curling ice."""
USUAL_FRICTION = (0.006, 0.016)
"""Range of friction of ice for games (Li 2022, Lubricants 10:265; Yang 2023, 11:370)."""
SLOW_MOTIONS = (2.0, 4.0, 8.0, 16.0, 0.5)
"""Usual factors of slow motion."""
MIN_SLIDE = 3.0
"""Minimum slide for an estimate of the friction [m]."""


def friction_question(mu: float) -> str | None:
    """Return the question about a coefficient of friction; None if it is plausible, or for NaN."""
    least, most = FRICTION_OF_ICE
    if np.isnan(mu) or least <= mu <= most:
        return None
    low, high = USUAL_FRICTION
    likely = [n for n in SLOW_MOTIONS if low <= mu * n**2 <= high]
    asked = f"μ = {mu:.4f} is {'below' if mu < least else 'above'} that of curling ice"
    if not likely:
        return f"{asked}: are the times of the frames and the lengths in the scene correct?"
    slow = likely[0]
    played = f"{slow:g} times slower" if slow > 1 else f"{1 / slow:g} times faster"
    return (
        f"{asked}: does the film play {played} than life? "
        f"--slow {slow:g} makes it {mu * slow**2:.4f}"
    )


def rough_friction(track: Trajectory) -> float:
    """Return the friction that slows a stone over its longest free slide.

    NaN if it slides less than `MIN_SLIDE`.
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
