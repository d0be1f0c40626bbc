"""Results of the coaching functions as tables and sentences for a coach."""

from __future__ import annotations

from collections.abc import Sequence

from agents.coaching.athletes import AthleteErrors, ErrorSummary, Interval
from agents.coaching.misses.causes import CAUSES, INTERVAL, Cause, Part, Pattern, SessionCauses
from agents.coaching.stones import StoneFactor, StoneMatch, StonePair
from curling_env.units import length, short_length, side, speed
from friction_estimation.reports.throws_section import NOT_SEEN, ThrowRows

CAUSE_WORDS: dict[Cause, str] = {
    "weight": "weight",
    "line": "line",
    "rotation": "rotation",
    "ice": "misread ice",
    "sweeping": "sweeping",
    "neither": "unexplained",
}
"""Name of each cause."""
MIN_SHOWN = 0.02
"""Smallest part of a miss that is shown [m]."""
MIN_MENTIONED_MEAN = 0.1
"""Smallest mean part that is mentioned [m]."""


def offset(right: float, past: float) -> str:
    """Format a displacement on the ice: along play first, without a component that is small beside
    the other.

    Parameters
    ----------
    right, past : to the right, and along play [m]
    """
    least = max(MIN_SHOWN, 0.2 * max(abs(right), abs(past)))
    parts = [
        side(value, right=name)
        for value, name in ((past, "past"), (right, "right"))
        if abs(value) >= least
    ]
    return ", ".join(parts) or "0"


# --- hand or ice ---------------------------------------------------------------------------------


def causes_rows(found: SessionCauses) -> ThrowRows:
    """Return a row for each throw: its miss and the contribution of each cause."""
    causes: list[Cause] = [c for c in CAUSES if any(c in one.parts for one in found.throws)]
    if not found.believed and not any(
        one.parts["ice"].size > MIN_SHOWN for one in found.throws if "ice" in one.parts
    ):
        causes.remove("ice")
    head = ["throw", "athlete", "called", "miss", *(CAUSE_WORDS[c] for c in causes), "mostly"]
    rows = [
        [
            str(one.throw),
            one.athlete,
            one.call.text,
            offset(float(one.miss[0]), float(one.miss[1])),
            *(part_in_words(one.parts.get(cause)) for cause in causes),
            CAUSE_WORDS[one.main],
        ]
        for one in found.throws
    ]
    return _without_empty(head, rows, numeric=("throw",))


def part_in_words(part: Part | None) -> str:
    """Format the contribution of a cause, with half its 95 % interval along its larger
    component.
    """
    if part is None:
        return NOT_SEEN
    larger = max((part.right, part.past), key=lambda one: abs(one.value))
    half = INTERVAL * (larger.sigma or 0.0)
    text = offset(part.right.value, part.past.value)
    return f"{text} ± {short_length(half)}" if half >= 0.005 else text


def pattern_in_words(pattern: Pattern) -> str:
    """Describe the common pattern of some throws in one or two sentences."""
    who = "All throws" if pattern.athlete is None else pattern.athlete
    count = "one throw" if pattern.throws == 1 else f"{pattern.throws} throws"
    ordered = sorted(pattern.shares, key=lambda cause: -pattern.shares[cause].value)
    shares = [
        f"{100 * pattern.shares[cause].value:.0f} % {CAUSE_WORDS[cause]}"
        for cause in ordered
        if abs(pattern.shares[cause].value) >= 0.005
    ]
    words = (
        f"{who} ({count}): {length(pattern.typical_miss)} from the target (root mean "
        f"square); of this {', '.join(shares)}."
    )
    again = [
        f"{CAUSE_WORDS[cause]} {offset(right, past)}"
        for cause, ways in pattern.mean.items()
        if pattern.throws > 2
        for right, past in [
            tuple(
                way.value
                if abs(way.value) > max(INTERVAL * (way.sigma or 0.0), MIN_MENTIONED_MEAN)
                else 0.0
                for way in ways
            )
        ]
        if right or past
    ]
    return f"{words} Systematic: {'; '.join(again)}." if again else words


def session_in_words(found: SessionCauses) -> list[str]:
    """Describe the pattern of a session and of each athlete, and list the excluded throws."""
    patterns = [found.pattern] if found.pattern is not None else []
    if len(found.athletes) > 1 or (found.athletes and found.athletes[0].throws < len(found.throws)):
        patterns += found.athletes
    sentences = [pattern_in_words(pattern) for pattern in patterns]
    if found.throws:
        sentences.append(
            "Each cause is shown as the distance that it moved the stone; the parts add up to the "
            "miss, and ± is half a 95 % interval."
        )
    sentences += [f"excluded: throw {throw}: {why}" for throw, why in found.left_out.items()]
    return sentences + list(found.remarks)


# --- athletes ------------------------------------------------------------------------------------


def athletes_rows(athletes: Sequence[AthleteErrors]) -> ThrowRows:
    """Return a row for all throws of each athlete, then one for each handle and weight."""
    head = ["athlete", "throws", "handle", "shot", "weight", "± weight", "line", "± line"]
    head += ["rotation", "± rotation"]
    rows: list[list[str]] = []
    for one in athletes:
        for group in (one.overall, *(g for g in one.groups if _is_finest(one, g))):
            rows.append(
                [
                    one.name if group is one.overall else "",
                    str(group.throws),
                    group.handle or ("all" if group is one.overall else ""),
                    group.weight or "",
                    *_weight(one, group),
                    _value(group.bias[1]),
                    short_length(group.spread[1].value),
                    *_rotation(one, group),
                ]
            )
    return _without_empty(head, rows, numeric=("throws",))


def athletes_in_words(athletes: Sequence[AthleteErrors]) -> list[str]:
    """Describe the notable errors of each athlete."""
    sentences: list[str] = []
    for one in athletes:
        errors: list[str] = []
        weight, line, _ = one.overall.bias
        if not weight.low <= 0 <= weight.high:
            errors.append(f"throws {_weight(one, one.overall)[0].split(' (')[0]}")
        if not line.low <= 0 <= line.high:
            errors.append(f"sends stones {side(line.value)} of the line")
        by_handle = [g for g in one.groups if g.handle is not None and g.weight is None]
        if line.low <= 0 <= line.high and not by_handle:
            by_handle = [g for g in one.groups if g.handle is not None and _is_finest(one, g)]
        for group in by_handle:
            low, high = group.bias[1].low, group.bias[1].high
            if line.low <= 0 <= line.high and not low <= 0 <= high:
                errors.append(f"{group.handle}s {side(group.bias[1].value)}")
        name = one.name or "Throws without a name"
        count = f"{one.overall.throws} throws in {_sessions(one.sessions)}"
        sentences.append(f"{name} ({count}): {', '.join(errors) or 'no clear habit'}.")
    if athletes:
        sentences.append(
            "Weight, line and rotation have 95 % intervals; columns with ± are the spread from "
            "throw to throw, without the measurement error."
        )
    return sentences


def _sessions(count: int) -> str:
    return "one session" if count == 1 else f"{count} sessions"


def _is_finest(one: AthleteErrors, group: ErrorSummary) -> bool:
    """Return whether a group is not a part of another one that is shown."""
    whole = (group.handle is None) + (group.weight is None)
    some = {(g.handle is None) + (g.weight is None) for g in one.groups}
    return whole == min(some, default=0) and group.throws < one.overall.throws


def _weight(one: AthleteErrors, group: ErrorSummary) -> tuple[str, str]:
    """Format bias and spread of the weight, as times if these are known."""
    bias, spread = group.bias[0], group.spread[0]
    each = one.seconds_per_speed
    if each is None:
        sign = "+" if bias.value > 0 else "−"
        return f"{sign}{speed(abs(bias.value))}", speed(spread.value)
    value = each * bias.value
    sign = 1.0 if value > 0 else -1.0
    low, high = sorted((sign * each * bias.low, sign * each * bias.high))
    return (
        f"{abs(value):.2f} s {'light' if value > 0 else 'heavy'} ({_range(low, high, 2)})",
        f"{abs(each) * spread.value:.2f} s",
    )


def _range(low: float, high: float, digits: int) -> str:
    return f"{low:.{digits}f} to {high:.{digits}f}".replace("-", "−")


def _value(bias: Interval) -> str:
    half = short_length((bias.high - bias.low) / 2)
    return f"{side(bias.value)} ± {half}"


def _rotation(one: AthleteErrors, group: ErrorSummary) -> tuple[str, str]:
    bias, spread, each = group.bias[2], group.spread[2], one.turns_per_spin
    if not (one.errors[:, 2] == one.errors[:, 2]).any():
        return NOT_SEEN, NOT_SEEN
    if each is None:
        return f"{bias.value:+.2f} rad/s".replace("-", "−"), f"{spread.value:.2f} rad/s"
    value = round(each * bias.value, 1) + 0.0
    word = "more" if value > 0 else "fewer"
    text = f"{abs(value):.1f} turns {word}" if value else "0"
    return text, f"{each * spread.value:.1f} turns"


# --- stones --------------------------------------------------------------------------------------


def stones_rows(found: StoneMatch) -> ThrowRows:
    """Return a row for each stone, the keenest first."""
    head = ["stone", "throws", "friction", "on a draw", "curl"]
    rows = [
        [
            one.stone,
            str(one.throws),
            _percent(one.friction, "heavier", "keener"),
            _carry(one),
            NOT_SEEN if one.curl is None else _percent(one.curl, "more", "less"),
        ]
        for one in found.stones
    ]
    return _without_empty(head, rows, numeric=("throws",))


def _percent(one: Interval, above: str, below: str) -> str:
    value = 100 * (one.value - 1)
    sign = 1.0 if value > 0 else -1.0
    low, high = sorted(100 * sign * (x - 1) for x in (one.low, one.high))
    return f"{abs(value):.1f} % {above if value > 0 else below} ({_range(low, high, 1)})"


def _carry(one: StoneFactor) -> str:
    word = "further" if one.carry.value > 0 else "shorter"
    half = (one.carry.high - one.carry.low) / 2
    return f"{short_length(one.carry.value)} {word} ± {short_length(half)}"


def stones_in_words(found: StoneMatch) -> list[str]:
    """Describe the pairs, and the throws needed to distinguish the rest."""
    pairs = "; ".join(
        f"{p.first} and {p.second} ({short_length(p.apart)} apart)" for p in found.pairs
    )
    sentences = [f"Pairs that run most alike on a draw: {pairs}."]
    if found.undecided:
        shown = "; ".join(map(_undecided, found.undecided[:6]))
        rest = len(found.undecided) - 6
        more = f"; and {rest} more" if rest > 0 else ""
        sentences.append(f"Not distinguished yet: {shown}{more}.")
        sentences.append(
            "Best are unswept draws, seen from the hog line to rest, all down the same line: "
            "alternate in- and out-turns, and throw the stones in the order A B B A, so that "
            "changing ice favours none."
        )
    else:
        sentences.append(
            "Every pair is settled: the stones differ, or are alike enough for any player."
        )
    sentences += [f"excluded: throw {throw}: {why}" for throw, why in found.left_out.items()]
    return sentences + list(found.remarks)


def _undecided(pair: StonePair) -> str:
    count = "one more draw" if pair.more == 1 else f"{pair.more} more draws"
    return f"{pair.first} and {pair.second} ({count} of each)"


def _without_empty(head: list[str], rows: list[list[str]], *, numeric: Sequence[str]) -> ThrowRows:
    """Return a table without its empty columns."""
    kept = [k for k in range(len(head)) if any(row[k] not in ("", NOT_SEEN, "0") for row in rows)]
    return ThrowRows(
        head=[head[k] for k in kept],
        rows=[[row[k] for k in kept] for row in rows],
        numeric={i for i, k in enumerate(kept) if head[k] in numeric},
    )
