"""The ice in curlers' words: weights and ice to give for each lane, the map, earlier sessions."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from agents.app.sheet.forms import rounded
from agents.coaching.draw_weight import Centre, centre_of_draws, compared_in_words
from agents.coaching.lane_draws import LANES, lane_draws
from curling_env.analysis.ice_remarks import NO_CURL as NO_CURL_COMMAND
from curling_env.analysis.ice_remarks import (
    assumption_remark,
    believed_effects,
    missing_effect_remarks,
)
from curling_env.analysis.ice_uncertainty import is_uncertain
from curling_env.ice import Ice
from curling_env.sheet import Direction
from friction_estimation.reports.keen_and_heavy import (
    NOTABLE,
    SIGMAS,
    in_a_sentence,
    level,
    relative_map,
    zones,
)

if TYPE_CHECKING:
    from friction_estimation.reports.missing_in_words import Findings

LANE_NAMES = dict(
    zip(
        LANES,
        (
            "left edge, 8-foot",
            "left edge, 4-foot",
            "tee",
            "right edge, 4-foot",
            "right edge, 8-foot",
        ),
        strict=True,
    )
)
MOSTLY_SEEN = 0.7
"""Share of a path over measured ice from which its numbers are reported as measured."""

NO_CURL = (
    "this ice was estimated without effects, so no stone curls on it: estimate it again on the "
    "page Practice"
)


@dataclass(frozen=True, kw_only=True)
class EarlierIce:
    """The ice of another session.

    Parameters
    ----------
    id : number of the session
    name : name and day of the session
    ice : its ice
    centre : its draws down the centre line, see `centre_of`
    """

    id: int
    name: str
    ice: Ice
    centre: Centre | None


def ice_document(
    ice: Ice,
    *,
    earlier: Sequence[EarlierIce] = (),
    found: Findings | None = None,
) -> dict[str, Any]:
    """Describe an ice for its page.

    Parameters
    ----------
    ice : the ice
    earlier : ices of other sessions on the same sheet, the latest first
    found : what a discovery in the same session says
    """
    own = {direction: lane_draws(ice, direction) for direction in Direction}
    centre = centre_of_draws([draw for draws in own.values() for draw in draws])
    sentence = in_a_sentence(ice)
    if centre is not None:  # shares of friction, as seconds from hog line to hog line
        of = centre.seconds / 2
        sentence = re.sub(
            r"[+−-]([\d.]+) %", lambda found: f"{of * float(found[1]) / 100:.2f} s", sentence
        )
    return {
        "sentence": sentence,
        "centre": centre,
        "uncertain": is_uncertain(ice),
        "sheet": {"length": ice.sheet.length, "width": ice.sheet.width},
        "stone_radius": ice.stone.radius,
        "cells": cells_document(ice),
        # The time between the hog lines goes with one over the root of the friction.
        "seconds_per_share": None if centre is None else round(-centre.seconds / 2, 3),
        "zones": zones(ice),
        "seen": round(float(ice.friction.observed.mean()), 3),
        "lanes": [
            {"to": direction.name.lower(), "draws": own[direction]} for direction in Direction
        ],
        "earlier": [
            {
                "id": other.id,
                "name": other.name,
                "words": compared_in_words(centre, other.centre),
                "cells": change_of_maps(ice, other.ice),
            }
            for other in earlier
        ],
        "remarks": _remarks(ice),
        "discovery": found,
    }


def cells_document(ice: Ice) -> dict[str, Any]:
    """The map: friction of each cell over the sheet's, less 1; null where no stone ran."""
    return {
        "size": ice.sheet.cell_size,
        "relative": rounded(relative_map(ice), 4),
        "sigma": rounded(ice.friction.sigma / level(ice), 4),
    }


def change_of_maps(now: Ice, then: Ice) -> dict[str, Any] | None:
    """Return the change at each cell of the map; None for sheets of other cells.

    A cell counts only where it changed by more than its errors and by what a player feels.
    """
    if now.sheet != then.sheet:
        return None
    change = relative_map(now) - relative_map(then)
    error = np.hypot(now.friction.sigma / level(now), then.friction.sigma / level(then))
    felt = np.abs(change) > np.maximum(SIGMAS * error, NOTABLE)
    shown = np.where(np.isnan(change), np.nan, np.where(felt, change, 0.0))
    return {"size": now.sheet.cell_size, "relative": rounded(shown, 4)}


def _remarks(ice: Ice) -> list[str]:
    missing = [NO_CURL if one == NO_CURL_COMMAND else one for one in missing_effect_remarks(ice)]
    return missing + [assumption_remark(name) for name in believed_effects(ice)]
