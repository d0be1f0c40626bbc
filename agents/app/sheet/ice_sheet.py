"""The ice in curlers' words: weights and ice to give for each lane, the map, earlier sessions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from agents.app.sheet.forms import rounded
from agents.coaching.lane_draws import LANES, LaneDraw, lane_draws
from curling_env.analysis.ice_remarks import (
    assumption_remark,
    believed_effects,
    missing_effect_remarks,
)
from curling_env.analysis.ice_uncertainty import is_uncertain
from curling_env.ice import Ice
from curling_env.sheet import Direction
from curling_env.units import brooms, length
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

LANE_NAMES = (
    "left edge, 8-foot",
    "left edge, 4-foot",
    "tee",
    "right edge, 4-foot",
    "right edge, 8-foot",
)
MOSTLY_SEEN = 0.7
"""Share of a path over measured ice from which its numbers are reported as measured."""

SAME_WEIGHT = 0.05
"""Change of the time between the hog lines that no one feels [s]."""


@dataclass(frozen=True, kw_only=True)
class EarlierIce:
    """The ice of another session.

    Parameters
    ----------
    id : number of the session
    name : name and day of the session
    ice : its ice
    """

    id: int
    name: str
    ice: Ice


def ice_document(
    ice: Ice,
    *,
    earlier: Sequence[EarlierIce] = (),
    found: Findings | None = None,
) -> dict[str, Any]:
    """An ice as its page draws and tells it.

    Parameters
    ----------
    ice : the ice
    earlier : ices of other sessions on the same sheet, the latest first
    found : what a discovery in the same session says
    """
    own = {direction: lane_draws(ice, direction) for direction in Direction}
    centre = _centre([draw for draws in own.values() for draw in draws])
    return {
        "sentence": in_a_sentence(ice),
        "headline": _headline(centre),
        "uncertain": is_uncertain(ice),
        "sheet": {"length": ice.sheet.length, "width": ice.sheet.width},
        "stone_radius": ice.stone.radius,
        "cells": cells_document(ice),
        # The time between the hog lines goes with one over the root of the friction.
        "seconds_per_share": None if centre is None else round(-centre.seconds / 2, 3),
        "zones": [
            {"name": z.name, "words": z.words, "stands_out": z.stands_out, "seen": round(z.seen, 2)}
            for z in zones(ice)
        ],
        "seen": round(float(ice.friction.observed.mean()), 3),
        "lanes": [
            {"to": direction.name.lower(), "draws": [_lane(draw) for draw in own[direction]]}
            for direction in Direction
        ],
        "earlier": [_compared(ice, centre, other) for other in earlier],
        "remarks": _remarks(ice),
        "discovery": None if found is None else findings_document(found),
    }


def cells_document(ice: Ice) -> dict[str, Any]:
    """The map: friction of each cell over the sheet's, less 1; null where no stone ran."""
    return {
        "size": ice.sheet.cell_size,
        "relative": rounded(relative_map(ice), 4),
        "sigma": rounded(ice.friction.sigma / level(ice), 4),
    }


def findings_document(found: Findings) -> dict[str, Any]:
    """Return the findings of a discovery, as the page shows them."""
    return {
        "verdict": found.verdict,
        "remarks": list(found.remarks),
        "missing": [
            {"title": m.title, "words": m.words, "unsure": list(m.unsure), "settled": m.settled_by}
            for m in found.missing
        ],
        "next": [{"throw": throw, "teaches": teaches} for throw, teaches in found.next_throws],
    }


def _lane(draw: LaneDraw) -> dict[str, Any]:
    told = draw.description
    return {
        "lane": LANE_NAMES[_number(draw.lane)],
        "x": round(draw.direction * draw.lane, 4),
        "spin": draw.throw.spin,
        "right_hander": told.right_hander,
        "left_hander": told.left_hander,
        "seconds": None if told.hog_to_hog_s is None else round(told.hog_to_hog_s, 2),
        "seconds_sigma": None if draw.seconds_sigma is None else round(draw.seconds_sigma, 3),
        "ice_m": round(told.ice_m, 3),
        "ice_sigma": None if draw.ice_sigma is None else round(draw.ice_sigma, 3),
        "ice": length(told.ice_m),
        "brooms": brooms(told.ice_m),
        "side": "right" if told.ice_on_the_right else "left",
        "measured": draw.seen >= MOSTLY_SEEN,
        "seen": round(draw.seen, 2),
        "path": rounded(draw.path, 2),
    }


def _number(lane: float) -> int:
    return int(np.argmin([abs(lane - other) for other in LANES]))


@dataclass(frozen=True, kw_only=True)
class _Centre:
    """Draws to the tee of both ends: mean time [s] and ice of either handle [m], with errors."""

    seconds: float
    seconds_sigma: float
    ice: dict[str, tuple[float, float]]


def _centre(draws: Sequence[LaneDraw]) -> _Centre | None:
    own = [d for d in draws if d.lane == 0.0 and d.description.hog_to_hog_s is not None]
    if not own:
        return None
    seconds = [d.description.hog_to_hog_s or 0.0 for d in own]
    ice: dict[str, tuple[float, float]] = {}
    for handle in ("in-turn", "out-turn"):
        those = [d for d in own if d.description.right_hander == handle]
        if those:
            ice[handle] = (
                float(np.mean([d.description.ice_m for d in those])),
                float(np.mean([d.ice_sigma or 0.0 for d in those])),
            )
    return _Centre(
        seconds=float(np.mean(seconds)),
        seconds_sigma=float(np.mean([d.seconds_sigma or 0.0 for d in own])),
        ice=ice,
    )


def _headline(centre: _Centre | None) -> list[dict[str, Any]]:
    """The few numbers that a team wants first."""
    if centre is None:
        return []
    numbers = [
        {
            "value": f"{centre.seconds:.1f} s",
            "sigma": _plus_minus(centre.seconds_sigma, "s", 2),
            "what": "hog to hog, draw to the tee",
        }
    ]
    for handle, (ice, sigma) in centre.ice.items():
        numbers.append(
            {
                "value": length(ice),
                "sigma": _plus_minus(sigma, "m", 2),
                "what": f"of ice, {brooms(ice)}: {handle} of a right-hander",
            }
        )
    return numbers


def _plus_minus(sigma: float, unit: str, digits: int) -> str:
    if sigma <= 0:
        return ""
    least = 10.0**-digits
    return f"± {max(sigma, least):.{digits}f} {unit}"


def _compared(ice: Ice, centre: _Centre | None, other: EarlierIce) -> dict[str, Any]:
    """Today against another session: draws to the tee, and the map where stones ran in both."""
    draws = [lane_draws(other.ice, direction, lanes=(0.0,)) for direction in Direction]
    then = _centre([draw for those in draws for draw in those])
    told: dict[str, Any] = {"id": other.id, "name": other.name, "rows": [], "cells": None}
    if centre is None or then is None:
        told["words"] = "no draw rests on one of the two"
        return told
    change = centre.seconds - then.seconds
    error = float(np.hypot(centre.seconds_sigma, then.seconds_sigma))
    told["seconds"] = {"then": round(then.seconds, 2), "change": round(change, 2)}
    clear = abs(change) > max(SIGMAS * error, SAME_WEIGHT)
    longer = "longer" if change > 0 else "shorter"
    words = ["of the same weight"]
    if clear:
        kind = "keener" if change > 0 else "heavier"
        words = [f"{kind} today: {abs(change):.1f} s {longer} hog to hog"]
    elif abs(change) >= SAME_WEIGHT:
        limit = max(SIGMAS * error, 0.01)
        words = [f"no clear change: {abs(change):.2f} s {longer} hog to hog, ± {limit:.2f} s"]
    for handle in centre.ice.keys() & then.ice.keys():
        (now, a), (before, b) = centre.ice[handle], then.ice[handle]
        if abs(now - before) > max(SIGMAS * float(np.hypot(a, b)), 0.1):
            more = "more" if now > before else "less"
            words.append(f"{abs(now - before):.1f} m {more} ice for the {handle}")
    told["words"] = "; ".join(sorted(words, key=lambda text: "hog" not in text))
    told["cells"] = change_of_maps(ice, other.ice)
    return told


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
    return missing_effect_remarks(ice) + [assumption_remark(name) for name in believed_effects(ice)]
