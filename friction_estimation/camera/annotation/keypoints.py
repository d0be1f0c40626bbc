"""Places on the ice that a hand can mark in a picture, each where two lines or edges meet."""

from __future__ import annotations

from curling_env.sheet import BACK_LINE_Y, HOG_LINE_WIDTH, HOG_LINE_Y, HOUSE_RADIUS, TEE_Y, Sheet


def keypoints_of(sheet: Sheet) -> dict[str, tuple[float, float]]:
    """Every place that can be marked, by name, in the sheet frame [m].

    The four corners come first, under their names in a scene file. Left and right are those of
    someone looking from the home end to the away end. On a hog line its middle is meant, on a
    ring the outer edge of the twelve-foot.
    """
    side = sheet.width / 2
    places = dict(sheet.corners)
    for end, s in (("home", -1.0), ("away", 1.0)):
        hog = s * (HOG_LINE_Y + HOG_LINE_WIDTH / 2)
        places |= {
            f"{end}_hog_left": (-side, hog),
            f"{end}_hog_centre": (0.0, hog),
            f"{end}_hog_right": (side, hog),
            f"{end}_tee": (0.0, s * TEE_Y),
            f"{end}_ring_left": (-HOUSE_RADIUS, s * TEE_Y),
            f"{end}_ring_right": (HOUSE_RADIUS, s * TEE_Y),
            f"{end}_ring_top": (0.0, s * (TEE_Y - HOUSE_RADIUS)),
            f"{end}_back_centre": (0.0, s * BACK_LINE_Y),
        }
    return places
