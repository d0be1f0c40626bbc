"""The rows of hands and of strategy in the table of published measurements.

They read the kept results of many games (`results.json`); playing them anew takes an hour.
"""

from __future__ import annotations

from typing import Any

from agents.playing.ends.published import (
    CLASSES,
    DRAW_POINTS,
    DRAWS_SOURCE,
    PERFECT_SHARES,
    POSITION_POINTS,
    PUBLISHED_NET,
    PUBLISHED_ODDS,
    PUBLISHED_SHARES,
    PUBLISHED_SOURCE,
    SHARES_SOURCE,
    SHOT_SHARES,
    WOMEN_SOURCE,
)
from agents.playing.ends.results import kept_results
from curling_env.validation import Row, Shots

WITHIN = 2.0
"""Percentage points within which a share of ends agrees."""
HANDS, STRATEGY = "hands", "strategy"
GRADES_SOURCE = (
    "statistics of championships in round numbers, about 80 to 88 % for elite players; quoted, the "
    "first source was not read"
)

_INDEPENDENT = (
    "ends of one game are taken for independent of the score; teams play for what they need, and "
    "the better team more often has the first hammer"
)

_CALLS_FITTED = "calls are those of one player with a style, not of a thousand teams"

GRADED_ALIKE = 5.0
"""Percentage points within which grades by the eye agree with grades by distances."""
SHARES_SHOTS = 1930
"""Number of shots behind `published.SHOT_SHARES`."""
_WHY_PERFECT = {
    "takeout": "here every stone that takes one out and stays is perfect; statisticians ask more",
}
_WHY_GRADE = {
    "lead": "leads throw guards before an empty house by the style that was fitted",
    "first draw": "graded like any draw here; statisticians are content with less of a first stone",
}
_WHY_CALLS = {
    "run-back": "search takes out a stone by another thrice as often as people, and more",
}


def rows_of_ends() -> tuple[Row, ...]:
    """The rows, from the results that are kept with the package."""
    kept = kept_results()
    fitted = kept["found"]["championship"]
    return (*_ends(fitted), *_grades(fitted), *_chances(kept), *_network(kept))


def _ends(fitted: dict[str, Any]) -> list[Row]:
    counts = fitted["counts"]
    total = sum(counts)
    about = (
        f"hands, judgement and calls were fitted; {total} ends of other seeds, seen from the hammer"
    )
    found = [
        _row(
            f"ends: {name}",
            HANDS,
            f"{100 * share:.1f} %",
            (100 * share - WITHIN, 100 * share + WITHIN),
            "%",
            PUBLISHED_SOURCE,
            100 * count / total,
            about,
            _CALLS_FITTED,
        )
        for name, share, count in zip(CLASSES, PUBLISHED_SHARES, counts, strict=True)
    ]
    steals = sum(PUBLISHED_SHARES[:3])
    found.append(
        _row(
            "ends: steals",
            HANDS,
            f"{100 * steals:.1f} %",
            (100 * steals - WITHIN, 100 * steals + WITHIN),
            "%",
            PUBLISHED_SOURCE,
            100 * sum(counts[:3]) / total,
            about,
        )
    )
    found.append(
        _row(
            "ends: points a hammer",
            HANDS,
            f"{PUBLISHED_NET:.2f}",
            (PUBLISHED_NET - 0.1, PUBLISHED_NET + 0.1),
            "points",
            PUBLISHED_SOURCE,
            fitted["net"],
            about,
        )
    )
    found.append(
        _row(
            "ends: all classes at once",
            HANDS,
            "χ² below 12.6 (95 %)",
            (0.0, 12.6),
            "1",
            PUBLISHED_SOURCE,
            fitted["chi_square"],
            about,
            f"so many ends show what is left ({_CALLS_FITTED})",
        )
    )
    return found


def _grades(fitted: dict[str, Any]) -> list[Row]:
    told = {one["type"]: one for one in fitted["grades"]}
    found = [
        _row(
            "grade: all, elite players",
            HANDS,
            "80-88 %",
            (80.0, 88.0),
            "%",
            GRADES_SOURCE,
            told["all"]["mean"],
            "statisticians grade by eye; ours has distances of its own",
            "hands were fitted to all championships, whose mean is lower: 77.5 % of women",
        )
    ]
    for name, share in PERFECT_SHARES.items():
        chosen = name in ("draw", "guard")
        found.append(
            _percent(
                f"perfect: {name}",
                100 * share,
                GRADED_ALIKE,
                WOMEN_SOURCE,
                100 * told[name]["perfect"],
                "how near a draw or a guard is perfect was chosen by these two shares"
                if chosen
                else "the share of 4 among 0 to 4; five points count as agreement",
                _WHY_PERFECT.get(name, ""),
            )
        )
    points = {**POSITION_POINTS, **DRAW_POINTS}
    for name, mean in points.items():
        source = DRAWS_SOURCE if name in DRAW_POINTS else WOMEN_SOURCE
        found.append(
            _percent(
                f"grade: {name}",
                25 * mean,
                GRADED_ALIKE,
                source,
                told[name]["mean"],
                "points of 4, as a percentage; five points count as agreement",
                _WHY_GRADE.get(name, ""),
            )
        )
    for name, share in SHOT_SHARES.items():
        sampling = 200 * (share * (1 - share) / SHARES_SHOTS) ** 0.5
        found.append(
            _percent(
                f"calls: {name}",
                100 * share,
                sampling,
                SHARES_SOURCE,
                100 * told[name]["shots"] / told["all"]["shots"],
                "share of all shots; uncertain by their number",
                _WHY_CALLS.get(name, ""),
            )
        )
    return found


def _percent(
    name: str, said: float, within: float, source: str, value: float, about: str, why: str
) -> Row:
    bounds = (said - within, said + within)
    return _row(name, HANDS, f"{said:.1f} %", bounds, "%", source, value, about, why)


def _chances(kept: dict[str, Any]) -> list[Row]:
    own, published = kept["win_table_of_search"], kept["win_table_of_published_ends"]
    found: list[Row] = []
    for state in PUBLISHED_ODDS:
        holder = "with hammer" if state.hammer else "without hammer"
        bounds = (state.share - 0.03, state.share + 0.03)
        for table, title in ((own, "search"), (published, "independent published ends")):
            found.append(
                _row(
                    f"chance: {state.words}, {holder} ({title})",
                    STRATEGY,
                    f"{state.share:.3f}",
                    bounds,
                    "1",
                    PUBLISHED_SOURCE,
                    table[state.words],
                    "three percentage points count as agreement: such states are rare",
                    _INDEPENDENT,
                )
            )
    return found


def _network(kept: dict[str, Any]) -> list[Row]:
    shares = kept["network_before_an_end"]["champion"]
    wanted = (("blank", PUBLISHED_SHARES[3], shares[3]), ("two", PUBLISHED_SHARES[5], shares[5]))
    return [
        _row(
            f"value network before an end: {name}",
            STRATEGY,
            f"{100 * share:.1f} %",
            (100 * share - WITHIN, 100 * share + WITHIN),
            "%",
            PUBLISHED_SOURCE,
            100 * value,
            "level, ten ends left, hands of `champion`",
            "it learnt from ends of its own, which open with a draw and a hit",
        )
        for name, share, value in wanted
    ]


def _row(
    name: str,
    part: str,
    said: str,
    bounds: tuple[float, float],
    unit: str,
    source: str,
    value: float,
    about: str,
    why: str = "",
) -> Row:
    def kept(_shots: Shots) -> float:
        return value

    return Row(
        name=name,
        part=part,
        said=said,
        low=bounds[0],
        high=bounds[1],
        unit=unit,
        source=source,
        value=kept,
        about=about,
        why={"any": why} if why else {},
        depends_on_ice=False,
    )
