"""Problems of a camera that was marked by hand, beyond its fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from curling_env.sheet import PAPER_SHEET, WORLD_CURLING_SHEET, Sheet
from curling_env.units import FOOT
from friction_estimation.camera.refined import RefinedCamera
from friction_estimation.camera.tuning import (
    CAMERA_HEIGHTS,
    CLICK_SIGMA_PX,
    OUTLIER_AT,
    TOLERANCE_PX,
)

SHEETS = (WORLD_CURLING_SHEET, PAPER_SHEET)
"""Sizes of ice that clubs have."""
BETTER_BY = 25.0
"""Minimum fall of the misfit for another size of the ice [squared standard errors]."""


def problems_of(refined: RefinedCamera, apart_px: Mapping[str, float]) -> list[str]:
    """Return the problems of a camera, in sentences; empty if all visible paint agrees.

    Parameters
    ----------
    refined : as the paint has corrected it
    apart_px : distance of each click from where the camera puts it, by the name of its keypoint
    """
    problems: list[str] = []
    low, high = refined.height_range
    if low > CAMERA_HEIGHTS[1]:  # as with the wrong size of the ice
        problems.append(
            f"The camera would hang {low:.0f} to {high:.0f} m above the ice, and stones would be "
            "too small: check the size of the ice."
        )
    name = max(apart_px, key=lambda one: apart_px[one])
    if apart_px[name] > OUTLIER_AT * CLICK_SIGMA_PX:
        problems.append(
            f"The mark of the {name.replace('_', ' ')} is {apart_px[name]:.0f} px from the paint: "
            "move it onto the paint."
        )
    if off := refined.missed:
        problems.append(
            f"The {' and '.join(off)} in the picture {'is' if len(off) == 1 else 'are'} more than "
            f"{TOLERANCE_PX:g} px from the drawn line."
        )
    return problems


def better_sheet(own: RefinedCamera, others: Sequence[tuple[Sheet, RefinedCamera]]) -> Sheet | None:
    """Return a size of ice that rings and borders fit clearly better; or None.

    Parameters
    ----------
    own : the camera with the ice as it is marked
    others : other sizes of the ice with the camera that the same clicks give on each
    """
    for sheet, found in others:
        # Paint that is not seen in its place counts in the misfit.
        if found.measured and (not own.measured or found.misfit + BETTER_BY < own.misfit):
            return sheet
    return None


def size_in_words(sheet: Sheet) -> str:
    """Length and width of a sheet, in metres and feet."""
    feet = (f"{side / FOOT:.1f}".removesuffix(".0") for side in (sheet.length, sheet.width))
    return f"{sheet.length:g} × {sheet.width:g} m ({' × '.join(feet)} ft)"
